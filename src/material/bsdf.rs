//! The scattering function of a hit: the lobe of its material there, which may be of a different kind in each lane.

use super::bxdf::{Branch, Bxdf, BxdfSample, TransportMode};
use super::kind::{Kind, Kinds, materials};
use super::program::Leaf;
use super::row::{IOR, METAL_INDICES, Numbers, Site};
use crate::math::{Float, Mask, Rgb, Uint, Vec3, function, value};

/// The data from which the scattering functions of hits are made.
#[derive(Clone, Copy, Debug)]
pub struct Local<F: Float> {
    pub(super) kind: F::Uint,
    pub(super) numbers: Numbers<F>,
    pub(super) site: Site<F>,
}

value!(Local { kind, numbers, site });

/// The scattering functions of hits. Integrators use materials only through this type.
#[derive(Clone, Copy)]
pub struct Bsdf<F: Float> {
    pub(super) local: Local<F>,
    /// The kinds in the scene: no lane has another.
    pub(super) kinds: Kinds,
}

macro_rules! frequent {
    (
        {}
        leaves { $($(#[$cfg:meta])* $module:ident::$Leaf:ident $(($parameters:ident))?,)* }
        choosers $choosers:tt
    ) => {
        /// The number of frequent kinds ([`Leaf::IS_FREQUENT`]), which are the first ones.
        const FREQUENT: u32 = {
            let mut frequent = 0;
            $(
                $(#[$cfg])*
                {
                    if super::$module::$Leaf::IS_FREQUENT {
                        assert!(frequent == Kind::$Leaf as u32, "frequent kinds must precede all others");
                        frequent += 1;
                    }
                }
            )*
            frequent
        };

        /// The leaves that are not frequent.
        const INFREQUENT: Kinds = {
            let mut infrequent = Kinds::NONE;
            $(
                $(#[$cfg])*
                {
                    if !super::$module::$Leaf::IS_FREQUENT {
                        infrequent = infrequent.with(Kind::$Leaf);
                    }
                }
            )*
            infrequent
        };
    };
}
materials!(frequent);

/// Whether the lobe of a leaf has a flag of [`Bxdf`]. Every lobe is in `ALL`.
macro_rules! has {
    (ALL, $Leaf:ty) => {
        true
    };
    ($flag:ident, $Leaf:ty) => {
        <<$Leaf as Leaf>::Lobe<F> as Bxdf<F>>::$flag
    };
}

/// Calls a function of the lobe of a leaf as a function of recorded programs.
macro_rules! of_leaf {
    ($Leaf:ident, $function:literal, $bxdf:ident, ($($argument:ident),*), $answer:expr) => {
        function!(F, concat!(stringify!($Leaf), "_", $function), ($bxdf $(, $argument)*), { $answer })
    };
}

/// Evaluates each lane's lobe, if it has a flag; other lanes are unspecified. `$function` names the evaluated function.
///
/// The lobe of the first leaf is evaluated in all lanes, each other one only if some lane has it. For kinds that the
/// scene lacks there is no code in recorded programs, and lanes do not test for them. They test once for each frequent
/// kind, and once for all others together, which are out of line.
macro_rules! answer {
    (
        { $kinds:ident, $local:ident, $flag:ident, $function:literal, $arguments:tt, $bxdf:ident => $answer:expr }
        leaves {
            $first_module:ident::$First:ident($first_parameters:ident),
            $($(#[$cfg:meta])* $module:ident::$Leaf:ident $(($parameters:ident))?,)*
        }
        choosers $choosers:tt
    ) => {{
        let $bxdf = $local.lobe::<super::$first_module::$First>();
        let mut answer = of_leaf!($First, $function, $bxdf, $arguments, $answer);
        $(
            $(#[$cfg])*
            {
                answer = answer_of!(
                    $module::$Leaf, super::$module::$Leaf::IS_FREQUENT,
                    { $kinds, $local, $flag, $function, $arguments, $bxdf => $answer }, answer
                );
            }
        )*
        if $kinds.has_any(INFREQUENT) {
            answer = F::branch(
                $local.is_infrequent(),
                answer,
                #[inline(always)]
                || {
                    F::out_of_line(
                        #[inline(always)]
                        move || {
                            let mut answer = answer;
                            $(
                                $(#[$cfg])*
                                {
                                    answer = answer_of!(
                                        $module::$Leaf, !super::$module::$Leaf::IS_FREQUENT,
                                        { $kinds, $local, $flag, $function, $arguments, $bxdf => $answer }, answer
                                    );
                                }
                            )*
                            answer
                        },
                    )
                },
            );
        }
        answer
    }};
}

/// The result of a leaf in its lanes, if a condition holds and the scene has some; `$otherwise` in other lanes.
macro_rules! answer_of {
    (
        $module:ident::$Leaf:ident, $condition:expr,
        { $kinds:ident, $local:ident, $flag:ident, $function:literal, $arguments:tt, $bxdf:ident => $answer:expr },
        $otherwise:ident
    ) => {
        if $condition && has!($flag, super::$module::$Leaf) && $kinds.has(Kind::$Leaf) {
            F::branch(
                $local.is(Kind::$Leaf),
                $otherwise,
                #[inline(always)]
                || {
                    let $bxdf = $local.lobe::<super::$module::$Leaf>();
                    of_leaf!($Leaf, $function, $bxdf, $arguments, $answer)
                },
            )
        } else {
            $otherwise
        }
    };
}

/// The lanes whose lobe has a flag.
macro_rules! lanes_with {
    (
        { $bsdf:ident, $flag:ident }
        leaves { $($(#[$cfg:meta])* $module:ident::$Leaf:ident $(($parameters:ident))?,)* }
        choosers $choosers:tt
    ) => {{
        let mut lanes = F::Mask::splat(false);
        $(
            $(#[$cfg])*
            {
                if super::$module::$Leaf::IS_FREQUENT
                    && has!($flag, super::$module::$Leaf)
                    && $bsdf.kinds.has(Kind::$Leaf)
                {
                    lanes = lanes | $bsdf.local.is(Kind::$Leaf);
                }
            }
        )*
        if $bsdf.kinds.has_any(INFREQUENT) {
            $(
                $(#[$cfg])*
                {
                    if !super::$module::$Leaf::IS_FREQUENT
                        && has!($flag, super::$module::$Leaf)
                        && $bsdf.kinds.has(Kind::$Leaf)
                    {
                        lanes = lanes | $bsdf.local.is(Kind::$Leaf);
                    }
                }
            )*
        }
        lanes
    }};
}

impl<F: Float> Local<F> {
    /// The lanes whose material is of a kind.
    #[inline(always)]
    fn is(&self, kind: Kind) -> F::Mask {
        self.kind.eq(F::Uint::splat(kind as u32))
    }

    /// The lanes whose material is of an infrequent kind.
    #[inline(always)]
    fn is_infrequent(&self) -> F::Mask {
        !self.kind.lt(F::Uint::splat(FREQUENT))
    }

    /// The lobe of a kind, valid in lanes of that kind.
    #[inline(always)]
    fn lobe<L: Leaf>(&self) -> L::Lobe<F> {
        L::lobe(&self.numbers, &self.site)
    }
}

impl<F: Float> Bsdf<F> {
    /// The data it is made of, for structures of numbers: see
    /// [`MaterialTable::bsdf_of`](super::MaterialTable::bsdf_of).
    #[inline(always)]
    pub fn local(&self) -> Local<F> {
        self.local
    }

    /// The lanes whose lobes are black, except for delta lobes.
    #[inline(always)]
    pub fn is_black(&self) -> F::Mask {
        self.local.numbers.colour.max_channel().le(F::zero())
    }

    /// [`Bxdf::eval`] in the lanes of [`Bxdf::has_non_delta`]; others are unspecified.
    #[inline(always)]
    pub fn eval_non_delta(&self, wo: Vec3<F>, wi: Vec3<F>, mode: TransportMode) -> Rgb<F> {
        let Bsdf { local, kinds } = *self;
        function!(F, bsdf_eval(local, wo, wi), {
            materials!(answer kinds, local, HAS_NON_DELTA, "eval", (wo, wi), lobe => lobe.eval(wo, wi, mode))
        })
    }

    /// [`Bxdf::pdf`] in the lanes of [`Bxdf::has_non_delta`]; others are unspecified.
    #[inline(always)]
    pub fn pdf_non_delta(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        let Bsdf { local, kinds } = *self;
        function!(F, bsdf_pdf(local, wo, wi), {
            materials!(answer kinds, local, HAS_NON_DELTA, "pdf", (wo, wi), lobe => lobe.pdf(wo, wi))
        })
    }

    /// The same where the index of refraction above the surface is `outside`: the indices of dielectrics, thin sheets
    /// and metals become relative to it.
    #[inline(always)]
    pub fn within(mut self, outside: F) -> Self {
        // Other materials have no number there.
        let own = self.local.numbers.further;
        let mut further = own;
        further[IOR] = own[IOR] / outside;
        if self.kinds.has(Kind::Conductor) | self.kinds.has(Kind::SmoothConductor) {
            let is_metal = self.local.is(Kind::Conductor) | self.local.is(Kind::SmoothConductor);
            let mut i = 0;
            while i < METAL_INDICES {
                further[i] = F::select(is_metal, own[i] / outside, further[i]);
                i += 1;
            }
        }
        self.local.numbers.further = further;
        self
    }

    /// The index of refraction below the surface over that above it, by which delta lobes refract; 1 for lobes that do
    /// not refract.
    #[inline(always)]
    pub fn index(&self) -> F {
        let one = F::splat(1.0);
        if self.kinds.has(Kind::Glass) {
            F::select(self.local.is(Kind::Glass), self.local.numbers.further[IOR], one)
        } else {
            one
        }
    }
}

impl<F: Float> Bxdf<F> for Bsdf<F> {
    const HAS_DELTA: bool = true;
    const TRANSMITS: bool = true;

    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, mode: TransportMode) -> Rgb<F> {
        self.eval_non_delta(wo, wi, mode).only(self.has_non_delta())
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], choice: F, mode: TransportMode) -> BxdfSample<F> {
        let Bsdf { local, kinds } = *self;
        function!(F, bsdf_sample(local, wo, u, choice), {
            materials!(answer kinds, local, ALL, "sample", (wo, u, choice), lobe => lobe.sample(wo, u, choice, mode))
        })
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        self.pdf_non_delta(wo, wi).only(self.has_non_delta())
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        let Bsdf { local, kinds } = *self;
        function!(F, bsdf_albedo(local), {
            materials!(answer kinds, local, ALL, "albedo", (), lobe => lobe.albedo())
        })
    }

    #[inline(always)]
    fn has_non_delta(&self) -> F::Mask {
        materials!(lanes_with self, HAS_NON_DELTA)
    }

    #[inline(always)]
    fn has_delta(&self) -> F::Mask {
        materials!(lanes_with self, HAS_DELTA)
    }

    #[inline(always)]
    fn transmits(&self) -> F::Mask {
        materials!(lanes_with self, TRANSMITS)
    }

    #[inline(always)]
    fn branches(&self, wo: Vec3<F>, mode: TransportMode) -> [Branch<F>; 2] {
        let Bsdf { local, kinds } = *self;
        function!(F, bsdf_branches(local, wo), {
            materials!(answer kinds, local, TRANSMITS, "branches", (wo), lobe => lobe.branches(wo, mode))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{
        ConductorParameters, DielectricParameters, GlassParameters, MaterialParameters, MaterialTable,
        MatteParameters, MirrorParameters, Row,
    };
    use crate::math::lanes::scalar::Wrapping;
    use crate::sampling::{Stream, warp};
    use rand::RngExt;

    macro_rules! kinds_of_leaves {
        (
            {}
            leaves {
                $($module:ident::$Leaf:ident $(($parameters:ident))?,)*
                #[$cfg:meta] $broken_module:ident::$Broken:ident($broken_parameters:ident),
            }
            choosers $choosers:tt
        ) => {
            [$(Kind::$Leaf,)*]
        };
    }

    /// Rows of every kind with the same reflectance.
    fn rows(colour: f64) -> Vec<Row> {
        let (reflectance, transmittance) = ([colour; 3], [0.5; 3]);
        let mut rows = vec![
            MirrorParameters { reflectance }.row(),
            GlassParameters { ior: 1.5, reflectance, transmittance }.row(),
        ];
        for roughness in [0.0, 0.5] {
            rows.push(MatteParameters { reflectance, roughness }.row());
            let (eta, k, roughness) = (Some([1.0 + colour; 3]), Some([0.0; 3]), [roughness; 2]);
            rows.push(ConductorParameters { metal: None, eta, k, roughness }.row());
            for thin_walled in [false, true] {
                let (ior, absorption, priority) = (1.5, [0.0; 3], 0.0);
                rows.push(
                    DielectricParameters {
                        ior,
                        roughness,
                        absorption,
                        priority,
                        thin_walled,
                        reflectance,
                        transmittance,
                    }
                    .row(),
                );
            }
        }
        rows
    }

    /// Paths sample no lights if [`Bsdf::is_black`] holds: there must be nothing to lose.
    #[test]
    fn black_surfaces_scatter_only_by_delta_lobes() {
        let mut stream = Stream::new(50, 0, 0);
        for kind in materials!(kinds_of_leaves) {
            assert!(rows(0.0).iter().any(|row| row.kind == kind), "no row is a {kind:?}");
        }
        for (colour, some_are_black) in [(0.0, true), (0.5, false)] {
            let (mut scattered, mut black) = (0, 0);
            for row in rows(colour) {
                let site = Site::new(Vec3::zero(), [0.5; 2], 0.0);
                let table = MaterialTable::new(vec![row]);
                let bsdf = table.bsdf(Wrapping(0), site);
                black += u32::from(bsdf.is_black());
                for _ in 0..100 {
                    let [wo, wi] =
                        [(); 2].map(|()| warp::uniform_sphere([stream.random::<f32>(), stream.random()]));
                    let f = bsdf.eval(wo, wi, TransportMode::Radiance);
                    assert!(!bsdf.is_black() || f == Rgb::black(), "{:?}: {f:?}", row.kind);
                    scattered += u32::from(f.max_channel() > 0.0);
                }
            }
            assert_eq!(black > 0, some_are_black);
            // Negative control: transmitting lobes scatter light although they reflect none.
            assert!(scattered > 100, "{scattered}");
        }
    }
}
