//! Transforms of shapes that remain shapes of the same kind.

use super::list::*;
use super::{AnyShape, Piece, Quad, ShapeParameters};
use glam::{DAffine3, DMat3, DVec3};

/// The relative tolerance for the squared lengths of a similarity's columns.
const SIMILAR: f64 = 1e-9;

/// The scale of a similarity: a transform that rotates, reflects and scales uniformly.
fn scale_of(a: &DMat3) -> Option<f64> {
    let squares = a.transpose() * *a;
    let square = squares.x_axis.x;
    let off = squares - DMat3::from_diagonal(DVec3::splat(square));
    let most = off.to_cols_array().into_iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    (most <= SIMILAR * square).then(|| square.sqrt())
}

/// Whether a matrix scales uniformly and does nothing else.
fn only_scales(a: &DMat3) -> bool {
    let off = *a - DMat3::from_diagonal(DVec3::splat(a.x_axis.x));
    a.x_axis.x > 0.0 && off.to_cols_array().into_iter().all(|x| x.abs() <= SIMILAR * a.x_axis.x)
}

/// The pieces of a transformed shape, and whether their outward side has been exchanged with the other one. `None` if
/// the result is not a shape of the same kind. With `keeps_uv` its uv are unchanged, too; otherwise those of shapes
/// whose uv follow the world's axes may be rotated.
///
/// `None` for a mesh, whose triangles are stored separately.
pub fn transformed(shape: &AnyShape, transform: &DAffine3, keeps_uv: bool) -> Option<(Vec<Piece>, bool)> {
    let a = &transform.matrix3;
    let mirrors = a.determinant() < 0.0;
    let point = |p: DVec3| transform.transform_point3(p);
    let quad = |corner: DVec3, u: DVec3, v: DVec3| Piece::Quad(Quad::new(point(corner), *a * u, *a * v));
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let scale = || scale_of(a).filter(|_| !keeps_uv || only_scales(a));
    let pieces = match shape {
        AnyShape::Quad(QuadParameters { corner, u, v }) => {
            return Some((vec![quad(*corner, *u, *v)], mirrors));
        }
        AnyShape::Box(cuboid) => {
            let side = |piece| match piece {
                Piece::Quad(side) => quad(wide(side.corner), wide(side.u), wide(side.v)),
                other => other,
            };
            return Some((cuboid.pieces().into_iter().map(side).collect(), mirrors));
        }
        AnyShape::Sphere(SphereParameters { center, radius }) => {
            SphereParameters { center: point(*center), radius: radius * scale()? }.pieces()
        }
        AnyShape::Disk(DiskParameters { center, normal, radius }) => {
            let normal = (*a * *normal).normalize();
            DiskParameters { center: point(*center), normal, radius: radius * scale()? }.pieces()
        }
        AnyShape::Cylinder(CylinderParameters { from, to, radius }) => {
            CylinderParameters { from: point(*from), to: point(*to), radius: radius * scale()? }.pieces()
        }
        AnyShape::Plane(_) | AnyShape::Mesh { .. } => return None,
    };
    // A similarity maps a disk's normal to its normal, with or without reflection.
    Some((pieces, false))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::CustomShape;
    use glam::DQuat;

    #[test]
    fn similarities_preserve_shapes() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.7);
        let similar = DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), turn, DVec3::X * 3.0);
        let squeezed = DAffine3::from_scale_rotation_translation(DVec3::new(2.0, 1.0, 2.0), turn, DVec3::X);
        let grown = DAffine3::from_scale_rotation_translation(DVec3::splat(3.0), DQuat::IDENTITY, DVec3::Y);
        let ball = AnyShape::Sphere(SphereParameters { center: DVec3::Z, radius: 1.5 });
        let Some((pieces, false)) = transformed(&ball, &similar, false) else { panic!("a sphere") };
        let [Piece::Sphere(sphere)] = pieces[..] else { panic!("one sphere") };
        assert!((sphere.radius - 3.0).abs() < 1e-6);
        let centre = similar.transform_point3(DVec3::Z).to_array();
        assert!((0..3).all(|i| (f64::from(sphere.centre[i]) - centre[i]).abs() < 1e-6));
        // Its uv are rotated.
        assert!(
            transformed(&ball, &similar, true).is_none() && transformed(&ball, &squeezed, false).is_none()
        );
        assert!(transformed(&ball, &grown, true).is_some());
        let pane = AnyShape::Quad(QuadParameters { corner: DVec3::ZERO, u: DVec3::X, v: DVec3::Y });
        for (transform, turned) in
            [(squeezed, false), (DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)), true)]
        {
            let Some((pieces, is_turned)) = transformed(&pane, &transform, true) else { panic!("a quad") };
            assert_eq!((pieces.len(), is_turned), (1, turned));
            let inverse = transform.matrix3.inverse().transpose();
            let outward =
                DVec3::from(pieces[0].surface().normal.map(f64::from)) * if turned { -1.0 } else { 1.0 };
            assert!((outward - (inverse * DVec3::Z).normalize()).length() < 1e-6);
        }
        let disk = AnyShape::Disk(DiskParameters { center: DVec3::X, normal: DVec3::Z, radius: 1.0 });
        let flipped = DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let Some((pieces, false)) = transformed(&disk, &flipped, false) else { panic!("a disk") };
        let [Piece::Custom(CustomShape::Disk(disk))] = pieces[..] else { panic!("one disk") };
        assert_eq!(disk.normal, [0.0, 0.0, -1.0]);
        let tube = AnyShape::Cylinder(CylinderParameters { from: DVec3::ZERO, to: DVec3::Z, radius: 1.0 });
        assert!(
            transformed(&tube, &similar, false).is_some() && transformed(&tube, &squeezed, false).is_none()
        );
    }
}
