//! The events of a path, for `stride trace`.

use crate::math::{Float, Ray, Rgb, Uint, Vec3};

/// An event on a path.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A ray leaves the camera or a surface.
    Ray {
        /// Bounces so far.
        depth: u32,
        /// The ray's origin.
        origin: [f32; 3],
        /// The ray's direction.
        direction: [f32; 3],
    },
    /// The ray hits a surface.
    Hit {
        /// Distance along the ray.
        distance: f32,
        /// The hit point.
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
    /// The ray passes straight through the surface that it hit, which is no bounce.
    Pass {
        /// The reason.
        through: Passage,
    },
    /// The ray leaves the scene.
    Escape {
        /// The radiance of the environment and of lights at infinity.
        radiance: [f32; 3],
    },
    /// A light was sampled.
    Light {
        /// Direction to the light.
        direction: [f32; 3],
        /// Radiance that the sample adds to the path, before throughput.
        added: [f32; 3],
    },
    /// The path continues in a direction sampled from the BxDF.
    Scatter {
        /// f·|cos θ|/pdf.
        weight: [f32; 3],
        /// Density of the direction by solid angle, in 1/sr; the probability of a delta lobe.
        pdf: f32,
        /// The throughput: the product of all weights so far.
        throughput: [f32; 3],
    },
    /// The path survives Russian roulette.
    Survive {
        /// The survival probability, by which the throughput is divided.
        chance: f32,
        /// The throughput: the product of all weights so far.
        throughput: [f32; 3],
    },
    /// The path ends.
    End {
        /// The reason.
        reason: &'static str,
        /// The radiance of the sample.
        radiance: [f32; 3],
    },
}

/// The reason why a path passes straight through a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passage {
    /// The material's opacity is below one, and the random number chose the part that is open.
    Hole,
    /// The effective medium is the same on both sides: a dielectric of a higher priority, or the same one, is around.
    NoInterface,
}

/// The end of a path that passed too many surfaces in a row.
pub(super) const TOO_MANY_PASSED: &str = "too many surfaces that are no interfaces";

/// A log of the events of a path, if the caller wants one.
///
/// Events are recorded only at the scalar level, so that wider lanes have no code for them.
pub struct Observer<'a>(Option<&'a mut Vec<Event>>);

impl<'a> Observer<'a> {
    /// Records nothing.
    pub fn none() -> Observer<'a> {
        Observer(None)
    }

    /// Appends the events of the path to a list.
    pub fn of(events: &'a mut Vec<Event>) -> Observer<'a> {
        Observer(Some(events))
    }

    /// Whether events of paths in lanes of this width are recorded.
    #[inline(always)]
    pub fn listens<F: Float>(&self) -> bool {
        F::LANES == 1 && self.0.is_some()
    }

    /// Records an event of the path in lane 0.
    #[inline(always)]
    pub fn event<F: Float>(&mut self, event: impl FnOnce() -> Event) {
        if F::LANES == 1
            && let Some(events) = &mut self.0
        {
            events.push(event());
        }
    }
}

#[inline(always)]
pub(super) fn vec3<F: Float>(v: Vec3<F>) -> [f32; 3] {
    let [x, y, z] = v.coordinates();
    [x.first(), y.first(), z.first()]
}

#[inline(always)]
pub(super) fn rgb<F: Float>(c: Rgb<F>) -> [f32; 3] {
    let [r, g, b] = c.channels();
    [r.first(), g.first(), b.first()]
}

#[inline(always)]
pub(super) fn ray_event<F: Float>(depth: F::Uint, ray: &Ray<F>) -> Event {
    Event::Ray { depth: depth.first(), origin: vec3(ray.o), direction: vec3(ray.d) }
}
