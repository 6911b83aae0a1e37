//! The lobes of materials, one file each, and their combinations.

mod conductor;
mod dielectric;
mod ggx;
mod lambertian;
mod oren_nayar;
mod rough_dielectric;
mod specular_reflection;
mod sum;
mod thin_dielectric;

pub use conductor::{Metal, RoughMetal, SmoothMetal, fresnel_conductor};
pub use dielectric::{SmoothDielectric, fresnel_dielectric};
pub use ggx::{Ggx, LEAST_ALPHA};
pub use lambertian::Lambertian;
pub use oren_nayar::OrenNayar;
pub use rough_dielectric::RoughDielectric;
pub use specular_reflection::SpecularReflection;
pub use sum::Sum;
pub use thin_dielectric::{RoughSheet, Sheet, SmoothSheet};

use crate::math::{Float, Vec3};

/// Whether two directions are on the same side of the surface.
#[inline(always)]
fn same_side<F: Float>(wo: Vec3<F>, wi: Vec3<F>) -> F::Mask {
    (wo.z * wi.z).gt(F::zero())
}

/// The mirror image of a direction about the normal.
#[inline(always)]
fn reflect<F: Float>(w: Vec3<F>) -> Vec3<F> {
    Vec3::new(-w.x, -w.y, w.z)
}

/// A direction reflected to the upper side if it is below the surface.
#[inline(always)]
fn raised<F: Float>(w: Vec3<F>) -> Vec3<F> {
    Vec3::new(w.x, w.y, w.z.abs())
}
