//! The dielectrics that a camera is inside of.

use super::{CompiledScene, Uv, World};
use crate::material::Media;
use crate::math::{Ray, Vec3};
use std::cmp::Reverse;

/// The most surfaces that are looked at.
const MOST_SURFACES: u32 = 4096;

/// The number by which mixes choose there; what is less opaque than this is a hole.
const HALF: f32 = 0.5;

impl CompiledScene {
    /// With the media that the camera is inside of: those that a ray from its eye upwards leaves without having entered
    /// them.
    #[must_use]
    pub fn submerged(mut self, world: &World) -> CompiledScene {
        let Some(media) = self.materials.media() else { return self };
        let mut ray = Ray::new(Vec3::splat(self.camera.eye), Vec3::splat(self.camera.up).normalized());
        let (mut entered, mut inside) = (Vec::new(), Vec::new());
        for _ in 0..MOST_SURFACES {
            let hit = world.intersect::<f32>(&ray, true);
            if !hit.is_some() {
                break;
            }
            let mut at = self.interaction(&ray, &hit, true, Uv::WherePatterned);
            let mut opacity = 1.0;
            if self.materials.is_walked() {
                (at, opacity) = self.modified(at, ray.d, true, HALF);
            }
            if opacity < HALF {
                // It goes through a hole.
                ray = at.straight_on(&ray);
                continue;
            }
            let medium = media.medium(at.material);
            if at.cos_o > 0.0 {
                entered.push(medium);
            } else if let Some(place) = entered.iter().rposition(|other| *other == medium) {
                entered.remove(place);
            } else if medium.0 > 0 {
                inside.push(medium);
            }
            ray = at.straight_on(&ray);
        }
        // What is left first was entered last, and comes before others of its priority.
        inside.sort_by_key(|&medium| Reverse(media.priority(medium).0));
        self.inside = Media::packed(inside.into_iter().map(|medium| medium.0));
        self
    }
}
