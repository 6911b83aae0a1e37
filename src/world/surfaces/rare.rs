//! Hits on rare shapes, lane by lane: their numbers are those of [`RareForm`].

use super::SurfaceTable;
use crate::math::lanes::Device;
use crate::math::{Float, LaneFloat, Vec3};
use crate::shape::RareForm;
use crate::world::rare::Rares;

impl SurfaceTable {
    /// The kinds and the forms of rows of rare shapes.
    #[inline(always)]
    pub(super) fn rare<F: Float>(&self, row: F::Uint) -> (F::Uint, RareForm<F>) {
        let form = RareForm {
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

    /// Normals at points, and how far the points lie off the surfaces, in some lanes.
    #[inline(always)]
    pub(super) fn rare_point<F: Float>(&self, row: F::Uint, p: Vec3<F>, lanes: F::Mask) -> (Vec3<F>, F) {
        F::device(&RarePoint(self), (row, p, lanes))
    }

    /// uv of points where the shapes' outward normals are `n`.
    #[inline(always)]
    pub(super) fn rare_uv<F: Float>(&self, row: F::Uint, p: Vec3<F>, n: Vec3<F>, lanes: F::Mask) -> [F; 2] {
        F::device(&RareUv(self), (row, p, n, lanes))
    }

    /// Directions at points in which u grows.
    #[inline(always)]
    pub(super) fn rare_tangent<F: Float>(&self, row: F::Uint, p: Vec3<F>, lanes: F::Mask) -> Vec3<F> {
        F::device(&RareTangent(self), (row, p, lanes))
    }
}

/// Normals at points of rare shapes, and how far the points lie off them: [`RareForm::point`], lane by lane.
struct RarePoint<'a>(&'a SurfaceTable);

impl Device for RarePoint<'_> {
    const NAME: &'static str = "rare_point";
    type Arguments<F: Float> = (F::Uint, Vec3<F>, F::Mask);
    type Output<F: Float> = (Vec3<F>, F);

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (row, p, lanes): Self::Arguments<F>) -> (Vec3<F>, F) {
        Rares::new(&self.0.rows, lanes, row, p).points()
    }

    fn recorded<F: Float>(&self, (row, p, _): Self::Arguments<F>) -> Option<(Vec3<F>, F)> {
        let (kind, form) = self.0.rare::<F>(row);
        Some(form.point(kind, p))
    }
}

/// Their uv: [`RareForm::uv`].
struct RareUv<'a>(&'a SurfaceTable);

impl Device for RareUv<'_> {
    const NAME: &'static str = "rare_uv";
    type Arguments<F: Float> = (F::Uint, Vec3<F>, Vec3<F>, F::Mask);
    type Output<F: Float> = [F; 2];

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (row, p, n, lanes): Self::Arguments<F>) -> [F; 2] {
        Rares::new(&self.0.rows, lanes, row, p).uv(n)
    }

    fn recorded<F: Float>(&self, (row, p, n, _): Self::Arguments<F>) -> Option<[F; 2]> {
        let (kind, form) = self.0.rare::<F>(row);
        Some(form.uv(kind, p, n))
    }
}

/// Their tangents: [`RareForm::tangent`].
struct RareTangent<'a>(&'a SurfaceTable);

impl Device for RareTangent<'_> {
    const NAME: &'static str = "rare_tangent";
    type Arguments<F: Float> = (F::Uint, Vec3<F>, F::Mask);
    type Output<F: Float> = Vec3<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (row, p, lanes): Self::Arguments<F>) -> Vec3<F> {
        Rares::new(&self.0.rows, lanes, row, p).tangents()
    }

    fn recorded<F: Float>(&self, (row, p, _): Self::Arguments<F>) -> Option<Vec3<F>> {
        let (kind, form) = self.0.rare::<F>(row);
        Some(form.tangent(kind, p))
    }
}
