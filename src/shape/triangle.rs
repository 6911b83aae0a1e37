//! The triangle, without a gap between neighbours.

use super::{NOTHING, POSITION_ERROR, UNIT_ROUNDOFF};
use crate::math::{Float, LaneFloat, LaneMask, Mask, Ray, Uint, Vec3};

/// A ray in the coordinates of tests against triangles: the axis along which it is longest comes third, and the
/// other two are sheared so that the ray runs along the third (Woop, Benthin and Wald 2013, "Watertight
/// Ray/Triangle Intersection").
///
/// Neighbours see a shared vertex at the same two sheared coordinates, and a shared edge's test differs only in
/// its sign, so that a ray that passes between them passes on the inner side, or on the edge, of one at least.
#[derive(Clone, Copy, Debug)]
pub struct Sheared<F> {
    /// The origin, its coordinates in the ray's own order.
    o: Vec3<F>,
    /// dx/dz, dy/dz and 1/dz in that order.
    shear: Vec3<F>,
    /// 1/dx and 1/dy; NaN for the inverse of zero, which makes NaN of all three corners and so bounds nothing,
    /// where an infinity would make NaN of those in the ray's plane alone.
    inverse: [F; 2],
}

#[inline(always)]
fn inverse<F: LaneFloat>(d: F) -> F {
    let inverse = F::splat(1.0) / d;
    inverse + inverse * F::zero()
}

impl<F: LaneFloat> Sheared<F> {
    /// One ray, in every lane, and the order of its coordinates.
    #[inline(always)]
    pub fn one(ray: &Ray<f32>) -> (Self, [usize; 3]) {
        let (o, d) = ([ray.o.x, ray.o.y, ray.o.z], [ray.d.x, ray.d.y, ray.d.z]);
        let longest = if d[0].abs() > d[1].abs() { 0 } else { 1 };
        let z = if d[longest].abs() > d[2].abs() { longest } else { 2 };
        let order = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, dz] = order.map(|i| d[i]);
        let sheared = Sheared {
            o: Vec3::splat(order.map(|i| o[i])),
            shear: Vec3::splat([dx / dz, dy / dz, 1.0 / dz]),
            inverse: [F::splat(inverse(dx)), F::splat(inverse(dy))],
        };
        (sheared, order)
    }
}

/// Rays of which each has its own order.
#[derive(Clone, Copy, Debug)]
pub struct Shears<F: LaneFloat> {
    sheared: Sheared<F>,
    /// Whether the first coordinate comes last, and whether the second does.
    x_last: F::Mask,
    y_last: F::Mask,
}

impl<F: LaneFloat> Shears<F> {
    /// One ray a lane.
    #[inline(always)]
    pub fn new(ray: &Ray<F>) -> Self {
        let [x, y, z] = [ray.d.x.abs(), ray.d.y.abs(), ray.d.z.abs()];
        let x_longest = x.gt(y);
        let beyond_z = F::select(x_longest, x, y).gt(z);
        let (x_last, y_last) = (x_longest & beyond_z, !x_longest & beyond_z);
        let (o, d) = (order(x_last, y_last, ray.o), order(x_last, y_last, ray.d));
        let one = F::splat(1.0);
        let sheared = Sheared {
            o,
            shear: Vec3::new(d.x / d.z, d.y / d.z, one / d.z),
            inverse: [inverse(d.x), inverse(d.y)],
        };
        Shears { sheared, x_last, y_last }
    }

    /// The hit of each lane's ray on its triangle, which may be a needle only if `has_needles`.
    #[inline(always)]
    pub fn meet(&self, corners: [Vec3<F>; 3], has_needles: bool) -> Meeting<F> {
        // An array's own `map` would not be inlined, and run without the level's instructions.
        let [a, b, c] = corners;
        let (x, y) = (self.x_last, self.y_last);
        self.sheared.meet([order(x, y, a), order(x, y, b), order(x, y, c)], has_needles)
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
pub struct Meeting<F> {
    /// Distance, or [`NOTHING`].
    pub t: F,
    /// The weights of the second and the third corner; unspecified where there is no hit.
    pub weights: [F; 2],
}

/// The lanes in which no two numbers have different signs.
#[inline(always)]
fn one_sign<F: LaneFloat>(u: F, v: F, w: F) -> F::Mask {
    let zero = F::zero();
    let front = zero.le(u) & zero.le(v) & zero.le(w);
    let back = u.le(zero) & v.le(zero) & w.le(zero);
    front | back
}

/// What is left of a·b − c·d where both products round to the same number: the difference of their rounding
/// errors, each exact (Dekker 1971). Its sign is the true one, and turns when the products change places.
#[inline(always)]
fn exact_difference<F: LaneFloat>([a, b]: [F; 2], [c, d]: [F; 2]) -> F {
    product_error(a, b) - product_error(c, d)
}

/// x·y less the number that it rounds to.
#[inline(always)]
fn product_error<F: LaneFloat>(x: F, y: F) -> F {
    let ((xh, xl), (yh, yl)) = (halves(x), halves(y));
    ((xh * yh - x * y) + xh * yl + xl * yh) + xl * yl
}

/// A number as the sum of two of half as many digits.
#[inline(always)]
fn halves<F: LaneFloat>(x: F) -> (F, F) {
    let big = x * F::splat(4097.0);
    let high = big - (big - x);
    (high, x - high)
}

impl<F: LaneFloat> Sheared<F> {
    /// The hit of the ray on a triangle, whose corners are in the order of the ray's coordinates, and which may be a
    /// needle (see [`NEEDLE`]) only if `has_needles`.
    ///
    /// The distance is never outside of the triangle's own box, however small the angle between the ray and the plane,
    /// so that a ray which misses the box has no hit (see [`super::BOUNDS_ERROR`]).
    #[inline(always)]
    pub fn meet(&self, corners: [Vec3<F>; 3], has_needles: bool) -> Meeting<F> {
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
            // Where rounding makes a difference zero, a ray far beside a small triangle seems to be on its side; and
            // of a needle little but rounding is left of it.
            let zero = F::zero();
            let doubtful = inside & u.abs().min(v.abs()).min(w.abs()).le(zero);
            let mut needles = F::Mask::splat(false);
            if has_needles {
                needles = inside & is_needle(corners[1] - corners[0], corners[2] - corners[0]);
            }
            if (doubtful | needles).any() {
                // Zero and what is left of it is what is left.
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
            // Lengths times areas leave the range from sides of 10¹² on. What is seen from its edge overflows as well,
            // and still does then.
            let overflows = inside & !mean.abs().lt(F::splat(NOTHING));
            if overflows.any() {
                let weighted = u * per_area * az + v * per_area * bz + w * per_area * cz;
                mean = F::select(overflows, weighted, mean);
            }
            // Where the ray is in the triangle's box, along all three axes.
            let span = |p: F, q: F, r: F| (p.min(q).min(r), p.max(q).max(r));
            let [by_x, by_y] = self.inverse;
            let (x_near, x_far) = span(a.x * by_x, b.x * by_x, c.x * by_x);
            let (y_near, y_far) = span(a.y * by_y, b.y * by_y, c.y * by_y);
            let (z_near, z_far) = span(az, bz, cz);
            let clamped = x_far.min(y_far.min(z_far.min(mean)));
            let clamped = x_near.max(y_near.max(z_near.max(clamped)));
            // Seen from its edge a triangle has no area, and `mean` is NaN or infinite.
            let met = inside & mean.abs().lt(F::splat(NOTHING)) & clamped.gt(zero);
            t = F::select(met, clamped, t);
        }
        Meeting { t, weights: [v * per_area, w * per_area] }
    }
}

/// A triangle's share of its hits' error bound, for each unit of its longest side, times that side's square
/// over twice the area: the sheared areas are off by a few roundings of the square, and the distance by as much
/// over the area.
pub const TRIANGLE_ERROR: f32 = 8.0 * UNIT_ROUNDOFF;

/// The longest side's square over twice the area from which on a triangle is a needle; the largest coordinate stands
/// for each length. The sheared areas of needles are computed to their last digits, and their error bound does not grow
/// with their form.
///
/// The bound of all other triangles grows faster than their width falls: at this form it is a hundredth of the width,
/// and at ten times the length as large as the width, so that rays would start and end beyond another needle that lies
/// beside it. Wider triangles do without: the exact areas cost more than all the rest of the test.
pub const NEEDLE: f32 = 128.0;

/// The lanes whose triangles, of which these are two sides, are needles. The answer is the same to the bit for
/// coordinates in any cyclic order: tests use those of the ray, the error bound those of the world.
#[inline(always)]
pub fn is_needle<F: LaneFloat>(ab: Vec3<F>, ac: Vec3<F>) -> F::Mask {
    let size = ab.max_abs().max(ac.max_abs());
    (size * size).gt(ab.cross(ac).max_abs() * NEEDLE)
}

/// Sides of a triangle as short as this, or shorter, and as long as the other one, or longer, are scaled before they are
/// multiplied.
const SHORT: f32 = 1.0 / (1 << 20) as f32;
const LONG: f32 = (1 << 20) as f32;

/// The cross product of the two sides of a triangle at a corner, scaled to avoid overflow.
///
/// The square of an area is a length's fourth power, which leaves the range of 32 bits at 10⁻¹⁰ and at 10⁹. Short and
/// long sides are therefore multiplied by a power of two first, which takes their size to about one and changes no bit
/// of anything else.
#[derive(Clone, Copy, Debug)]
pub struct Sides<F> {
    /// The largest coordinate of both.
    size: F,
    /// The factor that both sides were multiplied by.
    scale: F,
    /// Their cross product after that, whose length is twice the area.
    pub across: Vec3<F>,
    /// Its length; zero if there is no area.
    pub length: F,
}

impl<F: Float> Sides<F> {
    /// From the sides.
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
                // The opposite exponent is 255 less the own one. That of zero and of subnormals would be an infinity's.
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
        // Not by the square: that need not fit.
        self.length * 0.5 / self.scale / self.scale
    }

    /// See [`triangle_error`], for the corner at which the sides begin.
    #[inline(always)]
    pub fn error(&self, a: Vec3<F>) -> F {
        let size = self.size;
        let scaled = size * self.scale;
        let square = scaled * scaled;
        // As `is_needle` has it, of sides whose squares fit.
        let is_needle = square.gt(self.across.max_abs() * NEEDLE);
        let flatness = (square / self.length).min(F::splat(NEEDLE));
        let flatness = F::select(is_needle, F::splat(1.0), flatness);
        a.max_abs().max(size) * (2.0 * POSITION_ERROR) + size * flatness * TRIANGLE_ERROR
    }
}

/// How far at most a point that is computed as the mean of a triangle's corners lies off the triangle, plus how
/// close to it a ray may start without meeting it again: of a corner and the sides that begin there.
#[inline(always)]
pub fn triangle_error<F: LaneFloat>(a: Vec3<F>, ab: Vec3<F>, ac: Vec3<F>) -> F {
    Sides::new(ab, ac).error(a)
}
