//! The shapes of which most scenes have none.

use super::{Bounds, RareShape, Shape, Surface};
use crate::math::{Float, Ray, Uint, Vec3};

/// What hits on rare shapes look up. What it is in each shape its file says.
#[derive(Clone, Copy, Debug)]
pub struct RareForm<F> {
    /// A point.
    pub anchor: Vec3<F>,
    /// A direction of length one.
    pub axis: Vec3<F>,
    /// A length.
    pub constant: F,
    /// A vector for u,
    pub u_axis: Vec3<F>,
    /// and a number.
    pub u_offset: F,
    /// The same for v.
    pub v_axis: Vec3<F>,
    /// See there.
    pub v_offset: F,
}

impl RareKind {
    /// Its number, from one.
    pub const fn number(self) -> u32 {
        self as u32 + 1
    }
}

impl Surface {
    /// What hits on a rare shape look up.
    #[inline(always)]
    pub fn rare_form(&self) -> RareForm<f32> {
        let ([ux, uy, uz, u_offset], [vx, vy, vz, v_offset]) = (self.u_axis, self.v_axis);
        RareForm {
            anchor: Vec3::splat(self.anchor),
            axis: Vec3::splat(self.normal),
            constant: self.distance,
            u_axis: Vec3::splat([ux, uy, uz]),
            u_offset,
            v_axis: Vec3::splat([vx, vy, vz]),
            v_offset,
        }
    }
}

/// Makes one shape of several.
macro_rules! rare {
    ($($file:ident::$shape:ident),+) => {
        $(pub use super::$file::$shape;)+

        /// Any of the shapes of which most scenes have none. Rays are tested against all of these in one place, which
        /// is skipped in scenes without them.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Rare {
            $(
                #[doc = concat!("A [`", stringify!($shape), "`].")]
                $shape($shape),
            )+
        }

        /// Which of these shapes it is.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum RareKind {
            $(
                #[doc = concat!("A [`", stringify!($shape), "`].")]
                $shape,
            )+
        }

        $(
            impl From<$shape> for Rare {
                fn from(shape: $shape) -> Rare {
                    Rare::$shape(shape)
                }
            }
        )+

        impl Shape for Rare {
            #[inline(always)]
            fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
                match self {
                    $(Rare::$shape(shape) => shape.intersect(ray),)+
                }
            }

            fn bounds(&self) -> Bounds {
                match self {
                    $(Rare::$shape(shape) => shape.bounds(),)+
                }
            }

            fn surface(&self) -> Surface {
                match self {
                    $(Rare::$shape(shape) => shape.surface(),)+
                }
            }
        }

        impl<F: Float> RareForm<F> {
            /// The outward unit normal of the surface at its point nearest to `p`, and how far `p` lies off the
            /// surface along that normal. `p` is a computed hit: off by rounding alone. Lanes of no kind are unspecified.
            #[inline(always)]
            pub fn point(&self, kind: F::Uint, p: Vec3<F>) -> (Vec3<F>, F) {
                let mut point = (self.axis, F::zero());
                $(
                    point = F::branch(
                        kind.eq(F::Uint::splat(RareKind::$shape.number())),
                        point,
                        #[inline(always)]
                        || $shape::point(self, p),
                    );
                )+
                point
            }

            /// The direction at a point on the surface in which u grows and v does not change, of any length.
            #[inline(always)]
            pub fn tangent(&self, kind: F::Uint, p: Vec3<F>) -> Vec3<F> {
                let mut tangent = self.axis;
                $(
                    tangent = F::branch(
                        kind.eq(F::Uint::splat(RareKind::$shape.number())),
                        tangent,
                        #[inline(always)]
                        || $shape::tangent(self, p),
                    );
                )+
                tangent
            }

            /// uv at a point on the surface, where the outward unit normal is `n`.
            #[inline(always)]
            pub fn uv(&self, kind: F::Uint, p: Vec3<F>, n: Vec3<F>) -> [F; 2] {
                let mut uv = [F::zero(); 2];
                $(
                    uv = F::branch(
                        kind.eq(F::Uint::splat(RareKind::$shape.number())),
                        uv,
                        #[inline(always)]
                        || $shape::uv(self, p, n),
                    );
                )+
                uv
            }

            /// The area of uv for each area of the surface at a point.
            #[inline(always)]
            pub fn uv_per_area(&self, kind: F::Uint, p: Vec3<F>) -> F {
                let mut area = F::zero();
                $(
                    area = F::branch(
                        kind.eq(F::Uint::splat(RareKind::$shape.number())),
                        area,
                        #[inline(always)]
                        || $shape::uv_per_area(self, p),
                    );
                )+
                area
            }

            /// The gradients of u and of v along the surface at a point.
            #[inline(always)]
            pub fn uv_gradients(&self, kind: F::Uint, p: Vec3<F>) -> [Vec3<F>; 2] {
                let mut gradients = [Vec3::zero(); 2];
                $(
                    gradients = F::branch(
                        kind.eq(F::Uint::splat(RareKind::$shape.number())),
                        gradients,
                        #[inline(always)]
                        || $shape::uv_gradients(self, p),
                    );
                )+
                gradients
            }
        }
    };
}

rare! { disk::Disk, cylinder::Cylinder }
