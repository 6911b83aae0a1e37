//! Looking over an integrator's shoulder.

use crate::math::{Float, Mask, Ray, Rgb, Vec3};

/// Something that happens on a path.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A ray sets out.
    Ray {
        /// Bounces so far.
        depth: u32,
        /// Its origin.
        origin: [f32; 3],
        /// Its direction.
        direction: [f32; 3],
    },
    /// It met a surface.
    Hit {
        /// Distance along the ray.
        distance: f32,
        /// The point.
        point: [f32; 3],
        /// The outward normal there.
        normal: [f32; 3],
        /// The entity's index in the scene.
        entity: u32,
        /// The material's index in the scene, checkerboards resolved.
        material: u32,
        /// Radiance emitted towards the ray's origin.
        emitted: [f32; 3],
    },
    /// It left the scene.
    Escape {
        /// What it saw there.
        radiance: [f32; 3],
    },
    /// A light was asked directly.
    Light {
        /// Direction to the light.
        direction: [f32; 3],
        /// Radiance that this adds to the path, before throughput.
        added: [f32; 3],
    },
    /// The path goes on in a direction drawn from the BxDF.
    Scatter {
        /// f·|cos θ|/pdf.
        weight: [f32; 3],
        /// Density of the direction by solid angle; the chance of a delta lobe.
        pdf: f32,
        /// Product of all weights so far.
        throughput: [f32; 3],
    },
    /// The path survives Russian roulette.
    Survive {
        /// The chance of that, which its throughput is divided by.
        chance: f32,
        /// Product of all weights so far.
        throughput: [f32; 3],
    },
    /// The path ends.
    End {
        /// Why.
        reason: &'static str,
        /// What it saw.
        radiance: [f32; 3],
    },
}

/// Is told what happens. All methods do nothing unless overridden, so that the hot path has none of it.
pub trait Observer {
    /// Whether anything is listening.
    const LISTENS: bool;
    /// Something happened on the path in lane 0.
    fn event(&mut self, event: impl FnOnce() -> Event);
}

/// Hears nothing.
pub struct Silent;

impl Observer for Silent {
    const LISTENS: bool = false;
    #[inline(always)]
    fn event(&mut self, _event: impl FnOnce() -> Event) {}
}

/// Writes everything down.
#[derive(Default)]
pub struct Record(pub Vec<Event>);

impl Observer for Record {
    const LISTENS: bool = true;
    fn event(&mut self, event: impl FnOnce() -> Event) {
        self.0.push(event());
    }
}

/// Lane 0 of a mask.
#[inline(always)]
pub(super) fn first<M: Mask>(mask: M) -> bool {
    mask.bits() & 1 != 0
}

#[inline(always)]
pub(super) fn vec3<F: Float>(v: Vec3<F>) -> [f32; 3] {
    v.lane(0)
}

#[inline(always)]
pub(super) fn rgb<F: Float>(c: Rgb<F>) -> [f32; 3] {
    c.lane(0)
}

#[inline(always)]
pub(super) fn ray_event<F: Float>(depth: u32, ray: &Ray<F>) -> Event {
    Event::Ray { depth, origin: vec3(ray.o), direction: vec3(ray.d) }
}
