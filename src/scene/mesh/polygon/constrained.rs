//! Polygons whose outline touches itself, by a constrained Delaunay triangulation of their corners.
//!
//! Every side of the polygon is one or several edges of this triangulation. Between two adjacent triangles, the winding
//! number changes by the number of times that the outline passes their edge in one direction minus that in the other.
//! Bridges and spikes, passed in both directions, therefore change nothing, and triangles with the winding number 1 are
//! inside.

use glam::DVec2;
use spade::handles::{FixedDirectedEdgeHandle, FixedUndirectedEdgeHandle, FixedVertexHandle};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, mitigate_underflow};

/// The triangulation of a polygon.
pub(super) struct Inside {
    /// Triangles of corner indices in the polygon.
    pub(super) triangles: Vec<[usize; 3]>,
    /// Whether all winding numbers are 0 or 1.
    pub(super) once: bool,
}

/// The maximum number of times that sides are routed through corners that they touch within rounding, before the
/// polygon is rejected.
const MOST_ROUNDS: usize = 8;

/// The maximum number of coincident corners that are examined for the one whose inside a triangle is in.
const MOST_ASKED: usize = 16;

/// Triangulates a counter-clockwise polygon. `numbers` are the vertices of its corners; coincident corners of one
/// vertex are interchangeable. Sides may cross corners by at most `tolerance`; a polygon whose outline crosses itself
/// farther is rejected.
pub(super) fn triangulate(flat: &[DVec2], numbers: &[u32], tolerance: f64) -> Option<Inside> {
    let (low, high) = flat.iter().fold((flat[0], flat[0]), |(low, high), p| (low.min(*p), high.max(*p)));
    // A power of two, which scales the size to about one without rounding.
    let exponent = (high - low).max_element().to_bits() >> 52;
    let scale = f64::from_bits(0x7fe_u64.saturating_sub(exponent) << 52);
    let flat: Vec<DVec2> = flat.iter().map(|p| (*p - low) * scale).collect();
    let outline = Outline::new(&flat, numbers);
    let points = outline.places.iter().map(|&corner| flat[corner]);
    let points: Vec<_> = points.map(|p| mitigate_underflow(Point2::new(p.x, p.y))).collect();
    let empty = Delaunay::bulk_load_cdt(points, Vec::new()).ok()?;
    let mut sides = outline.sides();
    for _ in 0..MOST_ROUNDS {
        let mut delaunay = empty.clone();
        match constrain(&mut delaunay, &sides, tolerance * scale)? {
            Constrained::Fully(edges) => return Some(outline.inside(&delaunay, &edges)),
            Constrained::ButFor(bent) => sides = bent,
        }
    }
    None
}

type Delaunay = ConstrainedDelaunayTriangulation<Point2<f64>>;

fn vertex(place: usize) -> FixedVertexHandle {
    FixedVertexHandle::from_index(place)
}

enum Constrained {
    /// All sides are edges.
    Fully(Vec<FixedDirectedEdgeHandle>),
    /// Some sides cross others within rounding; routed through the corners that they touch, they would not.
    ButFor(Vec<[usize; 2]>),
}

/// Makes edges of sides; `None` if some cross.
fn constrain(delaunay: &mut Delaunay, sides: &[[usize; 2]], tolerance: f64) -> Option<Constrained> {
    // Neighbouring sides cross the same edges. In a scattered order, few edges are crossed often.
    let mut order: Vec<usize> = (0..sides.len()).collect();
    order.sort_by_key(|&side| (side as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut edges = vec![Vec::new(); sides.len()];
    // By side, and by edge: the corners to route through.
    let mut through = vec![Vec::new(); sides.len()];
    let mut of_edge: Vec<(FixedUndirectedEdgeHandle, usize)> = Vec::new();
    let mut crossings = 0;
    for side in order {
        let [a, b] = sides[side];
        edges[side] = delaunay.try_add_constraint(vertex(a), vertex(b));
        if !edges[side].is_empty() {
            continue;
        }
        let before = crossings;
        for edge in delaunay.get_conflicting_edges_between_vertices(vertex(a), vertex(b)) {
            crossings += 1;
            let [p, q] = edge.vertices().map(|vertex| vertex.fix().index());
            let touching = [(p, [a, b], true), (q, [a, b], true), (a, [p, q], false), (b, [p, q], false)];
            let off = |(place, ends, bends_side): (usize, [usize; 2], bool)| {
                (distance(at(delaunay, place), ends.map(|end| at(delaunay, end))), place, bends_side)
            };
            let (off, place, bends_side) =
                touching.map(off).into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
            if off > tolerance || crossings > sides.len() {
                return None;
            }
            match bends_side {
                true => through[side].push(place),
                false => of_edge.push((edge.as_undirected().fix(), place)),
            }
        }
        if crossings == before {
            return None;
        }
    }
    if crossings == 0 {
        return Some(Constrained::Fully(edges.into_iter().flatten().collect()));
    }
    of_edge.sort_unstable_by_key(|(edge, place)| (edge.index(), *place));
    for (through, edges) in through.iter_mut().zip(&edges) {
        for edge in edges {
            let index = edge.as_undirected().index();
            let from = of_edge.partition_point(|(edge, _)| edge.index() < index);
            let here = of_edge[from..].iter().take_while(|(edge, _)| edge.index() == index);
            through.extend(here.map(|(_, place)| *place));
        }
    }
    let mut bent = Vec::with_capacity(sides.len() + of_edge.len());
    for (&[from, to], mut through) in sides.iter().zip(through) {
        let [start, end] = [from, to].map(|place| at(delaunay, place));
        let along = |place: &usize| (at(delaunay, *place) - start).dot(end - start);
        through.sort_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        through.dedup();
        through.push(to);
        let mut last = from;
        for place in through {
            if place != last {
                bent.push([last, place]);
            }
            last = place;
        }
    }
    Some(Constrained::ButFor(bent))
}

fn at(delaunay: &Delaunay, place: usize) -> DVec2 {
    let p = delaunay.vertex(vertex(place)).position();
    DVec2::new(p.x, p.y)
}

/// The distance of a point from a segment.
fn distance(p: DVec2, [from, to]: [DVec2; 2]) -> f64 {
    let along = to - from;
    let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    p.distance(from + along * share)
}

/// A polygon's corners, with coincident ones merged into places.
struct Outline<'a> {
    flat: &'a [DVec2],
    numbers: &'a [u32],
    /// The corners sorted by place, and the first of each place among them.
    sorted: Vec<usize>,
    first: Vec<usize>,
    /// The first corner in each place.
    places: Vec<usize>,
    /// The place of each corner.
    place: Vec<usize>,
    /// The previous and the next corner in another place, for each corner.
    before: Vec<usize>,
    after: Vec<usize>,
}

impl<'a> Outline<'a> {
    fn new(flat: &'a [DVec2], numbers: &'a [u32]) -> Self {
        let n = flat.len();
        let key = |corner: usize| (flat[corner].x, flat[corner].y);
        let mut sorted: Vec<usize> = (0..n).collect();
        sorted.sort_by(|&a, &b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let (mut first, mut places, mut place) = (Vec::new(), Vec::new(), vec![0; n]);
        for (i, &corner) in sorted.iter().enumerate() {
            if i == 0 || key(corner) != key(sorted[i - 1]) {
                first.push(i);
                places.push(corner);
            }
            place[corner] = places.len() - 1;
        }
        // Twice around, so that the predecessors of the first are known.
        let (mut before, mut after) = (vec![0; n], vec![0; n]);
        let (mut last, mut next) = (0, 0);
        for i in (0..n).chain(0..n) {
            let (neighbour, back) = ((i + n - 1) % n, n - 1 - i);
            last = if place[neighbour] == place[i] { last } else { neighbour };
            before[i] = last;
            let neighbour = (back + 1) % n;
            next = if place[neighbour] == place[back] { next } else { neighbour };
            after[back] = next;
        }
        Outline { flat, numbers, sorted, first, places, place, before, after }
    }

    /// The sides from place to place, once around.
    fn sides(&self) -> Vec<[usize; 2]> {
        let n = self.place.len();
        let sides = (0..n).map(|i| [self.place[i], self.place[(i + 1) % n]]);
        sides.filter(|[from, to]| from != to).collect()
    }

    /// The triangles inside the outline, given the edges of its sides.
    fn inside(&self, delaunay: &Delaunay, sides: &[FixedDirectedEdgeHandle]) -> Inside {
        let mut walked = vec![0_i64; delaunay.num_undirected_edges()];
        let sign = |edge: FixedDirectedEdgeHandle| match edge == edge.as_undirected().as_directed() {
            true => 1,
            false => -1,
        };
        for &edge in sides {
            walked[edge.as_undirected().index()] += sign(edge);
        }
        let walked = |edge: FixedDirectedEdgeHandle| sign(edge) * walked[edge.as_undirected().index()];
        let mut times = vec![None; delaunay.num_all_faces()];
        let outer = delaunay.outer_face();
        times[outer.index()] = Some(0_i64);
        // Edges whose left triangle has a known winding number.
        let mut edges: Vec<_> = delaunay.convex_hull().collect();
        while let Some(edge) = edges.pop() {
            let known = times[edge.face().index()].unwrap_or_default();
            let beyond = edge.rev().face();
            let Some(triangle) = beyond.as_inner() else { continue };
            if times[beyond.index()].is_none() {
                // The inside is on the left.
                times[beyond.index()] = Some(known - walked(edge.fix()));
                edges.extend(triangle.adjacent_edges());
            }
        }
        let mut inside = Inside { triangles: Vec::new(), once: true };
        for face in delaunay.inner_faces() {
            let times = times[face.index()].unwrap_or_default();
            inside.once &= (0..=1).contains(&times);
            let [a, b, c] = self.corners(face.vertices().map(|vertex| vertex.fix().index()));
            match times {
                0 => {}
                1.. => inside.triangles.push([a, b, c]),
                ..=-1 => inside.triangles.push([a, c, b]),
            }
        }
        inside
    }

    /// The corners of a triangle of places: among coincident corners, the one whose inside contains the triangle.
    fn corners(&self, places: [usize; 3]) -> [usize; 3] {
        let middle = places.iter().map(|&place| self.flat[self.places[place]]).sum::<DVec2>() / 3.0;
        places.map(|place| {
            let end = self.first.get(place + 1).copied().unwrap_or(self.sorted.len());
            let here = &self.sorted[self.first[place]..end];
            if here.iter().all(|&corner| self.numbers[corner] == self.numbers[here[0]]) {
                return here[0];
            }
            let asked = here.iter().take(MOST_ASKED).copied();
            asked.clone().find(|&corner| self.faces(corner, middle)).unwrap_or(here[0])
        })
    }

    /// Whether a point is between the two sides of a corner, on their left.
    fn faces(&self, corner: usize, point: DVec2) -> bool {
        let [before, at, after] = [self.before[corner], corner, self.after[corner]].map(|i| self.flat[i]);
        let left_of = |from: DVec2, to: DVec2| (to - from).perp_dot(point - from) > 0.0;
        let (in_first, in_second) = (left_of(before, at), left_of(at, after));
        match (at - before).perp_dot(after - at) >= 0.0 {
            true => in_first && in_second,
            false => in_first || in_second,
        }
    }
}
