//! The limits of a scene's tables.

use super::groups::Places;
use super::sharing::{SHARING_PAYS_FROM, shared};
use crate::material::{MOST_MEDIA, Media};
use crate::scene::{Scene, Shape};
use crate::shape::{MOST_TRIANGLES, Mesh};

/// The most surfaces and triangles of a scene: their numbers have 30 bits where the tree keeps them.
pub const MOST_PRIMITIVES: u64 = MOST_TRIANGLES as u64;

/// The most vertices of a scene: lanes look them up by signed numbers of 32 bits (see
/// [`Float::gather`](crate::math::Float::gather)).
pub const MOST_VERTICES: u64 = i32::MAX as u64;

/// A scene with more in it than can be numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TooLarge {
    /// Too many surfaces and triangles.
    #[error(
        "the scene has {0} surfaces and triangles in all, more than stride can number ({MOST_PRIMITIVES}); take \
         meshes of fewer triangles, or fewer of them"
    )]
    Primitives(u64),
    /// Too many vertices.
    #[error(
        "the meshes of the scene have {0} vertices in all, more than stride can number ({MOST_VERTICES}); take \
         meshes of fewer vertices, or fewer of them"
    )]
    Vertices(u64),
    /// Too many dielectrics with absorption or priorities.
    #[error(
        "the scene has {0} dielectrics that differ, more than stride can number ({MOST_MEDIA}) where one has absorption \
         or a priority; take fewer"
    )]
    Media(u64),
}

/// How much the tables of a scene have to hold. Copies of a mesh count once where they share one, and each where they
/// do not. Groups count once, and each of their places as one more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Surfaces, instances and triangles.
    pub primitives: u64,
    /// Vertices of meshes.
    pub vertices: u64,
    /// Media inside of dielectrics.
    pub media: u64,
}

impl Size {
    /// That of the scene as [`compile`](super::compile()) makes it.
    pub fn of(scene: &Scene) -> Size {
        let (meshes, of_entity) = shared(scene, SHARING_PAYS_FROM);
        Size::sharing(scene, &meshes, &of_entity, &Places::of(scene))
    }

    /// That of a scene with these meshes shared: see [`shared`].
    pub(super) fn sharing(
        scene: &Scene,
        meshes: &[&Mesh],
        of_entity: &[Option<usize>],
        places: &Places,
    ) -> Size {
        let rows: Vec<_> = scene.materials.iter().map(|material| material.kind.row()).collect();
        let mut size = Size { media: Media::new(&rows).count() as u64, ..Size::default() };
        for (index, (entity, shared)) in scene.entities.iter().zip(of_entity).enumerate() {
            // What is written out there is once at each place, and all else of a group once.
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
        // Copies cost no memory before the tables are built: there may be any number of them.
        Size {
            primitives: self.primitives.saturating_add(primitives as u64),
            vertices: self.vertices.saturating_add(vertices as u64),
            ..self
        }
    }

    /// Whether the tables have room for it.
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
    fn what_cannot_be_numbered_is_refused() {
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
