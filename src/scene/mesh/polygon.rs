//! Triangulation of polygons.
//!
//! A polygon is projected along its mean normal, after Newell (Sutherland, Sproull and Schumacker 1974). Its corners
//! are clipped one after another, as ears (Meisters 1975), which is correct for simple polygons. If this reverses a
//! triangle, the outline touches itself: a hole is connected by a bridge, or there are spikes or coincident corners.
//! Such polygons go to [`constrained`], which computes winding numbers.

mod constrained;
#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3};

/// The maximum number of corners for ear clipping, which takes quadratic time; larger polygons become a fan or go to
/// [`constrained`].
const MOST_EARS: usize = 4096;

/// The fraction of a polygon's area that reversed triangles may cover, as rounding errors.
const TURNED_OVER: f64 = 1e-6;

/// The tolerance between a side and corners that touch it, relative to the polygon's largest coordinate, which has 24
/// bits.
const TOUCHING: f64 = 4.0 * f32::EPSILON as f64;

/// The quality of a triangulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cut {
    /// The triangles cover exactly the inside.
    Exact,
    /// The polygon is degenerate: all corners are on one line.
    Flat,
    /// The outline crosses itself, and some triangles lie outside.
    Crossed,
}

/// Splits a polygon of more than three corners into triangles that have its corners and its winding.
///
/// The polygon may be concave and slightly bent, and touch itself. Corners are indices of `positions`; an invalid index
/// makes it a fan, so that a later error reports it.
pub(super) fn triangulate(corners: &[u32], positions: &[[f32; 3]], triangles: &mut Vec<[u32; 3]>) -> Cut {
    let point = |&i: &u32| positions.get(i as usize).map(|p| DVec3::from(p.map(f64::from)));
    let points: Option<Vec<DVec3>> = corners.iter().map(point).collect();
    let name = |triangle: [usize; 3]| triangle.map(|i| corners[i]);
    let fan = || (2..corners.len()).map(|i| [0, i - 1, i]);
    let Some(points) = points.filter(|points| points.len() > 3) else {
        triangles.extend(fan().map(name));
        return Cut::Exact;
    };
    let Some(flat) = flattened(&points) else {
        triangles.extend(fan().map(name));
        return Cut::Flat;
    };
    let turned_over = |triangles: &[[usize; 3]]| {
        let turned = triangles.iter().map(|&corners| (-doubled(corners.map(|i| flat[i]))).max(0.0));
        turned.sum::<f64>()
    };
    let total: f64 = fan().map(|corners| doubled(corners.map(|i| flat[i]))).sum();
    let first = if points.len() <= MOST_EARS { ears(&flat) } else { fan().collect() };
    if turned_over(&first) <= TURNED_OVER * total {
        triangles.extend(first.into_iter().map(name));
        return Cut::Exact;
    }
    let size = points.iter().fold(0.0_f64, |size, p| size.max(p.abs().max_element()));
    let inside = constrained::triangulate(&flat, corners, size * TOUCHING);
    let once = inside.as_ref().is_some_and(|inside| inside.once);
    triangles.extend(inside.map_or(first, |inside| inside.triangles).into_iter().map(name));
    if once { Cut::Exact } else { Cut::Crossed }
}

/// Whether a triangle of a file is degenerate.
pub(super) fn is_flat(corners: [u32; 3], positions: &[[f32; 3]]) -> bool {
    match corners.map(|i| positions.get(i as usize)) {
        [Some(a), Some(b), Some(c)] => {
            let [a, b, c] = [a, b, c].map(|p| DVec3::from(p.map(f64::from)));
            (b - a).cross(c - a) == DVec3::ZERO
        }
        // A later error reports the invalid corner.
        _ => false,
    }
}

/// A polygon's corners, projected along its mean normal and counter-clockwise; `None` without such a normal.
fn flattened(points: &[DVec3]) -> Option<Vec<DVec2>> {
    let mut normal = DVec3::ZERO;
    for (i, a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        normal += (a - points[0]).cross(b - points[0]);
    }
    let normal = normal.try_normalize()?;
    let (s, t) = normal.any_orthonormal_pair();
    // Right-handed, with the normal towards the viewer.
    let (s, t) = if s.cross(t).dot(normal) > 0.0 { (s, t) } else { (t, s) };
    Some(points.iter().map(|p| DVec2::new(p.dot(s), p.dot(t))).collect())
}

/// Twice the area of a triangle; negative if it is clockwise.
fn doubled([a, b, c]: [DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Triangulates a counter-clockwise polygon by repeatedly clipping the first ear, or the first corner if there is none.
///
/// Corners found outside of a candidate ear are not tested again until one of its own corners changes, which happens
/// twice per clipped corner: so there are at most 3 n² tests.
fn ears(flat: &[DVec2]) -> Vec<[usize; 3]> {
    /// Known facts about the triangle of a corner and its two neighbours.
    #[derive(Clone, Copy)]
    struct Known {
        /// It is no ear because of its winding.
        reflex: Option<bool>,
        /// No corner before this index is inside.
        asked: usize,
    }
    const NOTHING: Known = Known { reflex: None, asked: 0 };
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut known = vec![NOTHING; flat.len()];
    let mut is_left = vec![true; flat.len()];
    while left.len() > 3 {
        let n = left.len();
        let around = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
        let mut is_ear = |&i: &usize| {
            let known = &mut known[left[i]];
            let ear = || around(i).map(|j| flat[j]);
            let reflex = *known.reflex.get_or_insert_with(|| {
                let [a, b, c] = ear();
                let turn = (b - a).perp_dot(c - b);
                turn <= 0.0 || turn.is_nan()
            });
            // The last corner found inside may still be there.
            if reflex || known.asked > 0 && is_left[known.asked - 1] {
                return false;
            }
            let (own, [a, b, c]) = (around(i), ear());
            let from = left.partition_point(|&j| j < known.asked);
            let inside = left[from..].iter().find(|j| !own.contains(j) && within(flat[**j], [a, b, c]));
            known.asked = inside.map_or(flat.len() + 1, |j| j + 1);
            inside.is_none()
        };
        let ear = (0..n).find(&mut is_ear).unwrap_or(0);
        triangles.push(around(ear));
        let [before, gone, after] = around(ear);
        is_left[gone] = false;
        [known[before], known[after]] = [NOTHING; 2];
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// Whether a point is in a counter-clockwise triangle or on its edge.
fn within(p: DVec2, [a, b, c]: [DVec2; 3]) -> bool {
    [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| (to - from).perp_dot(p - from) >= 0.0)
}
