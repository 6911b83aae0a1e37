//! The list of all kinds of lights, and the dispatch of lanes with lights of different kinds.

use super::area::AreaLight;
use super::columns::{Columns, LaneLights};
use super::contract::{Light, ListedLight};
use super::directional::{Distant, DistantDisk};
use super::environment_map::EnvironmentMap;
use super::point::PointLight;
use super::sample::{EmittedRay, Escaped, LightSample};
use super::spot::SpotLight;
use super::textured_quad::TexturedQuad;
use super::textured_round::TexturedRound;
use super::textured_triangle::TexturedTriangle;
use super::triangle::Triangle;
use crate::math::{Float, Mask, Rgb, Vec3, function};
use crate::shape::{Cylinder, Disk, Quad, Sphere};

/// Calls a function of a kind as a function of recorded programs. The light and further arguments are those of the call
/// in parentheses.
macro_rules! of_kind {
    ($name:ident $function:literal, <$Type:ty>::$method:ident($lights:ident $(, $argument:ident)*)) => {{
        let (light, origin) = ($lights.light, $lights.origin);
        function!(F, concat!(stringify!($name), $function), (light, origin $(, $argument)*), {
            let lights = $lights.of(light, origin);
            <$Type>::$method(&lights $(, $argument)*)
        })
    }};
}

/// Samples the lights of a kind in their lanes, if a condition holds and the scene has lights of that kind;
/// `$otherwise` in other lanes.
macro_rules! sample_of {
    (
        $name:ident: $Type:ty, $condition:expr,
        ($lights:ident, $p:ident, $emission:ident, $u:ident), $otherwise:ident
    ) => {
        if $condition && $lights.has(<$Type>::KIND) {
            F::branch(
                $lights.are(<$Type>::KIND),
                $otherwise,
                #[inline(always)]
                || of_kind!($name "_sample", <$Type>::sample($lights, $p, $emission, $u)),
            )
        } else {
            $otherwise
        }
    };
}

macro_rules! kinds {
    (
        $first:ident: $First:ty,
        $($(#[$attribute:meta])* $name:ident: $Type:ty,)+
    ) => {
        /// The kinds of lights, by their numbers in the table.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u32)]
        pub enum LightKind {
            #[doc = concat!("[`", stringify!($First), "`]")]
            $first,
            $(
                $(#[$attribute])*
                #[doc = concat!("[`", stringify!($Type), "`]")]
                $name,
            )+
        }

        impl LightKind {
            /// All kinds.
            pub const ALL: &[LightKind] = &[
                LightKind::$first,
                $(
                    $(#[$attribute])*
                    LightKind::$name,
                )+
            ];
        }

        impl ListedLight for $First {
            const KIND: u32 = LightKind::$first as u32;
        }
        $(
            $(#[$attribute])*
            impl ListedLight for $Type {
                const KIND: u32 = LightKind::$name as u32;
            }
        )+

        /// Whether any kind is at infinity. If not, no code is compiled for such lights.
        pub(super) const ANY_INFINITE: bool = {
            let mut any = <$First>::INFINITE;
            $(
                $(#[$attribute])*
                {
                    any = any || <$Type>::INFINITE;
                }
            )+
            any
        };

        /// The number of frequent kinds, which are the first ones.
        const FREQUENT: u32 = {
            let mut frequent = 1;
            $(
                $(#[$attribute])*
                {
                    if <$Type>::IS_FREQUENT {
                        assert!(frequent == <$Type>::KIND, "frequent kinds must precede all others");
                        frequent += 1;
                    }
                }
            )+
            frequent
        };

        /// The other kinds, as bits.
        const INFREQUENT: u32 = !((1 << FREQUENT) - 1);

        /// Whether rays that leave the scene see lights of a kind.
        pub(super) fn are_visible(kind: u32) -> bool {
            let mut visible = <$First>::INFINITE && !<$First>::DELTA && kind == <$First>::KIND;
            $(
                $(#[$attribute])*
                {
                    visible = visible || <$Type>::INFINITE && !<$Type>::DELTA && kind == <$Type>::KIND;
                }
            )+
            visible
        }

        /// The lanes whose lights are at infinity.
        #[inline(always)]
        pub(super) fn are_infinite<F: Float>(columns: &Columns, light: F::Uint) -> F::Mask {
            let mut lanes = F::Mask::splat(false);
            $(
                $(#[$attribute])*
                {
                    if <$Type>::INFINITE && columns.has(<$Type>::KIND) {
                        lanes = lanes | columns.are::<F>(light, <$Type>::KIND);
                    }
                }
            )+
            lanes
        }

        /// See [`Light::sample`]. With `DELTA`, the lights of all lanes are delta lights.
        #[inline(always)]
        pub(super) fn sample<F: Float, const DELTA: bool>(
            lights: &LaneLights<'_, F>,
            p: Vec3<F>,
            emission: Rgb<F>,
            u: [F; 2],
        ) -> LightSample<F> {
            let mut sample = of_kind!($first "_sample", <$First>::sample(lights, p, emission, u));
            $(
                $(#[$attribute])*
                {
                    sample = sample_of!(
                        $name: $Type, <$Type>::IS_FREQUENT && (<$Type>::DELTA || !DELTA),
                        (lights, p, emission, u), sample
                    );
                }
            )+
            if lights.has_any(INFREQUENT) {
                sample = F::branch(
                    lights.are_from(FREQUENT),
                    sample,
                    #[inline(always)]
                    || {
                        let lights = *lights;
                        F::out_of_line(
                            #[inline(always)]
                            move || {
                                let (lights, mut sample) = (&lights, sample);
                                $(
                                    $(#[$attribute])*
                                    {
                                        sample = sample_of!(
                                            $name: $Type, !<$Type>::IS_FREQUENT && (<$Type>::DELTA || !DELTA),
                                            (lights, p, emission, u), sample
                                        );
                                    }
                                )+
                                sample
                            },
                        )
                    },
                );
            }
            sample
        }

        /// See [`Light::pdf`]; `by_area` is the density of a point sampled uniformly by area.
        #[inline(always)]
        pub(super) fn pdf<F: Float>(
            lights: &LaneLights<'_, F>,
            p: Vec3<F>,
            on: Vec3<F>,
            t: F,
            cos_light: F,
            by_area: F,
        ) -> F {
            let pdf = by_area;
            $(
                $(#[$attribute])*
                let pdf = if <$Type>::HAS_OWN_PDF && lights.has(<$Type>::KIND) {
                    F::branch(
                        lights.are(<$Type>::KIND),
                        pdf,
                        #[inline(always)]
                        || of_kind!($name "_light_pdf", <$Type>::pdf(lights, p, on, t, cos_light, by_area)),
                    )
                } else {
                    pdf
                };
            )+
            pdf
        }

        /// See [`Light::escaped`]. The lights of all lanes are of this kind, which such rays see.
        #[inline(always)]
        pub(super) fn escaped<F: Float>(
            kind: u32,
            lights: &LaneLights<'_, F>,
            emission: Rgb<F>,
            d: Vec3<F>,
        ) -> Escaped<F> {
            $(
                $(#[$attribute])*
                {
                    if <$Type>::INFINITE && !<$Type>::DELTA && kind == <$Type>::KIND {
                        return of_kind!($name "_escaped", <$Type>::escaped(lights, emission, d));
                    }
                }
            )+
            let _ = (kind, lights, emission, d);
            Escaped::none()
        }

        /// See [`Light::emit`].
        #[inline(always)]
        pub(super) fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, u: [F; 4]) -> EmittedRay<F> {
            let emitted = of_kind!($first "_emit", <$First>::emit(lights, emission, u));
            $(
                $(#[$attribute])*
                let emitted = if lights.has(<$Type>::KIND) {
                    F::branch(
                        lights.are(<$Type>::KIND),
                        emitted,
                        #[inline(always)]
                        || of_kind!($name "_emit", <$Type>::emit(lights, emission, u)),
                    )
                } else {
                    emitted
                };
            )+
            emitted
        }
    };
}

// The first kind is computed in all lanes, the others only if a lane has one. New kinds come before those of tests.
kinds! {
    Point: PointLight,
    Sphere: AreaLight<Sphere>,
    Quad: AreaLight<Quad>,
    Triangle: AreaLight<Triangle>,
    Disk: AreaLight<Disk>,
    Cylinder: AreaLight<Cylinder>,
    Distant: Distant,
    DistantDisk: DistantDisk,
    Spot: SpotLight,
    TexturedQuad: TexturedQuad,
    EnvironmentMap: EnvironmentMap,
    TexturedRound: TexturedRound,
    TexturedTriangle: TexturedTriangle,
    #[cfg(test)]
    Sky: super::test_sky::Sky,
}
