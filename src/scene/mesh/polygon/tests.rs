//! Polygons of all kinds, compared with the area formula.

use super::*;
use crate::sampling::Stream;
use glam::DMat3;
use rand::RngExt;
use std::f64::consts::TAU;

/// A polygon in space, and its triangulation.
struct Polygon {
    corners: Vec<u32>,
    positions: Vec<[f32; 3]>,
}

impl Polygon {
    fn of(points: &[DVec2], place: impl Fn(DVec2) -> DVec3) -> Polygon {
        let positions = points.iter().map(|p| place(*p).to_array().map(|x| x as f32)).collect();
        Polygon { corners: (0..points.len() as u32).collect(), positions }
    }

    fn flat(points: &[[f64; 2]]) -> Polygon {
        let points: Vec<_> = points.iter().copied().map(DVec2::from).collect();
        Polygon::of(&points, |p| p.extend(0.0))
    }

    fn at(&self, corner: u32) -> DVec3 {
        DVec3::from(self.positions[corner as usize].map(f64::from))
    }

    /// Twice the area, along its mean normal.
    fn doubled(&self) -> DVec3 {
        let n = self.corners.len();
        let o = self.at(self.corners[0]);
        let side = |i: usize| (self.at(self.corners[i]) - o).cross(self.at(self.corners[(i + 1) % n]) - o);
        (0..n).map(side).sum()
    }

    fn cut(&self) -> (Cut, Vec<[u32; 3]>) {
        let mut triangles = Vec::new();
        let cut = triangulate(&self.corners, &self.positions, &mut triangles);
        (cut, triangles)
    }

    /// The fraction of the area that triangles miss, and that of reversed triangles.
    fn errors(&self, triangles: &[[u32; 3]]) -> [f64; 2] {
        let normal = self.doubled().normalize();
        let area = |&corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| self.at(corner));
            (b - a).cross(c - a).dot(normal)
        };
        let (mut sum, mut turned) = (0.0, 0.0);
        for area in triangles.iter().map(area) {
            sum += area;
            turned += (-area).max(0.0);
        }
        let whole = self.doubled().length();
        [(sum - whole).abs() / whole, turned / whole]
    }

    #[track_caller]
    fn is_cut_right(&self) {
        let (cut, triangles) = self.cut();
        let [missed, turned] = self.errors(&triangles);
        assert!(
            cut == Cut::Exact && missed < 1e-5 && turned < 1e-5,
            "{cut:?}: {missed} missed, {turned} turned over"
        );
    }
}

/// Reference implementation: repeatedly clips the first ear, testing each corner against all others.
fn slow_ears(flat: &[DVec2]) -> Vec<[usize; 3]> {
    let mut triangles = Vec::new();
    let mut left: Vec<usize> = (0..flat.len()).collect();
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
        triangles.push(around(ear));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// A star-shaped polygon around the origin.
fn star(n: usize, low: f64, high: f64, stream: &mut Stream) -> Vec<DVec2> {
    let at = |i: usize, stream: &mut Stream| {
        let angle = TAU * (i as f64 + 0.9 * stream.random::<f64>()) / n as f64;
        DVec2::from_angle(angle) * stream.random_range(low..high)
    };
    (0..n).map(|i| at(i, stream)).collect()
}

#[test]
fn ears_are_those_of_the_reference_implementation() {
    let stream = &mut Stream::new(41, 0, 0);
    for i in 0..600 {
        let n = stream.random_range(4..60);
        let mut points = match i % 3 {
            0 => star(n, 1.0, 1.0 + 1e-9, stream),
            1 => star(n, 0.1, 1.0, stream),
            // On a lattice: coincident corners, collinear sides, crossings.
            _ => (0..n)
                .map(|_| DVec2::new(stream.random_range(0..5).into(), stream.random_range(0..5).into()))
                .collect(),
        };
        let first = stream.random_range(0..n);
        points.rotate_left(first);
        assert_eq!(ears(&points), slow_ears(&points), "{points:?}");
    }
}

#[test]
fn holes_spikes_and_touching_corners_have_no_area() {
    let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    let hole = [[1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0]];
    let [a, b, c, d] = square;
    let [p, q, r, s] = hole;
    for (points, area) in [
        // A keyhole, from two corners of the outline.
        (vec![a, b, c, d, a, p, q, r, s, p], 12.0),
        (vec![a, p, q, r, s, p, a, b, c, d], 12.0),
        // Two holes, the second connected by way of the first.
        (
            vec![
                a,
                b,
                [9.0, 0.0],
                [9.0, 4.0],
                c,
                d,
                a,
                p,
                q,
                r,
                [5.0, 3.0],
                [7.0, 3.0],
                [7.0, 1.0],
                [5.0, 3.0],
                r,
                s,
                p,
            ],
            30.0,
        ),
        // Spikes: outwards, inwards, along a side, two in one.
        (vec![a, b, c, [4.0, 8.0], c, d], 16.0),
        (vec![a, b, c, [2.0, 2.0], c, d], 16.0),
        (vec![a, b, [4.0, 3.0], [4.0, 1.0], c, d], 16.0),
        (vec![a, b, c, [6.0, 6.0], [8.0, 8.0], [5.0, 5.0], c, d], 16.0),
        // Corners that coincide, next to one another and not.
        (vec![a, a, b, c, c, c, d], 16.0),
        (vec![a, b, c, d, a, b, c, d, a, p, q, r, s, p], f64::NAN),
        // Two triangles that touch in a corner, and a corner that touches a side.
        (vec![[2.0, 2.0], a, b, [2.0, 2.0], c, d], 8.0),
        (vec![a, b, c, d, [0.0, 3.0], [2.0, 0.0], [0.0, 1.0]], 14.0),
        // All corners on the sides of a triangle.
        (vec![a, [1.0, 0.0], [2.0, 0.0], b, [2.0, 2.0], d, [0.0, 2.0], [0.0, 1.0]], 8.0),
    ] {
        let polygon = Polygon::flat(&points);
        if area.is_nan() {
            // With the winding number 2: there is no correct result, and this is reported.
            assert_eq!(polygon.cut().0, Cut::Crossed);
            continue;
        }
        assert_eq!(polygon.doubled(), DVec3::new(0.0, 0.0, 2.0 * area), "{points:?}");
        polygon.is_cut_right();
        for scale in [1e-12, 1e12] {
            let points: Vec<_> = points.iter().map(|p| p.map(|x| x * scale)).collect();
            Polygon::flat(&points).is_cut_right();
        }
        let mirrored: Vec<_> = points.iter().map(|[x, y]| [-x, *y]).collect();
        Polygon::flat(&mirrored).is_cut_right();
    }
}

#[test]
fn collinear_corners_are_reported_and_triangulated() {
    for points in [vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]], vec![[1.0, 1.0]; 5]] {
        let (cut, triangles) = Polygon::flat(&points).cut();
        assert_eq!((cut, triangles.len()), (Cut::Flat, points.len() - 2));
    }
}

#[test]
fn self_intersecting_outlines_are_reported() {
    let (cut, triangles) = Polygon::flat(&[[0.0, 0.0], [4.0, 3.0], [4.0, 0.0], [0.0, 4.0]]).cut();
    assert_eq!((cut, triangles.len()), (Cut::Crossed, 2));
}

/// A random polygon that touches itself: a plate whose right side is a chain of corners, each above the last, with rows
/// of holes connected by bridges to the left side, spikes, and repeated corners.
fn weakly_simple(stream: &mut Stream) -> Vec<DVec2> {
    let rows = stream.random_range(0..5_usize);
    let height = rows as f64 + 1.0;
    let mut points = vec![DVec2::ZERO];
    let mut y = 0.0;
    while y < height {
        let p = DVec2::new(stream.random_range(9.0..12.0), y);
        points.push(p);
        if stream.random_range(0..3) == 0 {
            // Away from the plate, into it, or back along the side that led here.
            let tip = match (stream.random_range(0..3), points.len()) {
                (0, 3..) => p.lerp(points[points.len() - 2], stream.random()),
                (1, _) => p - DVec2::new(stream.random_range(0.1..0.4), 0.0),
                _ => p + DVec2::new(stream.random_range(0.1..9.0), 0.0),
            };
            points.extend([tip, p]);
        }
        y += stream.random_range(0.05..0.6);
    }
    points.extend([DVec2::new(9.0, height), DVec2::new(0.0, height)]);
    for row in (0..rows).rev() {
        let left = DVec2::new(0.0, row as f64 + 1.0);
        points.push(left);
        let (mut back, mut from) = (vec![left], 0.0);
        for hole in 0..stream.random_range(1..4) {
            let radius = stream.random_range(0.1..0.4);
            // Some bridges have length zero: the hole touches the previous one.
            let gap = if stream.random_range(0..4) == 0 { 0.0 } else { stream.random_range(0.1..1.0) };
            let (first, last) = (left.x + from + gap, left.x + from + gap + 2.0 * radius);
            let at = |x: f64, y: f64| DVec2::new(x, left.y + y);
            let middle = (first + last) / 2.0;
            // Clockwise, from the left to the right and back.
            let over: Vec<_> = (0..stream.random_range(1..5))
                .map(|i| at(first + radius * (0.2 + 0.3 * i as f64), stream.random_range(0.0..0.45)))
                .collect();
            points.push(at(first, 0.0));
            points.extend(over);
            points.push(at(last, 0.0));
            back.extend([at(first, 0.0), at(middle, -stream.random_range(0.01..0.45)), at(last, 0.0)]);
            from = last - left.x;
            if hole == 0 && stream.random_range(0..3) == 0 {
                // A hole that does not go on.
                break;
            }
        }
        back.pop();
        points.extend(back.into_iter().rev());
    }
    for _ in 0..stream.random_range(0..4) {
        let at = stream.random_range(0..points.len());
        points.insert(at, points[at]);
    }
    let first = stream.random_range(0..points.len());
    points.rotate_left(first);
    points
}

#[test]
fn polygons_that_touch_themselves_are_triangulated_at_any_position_and_size() {
    let stream = &mut Stream::new(42, 0, 0);
    let (mut cut, mut by_ears) = (0, 0);
    for i in 0..3000 {
        let points = weakly_simple(stream);
        let turn = match i % 3 {
            0 => DMat3::IDENTITY,
            1 => DMat3::from_rotation_x(TAU / 4.0) * DMat3::from_rotation_z(TAU / 2.0),
            _ => DMat3::from_euler(
                glam::EulerRot::ZYX,
                stream.random::<f64>() * 6.0,
                stream.random(),
                stream.random(),
            ),
        };
        let scale = 10_f64.powf(stream.random_range(-12.0..12.0));
        let polygon = Polygon::of(&points, |p| turn * p.extend(0.0) * scale);
        polygon.is_cut_right();
        cut += 1;
        let flat: Vec<DVec3> = polygon.corners.iter().map(|&corner| polygon.at(corner)).collect();
        let ears = ears(&flattened(&flat).unwrap());
        let ears: Vec<_> = ears.into_iter().map(|corners| corners.map(|i| i as u32)).collect();
        by_ears += usize::from(polygon.errors(&ears)[1] < 1e-5);
    }
    // Negative control: ear clipping alone fails for many, and for more than those with holes only.
    assert!(cut == 3000 && (100..2000).contains(&by_ears), "{by_ears} of {cut} by their ears");
}

#[test]
fn simple_polygons_of_many_corners_are_triangulated() {
    let stream = &mut Stream::new(43, 0, 0);
    let ring = star(10_000, 0.2, 1.0, stream);
    Polygon::of(&ring, |p| p.extend(0.0)).is_cut_right();
    // A keyhole between two rings.
    let inner: Vec<_> = star(10_000, 0.1, 0.15, stream).into_iter().rev().collect();
    let keyhole: Vec<_> = ring.iter().chain(&ring[..1]).chain(&inner).chain(&inner[..1]).copied().collect();
    Polygon::of(&keyhole, |p| p.extend(0.0)).is_cut_right();
    // A comb, the teeth of which are long.
    let tooth = |i: u32| {
        let x = f64::from(i);
        [[x, 1.0], [x + 0.5, 1000.0]]
    };
    let teeth = (0..20_000).rev().flat_map(tooth);
    let comb: Vec<_> = [[0.0, 0.0], [20_000.0, 0.0]].into_iter().chain(teeth).collect();
    Polygon::flat(&comb).is_cut_right();
    // A fan is correct for convex polygons of any number of corners.
    let convex = star(5000, 1.0, 1.0 + 1e-12, stream);
    let polygon = Polygon::of(&convex, |p| p.extend(0.0));
    assert_eq!(polygon.cut().1[..2], [[0, 1, 2], [0, 2, 3]]);
    polygon.is_cut_right();
}

#[test]
fn triangles_use_the_corners_on_their_side_of_a_bridge() {
    // The corners of the bridge have a vertex for each direction.
    let points = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
        [1.0, 1.0],
    ];
    let polygon = Polygon::flat(&points);
    let (_, triangles) = polygon.cut();
    // Below the diagonal, then above it.
    for (ours, side) in [([0, 9], 1.0), ([4, 5], -1.0)] {
        let with = triangles.iter().filter(|corners| corners.iter().any(|corner| ours.contains(corner)));
        let below = |corners: &[u32; 3]| {
            corners.iter().map(|&corner| polygon.at(corner)).map(|p| p.x - p.y).sum::<f64>()
        };
        assert!(with.clone().count() > 0);
        assert!(with.clone().all(|corners| below(corners) * side > 0.0), "{triangles:?}");
    }
}
