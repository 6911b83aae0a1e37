//! The triangle, watertight between neighbours.

use super::{NOTHING, POSITION_ERROR, UNIT_ROUNDOFF};
use crate::math::{Float, LaneFloat, LaneMask, Mask, Ray, Uint, Vec3};

/// A ray in the coordinates of tests against triangles. The axis of the direction's largest component comes third, and
/// the other two are sheared so that the ray runs along the third (Woop, Benthin and Wald 2013, "Watertight
/// Ray/Triangle Intersection").
///
/// Neighbours compute the same two sheared coordinates for a shared vertex, and their tests of a shared edge differ
/// only in sign. A ray that passes between them is therefore inside, or on the edge, of at least one.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay<F> {
    /// The origin, in the ray's order of coordinates.
    o: Vec3<F>,
    /// dx/dz, dy/dz and 1/dz in that order.
    shear: Vec3<F>,
    /// 1/dx and 1/dy; NaN in place of the inverse of zero. It gives NaN for all three corners and so no bound, whereas
    /// an infinity would give NaN only for corners in the ray's plane.
    inverse: [F; 2],
}

#[inline(always)]
fn inverse<F: LaneFloat>(d: F) -> F {
    let inverse = F::splat(1.0) / d;
    inverse + inverse * F::zero()
}

impl<F: LaneFloat> ShearedRay<F> {
    /// One ray in every lane, and the order of its coordinates.
    #[inline(always)]
    pub fn one(ray: &Ray<f32>) -> (Self, [usize; 3]) {
        let (o, d) = ([ray.o.x, ray.o.y, ray.o.z], [ray.d.x, ray.d.y, ray.d.z]);
        let longest = if d[0].abs() > d[1].abs() { 0 } else { 1 };
        let z = if d[longest].abs() > d[2].abs() { longest } else { 2 };
        let order = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, dz] = order.map(|i| d[i]);
        let sheared = ShearedRay {
            o: Vec3::splat(order.map(|i| o[i])),
            shear: Vec3::splat([dx / dz, dy / dz, 1.0 / dz]),
            inverse: [F::splat(inverse(dx)), F::splat(inverse(dy))],
        };
        (sheared, order)
    }
}

/// Rays with an order of coordinates each.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRays<F: LaneFloat> {
    sheared: ShearedRay<F>,
    /// Whether the first coordinate comes last, and whether the second does.
    x_last: F::Mask,
    y_last: F::Mask,
}

impl<F: LaneFloat> ShearedRays<F> {
    /// One ray per lane.
    #[inline(always)]
    pub fn new(ray: &Ray<F>) -> Self {
        let [x, y, z] = [ray.d.x.abs(), ray.d.y.abs(), ray.d.z.abs()];
        let x_longest = x.gt(y);
        let beyond_z = F::select(x_longest, x, y).gt(z);
        let (x_last, y_last) = (x_longest & beyond_z, !x_longest & beyond_z);
        let (o, d) = (order(x_last, y_last, ray.o), order(x_last, y_last, ray.d));
        let one = F::splat(1.0);
        let sheared = ShearedRay {
            o,
            shear: Vec3::new(d.x / d.z, d.y / d.z, one / d.z),
            inverse: [inverse(d.x), inverse(d.y)],
        };
        ShearedRays { sheared, x_last, y_last }
    }

    /// The hit of each lane's ray on its triangle, which may be a needle only if `has_needles`.
    #[inline(always)]
    pub fn intersect(&self, corners: [Vec3<F>; 3], has_needles: bool) -> TriangleHit<F> {
        // An array's own `map` would not be inlined, and would run without the level's instructions.
        let [a, b, c] = corners;
        let (x, y) = (self.x_last, self.y_last);
        self.sheared.intersect([order(x, y, a), order(x, y, b), order(x, y, c)], has_needles)
    }
}

/// Coordinates in a ray's order: the one after the last comes first.
#[inline(always)]
fn order<F: LaneFloat>(x_last: F::Mask, y_last: F::Mask, v: Vec3<F>) -> Vec3<F> {
    let pick = |x, y, z| F::select(x_last, x, F::select(y_last, y, z));
    Vec3::new(pick(v.y, v.z, v.x), pick(v.z, v.x, v.y), pick(v.x, v.y, v.z))
}

/// The hit of a ray on a triangle.
#[derive(Clone, Copy, Debug)]
pub struct TriangleHit<F> {
    /// Distance, or [`NOTHING`].
    pub t: F,
    /// The weights of the second and the third corner; unspecified without a hit.
    pub weights: [F; 2],
}

/// The lanes in which no two numbers have opposite signs.
#[inline(always)]
fn one_sign<F: LaneFloat>(u: F, v: F, w: F) -> F::Mask {
    let zero = F::zero();
    let front = zero.le(u) & zero.le(v) & zero.le(w);
    let back = u.le(zero) & v.le(zero) & w.le(zero);
    front | back
}

/// The value of a·b − c·d if both products round to the same number: the difference of their rounding errors, each of
/// which is exact (Dekker 1971). Its sign is correct, and is reversed if the products are swapped.
#[inline(always)]
fn exact_difference<F: LaneFloat>([a, b]: [F; 2], [c, d]: [F; 2]) -> F {
    product_error(a, b) - product_error(c, d)
}

/// x·y minus its rounded value.
#[inline(always)]
fn product_error<F: LaneFloat>(x: F, y: F) -> F {
    let ((xh, xl), (yh, yl)) = (halves(x), halves(y));
    ((xh * yh - x * y) + xh * yl + xl * yh) + xl * yl
}

/// A number as the sum of two numbers with half as many digits.
#[inline(always)]
fn halves<F: LaneFloat>(x: F) -> (F, F) {
    let big = x * F::splat(4097.0);
    let high = big - (big - x);
    (high, x - high)
}

impl<F: LaneFloat> ShearedRay<F> {
    /// The hit of the ray on a triangle. Its corners are in the ray's order of coordinates. It may be a needle (see
    /// [`NEEDLE`]) only if `has_needles`.
    ///
    /// The hit is never outside the triangle's own box, however small the angle between the ray and the plane. A ray
    /// that misses the box therefore has no hit (see [`super::BOUNDS_ERROR`]).
    #[inline(always)]
    pub fn intersect(&self, corners: [Vec3<F>; 3], has_needles: bool) -> TriangleHit<F> {
        let shear = self.shear;
        let [a, b, c] = corners;
        let (a, b, c) = (a - self.o, b - self.o, c - self.o);
        let flat = |w: Vec3<F>| [w.x - shear.x * w.z, w.y - shear.y * w.z];
        let ([ax, ay], [bx, by], [cx, cy]) = (flat(a), flat(b), flat(c));
        // Twice the areas between the ray and each side.
        let (mut u, mut v, mut w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
        let mut inside = one_sign(u, v, w);
        let mut t = F::splat(NOTHING);
        if inside.any() {
            // If rounding makes a difference zero, a ray far from a small triangle appears to be on its side. The
            // differences of a needle consist mostly of rounding errors.
            let zero = F::zero();
            let doubtful = inside & u.abs().min(v.abs()).min(w.abs()).le(zero);
            let mut needles = F::Mask::splat(false);
            if has_needles {
                needles = inside & is_needle(corners[1] - corners[0], corners[2] - corners[0]);
            }
            if (doubtful | needles).any() {
                // For a difference of zero, this is the rounding error alone.
                let is_zero = [u.abs().le(zero), v.abs().le(zero), w.abs().le(zero)];
                u = F::select(needles | (doubtful & is_zero[0]), u + exact_difference([cx, by], [cy, bx]), u);
                v = F::select(needles | (doubtful & is_zero[1]), v + exact_difference([ax, cy], [ay, cx]), v);
                w = F::select(needles | (doubtful & is_zero[2]), w + exact_difference([bx, ay], [by, ax]), w);
                inside = one_sign(u, v, w);
            }
        }
        let per_area = F::splat(1.0) / (u + v + w);
        if inside.any() {
            let zero = F::zero();
            let (az, bz, cz) = (a.z * shear.z, b.z * shear.z, c.z * shear.z);
            let mut mean = (u * az + v * bz + w * cz) * per_area;
            // Lengths times areas overflow for sides of 10¹² and more. A triangle seen edge-on overflows as well, in
            // both forms.
            let overflows = inside & !mean.abs().lt(F::splat(NOTHING));
            if overflows.any() {
                let weighted = u * per_area * az + v * per_area * bz + w * per_area * cz;
                mean = F::select(overflows, weighted, mean);
            }
            // The interval of the ray inside the triangle's box, along all three axes.
            let span = |p: F, q: F, r: F| (p.min(q).min(r), p.max(q).max(r));
            let [by_x, by_y] = self.inverse;
            let (x_near, x_far) = span(a.x * by_x, b.x * by_x, c.x * by_x);
            let (y_near, y_far) = span(a.y * by_y, b.y * by_y, c.y * by_y);
            let (z_near, z_far) = span(az, bz, cz);
            let clamped = x_far.min(y_far.min(z_far.min(mean)));
            let clamped = x_near.max(y_near.max(z_near.max(clamped)));
            // Seen edge-on, a triangle has no area, and `mean` is NaN or infinite.
            let met = inside & mean.abs().lt(F::splat(NOTHING)) & clamped.gt(zero);
            t = F::select(met, clamped, t);
        }
        TriangleHit { t, weights: [v * per_area, w * per_area] }
    }
}

/// A triangle's contribution to its hits' error bound, per unit of its longest side times that side's square over twice
/// the area. The sheared areas are off by a few roundings of the square, and the distance by as much divided by the
/// area.
pub const TRIANGLE_ERROR: f32 = 8.0 * UNIT_ROUNDOFF;

/// The ratio of the longest side's square to twice the area above which a triangle is a needle; the largest coordinate
/// represents each length. The sheared areas of needles are computed to full precision, and their error bound does not
/// grow with this ratio.
///
/// The bound of all other triangles grows faster than their width shrinks. At this ratio it is a hundredth of the
/// width; at ten times the length it is as large as the width, so that rays would start and end beyond a neighbouring
/// needle. Wider triangles do not need the exact areas, which cost more than the rest of the test.
pub const NEEDLE: f32 = 128.0;

/// The lanes whose triangles, given by two sides, are needles. The result is the same to the bit for coordinates in any
/// cyclic order: tests use those of the ray, the error bound those of the world.
#[inline(always)]
pub fn is_needle<F: LaneFloat>(ab: Vec3<F>, ac: Vec3<F>) -> F::Mask {
    let size = ab.max_abs().max(ac.max_abs());
    (size * size).gt(ab.cross(ac).max_abs() * NEEDLE)
}

/// Pairs of sides at most as long as the first, or at least as long as the second, are scaled before they are
/// multiplied.
const SHORT: f32 = 1.0 / (1 << 20) as f32;
const LONG: f32 = (1 << 20) as f32;

/// The cross product of the two sides of a triangle at a corner, scaled to avoid overflow.
///
/// The square of an area is the fourth power of a length, which leaves the range of 32 bits at 10⁻¹⁰ and at 10⁹. Short
/// and long sides are therefore multiplied first by a power of two that brings their size to about one, which changes
/// no other bit.
#[derive(Clone, Copy, Debug)]
pub struct Sides<F> {
    /// The largest coordinate of both sides.
    size: F,
    /// The scale factor of both sides.
    scale: F,
    /// Their cross product after scaling; its length is twice the scaled area.
    pub across: Vec3<F>,
    /// Its length; zero if there is no area.
    pub length: F,
}

impl<F: Float> Sides<F> {
    /// From the two sides.
    #[inline(always)]
    pub fn new(ab: Vec3<F>, ac: Vec3<F>) -> Self {
        let size = ab.max_abs().max(ac.max_abs());
        let one = F::splat(1.0);
        let unusual = size.lt(F::splat(SHORT)) | size.gt(F::splat(LONG));
        let (scale, ab, ac) = F::guard(
            unusual,
            (one, ab, ac),
            #[inline(always)]
            || {
                // The exponent of the inverse is 255 minus the own one. For zero and subnormals it would be that of an
                // infinity.
                let exponent = F::Uint::splat(0x7f80_0000);
                let own = size.max(F::splat(f32::MIN_POSITIVE)).to_bits() & exponent;
                let scale = F::select(unusual, F::from_bits(own ^ exponent), one);
                (scale, ab * scale, ac * scale)
            },
        );
        let across = ab.cross(ac);
        Sides { size, scale, across, length: across.length() }
    }

    /// The triangle's area.
    #[inline(always)]
    pub fn area(&self) -> F {
        // Not by the square of the scale, which may overflow.
        self.length * 0.5 / self.scale / self.scale
    }

    /// See [`triangle_error`], for the corner at which the sides begin.
    #[inline(always)]
    pub fn error(&self, a: Vec3<F>) -> F {
        let size = self.size;
        let scaled = size * self.scale;
        let square = scaled * scaled;
        // As in `is_needle`, for sides whose squares are in range.
        let is_needle = square.gt(self.across.max_abs() * NEEDLE);
        let flatness = (square / self.length).min(F::splat(NEEDLE));
        let flatness = F::select(is_needle, F::splat(1.0), flatness);
        a.max_abs().max(size) * (2.0 * POSITION_ERROR) + size * flatness * TRIANGLE_ERROR
    }
}

/// The largest distance from the triangle of a point computed as a weighted mean of its corners, plus the distance at
/// which a ray may start without hitting the triangle again. Given a corner and the two sides that begin there.
#[inline(always)]
pub fn triangle_error<F: LaneFloat>(a: Vec3<F>, ab: Vec3<F>, ac: Vec3<F>) -> F {
    Sides::new(ab, ac).error(a)
}
