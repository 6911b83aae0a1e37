//! Sampling of rectangles by solid angle.

use crate::math::{Float, Vec3, trig, value};
use std::f32::consts::{PI, TAU};

/// A rectangle seen from a point, in the frame of its sides with the point at the origin (Ureña, Fajardo and King 2013,
/// "An Area-Preserving Parametrization for Spherical Rectangles").
///
/// The article takes arc cosines of the four inner angles and subtracts 2π. Here each angle's excess over a right angle
/// is an arc sine, which preserves the digits of small rectangles.
#[derive(Clone, Copy)]
pub(super) struct Rectangle<F: Float> {
    /// The rectangle from x₀ to x₁ and from y₀ to y₁, at z₀ < 0.
    x: [F; 2],
    y: [F; 2],
    z: F,
    /// The z components of the unit normals of the planes through the point and the sides at y₀ and y₁.
    b: [F; 2],
    /// The sum of the two inner angles at the side x₀, minus two right angles.
    excess: F,
    /// Its solid angle in steradians.
    pub(super) solid_angle: F,
}

value!(Rectangle { x, y, z, b, excess, solid_angle });

impl<F: Float> Rectangle<F> {
    /// The rectangle with its corner at `corner` relative to the point and the perpendicular sides `u` and `v`.
    #[inline(always)]
    pub(super) fn new(corner: Vec3<F>, u: Vec3<F>, v: Vec3<F>) -> Self {
        let (width, height) = (u.length(), v.length());
        let (x_axis, y_axis) = (u * (F::splat(1.0) / width), v * (F::splat(1.0) / height));
        let (x0, y0) = (corner.dot(x_axis), corner.dot(y_axis));
        let (x1, y1) = (x0 + width, y0 + height);
        let z = -corner.dot(x_axis.cross(y_axis)).abs();
        let normal = |side: F| side / (side * side + z * z).sqrt();
        let (n0, n1, n2, n3) = (-normal(y0), normal(x1), normal(y1), -normal(x0));
        // 1 − (ab)² without cancellation, from 1 − n² of each side, which is z²/(side² + z²).
        let rest = |side: F| z * z / (side * side + z * z);
        let (r0, r1, r2, r3) = (rest(y0), rest(x1), rest(y1), rest(x0));
        let left = excess(n2, r2, n3, r3) + excess(n3, r3, n0, r0);
        let right = excess(n0, r0, n1, r1) + excess(n1, r1, n2, r2);
        Rectangle { x: [x0, x1], y: [y0, y1], z, b: [n0, n2], excess: left, solid_angle: left + right }
    }

    /// A point of it, as coordinates along both sides, whose direction is uniform over the solid angle.
    #[inline(always)]
    pub(super) fn sample(&self, [u, v]: [F; 2]) -> [F; 2] {
        let Rectangle { x: [x0, x1], y: [y0, y1], z, b: [b0, b1], .. } = *self;
        // The x that cuts off a rectangle of u times the solid angle: ibid., §3.2, with the angle there, π − φ.
        let phi = self.excess - u * self.solid_angle;
        let turns = phi.abs() * (1.0 / TAU);
        let (sin, cos) = trig::sin_cos_turns(turns);
        let sin = sin.copysign(phi);
        let n = b0 * cos + b1;
        // cos² of the angle between the z axis and the plane through the point and the cut, scaled.
        let scaled = (n * n - sin * sin * (z * z / (y0 * y0 + z * z))).max(F::zero()).sqrt();
        let x = z * sin * F::splat(1.0).copysign(n) / scaled.max(F::splat(f32::MIN_POSITIVE));
        let x = x.max(x0).min(x1);
        // The y on that line: its sine as seen from the point is uniform.
        let d2 = x * x + z * z;
        let (h0, h1) = (y0 / (d2 + y0 * y0).sqrt(), y1 / (d2 + y1 * y1).sqrt());
        let h = h0 + v * (h1 - h0);
        let y = h * d2.sqrt() / (-h * h + 1.0).max(F::splat(f32::MIN_POSITIVE)).sqrt();
        let y = y.max(y0).min(y1);
        [(x - x0) / (x1 - x0), (y - y0) / (y1 - y0)]
    }
}

/// The arc sine of a·b, in radians, given 1 − a² and 1 − b².
#[inline(always)]
fn excess<F: Float>(a: F, a_rest: F, b: F, b_rest: F) -> F {
    let sin = a * b;
    let cos = (a_rest + a * a * b_rest).sqrt();
    (trig::angle_turns(sin.abs(), cos) * (2.0 * PI)).copysign(sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use rand::RngExt;

    /// The solid angle in double precision: a sum over the corners of arc tangents.
    fn solid_angle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> f64 {
        let corner = |x: f64, y: f64| (x * y / (z * (x * x + y * y + z * z).sqrt())).atan();
        corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
    }

    fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> Rectangle<f32> {
        let narrow = |v: [f64; 3]| Vec3::splat(v.map(|c| c as f32));
        Rectangle::new(narrow([x0, y0, z]), narrow([x1 - x0, 0.0, 0.0]), narrow([0.0, y1 - y0, 0.0]))
    }

    #[test]
    fn solid_angles_agree_with_double_precision() {
        let stream = &mut Stream::new(8, 0, 0);
        let mut large = 0;
        for _ in 0..100_000 {
            let mut any = |reach: f32| f64::from(stream.random_range(-reach..reach));
            let (x0, y0, z) = (any(5.0), any(5.0), any(2.0));
            let (x1, y1) = (x0 + any(4.0).abs() + 0.1, y0 + any(4.0).abs() + 0.1);
            // The reference uses the numbers as rounded to single precision.
            let [x0, x1, y0, y1, z] =
                [x0, x1, y0, y1, z].map(|x| f64::from((x * 1024.0).round() as f32 / 1024.0));
            if z == 0.0 {
                continue;
            }
            let expected = solid_angle([x0, x1], [y0, y1], z.abs());
            let got = f64::from(rectangle([x0, x1], [y0, y1], z).solid_angle);
            // Four angles, each within 2⁻²² of a turn.
            assert!((got - expected).abs() < 6e-6, "{got} is not {expected}");
            large += u32::from(expected > 0.01);
        }
        assert!(large > 50_000, "only {large} are large enough to count");
    }

    #[test]
    fn equal_intervals_of_the_numbers_have_equal_solid_angles() {
        // The parts cut off by u, and within that strip by v, have the expected solid angles.
        for (x, y, z) in [
            ([-1.0, 1.0], [-1.0, 1.0], -1.0),
            ([-0.5, 2.0], [1.0, 3.0], -0.25),
            ([2.0, 3.0], [-4.0, -3.0], 1.5),
            ([-3.0, 5.0], [-2.0, 0.5], -0.01),
        ] {
            let seen = rectangle(x, y, z);
            let whole = solid_angle(x, y, f64::abs(z));
            let along = |[from, to]: [f64; 2], share: f32| from + f64::from(share) * (to - from);
            for i in 0..=10 {
                let u = i as f32 / 10.0;
                let [a, _] = seen.sample([u, 0.3]);
                assert!((0.0..=1.0).contains(&a));
                let cut = solid_angle([x[0], along(x, a)], y, f64::abs(z)) / whole;
                assert!((cut - f64::from(u)).abs() < 2e-5, "{cut} of the angle is cut off by {u}");
            }
            for i in 0..=10 {
                let v = i as f32 / 10.0;
                let [a, b] = seen.sample([0.37, v]);
                let strip = |top: f64| {
                    let at = along(x, a);
                    let width = (x[1] - x[0]) * 1e-6;
                    solid_angle([at - width, at + width], [y[0], top], f64::abs(z))
                };
                let cut = strip(along(y, b)) / strip(y[1]);
                assert!((cut - f64::from(v)).abs() < 1e-3, "{cut} of the strip is cut off by {v}");
            }
        }
        // Negative control: the middle of a side is not the middle of an angle.
        let skewed = rectangle([0.0, 3.0], [-1.0, 1.0], -0.5);
        assert!((skewed.sample([0.5, 0.5])[0] - 0.5).abs() > 0.1);
    }
}
