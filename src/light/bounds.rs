//! Bounds of lights and of groups of lights: their position, power and directions of emission.

use std::f64::consts::PI;

/// Bounds of one or more lights (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with
/// Adaptive Tree Splitting", §4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// The lower corner of their bounding box.
    pub lo: [f32; 3],
    /// The upper corner.
    pub hi: [f32; 3],
    /// The mean position of their points, weighted by power.
    pub mean: [f64; 3],
    /// The mean squared distance from there, weighted by power.
    pub spread: f64,
    /// Power in W, averaged over the channels. In double precision, because the sizes and radiances of scenes have no
    /// common scale.
    pub power: f64,
    /// The number of their mesh, if all are triangles of the same one.
    pub mesh: Option<u32>,
    /// The axis of the cone of their normals, of length one.
    pub axis: [f32; 3],
    /// The cosine of the cone's half angle θₒ, which contains all normals.
    pub cos_o: f32,
    /// The cosine of θₑ, the largest angle between a normal and a direction of emission.
    pub cos_e: f32,
}

/// Bounds without power or extent, with emission in all directions.
impl Default for LightBounds {
    fn default() -> LightBounds {
        LightBounds {
            lo: [0.0; 3],
            hi: [0.0; 3],
            mean: [0.0; 3],
            spread: 0.0,
            power: 0.0,
            mesh: None,
            axis: [0.0, 0.0, 1.0],
            cos_o: -1.0,
            cos_e: 0.0,
        }
    }
}

/// The mean of the channels.
pub(super) fn grey(c: [f32; 3]) -> f64 {
    c.into_iter().map(f64::from).sum::<f64>() / 3.0
}

/// The squared distance between two points.
pub(super) fn distance2(a: [f64; 3], b: [f64; 3]) -> f64 {
    [0, 1, 2].map(|c| (a[c] - b[c]) * (a[c] - b[c])).iter().sum()
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl LightBounds {
    /// The radius of a ball around the mean that contains all of them.
    pub fn radius(&self) -> f64 {
        let reach = [0, 1, 2].map(|c| {
            let (lo, hi) = (f64::from(self.lo[c]), f64::from(self.hi[c]));
            (hi - self.mean[c]).max(self.mean[c] - lo)
        });
        distance2(reach, [0.0; 3]).sqrt()
    }

    /// The bounds of both.
    pub fn union(&self, other: &LightBounds) -> LightBounds {
        let (axis, cos_o) = cone_union((self.axis, self.cos_o), (other.axis, other.cos_o));
        let power = self.power + other.power;
        // Two groups without power have equal weights.
        let share = if power > 0.0 { other.power / power } else { 0.5 };
        let between = distance2(self.mean, other.mean);
        LightBounds {
            lo: [0, 1, 2].map(|c| self.lo[c].min(other.lo[c])),
            hi: [0, 1, 2].map(|c| self.hi[c].max(other.hi[c])),
            mean: [0, 1, 2].map(|c| self.mean[c] + share * (other.mean[c] - self.mean[c])),
            spread: (1.0 - share) * self.spread + share * other.spread + share * (1.0 - share) * between,
            power,
            mesh: self.mesh.filter(|_| self.mesh == other.mesh),
            axis,
            cos_o,
            cos_e: self.cos_e.min(other.cos_e),
        }
    }

    /// The cost of one side of a split: power times spread, so that lights that are near each other stay together,
    /// times the solid angle of emission (ibid., §4.4, which uses the area of the box instead of the spread).
    pub fn cost(&self) -> f64 {
        let (cos_o, cos_e) = (f64::from(self.cos_o), f64::from(self.cos_e));
        let theta_o = libm::acos(cos_o.clamp(-1.0, 1.0));
        let theta_w = (theta_o + libm::acos(cos_e)).min(PI);
        let sin_o = libm::sin(theta_o);
        let lit = 2.0 * PI * (1.0 - cos_o)
            + PI / 2.0
                * (2.0 * theta_w * sin_o - libm::cos(theta_o - 2.0 * theta_w) - 2.0 * theta_o * sin_o
                    + cos_o);
        self.power * self.spread * lit
    }
}

type DirectionCone = ([f32; 3], f32);

/// A cone that contains two cones (axis, cosine of the half angle).
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
    use crate::light::{AreaLight, Light, PointLight, flat};
    use crate::shape::{Cylinder, Disk, Sphere};
    use std::f64::consts::PI;

    fn point(position: [f32; 3], intensity: [f32; 3]) -> LightBounds {
        PointLight { position, intensity }.bounds().unwrap()
    }

    fn of<S>(shape: S) -> LightBounds
    where
        AreaLight<S>: Light,
    {
        AreaLight { shape, flipped: false, emission: [1.0; 3] }.bounds().unwrap()
    }

    #[test]
    fn a_cone_around_two_cones_contains_their_axes() {
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
    fn bounds_of_a_group_contain_its_members() {
        let sphere = Sphere::new(glam::DVec3::new(1.0, 2.0, 3.0), 0.5);
        let a = of(sphere);
        let b = point([5.0, 0.0, 0.0], [2.0; 3]);
        let both = a.union(&b);
        assert_eq!((both.lo, both.hi), ([0.5, 0.0, 0.0], [5.0, 2.5, 3.5]));
        assert_eq!(both.power, a.power + b.power);
    }

    /// A group's moments are those of its lights' points, in whatever order the lights were combined.
    #[test]
    fn moments_of_a_group_match_its_points() {
        let points: Vec<([f32; 3], f32)> =
            (0..7_u8).map(f32::from).map(|i| ([i * i, 3.0 - i, (i - 2.0) * (i - 5.0)], 1.0 + i)).collect();
        let lights: Vec<_> = points.iter().map(|&(at, power)| point(at, [power; 3])).collect();
        let forwards = lights.iter().copied().reduce(|a, b| a.union(&b)).unwrap();
        let backwards = lights.iter().rev().copied().reduce(|a, b| a.union(&b)).unwrap();
        let total: f64 = points.iter().map(|&(_, power)| f64::from(power)).sum();
        let mean = [0, 1, 2].map(|c| {
            points.iter().map(|&(at, power)| f64::from(power) * f64::from(at[c])).sum::<f64>() / total
        });
        let spread = points
            .iter()
            .map(|&(at, power)| f64::from(power) * distance2(at.map(f64::from), mean))
            .sum::<f64>()
            / total;
        for group in [forwards, backwards] {
            assert!(distance2(group.mean, mean) < 1e-20, "{:?}", group.mean);
            assert!((group.spread - spread).abs() < 1e-9 * spread, "{} is not {spread}", group.spread);
            assert!(lights.iter().all(|l| distance2(l.mean, mean).sqrt() <= group.radius() * (1.0 + 1e-12)));
        }
    }

    /// The moments of surfaces, compared with means over a grid of points on them.
    #[test]
    fn moments_of_surfaces_match_their_points() {
        let [a, b, c] = [[1.0, 0.0, 2.0], [4.0, 1.0, 2.0], [0.0, 3.0, -1.0]];
        let d = [0, 1, 2].map(|i| b[i] + c[i] - a[i]);
        let triangle = flat::bounds(&[a, b, c], [0.0, 0.0, 1.0], 1.0, [1.0; 3]);
        let quad = flat::bounds(&[a, b, c, d], [0.0, 0.0, 1.0], 1.0, [1.0; 3]);
        let steps = 400;
        let grid = (0..steps).flat_map(|i| (0..steps).map(move |j| [i, j]));
        let unit: Vec<[f64; 2]> =
            grid.map(|at| at.map(|i| (f64::from(i) + 0.5) / f64::from(steps))).collect();
        let on = |[u, v]: [f64; 2]| {
            [0, 1, 2].map(|i| {
                let [a, b, c] = [a[i], b[i], c[i]].map(f64::from);
                a + u * (b - a) + v * (c - a)
            })
        };
        let spread = |points: &[[f64; 2]], mean: [f64; 3]| {
            points.iter().map(|&at| distance2(on(at), mean)).sum::<f64>() / points.len() as f64
        };
        let disk = Disk::new(glam::DVec3::new(1.0, 2.0, 3.0), glam::DVec3::new(0.6, 0.0, 0.8), 2.0);
        let tube = Cylinder::new(glam::DVec3::new(1.0, 2.0, 3.0), glam::DVec3::new(1.0, 5.0, 7.0), 2.0);
        let disk_bounds = of(disk);
        let tube_bounds = of(tube);
        let frame = crate::math::Frame::<f32>::around(crate::math::Vec3::splat(tube.axis));
        let turned = |[u, v]: [f64; 2]| {
            let (angle, r) = (2.0 * PI * u, 2.0 * libm::sqrt(v));
            let (x, y) = (libm::cos(angle), libm::sin(angle));
            let [a, b] = disk.radii();
            let flat = [0, 1, 2].map(|i| {
                let [a, b] = [a[i], b[i]].map(|x| f64::from(x) / 2.0);
                f64::from(disk.centre[i]) + r * (x * a + y * b)
            });
            let [s, t] = [frame.s, frame.t].map(|v| [v.x, v.y, v.z].map(f64::from));
            let round = [0, 1, 2].map(|i| {
                let along = (2.0 * v - 1.0) * f64::from(tube.half) * f64::from(tube.axis[i]);
                f64::from(tube.middle[i]) + along + 2.0 * (x * s[i] + y * t[i])
            });
            [flat, round]
        };
        for (which, group) in [disk_bounds, tube_bounds].into_iter().enumerate() {
            let points = unit.iter().map(|&at| turned(at)[which]);
            let (mut expected, mut farthest) = (0.0, 0.0_f64);
            for p in points {
                expected += distance2(p, group.mean) / unit.len() as f64;
                farthest = farthest.max(distance2(p, group.mean));
                for ((p, lo), hi) in p.into_iter().zip(group.lo).zip(group.hi) {
                    assert!((f64::from(lo)..=f64::from(hi)).contains(&p), "{p} is not in {lo} to {hi}");
                }
            }
            assert!((group.spread - expected).abs() < 0.01 * expected, "{} is not {expected}", group.spread);
            assert!(group.radius() * group.radius() >= farthest);
        }
        let half: Vec<_> = unit.iter().copied().filter(|[u, v]| u + v < 1.0).collect();
        for (group, expected) in [(triangle, spread(&half, triangle.mean)), (quad, spread(&unit, quad.mean))]
        {
            assert!((group.spread - expected).abs() < 0.01 * expected, "{} is not {expected}", group.spread);
        }
    }
}
