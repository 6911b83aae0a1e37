//! The point light.

use super::LightSample;
use crate::math::{Float, Rgb, Uint, Vec3};
use crate::parameter::limits::{INTENSITY, POINT};
use crate::parameter::{Colour, Kind, parameters};
use glam::DVec3;

parameters! {
    /// Sends the same intensity in every direction.
    pub struct PointLightParameters: "point", "a point light" {
        /// Where the light is.
        position: DVec3 = POINT,
        /// Radiant intensity in W/sr, the same in every direction.
        intensity: Colour = Kind::Colour(INTENSITY),
    }
}

/// Sends the same intensity in every direction. No path can hit it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Where it is.
    pub position: [f32; 3],
    /// Radiant intensity in W/sr.
    pub intensity: [f32; 3],
}

/// The sample of a point light as seen from `p`.
#[inline(always)]
pub(super) fn sample<F: Float>(p: Vec3<F>, position: Vec3<F>, intensity: Rgb<F>) -> LightSample<F> {
    let to_light = position - p;
    let distance2 = to_light.dot(to_light);
    LightSample {
        wi: to_light * (F::splat(1.0) / distance2.sqrt()),
        target: position,
        radiance: intensity * (F::splat(1.0) / distance2),
        pdf: F::splat(1.0),
    }
}

/// All point lights, one column for each property, so that each lane can look at another one.
#[derive(Clone, Debug, Default)]
pub struct PointLights {
    position: [Vec<f32>; 3],
    intensity: [Vec<f32>; 3],
}

impl PointLights {
    /// Adds a light.
    pub fn push(&mut self, light: PointLight) {
        for c in 0..3 {
            self.position[c].push(light.position[c]);
            self.intensity[c].push(light.intensity[c]);
        }
    }

    /// How many lights there are.
    pub fn len(&self) -> usize {
        self.position[0].len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The lights, in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = PointLight> + '_ {
        (0..self.len()).map(|i| PointLight {
            position: [0, 1, 2].map(|c| self.position[c][i]),
            intensity: [0, 1, 2].map(|c| self.intensity[c][i]),
        })
    }

    /// One light each lane, all equally likely and weighted for it, chosen with `choice` in [0, 1).
    #[inline(always)]
    pub fn sample_one<F: Float>(&self, p: Vec3<F>, choice: F) -> LightSample<F> {
        let count = self.len() as f32;
        let index = (choice * count).to_uint();
        // A product that rounds up to `count` still means the last light.
        let last = F::Uint::splat(self.len() as u32 - 1);
        let index = F::Uint::select(index.lt(last), index, last);
        let (position, intensity) =
            (Vec3::gather(&self.position, index), Rgb::gather(&self.intensity, index));
        sample(p, position, intensity * F::splat(count))
    }
}
