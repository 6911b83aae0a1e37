//! Estimates of the contribution of lights to a point.

use super::node::{ChildIndex, Node};
use crate::math::{LaneFloat, Mask, Vec3};

/// The fraction of the spread that is added to the squared distance: the harmonic mean of |d|² over lights around a
/// point is less than the mean. Among 0.1 to 0.45 this gave the least variance for slabs, ceilings, clusters, lines and
/// cubes of 100 to 10,000 lights; results for 0.1 to 0.3 are within a tenth of it.
pub const NEARNESS: f32 = 0.2;

/// Lights are distant, if they are far enough away, and if each cosine is at least this,
pub const FACING: f32 = 0.3;

/// or if the cosine of the half angle of their cone of normals is at least this. Then they differ only by distance and
/// height.
pub const NARROW: f32 = 0.95;

/// The largest importance, for which the sum of eight is finite.
pub const GREATEST: f32 = 1e37;

/// The importance of a group of lights for a point.
pub(super) struct Importance<F: LaneFloat> {
    /// An estimate of the contribution, up to a common factor and without occlusion; zero only if there is none.
    pub(super) value: F,
    /// Whether the lights are so distant that their relative contributions hardly depend on the point.
    pub(super) is_far: F::Mask,
}

/// Properties of all lights of a tree, by which evaluations can be skipped.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Kinds {
    /// Whether some light has a normal, and so does not emit in all directions.
    pub(super) is_directed: bool,
    /// Whether some mesh emits.
    pub(super) has_meshes: bool,
}

impl<F: LaneFloat> Importance<F> {
    /// The importance of a node's children for a point `p` on a surface with normal `n` that scatters on both sides.
    ///
    /// For lights with the same spread in all directions, σ² in total, the mean of (n·d)² is (n·d̄)² + σ²/3, and that
    /// of |d|² is d̄² + σ²; their quotient approximates the mean of cos². It is exact for a single point.
    #[inline(always)]
    pub(super) fn of(node: &Node, at: impl ChildIndex<F>, kinds: Kinds, p: Vec3<F>, n: Vec3<F>) -> Self {
        let least = F::splat(f32::MIN_POSITIVE);
        let from_centre = p - at.vector(&node.centre);
        let spread = at.number(&node.spread);
        let distance2 = from_centre.dot(from_centre);
        let height = from_centre.dot(n);
        let cos2 = (height * height + spread * (1.0 / 3.0)) / (distance2 + spread).max(least);
        let falloff = (distance2 + spread * NEARNESS).max(least);
        let value = at.number(&node.power) * cos2.sqrt() / falloff;
        if !kinds.is_directed {
            return Importance { value: value.min(F::splat(GREATEST)), is_far: F::Mask::splat(false) };
        }

        let Angles { b, o, w, cos_p, lit } = Angles::of(node, at, from_centre, distance2);
        let value = (value * cos_p).only(lit).max(F::zero()).min(F::splat(GREATEST));
        if !kinds.has_meshes {
            return Importance { value, is_far: F::Mask::splat(false) };
        }
        // θ_w + θ_o + θ_b: the largest angle. It is below 3π/2 if θ_o and θ_w are below π/2.
        let (cos_s, _) = more(more(o, b), w);
        let acute = o.0.gt(F::zero()) & w.0.gt(F::zero());
        let faces = (acute & cos_s.gt(F::splat(FACING))) | o.0.gt(F::splat(NARROW));
        Importance { value, is_far: faces & distance2.gt(at.number(&node.far2)) }
    }
}

/// Whether some light of a node's children may illuminate a point, by their cones of normals and of emission. Where it
/// is false, the importance is zero for every normal.
#[inline(always)]
pub(super) fn reaches<F: LaneFloat>(node: &Node, at: impl ChildIndex<F>, p: Vec3<F>) -> F::Mask {
    let from_centre = p - at.vector(&node.centre);
    Angles::of(node, at, from_centre, from_centre.dot(from_centre)).lit
}

/// Cosine and sine of an angle in [0, π].
type Angle<F> = (F, F);

/// The angles between a point and the normals of a node's children.
struct Angles<F: LaneFloat> {
    /// Half the angle that the bounds cover as seen from the point; π inside them.
    b: Angle<F>,
    /// Half the angle of the cone of normals.
    o: Angle<F>,
    /// The angle between the cone's axis and the direction from the centre to the point.
    w: Angle<F>,
    /// The cosine of the smallest angle between the direction to the point and a normal.
    cos_p: F,
    /// Whether that angle is one of emission.
    lit: F::Mask,
}

impl<F: LaneFloat> Angles<F> {
    #[inline(always)]
    fn of(node: &Node, at: impl ChildIndex<F>, from_centre: Vec3<F>, distance2: F) -> Self {
        let least = F::splat(f32::MIN_POSITIVE);
        let radius = at.number(&node.radius);
        let near2 = radius * radius;
        let inside = distance2.le(near2);
        let sin2_b = near2 / distance2.max(least);
        let cos_b = F::select(inside, F::splat(-1.0), (-sin2_b + 1.0).max(F::zero()).sqrt());
        let b = (cos_b, sin2_b.sqrt().only(!inside));

        // θ' = max(0, θ_w − θ_o − θ_b) (Pharr, Jakob and Humphreys 2023, §12.6.3).
        let direction = from_centre * (F::splat(1.0) / distance2.max(least).sqrt());
        let cos_w = at.vector(&node.axis).dot(direction);
        let w = (cos_w, (-cos_w * cos_w + 1.0).max(F::zero()).sqrt());
        let o = (at.number(&node.cos_o), at.number(&node.sin_o));
        let (cos_p, _) = less(less(w, o), b);
        Angles { b, o, w, cos_p, lit: cos_p.gt(at.number(&node.cos_e)) }
    }
}

/// max(0, a − b).
#[inline(always)]
fn less<F: LaneFloat>((cos_a, sin_a): Angle<F>, (cos_b, sin_b): Angle<F>) -> Angle<F> {
    let none = cos_a.gt(cos_b);
    let cos = cos_a * cos_b + sin_a * sin_b;
    let sin = sin_a * cos_b - cos_a * sin_b;
    (F::select(none, F::splat(1.0), cos), sin.only(!none))
}

/// Cosine and sine of a + b, which may be above π.
#[inline(always)]
fn more<F: LaneFloat>((cos_a, sin_a): Angle<F>, (cos_b, sin_b): Angle<F>) -> (F, F) {
    (cos_a * cos_b - sin_a * sin_b, sin_a * cos_b + cos_a * sin_b)
}
