//! The dielectrics that contain the camera.

use super::{CompiledScene, Uv, World};
use crate::material::Media;
use crate::math::{Ray, Vec3};
use std::cmp::Reverse;

/// The maximum number of surfaces that are examined.
const MOST_SURFACES: u32 = 4096;

/// The random number that mixes use here. Surfaces with a lower opacity are holes.
const HALF: f32 = 0.5;

impl CompiledScene {
    /// Sets the media that contain the camera: those that a ray upwards from the eye leaves without having entered
    /// them. `world` holds the surfaces of the scene.
    #[must_use]
    #[inline(never)]
    pub fn with_camera_media(mut self, world: &World) -> CompiledScene {
        let Some(media) = self.materials.media() else { return self };
        let mut ray = Ray::new(Vec3::splat(self.camera.eye), Vec3::splat(self.camera.up).normalized());
        let (mut entered, mut inside) = (Vec::new(), Vec::new());
        for _ in 0..MOST_SURFACES {
            let hit = world.intersect_apart::<f32>(&ray, true);
            if !hit.is_some() {
                break;
            }
            let mut at = self.interaction_apart::<f32>(&ray, &hit, true, Uv::IfTextured);
            let mut opacity = 1.0;
            if self.materials.is_walked() {
                (at, opacity) = self.modified(at, ray.d, true, false, HALF);
            }
            if opacity < HALF {
                // The ray passes through a hole.
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
        // The medium that is left first was entered last, and takes precedence among equal priorities.
        inside.sort_by_key(|&medium| Reverse(media.priority(medium).0));
        self.inside = Media::packed(inside.into_iter().map(|medium| medium.0));
        self
    }
}
