//! The light-emitting cylinder.

use super::area::{self, AreaLight};
use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Frame, Mask, Rgb, Vec3, trig};
use crate::shape::{Cylinder, POSITION_ERROR, Shape};
use std::f32::consts::PI;

/// A cylinder that emits outwards is sampled, from a point outside, by the directions in which it is visible. One that
/// emits inwards is sampled uniformly by area, because any part of it may be visible through an end.
impl Light for AreaLight<Cylinder> {
    const HAS_OWN_PDF: bool = true;

    fn row(&self) -> LightRow {
        let (cylinder, surface) = (&self.shape, self.shape.surface());
        // A point on the light is computed from the end and the axis, however large they are.
        let from = cylinder.from();
        let extent = from.iter().fold(2.0 * cylinder.half + cylinder.radius, |m, x| m.max(x.abs()));
        LightRow {
            origin: from,
            edge_v: cylinder.axis.map(|x| x * 2.0 * cylinder.half),
            normal: cylinder.axis,
            radius: cylinder.radius,
            area: surface.area,
            error: surface.error + extent * POSITION_ERROR,
            inward: self.flipped,
            emission: self.emission,
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        use std::f64::consts::PI;
        let (cylinder, bounds) = (&self.shape, self.shape.bounds());
        let [r, half] = [cylinder.radius, cylinder.half].map(f64::from);
        Some(LightBounds {
            lo: bounds.low,
            hi: bounds.high,
            mean: cylinder.middle.map(f64::from),
            spread: r * r + half * half / 3.0,
            power: PI * f64::from(cylinder.area()) * grey(self.emission),
            ..LightBounds::default()
        })
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let end = lights.origin;
        let (axis, along) = (lights.normal(), lights.edge_v());
        let radius = lights.radius();
        let inward = lights.inward();
        let seen = visible_cylinder(lights, end - p);
        let towards = seen.sample(u);
        let outer = end + axis * towards.height + towards.normal * radius;
        let (on_light, normal, wi, pdf, illuminates) = F::branch(
            inward,
            (outer, towards.normal, towards.wi, towards.pdf, seen.outside),
            #[inline(always)]
            || {
                let (sin, cos) = trig::sin_cos_turns(u[0]);
                let outwards = Frame::around(axis).to_world(Vec3::new(cos, sin, F::zero()));
                let at = end + along * u[1] + outwards * radius;
                let to_light = at - p;
                let distance2 = to_light.dot(to_light);
                let back = to_light * (F::splat(1.0) / distance2.sqrt());
                let cos = back.dot(outwards);
                (at, -outwards, back, distance2 / (cos * lights.area()), cos.gt(F::zero()))
            },
        );
        let off = on_light.max_abs().max(p.max_abs()) * POSITION_ERROR + lights.error();
        LightSample {
            wi,
            target: on_light + normal * off,
            radiance: emission.only(illuminates),
            pdf: pdf.only(illuminates),
            delta: F::Mask::splat(false),
            infinite: F::Mask::splat(false),
        }
    }

    #[inline(always)]
    fn pdf<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        _on: Vec3<F>,
        t: F,
        cos_light: F,
        by_area: F,
    ) -> F {
        let seen = visible_cylinder(lights, lights.origin - p);
        F::select(seen.outside & !lights.inward(), seen.pdf(t, cos_light), by_area)
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let (sin, cos) = trig::sin_cos_turns(a);
        let outwards = Frame::around(lights.normal()).to_world(Vec3::new(cos, sin, F::zero()));
        let point = lights.origin + lights.edge_v() * b + outwards * lights.radius();
        let n = Vec3::select(lights.inward(), -outwards, outwards);
        area::emit(lights, emission, point, n, [c, d])
    }
}

/// A cylinder as seen from a point, with one end of its axis at `to_end` relative to the point.
#[inline(always)]
fn visible_cylinder<F: Float>(lights: &LaneLights<'_, F>, to_end: Vec3<F>) -> VisibleCylinder<F> {
    let (axis, along) = (lights.normal(), lights.edge_v());
    VisibleCylinder::new(to_end, axis, along.dot(axis), lights.radius())
}

/// A cylinder seen from a point outside it.
///
/// A direction is given by its angle α about the axis and the sine of its elevation β along the axis; dα·d(sin β) is
/// the solid angle. The cylinder covers an arc in α. For each α it is visible along a line from end to end, whose
/// distance from the point gives the range of sin β. Both are sampled uniformly. The result is nearly uniform by solid
/// angle, and no point on the hidden side is sampled.
struct VisibleCylinder<F: Float> {
    /// The direction to the axis, perpendicular to it and of length one.
    towards: Vec3<F>,
    axis: Vec3<F>,
    /// The distance to the axis.
    distance: F,
    radius: F,
    /// Half of the arc, in turns.
    half_arc: F,
    /// The positions of the ends along the axis.
    ends: [F; 2],
    /// Whether the point is outside; otherwise the other fields are unspecified.
    outside: F::Mask,
}

/// The range of β, the elevation of a direction along the axis, for one line of a cylinder from end to end.
struct ElevationRange<F> {
    /// 1 − sin β at both ends.
    less: [F; 2],
    /// 1 + sin β at both ends: the smaller of the two is computed without cancellation.
    more: [F; 2],
    /// The difference of the sines.
    sines: F,
}

impl<F: Float> ElevationRange<F> {
    /// The range for a line at a distance `across` from the axis, between two heights.
    #[inline(always)]
    fn new(across: F, [low, high]: [F; 2]) -> Self {
        let (length_low, length_high) = (length(low, across), length(high, across));
        let (less_low, more_low) = around_one(low, length_low, across);
        let (less_high, more_high) = around_one(high, length_high, across);
        let (sin_low, sin_high) = (low / length_low, high / length_high);
        // The difference of sines of one sign would cancel; that of their squares, divided by their sum, does not.
        let one_side = low.gt(F::zero()) | high.lt(F::zero());
        let cosines = (across / length_low) * (across / length_high);
        let of_squares = cosines * ((high - low) / length_low) * ((low + high) / length_high);
        ElevationRange {
            less: [less_low, less_high],
            more: [more_low, more_high],
            sines: F::select(one_side, of_squares / (sin_low + sin_high), sin_high - sin_low),
        }
    }
}

#[inline(always)]
fn length<F: Float>(a: F, b: F) -> F {
    (a * a + b * b).sqrt()
}

/// 1 − sin β and 1 + sin β, for sin β = height/length.
#[inline(always)]
fn around_one<F: Float>(height: F, length: F, across: F) -> (F, F) {
    let sum = length + height.abs();
    let (small, large) = ((across / length) * (across / sum), sum / length);
    let rises = height.gt(F::zero());
    (F::select(rises, small, large), F::select(rises, large, small))
}

/// A direction to a cylinder.
struct CylinderDirection<F> {
    /// Of length one.
    wi: Vec3<F>,
    /// The outward normal at the point in this direction.
    normal: Vec3<F>,
    /// The distance of that point from the lower end, along the axis.
    height: F,
    /// The density by solid angle.
    pdf: F,
}

impl<F: Float> VisibleCylinder<F> {
    /// The cylinder with one end of its axis at `from` relative to the point. `axis` has length one.
    #[inline(always)]
    fn new(from: Vec3<F>, axis: Vec3<F>, length: F, radius: F) -> Self {
        let low = from.dot(axis);
        let across = from - axis * low;
        let distance = across.length();
        let beyond = ((distance - radius) * (distance + radius)).max(F::zero()).sqrt();
        VisibleCylinder {
            towards: across * (F::splat(1.0) / distance),
            axis,
            distance,
            radius,
            half_arc: trig::angle_turns(radius, beyond),
            ends: [low, low + length],
            outside: distance.gt(radius),
        }
    }

    #[inline(always)]
    fn pdf_along(&self, range: &ElevationRange<F>) -> F {
        F::splat(1.0 / (4.0 * PI)) / (self.half_arc * range.sines)
    }

    /// A direction, sampled with `u` in [0, 1)².
    #[inline(always)]
    fn sample(&self, [u, v]: [F; 2]) -> CylinderDirection<F> {
        let turn = u * 2.0 - 1.0;
        let (sin, cos) = trig::sin_cos_turns(turn.abs() * self.half_arc);
        let sin = sin.copysign(turn);
        let aside = self.distance * sin;
        let half_chord = (self.radius * self.radius - aside * aside).max(F::zero()).sqrt();
        let across = (self.distance * cos - half_chord).max(self.distance - self.radius);
        let range = ElevationRange::new(across, self.ends);
        let rest = -v + 1.0;
        let (less, more) =
            (range.less[0] * rest + range.less[1] * v, range.more[0] * rest + range.more[1] * v);
        let (sin_b, cos_b) = ((more - less) * 0.5, (less * more).sqrt());
        let height = (across * sin_b / cos_b).min(self.ends[1]).max(self.ends[0]) - self.ends[0];
        let sideways = self.axis.cross(self.towards);
        let normal = self.towards * (across * cos - self.distance) + sideways * (across * sin);
        CylinderDirection {
            wi: (self.towards * cos + sideways * sin) * cos_b + self.axis * sin_b,
            normal: normal.normalized(),
            height,
            pdf: self.pdf_along(&range),
        }
    }

    /// The density of the direction of a point that was hit at distance `t`, with the cosine `cos` there.
    ///
    /// Projected along the axis, the point, the axis and the hit form a triangle with the known sides D and r. t·cos is
    /// the component of the third side, ρ, along the normal: D² = r² + ρ² + 2r·t·cos.
    #[inline(always)]
    fn pdf(&self, t: F, cos: F) -> F {
        let near = self.distance - self.radius;
        let far2 = near * (self.distance + self.radius);
        let across2 = far2 - self.radius * 2.0 * (t * cos);
        let across = across2.max(near * near).min(far2).sqrt();
        self.pdf_along(&ElevationRange::new(across, self.ends))
    }
}
