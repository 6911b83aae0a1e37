//! Polygons to triangles.

use glam::{DVec2, DVec3};

/// Cuts a polygon of more than three corners into triangles that have its corners and its winding, by clipping
/// ears (Meisters 1975); corners that stick out nowhere are cut in order.
///
/// The polygon may be concave and slightly bent; it is looked at along its mean normal. Corners are indices of
/// `positions`; one that is none of them makes it a fan, whose index an error will name.
pub(super) fn triangulate(corners: &[u32], positions: &[[f32; 3]], triangles: &mut Vec<[u32; 3]>) {
    let point = |&i: &u32| positions.get(i as usize).map(|p| DVec3::from(p.map(f64::from)));
    let points: Option<Vec<DVec3>> = corners.iter().map(point).collect();
    let fan = |triangles: &mut Vec<[u32; 3]>| {
        triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
    };
    // A polygon of a million corners is none; to look for its ears would take for ever.
    let Some(points) = points.filter(|points| (4..=4096).contains(&points.len())) else {
        return fan(triangles);
    };
    // Newell's normal (Sutherland, Sproull and Schumacker 1974).
    let mut normal = DVec3::ZERO;
    for (i, a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        normal += (a - points[0]).cross(b - points[0]);
    }
    let Some(normal) = normal.try_normalize() else { return fan(triangles) };
    let (s, t) = normal.any_orthonormal_pair();
    // Right-handed with the normal towards the eye.
    let (s, t) = if s.cross(t).dot(normal) > 0.0 { (s, t) } else { (t, s) };
    let flat: Vec<DVec2> = points.iter().map(|p| DVec2::new(p.dot(s), p.dot(t))).collect();
    let mut left: Vec<usize> = (0..points.len()).collect();
    while left.len() > 3 {
        let n = left.len();
        let around = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
        let is_ear = |&i: &usize| {
            let ear = around(i);
            let [a, b, c] = ear.map(|j| flat[j]);
            let inside = |&j: &usize| !ear.contains(&j) && within(flat[j], [a, b, c]);
            (b - a).perp_dot(c - b) > 0.0 && !left.iter().any(inside)
        };
        let ear = (0..n).find(is_ear).unwrap_or(0);
        triangles.push(around(ear).map(|j| corners[j]));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]].map(|j| corners[j]));
}

/// Whether a point is in a counter-clockwise triangle or on its edge.
fn within(p: DVec2, [a, b, c]: [DVec2; 3]) -> bool {
    [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| (to - from).perp_dot(p - from) >= 0.0)
}
