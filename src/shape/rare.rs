//! The shapes of which most scenes have none.

use super::{Bounds, RareShape, Shape, Surface};
use crate::math::{Float, Ray, Vec3};

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

        impl Rare {
            /// The outward unit normal of the surface at its point nearest to `p`, and how far `p` lies off the
            /// surface along that normal. `p` is a computed hit: off by rounding alone.
            #[inline(always)]
            pub fn point<F: Float>(&self, p: Vec3<F>) -> (Vec3<F>, F) {
                match self {
                    $(Rare::$shape(shape) => shape.point(p),)+
                }
            }

            /// uv at a point on the surface, where the outward unit normal is `n`.
            #[inline(always)]
            pub fn uv<F: Float>(&self, p: Vec3<F>, n: Vec3<F>) -> (F, F) {
                match self {
                    $(Rare::$shape(shape) => shape.uv(p, n),)+
                }
            }
        }
    };
}

rare! { disk::Disk, cylinder::Cylinder }
