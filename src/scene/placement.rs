//! Limits of the transforms of meshes and groups.

use super::description::Mesh;
use crate::math::Bounds;
use crate::parameter::limits::LONGEST;
use glam::{DAffine3, DMat3, DVec3};

/// The relative volume below which a transform counts as singular: a fraction of the maximum for its axes' lengths.
const FLAT: f64 = 1e-9;

/// The minimum longest side of the bounds of the meshes of one file. The areas of triangles a thousandth as long still
/// fit in 32 bits.
const SMALLEST: f64 = 1e-15;

/// Whether a transform is singular: its determinant is negligible relative to the maximum for axes of these lengths.
pub(super) fn is_flat(transform: &DAffine3) -> bool {
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    let largest = x.length() * y.length() * z.length();
    let is_deep = largest > 0.0 && transform.matrix3.determinant().abs() >= FLAT * largest;
    !(is_deep && transform.is_finite())
}

/// The maximum condition number of a transform. Geometry with a larger one is not shared.
const WORST_CONDITION: f32 = 1000.0;

/// The largest factor by which a matrix stretches a vector, and its condition number for errors, ‖|A|·|A⁻¹|‖; both in
/// the maximum norm.
pub(crate) fn magnification(a: DMat3) -> [f64; 2] {
    let absolute = |m: DMat3| DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let most = |m: DMat3| (0..3).map(|i| m.row(i).element_sum()).fold(0.0, f64::max);
    [most(absolute(a)), most(absolute(a) * absolute(a.inverse()))]
}

/// Whether a transform allows tracing rays in the space of shared geometry: its shear and uneven scale are limited.
pub(crate) fn is_placeable(transform: &DAffine3) -> bool {
    let (a, inverse) = (transform.matrix3, transform.matrix3.inverse());
    let [stretch, condition] = magnification(a);
    let numbers = a.to_cols_array().into_iter().chain(inverse.to_cols_array());
    let mut numbers = numbers.chain(transform.translation.to_array()).chain([stretch]);
    numbers.all(|x| (x as f32).is_finite()) && condition as f32 <= WORST_CONDITION
}

/// The problem with the transform of a box, if any: see [`misplaced`].
pub(super) fn misplaced_box(own: &Bounds, transform: &DAffine3) -> Option<&'static str> {
    let Bounds { low, high } = own;
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in 0..8 {
        let p = [0, 1, 2].map(|axis| f64::from(if corner >> axis & 1 == 0 { low[axis] } else { high[axis] }));
        let placed = transform.transform_point3(DVec3::from(p));
        let farthest = placed.abs().max_element().max(DVec3::from(p).abs().max_element());
        // NaN and infinities are not below it.
        if farthest.is_nan() || farthest > LONGEST {
            return Some("the group extends farther than 1e18, before or after its transform");
        }
        (least, most) = (least.min(placed), most.max(placed));
    }
    let message = "the transformed group is smaller than 1e-15 and would be invisible; give the transform a larger scale";
    ((most - least).max_element() < SMALLEST).then_some(message)
}

/// The problem with the transform of meshes that are the parts of one file, if any: some of them are too far from the
/// origin, or all together are too small to be visible. It takes time proportional to the number of vertices.
pub(super) fn misplaced<'m>(
    meshes: impl IntoIterator<Item = &'m Mesh>,
    transform: &DAffine3,
) -> Option<&'static str> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for position in meshes.into_iter().flat_map(|mesh| &mesh.positions) {
        let placed = transform.transform_point3(DVec3::from(position.map(f64::from)));
        // Larger coordinates have squares that overflow 32 bits.
        if placed.abs().max_element() > LONGEST {
            return Some("the transform moves some of the mesh farther than 1e18 from the origin");
        }
        let single = placed.map(|x| f64::from(x as f32));
        (low, high) = (low.min(single), high.max(single));
    }
    let mut sides = (high - low).to_array();
    sides.sort_by(f64::total_cmp);
    let [_, narrower, longest] = sides;
    let message = "the transformed mesh is smaller than 1e-15, or than the resolution of 32-bit numbers there, and would be invisible; give the transform a larger scale, or move the mesh closer to the origin";
    (longest < SMALLEST || narrower == 0.0).then_some(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(size: f32) -> Mesh {
        Mesh {
            positions: vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    #[test]
    fn singular_transforms_are_reported() {
        assert!(!is_flat(&DAffine3::IDENTITY));
        assert!(!is_flat(&DAffine3::from_scale(DVec3::new(1e-6, 1e6, -1.0))));
        assert!(is_flat(&DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0))));
        assert!(is_flat(&DAffine3::from_mat3(DMat3::NAN)));
    }

    #[test]
    fn distant_and_tiny_meshes_are_reported() {
        let reported = |sizes: &[f32], transform: DAffine3| {
            let meshes: Vec<_> = sizes.iter().map(|&size| triangle(size)).collect();
            misplaced(&meshes, &transform)
        };
        let moved = |x: f64| DAffine3::from_translation(DVec3::X * x);
        let scaled = |x: f64| DAffine3::from_scale(DVec3::splat(x));
        assert_eq!(reported(&[1.0], DAffine3::IDENTITY), None);
        assert_eq!(reported(&[1e17], moved(8e17)), None);
        assert!(
            reported(&[1e17], moved(9.5e17)).is_some_and(|reported| reported.contains("farther than 1e18"))
        );
        assert!(
            reported(&[1.0], scaled(-2e18)).is_some_and(|reported| reported.contains("farther than 1e18"))
        );
        assert_eq!(reported(&[1.0], scaled(2e-15)), None);
        assert!(
            reported(&[1.0], scaled(5e-16)).is_some_and(|reported| reported.contains("smaller than 1e-15"))
        );
        // There, 32 bits distinguish multiples of 64.
        assert!(reported(&[1.0], moved(1e9)).is_some_and(|reported| reported.contains("smaller than 1e-15")));
        // A single part may be arbitrarily small.
        assert_eq!(reported(&[1e-20, 1.0], DAffine3::IDENTITY), None);
    }
}
