//! What a light, or a group of lights, can do to a point at most: its place, its power, and where it shines.

use crate::math::Bounds;
use crate::shape::Sphere;
use std::f64::consts::PI;

/// Bounds of one or more lights (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with
/// Adaptive Tree Splitting", §4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Least corner of the box around them.
    pub lo: [f32; 3],
    /// Greatest corner.
    pub hi: [f32; 3],
    /// Power, up to a common factor: the mean of the channels. In double precision: a scene may be as large
    /// and as bright as it likes.
    pub power: f64,
    /// Axis of the cone of their normals, of length one.
    pub axis: [f32; 3],
    /// Cosine of the cone's half angle θₒ: every normal is within it.
    pub cos_o: f32,
    /// Cosine of θₑ: light leaves at most this far from a normal.
    pub cos_e: f32,
}

fn mean(c: [f32; 3]) -> f64 {
    c.into_iter().map(f64::from).sum::<f64>() / 3.0
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl LightBounds {
    /// Of a point light.
    pub fn point(position: [f32; 3], intensity: [f32; 3]) -> LightBounds {
        let power = 4.0 * PI * mean(intensity);
        LightBounds { lo: position, hi: position, power, axis: [0.0, 0.0, 1.0], cos_o: -1.0, cos_e: 0.0 }
    }

    /// Of a sphere, whichever side emits.
    pub fn sphere(sphere: &Sphere, emission: [f32; 3]) -> LightBounds {
        let r = sphere.radius;
        let power = 4.0 * PI * PI * f64::from(r) * f64::from(r) * mean(emission);
        LightBounds {
            lo: sphere.centre.map(|c| c - r),
            hi: sphere.centre.map(|c| c + r),
            power,
            axis: [0.0, 0.0, 1.0],
            cos_o: -1.0,
            cos_e: 0.0,
        }
    }

    /// Of something flat with these corners that emits where `normal` points.
    pub fn flat(corners: &[[f32; 3]], normal: [f32; 3], area: f32, emission: [f32; 3]) -> LightBounds {
        let bounds = Bounds::of(corners.iter().copied());
        LightBounds {
            lo: bounds.low,
            hi: bounds.high,
            power: PI * f64::from(area) * mean(emission),
            axis: normal,
            cos_o: 1.0,
            cos_e: 0.0,
        }
    }

    /// The middle of the box along an axis.
    pub fn centre(&self, axis: usize) -> f32 {
        0.5 * (self.lo[axis] + self.hi[axis])
    }

    /// Bounds of both.
    pub fn union(&self, other: &LightBounds) -> LightBounds {
        let (axis, cos_o) = cone_union((self.axis, self.cos_o), (other.axis, other.cos_o));
        LightBounds {
            lo: [0, 1, 2].map(|c| self.lo[c].min(other.lo[c])),
            hi: [0, 1, 2].map(|c| self.hi[c].max(other.hi[c])),
            power: self.power + other.power,
            axis,
            cos_o,
            cos_e: self.cos_e.min(other.cos_e),
        }
    }

    /// What a split's side costs: power times surface area times the solid angle lit (ibid., §4.4).
    pub fn cost(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|c| f64::from(self.hi[c]) - f64::from(self.lo[c]));
        let area = 2.0 * (x * y + y * z + z * x);
        let (cos_o, cos_e) = (f64::from(self.cos_o), f64::from(self.cos_e));
        let theta_o = libm::acos(cos_o.clamp(-1.0, 1.0));
        let theta_w = (theta_o + libm::acos(cos_e)).min(PI);
        let sin_o = libm::sin(theta_o);
        let lit = 2.0 * PI * (1.0 - cos_o)
            + PI / 2.0
                * (2.0 * theta_w * sin_o - libm::cos(theta_o - 2.0 * theta_w) - 2.0 * theta_o * sin_o
                    + cos_o);
        self.power * lit * area
    }
}

type DirectionCone = ([f32; 3], f32);

/// A cone around two cones (axis, cosine of the half angle).
fn cone_union(a: DirectionCone, b: DirectionCone) -> DirectionCone {
    let (wide, narrow) = if a.1 <= b.1 { (a, b) } else { (b, a) };
    let theta_a = libm::acosf(wide.1.clamp(-1.0, 1.0));
    let theta_b = libm::acosf(narrow.1.clamp(-1.0, 1.0));
    let between = libm::acosf(dot(wide.0, narrow.0).clamp(-1.0, 1.0));
    if (between + theta_b).min(std::f32::consts::PI) <= theta_a {
        return wide;
    }
    let theta = (theta_a + between + theta_b) / 2.0;
    let perpendicular = {
        let k = dot(wide.0, narrow.0);
        let v = [0, 1, 2].map(|c| narrow.0[c] - k * wide.0[c]);
        let length = dot(v, v).sqrt();
        (length > 1e-6).then(|| v.map(|x| x / length))
    };
    match perpendicular {
        Some(p) if theta < std::f32::consts::PI => {
            let turn = theta - theta_a;
            let (s, c) = (libm::sinf(turn), libm::cosf(turn));
            ([0, 1, 2].map(|i| c * wide.0[i] + s * p[i]), libm::cosf(theta))
        }
        _ => (wide.0, -1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_around_two_cones_holds_their_axes() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.6, 0.8], [-1.0, 0.0, 0.0], [0.6, 0.0, -0.8]];
        for a in axes {
            for b in axes {
                let (axis, cos) = cone_union((a, 1.0), (b, 0.9));
                assert!(dot(axis, a) >= cos - 1e-5 && dot(axis, b) >= cos - 1e-5, "{a:?} {b:?}");
                assert!((dot(axis, axis) - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn bounds_of_a_group_hold_its_members() {
        let sphere = Sphere::new(glam::DVec3::new(1.0, 2.0, 3.0), 0.5);
        let a = LightBounds::sphere(&sphere, [1.0; 3]);
        let b = LightBounds::point([5.0, 0.0, 0.0], [2.0; 3]);
        let both = a.union(&b);
        assert_eq!((both.lo, both.hi), ([0.5, 0.0, 0.0], [5.0, 2.5, 3.5]));
        assert_eq!(both.power, a.power + b.power);
    }
}
