//! Hits on custom shapes, lane by lane, as computed by [`CustomSurface`].

use super::SurfaceTable;
use crate::math::lanes::Device;
use crate::math::{Float, LaneFloat, Vec3};
use crate::shape::CustomSurface;
use crate::world::custom::CustomHits;

impl SurfaceTable {
    /// The kinds and the geometry of rows of custom shapes.
    #[inline(always)]
    pub(super) fn custom<F: Float>(&self, row: F::Uint) -> (F::Uint, CustomSurface<F>) {
        let form = CustomSurface {
            anchor: Vec3::gather(&self.anchor, row),
            axis: Vec3::gather(&self.axis, row),
            constant: F::gather(&self.constant, row),
            u_axis: Vec3::gather(&self.u_axis, row),
            u_offset: F::gather(&self.u_offset, row),
            v_axis: Vec3::gather(&self.v_axis, row),
            v_offset: F::gather(&self.v_offset, row),
        };
        ((-F::gather(&self.radius, row)).to_uint(), form)
    }

    /// Normals at points, and the distances from the points to the surfaces, in the lanes of `lanes`.
    #[inline(always)]
    pub(super) fn custom_point<F: Float>(&self, row: F::Uint, p: Vec3<F>, lanes: F::Mask) -> (Vec3<F>, F) {
        F::device(&CustomPoint(self), (row, p, lanes))
    }

    /// uv coordinates of points with the outward normals `n`.
    #[inline(always)]
    pub(super) fn custom_uv<F: Float>(&self, row: F::Uint, p: Vec3<F>, n: Vec3<F>, lanes: F::Mask) -> [F; 2] {
        F::device(&CustomUv(self), (row, p, n, lanes))
    }

    /// ∂p/∂u at points, of any length.
    #[inline(always)]
    pub(super) fn custom_tangent<F: Float>(&self, row: F::Uint, p: Vec3<F>, lanes: F::Mask) -> Vec3<F> {
        F::device(&CustomTangent(self), (row, p, lanes))
    }
}

/// Normals at points of custom shapes, and the distances of the points from them: [`CustomSurface::point`], lane by lane.
struct CustomPoint<'a>(&'a SurfaceTable);

impl Device for CustomPoint<'_> {
    const NAME: &'static str = "custom_point";
    type Arguments<F: Float> = (F::Uint, Vec3<F>, F::Mask);
    type Output<F: Float> = (Vec3<F>, F);

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (row, p, lanes): Self::Arguments<F>) -> (Vec3<F>, F) {
        CustomHits::new(&self.0.rows, lanes, row, p).points()
    }

    fn recorded<F: Float>(&self, (row, p, _): Self::Arguments<F>) -> Option<(Vec3<F>, F)> {
        let (kind, form) = self.0.custom::<F>(row);
        Some(form.point(kind, p))
    }
}

/// uv coordinates of points: [`CustomSurface::uv`].
struct CustomUv<'a>(&'a SurfaceTable);

impl Device for CustomUv<'_> {
    const NAME: &'static str = "custom_uv";
    type Arguments<F: Float> = (F::Uint, Vec3<F>, Vec3<F>, F::Mask);
    type Output<F: Float> = [F; 2];

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (row, p, n, lanes): Self::Arguments<F>) -> [F; 2] {
        CustomHits::new(&self.0.rows, lanes, row, p).uv(n)
    }

    fn recorded<F: Float>(&self, (row, p, n, _): Self::Arguments<F>) -> Option<[F; 2]> {
        let (kind, form) = self.0.custom::<F>(row);
        Some(form.uv(kind, p, n))
    }
}

/// Tangents at points: [`CustomSurface::tangent`].
struct CustomTangent<'a>(&'a SurfaceTable);

impl Device for CustomTangent<'_> {
    const NAME: &'static str = "custom_tangent";
    type Arguments<F: Float> = (F::Uint, Vec3<F>, F::Mask);
    type Output<F: Float> = Vec3<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (row, p, lanes): Self::Arguments<F>) -> Vec3<F> {
        CustomHits::new(&self.0.rows, lanes, row, p).tangents()
    }

    fn recorded<F: Float>(&self, (row, p, _): Self::Arguments<F>) -> Option<Vec3<F>> {
        let (kind, form) = self.0.custom::<F>(row);
        Some(form.tangent(kind, p))
    }
}
