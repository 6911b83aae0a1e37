//! Where meshes may be placed.

use super::description::Mesh;
use crate::parameter::limits::LONGEST;
use glam::{DAffine3, DVec3};

/// The volume below which a transform counts as flat, as a fraction of the largest that its axes' lengths allow.
const FLAT: f64 = 1e-9;

/// The smallest longest side of the box around meshes of one file. The areas of triangles a thousandth as long still
/// fit 32 bits.
const SMALLEST: f64 = 1e-15;

/// Whether a transform cannot be inverted: its determinant is next to nothing beside the largest that axes of these
/// lengths could have.
pub(super) fn is_flat(transform: &DAffine3) -> bool {
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    let largest = x.length() * y.length() * z.length();
    let is_deep = largest > 0.0 && transform.matrix3.determinant().abs() >= FLAT * largest;
    !(is_deep && transform.is_finite())
}

/// What is wrong with where a transform takes meshes, which are the parts of one file: some of it is too far out, or
/// the whole is too small to be seen. It takes time in proportion to the vertices.
pub(super) fn misplaced<'m>(
    meshes: impl IntoIterator<Item = &'m Mesh>,
    transform: &DAffine3,
) -> Option<&'static str> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for position in meshes.into_iter().flat_map(|mesh| &mesh.positions) {
        let placed = transform.transform_point3(DVec3::from(position.map(f64::from)));
        // Coordinates farther out have squares that do not fit 32 bits.
        if placed.abs().max_element() > LONGEST {
            return Some("the transform takes some of the mesh farther than 1e18");
        }
        let single = placed.map(|x| f64::from(x as f32));
        (low, high) = (low.min(single), high.max(single));
    }
    let mut sides = (high - low).to_array();
    sides.sort_by(f64::total_cmp);
    let [_, narrower, longest] = sides;
    let message = "the mesh is smaller than 1e-15 where it stands, or than what 32-bit numbers tell apart there: nothing of it would be seen; give the transform a larger scale, or move the mesh nearer to the origin";
    (longest < SMALLEST || narrower == 0.0).then_some(message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn triangle(size: f32) -> Mesh {
        Mesh {
            positions: vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    #[test]
    fn flat_transforms_are_told() {
        assert!(!is_flat(&DAffine3::IDENTITY));
        assert!(!is_flat(&DAffine3::from_scale(DVec3::new(1e-6, 1e6, -1.0))));
        assert!(is_flat(&DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0))));
        assert!(is_flat(&DAffine3::from_mat3(DMat3::NAN)));
    }

    #[test]
    fn meshes_too_far_out_and_too_small_ones_are_told() {
        let told = |sizes: &[f32], transform: DAffine3| {
            let meshes: Vec<_> = sizes.iter().map(|&size| triangle(size)).collect();
            misplaced(&meshes, &transform)
        };
        let moved = |x: f64| DAffine3::from_translation(DVec3::X * x);
        let scaled = |x: f64| DAffine3::from_scale(DVec3::splat(x));
        assert_eq!(told(&[1.0], DAffine3::IDENTITY), None);
        assert_eq!(told(&[1e17], moved(8e17)), None);
        assert!(told(&[1e17], moved(9.5e17)).is_some_and(|told| told.contains("farther than 1e18")));
        assert!(told(&[1.0], scaled(-2e18)).is_some_and(|told| told.contains("farther than 1e18")));
        assert_eq!(told(&[1.0], scaled(2e-15)), None);
        assert!(told(&[1.0], scaled(5e-16)).is_some_and(|told| told.contains("smaller than 1e-15")));
        // There 32 bits tell apart what is 64 from the next.
        assert!(told(&[1.0], moved(1e9)).is_some_and(|told| told.contains("smaller than 1e-15")));
        // A part may be as small as it likes.
        assert_eq!(told(&[1e-20, 1.0], DAffine3::IDENTITY), None);
    }
}
