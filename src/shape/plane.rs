//! The unbounded plane.

use super::{Bounds, Form, NOTHING, POSITION_ERROR, Piece, Shape, ShapeParameters, Surface};
use crate::math::{Float, Frame, Ray, Vec3, narrow};
use crate::parameter::limits::{COORDINATE, EDGE};
use crate::parameter::{ParameterKind, Problem, parameters, unit};
use glam::DVec3;

parameters! {
    /// All X with X·normal = distance, where the normal is of length one; outward is the normal.
    pub struct PlaneParameters: "plane", "a plane" {
        /// The direction the plane faces. Its length does not matter: it is made one.
        normal: DVec3 = EDGE,
        /// Signed distance of the plane from the origin along its normal, a length whatever the normal's: X·n = distance, where n is the normal over its length.
        distance: f64 = ParameterKind::Number(COORDINATE),
    }
    check = with_unit_normal;
}

/// A normal whose length is one but for this much is one whose components were rounded to three digits.
const UNIT_LENGTH: f64 = 1e-3;

fn with_unit_normal(plane: PlaneParameters, warnings: &mut Vec<Problem>) -> Result<PlaneParameters, Problem> {
    let PlaneParameters { normal, distance } = plane;
    let length = normal.length();
    // An unknown distance is NaN, and other than zero.
    if distance.abs() > 0.0 && (length - 1.0).abs() > UNIT_LENGTH {
        let length = shown(length);
        warnings.push(Problem {
            parameter: "distance",
            message: format!("the normal's length is {length}, and distance is a length all the same"),
            help: Some(format!(
                "if X·normal = distance is meant with the normal as it is, divide both by {length}"
            )),
        });
    }
    // Parts that 32 bits would round to 0 are 0 in a scene.
    let single = |x: f64| if x as f32 == 0.0 { 0.0_f64.copysign(x) } else { x };
    Ok(PlaneParameters { normal: unit(normal).map(single), distance })
}

/// A length in four digits or so, for messages.
fn shown(length: f64) -> String {
    match (1e-2..1e6).contains(&length) {
        true => format!("{length:.4}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => format!("{length:.3e}"),
    }
}

/// All X with X·normal = distance (report §2.3.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Of length one.
    pub normal: [f32; 3],
    /// Signed distance from the origin along the normal.
    pub distance: f32,
}

/// Distance along a ray to the plane X·n = distance, or [`NOTHING`]: the division is left to make an
/// infinity or NaN of a parallel ray, which the comparison then refuses.
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
        // uv are lengths along the frame's axes from the point nearest the origin, where both vanish.
        let frame = Frame::<f32>::around(Vec3::splat(self.normal));
        Surface {
            form: Form::Flat,
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
