//! Shapes with intersection and surface functions of their own, such as disks and cylinders.

use super::{Bounds, Shape, Surface, SurfaceFunctions};
use crate::math::{Float, Ray, Uint, Vec3};

/// The numbers of a custom shape that hits look up. Their meanings are in the file of each shape.
#[derive(Clone, Copy, Debug)]
pub struct CustomSurface<F> {
    /// A point.
    pub anchor: Vec3<F>,
    /// A direction of length one.
    pub axis: Vec3<F>,
    /// A length.
    pub constant: F,
    /// A vector for u.
    pub u_axis: Vec3<F>,
    /// An offset for u.
    pub u_offset: F,
    /// A vector for v.
    pub v_axis: Vec3<F>,
    /// An offset for v.
    pub v_offset: F,
}

impl CustomKind {
    /// Its number, from one.
    pub const fn number(self) -> u32 {
        self as u32 + 1
    }
}

impl Surface {
    /// The numbers of a custom shape.
    #[inline(always)]
    pub fn custom_surface(&self) -> CustomSurface<f32> {
        let ([ux, uy, uz, u_offset], [vx, vy, vz, v_offset]) = (self.u_axis, self.v_axis);
        CustomSurface {
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

/// Makes one type of several shapes, and dispatches to them.
macro_rules! custom {
    ($($file:ident::$shape:ident),+) => {
        $(pub use super::$file::$shape;)+

        /// A shape with functions of its own. Most scenes have none: rays are tested against these shapes in one place,
        /// which scenes without them skip.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum CustomShape {
            $(
                #[doc = concat!("A [`", stringify!($shape), "`].")]
                $shape($shape),
            )+
        }

        /// The kind of a custom shape.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum CustomKind {
            $(
                #[doc = concat!("A [`", stringify!($shape), "`].")]
                $shape,
            )+
        }

        $(
            impl From<$shape> for CustomShape {
                fn from(shape: $shape) -> CustomShape {
                    CustomShape::$shape(shape)
                }
            }
        )+

        impl Shape for CustomShape {
            #[inline(always)]
            fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
                match self {
                    $(CustomShape::$shape(shape) => shape.intersect(ray),)+
                }
            }

            fn bounds(&self) -> Bounds {
                match self {
                    $(CustomShape::$shape(shape) => shape.bounds(),)+
                }
            }

            fn surface(&self) -> Surface {
                match self {
                    $(CustomShape::$shape(shape) => shape.surface(),)+
                }
            }
        }

        impl<F: Float> CustomSurface<F> {
            /// The outward unit normal of the surface at its point nearest to `p`, and the distance of `p` from the
            /// surface along that normal. `p` is a computed hit: off by rounding errors only. Lanes of no kind are
            /// unspecified.
            #[inline(always)]
            pub fn point(&self, kind: F::Uint, p: Vec3<F>) -> (Vec3<F>, F) {
                let mut point = (self.axis, F::zero());
                $(
                    point = F::branch(
                        kind.eq(F::Uint::splat(CustomKind::$shape.number())),
                        point,
                        #[inline(always)]
                        || $shape::point(self, p),
                    );
                )+
                point
            }

            /// The direction, at a point on the surface, in which u increases and v is constant, of any length.
            #[inline(always)]
            pub fn tangent(&self, kind: F::Uint, p: Vec3<F>) -> Vec3<F> {
                let mut tangent = self.axis;
                $(
                    tangent = F::branch(
                        kind.eq(F::Uint::splat(CustomKind::$shape.number())),
                        tangent,
                        #[inline(always)]
                        || $shape::tangent(self, p),
                    );
                )+
                tangent
            }

            /// uv at a point on the surface, given its outward unit normal `n`.
            #[inline(always)]
            pub fn uv(&self, kind: F::Uint, p: Vec3<F>, n: Vec3<F>) -> [F; 2] {
                let mut uv = [F::zero(); 2];
                $(
                    uv = F::branch(
                        kind.eq(F::Uint::splat(CustomKind::$shape.number())),
                        uv,
                        #[inline(always)]
                        || $shape::uv(self, p, n),
                    );
                )+
                uv
            }

            /// The area of uv per area of the surface at a point.
            #[inline(always)]
            pub fn uv_per_area(&self, kind: F::Uint, p: Vec3<F>) -> F {
                let mut area = F::zero();
                $(
                    area = F::branch(
                        kind.eq(F::Uint::splat(CustomKind::$shape.number())),
                        area,
                        #[inline(always)]
                        || $shape::uv_per_area(self, p),
                    );
                )+
                area
            }

            /// The gradients of u and v along the surface at a point.
            #[inline(always)]
            pub fn uv_gradients(&self, kind: F::Uint, p: Vec3<F>) -> [Vec3<F>; 2] {
                let mut gradients = [Vec3::zero(); 2];
                $(
                    gradients = F::branch(
                        kind.eq(F::Uint::splat(CustomKind::$shape.number())),
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

custom! { disk::Disk, cylinder::Cylinder }
