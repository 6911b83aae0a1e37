//! Orthonormal frames around a normal.

use super::{Float, Vec3, function, value};

/// A right-handed orthonormal frame (s, t, n).
#[derive(Clone, Copy, Debug)]
pub struct Frame<F> {
    /// First tangent.
    pub s: Vec3<F>,
    /// Second tangent.
    pub t: Vec3<F>,
    /// Normal, the frame's +z.
    pub n: Vec3<F>,
}

value!(Frame { s, t, n });

impl<F: Float> Frame<F> {
    /// A frame around a unit normal, without a singularity (Duff et al. 2017, "Building an Orthonormal
    /// Basis, Revisited", listing 3). For n = (0, 0, 1), s is x and t is y.
    #[inline(always)]
    pub fn around(n: Vec3<F>) -> Self {
        function!(F, frame_around(n), {
            let sign = F::splat(1.0).copysign(n.z);
            let a = F::splat(-1.0) / (sign + n.z);
            let b = n.x * n.y * a;
            Frame {
                s: Vec3::new(sign * n.x * n.x * a + 1.0, sign * b, -sign * n.x),
                t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
                n,
            }
        })
    }
    /// The frame around a unit normal whose first tangent is nearest to a direction of any length; [`Frame::around`]
    /// the normal if the direction is parallel to it.
    #[inline(always)]
    pub fn along(n: Vec3<F>, direction: Vec3<F>) -> Self {
        function!(F, frame_along(n, direction), {
            let around = Frame::around(n);
            // Scaled first: squares of components may overflow.
            let unit = direction * (F::splat(1.0) / direction.max_abs().max(F::splat(f32::MIN_POSITIVE)));
            let across = unit - n * unit.dot(n);
            let length2 = across.dot(across);
            // A smaller tangent would consist of rounding errors.
            let has_one = length2.gt(F::splat(1e-8));
            let s = across * (F::splat(1.0) / F::select(has_one, length2, F::splat(1.0)).sqrt());
            let s = Vec3::select(has_one, s, around.s);
            Frame { s, t: n.cross(s), n }
        })
    }

    /// World coordinates of a vector in the frame's coordinates.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3<F>) -> Vec3<F> {
        let frame = *self;
        function!(F, to_world(frame, v), { frame.s * v.x + frame.t * v.y + frame.n * v.z })
    }
    /// The frame's coordinates of a vector in world coordinates.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3<F>) -> Vec3<F> {
        let frame = *self;
        function!(F, to_local(frame, v), { Vec3::new(v.dot(frame.s), v.dot(frame.t), v.dot(frame.n)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed_for_every_normal() {
        let mut normals = vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
        for i in 0..1000 {
            let (z, phi) = (1.0 - (2 * i + 1) as f32 / 1000.0, i as f32 * 2.4);
            let r = (1.0 - z * z).sqrt();
            normals.push([r * phi.cos(), r * phi.sin(), z]);
        }
        for n in normals {
            let f = Frame::<f32>::around(Vec3::splat(n));
            let close = |a: f32, b: f32| assert!((a - b).abs() < 2e-6, "{n:?}: {a} is not {b}");
            close(f.s.length(), 1.0);
            close(f.t.length(), 1.0);
            close(f.s.dot(f.t), 0.0);
            close(f.s.dot(f.n), 0.0);
            close(f.t.dot(f.n), 0.0);
            close(f.s.cross(f.t).dot(f.n), 1.0);
        }
    }

    #[test]
    fn frames_along_a_direction_are_nearest_to_it() {
        for i in 0..1000 {
            let of = |i: f32| {
                let z = 1.0 - 2.0 * (i * 0.618_034).fract();
                let r = (1.0 - z * z).sqrt();
                Vec3::splat([r * (i * 2.4).cos(), r * (i * 2.4).sin(), z])
            };
            let (n, direction) = (of(i as f32), of(i as f32 + 0.5));
            for scale in [1.0, 1e-20, 1e20] {
                let f = Frame::<f32>::along(n, direction * scale);
                let close = |a: f32, b: f32| assert!((a - b).abs() < 2e-6, "{i}: {a} is not {b}");
                close(f.s.length(), 1.0);
                close(f.t.length(), 1.0);
                close(f.s.dot(f.n), 0.0);
                close(f.s.cross(f.t).dot(f.n), 1.0);
                close(f.t.dot(direction), 0.0);
                assert!(f.s.dot(direction) > 0.0);
            }
            for none in [Vec3::zero(), n, -n * 3.0] {
                assert_eq!(Frame::along(n, none).s, Frame::around(n).s);
            }
        }
    }

    #[test]
    fn the_frame_of_plus_z_is_the_axes() {
        let f = Frame::<f32>::around(Vec3::splat([0.0, 0.0, 1.0]));
        assert_eq!(f.s, Vec3::splat([1.0, 0.0, 0.0]));
        assert_eq!(f.t, Vec3::splat([0.0, 1.0, 0.0]));
    }
}
