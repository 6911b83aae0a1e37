//! Hits on custom shapes. They are completed lane by lane in separate functions, so that the paths of other scenes
//! contain no code for them.

use super::attributes::SurfaceAttributes;
use crate::math::lanes::scalar::Wrapping;
use crate::math::lanes::{Kernel, MAX_LANES};
use crate::math::{LaneFloat, LaneMask, LaneUint, Vec3};
use crate::shape::{CustomSurface, Surface, SurfaceKind};

/// The lanes that hit a custom shape, and the points.
pub(super) struct CustomHits<'a> {
    rows: &'a [(Surface, SurfaceAttributes)],
    /// Bit `i` is set if lane `i` is one of them.
    lanes: u32,
    /// Each lane's row.
    row: [u32; MAX_LANES],
    /// The points, one column for each coordinate.
    p: [[f32; MAX_LANES]; 3],
}

#[inline(always)]
fn columns<F: LaneFloat>(v: Vec3<F>) -> [[f32; MAX_LANES]; 3] {
    let mut columns = [[0.0; MAX_LANES]; 3];
    v.store(&mut columns);
    columns
}

impl<'a> CustomHits<'a> {
    #[inline(always)]
    pub(super) fn new<F: LaneFloat>(
        rows: &'a [(Surface, SurfaceAttributes)],
        lanes: F::Mask,
        row: F::Uint,
        p: Vec3<F>,
    ) -> CustomHits<'a> {
        let mut row_of = [0; MAX_LANES];
        row.store(&mut row_of);
        CustomHits { rows, lanes: lanes.bits(), row: row_of, p: columns(p) }
    }

    /// Calls `f` for each of the lanes with its shape's kind and form and its point.
    #[inline(always)]
    fn for_each(&self, mut f: impl FnMut(usize, Wrapping, CustomSurface<f32>, Vec3<f32>)) {
        let mut lanes = self.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & (MAX_LANES - 1);
            lanes &= lanes - 1;
            let [x, y, z] = &self.p;
            // Lanes without a hit have no row, but may be active with the last one's numbers.
            let Some((surface, _)) = self.rows.get(self.row[lane] as usize) else { continue };
            let SurfaceKind::Custom(kind) = surface.kind else { continue };
            let kind = Wrapping(kind.number());
            f(lane, kind, surface.custom_surface(), Vec3::new(x[lane], y[lane], z[lane]));
        }
    }

    /// See [`CustomSurface::point`].
    #[inline(always)]
    pub(super) fn points<F: LaneFloat>(self) -> (Vec3<F>, F) {
        let [x, y, z, off] = &F::with_octets(Points(self));
        (Vec3::new(F::load(x), F::load(y), F::load(z)), F::load(off))
    }

    /// See [`CustomSurface::tangent`].
    #[inline(always)]
    pub(super) fn tangents<F: LaneFloat>(self) -> Vec3<F> {
        let [x, y, z] = &F::with_octets(Tangents(self));
        Vec3::new(F::load(x), F::load(y), F::load(z))
    }

    /// See [`CustomSurface::uv`].
    #[inline(always)]
    pub(super) fn uv<F: LaneFloat>(self, n: Vec3<F>) -> [F; 2] {
        let [u, v] = &F::with_octets(Uvs { at: self, n: columns(n) });
        [F::load(u), F::load(v)]
    }
}

/// Normals and distances from the surfaces.
struct Points<'a>(CustomHits<'a>);

impl Kernel for Points<'_> {
    type Output = [[f32; MAX_LANES]; 4];

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Self::Output {
        let mut out = [[0.0; MAX_LANES]; 4];
        self.0.for_each(
            #[inline(always)]
            |lane, kind, form, p| {
                let (n, off) = form.point(kind, p);
                out[0][lane] = n.x;
                out[1][lane] = n.y;
                out[2][lane] = n.z;
                out[3][lane] = off;
            },
        );
        out
    }
}

/// Directions of ∂p/∂u.
struct Tangents<'a>(CustomHits<'a>);

impl Kernel for Tangents<'_> {
    type Output = [[f32; MAX_LANES]; 3];

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Self::Output {
        let mut out = [[0.0; MAX_LANES]; 3];
        self.0.for_each(
            #[inline(always)]
            |lane, kind, form, p| {
                let tangent = form.tangent(kind, p);
                out[0][lane] = tangent.x;
                out[1][lane] = tangent.y;
                out[2][lane] = tangent.z;
            },
        );
        out
    }
}

/// uv coordinates at points with known normals.
struct Uvs<'a> {
    at: CustomHits<'a>,
    n: [[f32; MAX_LANES]; 3],
}

impl Kernel for Uvs<'_> {
    type Output = [[f32; MAX_LANES]; 2];

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Self::Output {
        let mut out = [[0.0; MAX_LANES]; 2];
        let [x, y, z] = &self.n;
        self.at.for_each(
            #[inline(always)]
            |lane, kind, form, p| {
                let [u, v] = form.uv(kind, p, Vec3::new(x[lane], y[lane], z[lane]));
                out[0][lane] = u;
                out[1][lane] = v;
            },
        );
        out
    }
}
