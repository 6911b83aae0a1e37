//! The infinite plane.

use super::{Bounds, NOTHING, POSITION_ERROR, Piece, Shape, ShapeParameters, Surface, SurfaceKind};
use crate::math::{Float, Frame, Ray, Vec3, narrow};
use crate::parameter::limits::{COORDINATE, EDGE};
use crate::parameter::{ParameterKind, Problem, parameters, unit};
use glam::DVec3;

parameters! {
    /// All X with X·normal = distance, where the normal is of length one; outward is the normal.
    pub struct PlaneParameters: "plane", "a plane" {
        /// The normal of the plane, of any length; it is normalised.
        normal: DVec3 = EDGE,
        /// Signed distance of the plane from the origin along its normal, whatever the length of the normal: X·n =
        /// distance, where n is the unit normal.
        distance: f64 = ParameterKind::Number(COORDINATE),
    }
    check = with_unit_normal;
}

/// The tolerance for the length of a normal that counts as one: its components may have been rounded to three digits.
const UNIT_LENGTH: f64 = 1e-3;

fn with_unit_normal(plane: PlaneParameters, warnings: &mut Vec<Problem>) -> Result<PlaneParameters, Problem> {
    let PlaneParameters { normal, distance } = plane;
    let length = normal.length();
    // An unknown distance is NaN, which differs from zero.
    if distance.abs() > 0.0 && (length - 1.0).abs() > UNIT_LENGTH {
        let length = shown(length);
        warnings.push(Problem {
            parameter: "distance",
            message: format!(
                "the normal's length is {length}, but distance is measured along the unit normal"
            ),
            help: Some(format!("to mean X·normal = distance with this normal, divide both by {length}")),
        });
    }
    // Components that would be rounded to 0 in 32 bits are 0 in a scene.
    let single = |x: f64| if x as f32 == 0.0 { 0.0_f64.copysign(x) } else { x };
    Ok(PlaneParameters { normal: unit(normal).map(single), distance })
}

/// A length with about four digits, for messages.
fn shown(length: f64) -> String {
    match (1e-2..1e6).contains(&length) {
        true => format!("{length:.4}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => format!("{length:.3e}"),
    }
}

/// All X with X·normal = distance (report §2.3.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The normal, of length one.
    pub normal: [f32; 3],
    /// Signed distance from the origin along the normal.
    pub distance: f32,
}

/// The distance along a ray to the plane X·n = distance, or [`NOTHING`]. For a parallel ray the division gives an
/// infinity or NaN, which the comparison rejects.
#[inline(always)]
pub(super) fn distance_to_plane<F: Float>(ray: &Ray<F>, n: Vec3<F>, distance: F) -> F {
    let t = (-ray.o.dot(n) + distance) / ray.d.dot(n);
    F::select(t.gt(F::zero()), t, F::splat(NOTHING))
}

impl ShapeParameters for PlaneParameters {
    fn pieces(&self) -> Vec<Piece> {
        let plane = Plane { normal: narrow(self.normal.to_array()), distance: self.distance as f32 };
        vec![Piece::Plane(plane)]
    }
}

impl Shape for Plane {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        distance_to_plane(ray, Vec3::splat(self.normal), F::splat(self.distance))
    }

    fn bounds(&self) -> Bounds {
        Bounds::EVERYTHING
    }

    fn surface(&self) -> Surface {
        // uv are lengths along the frame's axes, from the plane's point nearest to the origin.
        let frame = Frame::<f32>::around(Vec3::splat(self.normal));
        Surface {
            kind: SurfaceKind::Flat,
            centre: [0.0; 3],
            radius: 0.0,
            anchor: [0.0; 3],
            to_centre: [0.0; 3],
            anchor_power: 0.0,
            normal: self.normal,
            distance: self.distance,
            error: POSITION_ERROR * self.distance.abs(),
            u_axis: [frame.s.x, frame.s.y, frame.s.z, 0.0],
            v_axis: [frame.t.x, frame.t.y, frame.t.z, 0.0],
            area: f32::INFINITY,
        }
    }
}
