//! The limits of a scene's tables.

use super::groups::GroupPlacements;
use super::sharing::{SHARING_PAYS_FROM, shared};
use crate::material::{MOST_MEDIA, Media};
use crate::scene::{Scene, Shape};
use crate::shape::{MOST_TRIANGLES, Mesh};

/// The maximum number of surfaces and triangles of a scene: the tree stores their indices in 30 bits.
pub const MOST_PRIMITIVES: u64 = MOST_TRIANGLES as u64;

/// The maximum number of vertices of a scene: lanes look them up by signed 32-bit indices (see
/// [`Float::gather`](crate::math::Float::gather)).
pub const MOST_VERTICES: u64 = i32::MAX as u64;

/// The scene exceeds a limit of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TooLarge {
    /// Too many surfaces and triangles.
    #[error(
        "the scene has {0} surfaces and triangles in all, more than the maximum of {MOST_PRIMITIVES}; use fewer or \
         smaller meshes"
    )]
    Primitives(u64),
    /// Too many vertices.
    #[error(
        "the meshes of the scene have {0} vertices in all, more than the maximum of {MOST_VERTICES}; use fewer or \
         smaller meshes"
    )]
    Vertices(u64),
    /// Too many dielectrics with absorption or priorities.
    #[error(
        "the scene has {0} different dielectrics, more than the maximum of {MOST_MEDIA} in scenes with absorption or \
         priorities; use fewer"
    )]
    Media(u64),
}

/// The number of entries in the tables of a scene. A shared mesh counts once, and other copies count each. Groups count
/// once, and each of their instances counts as one more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Surfaces, instances and triangles.
    pub primitives: u64,
    /// Vertices of meshes.
    pub vertices: u64,
    /// Media inside dielectrics.
    pub media: u64,
}

impl Size {
    /// The size of the scene as compiled by [`compile`](super::compile()).
    pub fn of(scene: &Scene) -> Size {
        let (meshes, of_entity) = shared(scene, SHARING_PAYS_FROM);
        Size::sharing(scene, &meshes, &of_entity, &GroupPlacements::of(scene))
    }

    /// The size of a scene with these meshes shared: see [`shared`].
    pub(super) fn sharing(
        scene: &Scene,
        meshes: &[&Mesh],
        of_entity: &[Option<usize>],
        places: &GroupPlacements,
    ) -> Size {
        let rows: Vec<_> = scene.materials.iter().map(|material| material.kind.row()).collect();
        let mut size = Size { media: Media::new(&rows).count() as u64, ..Size::default() };
        for (index, (entity, shared)) in scene.entities.iter().zip(of_entity).enumerate() {
            // Entities that are written out count once per instance, all others of a group once.
            let times = match entity.within {
                Some(group) if places.written_out[index] => places.of_group[group].len(),
                _ => 1,
            };
            size = match &entity.shape {
                Shape::Mesh { mesh, .. } if shared.is_none() => {
                    let [triangles, vertices] = [mesh.triangles.len(), mesh.positions.len()];
                    size.with(triangles.saturating_mul(times), vertices.saturating_mul(times))
                }
                // An instance.
                Shape::Mesh { .. } => size.with(1, 0),
                shape => size.with(shape.pieces().len().saturating_mul(times), 0),
            };
        }
        size = places.of_group.iter().fold(size, |size, of_group| size.with(of_group.len(), 0));
        meshes.iter().fold(size, |size, mesh| size.with(mesh.triangles.len(), mesh.positions.len()))
    }

    fn with(self, primitives: usize, vertices: usize) -> Size {
        // Copies take no memory before the tables are built, so their number is unlimited here.
        Size {
            primitives: self.primitives.saturating_add(primitives as u64),
            vertices: self.vertices.saturating_add(vertices as u64),
            ..self
        }
    }

    /// Checks the size against the limits of the tables.
    pub fn check(self) -> Result<(), TooLarge> {
        if self.primitives > MOST_PRIMITIVES {
            return Err(TooLarge::Primitives(self.primitives));
        }
        if self.vertices > MOST_VERTICES {
            return Err(TooLarge::Vertices(self.vertices));
        }
        if self.media > MOST_MEDIA as u64 {
            return Err(TooLarge::Media(self.media));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_beyond_the_limits_are_rejected() {
        let check = |primitives, vertices| Size { primitives, vertices, media: 0 }.check();
        assert_eq!(check(1 << 30, (1 << 31) - 1), Ok(()));
        assert_eq!(check((1 << 30) + 1, 0), Err(TooLarge::Primitives((1 << 30) + 1)));
        assert_eq!(check(0, 1 << 31), Err(TooLarge::Vertices(1 << 31)));
        let media = |media| Size { media, ..Size::default() }.check();
        assert_eq!([media(65_535), media(65_536)], [Ok(()), Err(TooLarge::Media(65_536))]);
        let message = check(3 << 30, 0).unwrap_err().to_string();
        assert!(message.contains("3221225472") && message.contains("1073741824"), "{message}");
    }
}
