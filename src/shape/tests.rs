//! Distances against results in double precision, over many rays: far, near, grazing, from inside, and at scales from
//! 10⁻⁶ to 10⁶. The processing of hits is tested in `tests/transport/hits.rs`.

use super::*;
use crate::math::lanes::scalar::Wrapping;
use crate::sampling::Stream;
use glam::{DAffine3, DVec3};
use rand::RngExt;

const U: f64 = UNIT_ROUNDOFF as f64;
const SCALES: [f64; 5] = [1e-6, 1e-2, 1.0, 300.0, 1e6];

fn wide(v: Vec3<f32>) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

fn narrow(v: DVec3) -> Vec3<f32> {
    Vec3::splat(v.to_array().map(|x| x as f32))
}

fn array(v: [f32; 3]) -> DVec3 {
    wide(Vec3::splat(v))
}

/// The sum of the magnitudes of a dot product's terms, to which its rounding errors are relative.
fn magnitudes(a: DVec3, b: DVec3) -> f64 {
    a.abs().dot(b.abs())
}

fn direction(stream: &mut Stream) -> DVec3 {
    let z = stream.random_range(-1.0..1.0_f64);
    let phi = stream.random_range(0.0..std::f64::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// The expected result for a ray, within the precision of rounded inputs.
enum Truth {
    /// A hit at this distance, within an error.
    Hit(f64, f64),
    /// No hit.
    Nothing,
    /// So close to an edge or to the origin that a rounding error decides.
    Doubtful,
}

/// The number of times each result occurred, so that a test can check that it covers all.
#[derive(Default, Debug)]
struct Tally {
    hits: u32,
    nothings: u32,
    doubtful: u32,
}

impl Tally {
    fn check(&mut self, got: f32, truth: Truth, what: impl Fn() -> String) {
        match truth {
            Truth::Hit(t, error) => {
                self.hits += 1;
                let off = (f64::from(got) - t).abs();
                assert!(off <= error, "{}: {got} is {off:e} off {t}, bound {error:e}", what());
            }
            Truth::Nothing => {
                self.nothings += 1;
                assert!(got == NOTHING, "{}: {got} where no hit is expected", what());
            }
            Truth::Doubtful => self.doubtful += 1,
        }
    }

    fn assert_covers_all(&self) {
        let all = self.hits + self.nothings + self.doubtful;
        assert!(self.hits > all / 10 && self.nothings > all / 10 && self.doubtful < all / 5, "{self:?}");
    }
}

/// Origins and directions around an object of a size at a position. Origins are inside, near and a million sizes away;
/// directions are random, towards the object, and towards its rim.
fn ray(stream: &mut Stream, place: DVec3, size: f64) -> Ray<f32> {
    let distance = size * [0.5, 1.5, 10.0, 1e3, 1e6][stream.random_range(0..5)];
    let o = narrow(place + direction(stream) * distance * stream.random::<f64>());
    let towards = (place - wide(o)).normalize_or(DVec3::X);
    let target = match stream.random_range(0..4) {
        0 => return Ray::new(o, narrow(direction(stream)).normalized()),
        1 => place + direction(stream) * size * stream.random::<f64>(),
        // Just inside and just outside the rim, as seen from the origin.
        2 => place + direction(stream).cross(towards).normalize() * size * stream.random_range(0.95..1.05),
        _ => place + towards.any_orthonormal_vector() * size * stream.random_range(0.9999..1.0001),
    };
    Ray::new(o, narrow((target - wide(o)).normalize_or(DVec3::Y)).normalized())
}

fn plane_truth(ray: &Ray<f32>, normal: [f32; 3], distance: f32) -> Truth {
    let (o, d, n) = (wide(ray.o), wide(ray.d), array(normal));
    let (numerator, denominator) = (f64::from(distance) - o.dot(n), d.dot(n));
    let numerator_error = 4.0 * U * (f64::from(distance).abs() + magnitudes(o, n));
    let denominator_error = 3.0 * U * magnitudes(d, n);
    if numerator.abs() <= numerator_error || denominator.abs() <= 4.0 * denominator_error {
        return Truth::Doubtful;
    }
    let t = numerator / denominator;
    if t < 0.0 {
        return Truth::Nothing;
    }
    let relative = denominator_error / denominator.abs();
    Truth::Hit(t, (numerator_error / denominator.abs() + t * relative) * 1.5 + t * U)
}

#[test]
fn plane_distances_match_double_precision() {
    let stream = &mut Stream::new(1, 0, 0);
    let mut tally = Tally::default();
    for scale in SCALES {
        for _ in 0..40_000 {
            let place = direction(stream) * scale * stream.random::<f64>() * 3.0;
            let normal = direction(stream);
            let n = narrow(normal);
            let plane = Plane { normal: [n.x, n.y, n.z], distance: normal.dot(place) as f32 };
            let ray = ray(stream, place, scale);
            let truth = plane_truth(&ray, plane.normal, plane.distance);
            tally.check(plane.intersect(&ray), truth, || format!("{plane:?} {ray:?}"));
        }
    }
    tally.assert_covers_all();
}

/// For a distant ray that passes near the rim, the discriminant is lost in the rounding of the ray itself. All other
/// results are accurate to a few roundings of their inputs.
fn sphere_truth(sphere: &Sphere, ray: &Ray<f32>) -> Truth {
    let (m, d) = (wide(ray.o) - array(sphere.centre), wide(ray.d));
    let r = f64::from(sphere.radius);
    // The ray's length differs from one by a rounding or two; the reference uses its actual length.
    let a = d.length_squared();
    let (b, c) = (m.dot(d) / a, (m.length_squared() - r * r) / a);
    let discriminant = b * b - c;
    let reach = m.length();
    let perpendicular = (m - d * b).length();
    // m − b·d is off by a few roundings of m, and its square by twice its length times as many.
    let m_error = U * (3.0 * reach + wide(ray.o).abs().max_element());
    let discriminant_error =
        2.0 * perpendicular * (4.0 * U * reach + m_error) + 4.0 * U * (perpendicular * perpendicular + r * r);
    let c_error = 2.0 * reach * m_error + 6.0 * U * (reach * reach + r * r);
    if discriminant < -discriminant_error {
        return Truth::Nothing;
    }
    if discriminant <= 4.0 * discriminant_error {
        return Truth::Doubtful;
    }
    let root = discriminant.sqrt();
    let q_error = 4.0 * U * reach + m_error + discriminant_error / root;
    let (inside, behind) = (c < -c_error, b > 0.0);
    if c.abs() <= c_error {
        return Truth::Doubtful;
    }
    if !inside && behind {
        return Truth::Nothing;
    }
    let q = b.abs() + root;
    // From outside the nearer root is c/q, and from inside, looking outwards, the only one; otherwise it is q.
    if inside && !behind {
        return Truth::Hit(q, 2.0 * q_error);
    }
    let t = c.abs() / q;
    Truth::Hit(t, 2.0 * (c_error / q + t * q_error / q) + 2.0 * U * t)
}

#[test]
fn sphere_distances_match_double_precision() {
    let stream = &mut Stream::new(2, 0, 0);
    let mut tally = Tally::default();
    for scale in SCALES {
        for _ in 0..80_000 {
            let place = narrow(direction(stream) * scale * [0.0, 3.0, 30.0][stream.random_range(0..3)]);
            let sphere = Sphere::new(wide(place), f64::from(scale as f32));
            let ray = ray(stream, wide(place), scale);
            let truth = sphere_truth(&sphere, &ray);
            tally.check(sphere.intersect(&ray), truth, || format!("{sphere:?} {ray:?}"));
        }
    }
    tally.assert_covers_all();
}

#[test]
fn quad_distances_match_double_precision_within_its_edges() {
    let stream = &mut Stream::new(3, 0, 0);
    let mut tally = Tally::default();
    for scale in SCALES {
        for _ in 0..80_000 {
            let corner = direction(stream) * scale * 2.0 * stream.random::<f64>();
            let (u, v) =
                (direction(stream) * scale, direction(stream) * scale * stream.random_range(0.3..3.0));
            // Not so oblique that the edges themselves lose their digits.
            if u.normalize().cross(v.normalize()).length() < 0.1 {
                continue;
            }
            let quad = Quad::new(corner, u, v);
            let ray = ray(stream, corner + (u + v) * 0.5, scale);
            let truth = match plane_truth(&ray, quad.normal, quad.distance) {
                Truth::Hit(t, error) => {
                    let p = wide(ray.o) + wide(ray.d) * t;
                    let n = u.cross(v);
                    let coordinate = |axis: DVec3| (p - corner).dot(axis) / n.length_squared();
                    let (a_axis, b_axis) = (v.cross(n), n.cross(u));
                    let (a, b) = (coordinate(a_axis), coordinate(b_axis));
                    // The position error along the ray and from rounding, in units of the edges.
                    let off = error + 8.0 * U * (wide(ray.o).length() + t + corner.length() + scale);
                    let margin = off * a_axis.length().max(b_axis.length()) / n.length_squared();
                    // Positive inside both pairs of edges, negative outside.
                    let inside = a.min(1.0 - a).min(b).min(1.0 - b);
                    match inside {
                        _ if inside.abs() <= margin => Truth::Doubtful,
                        _ if inside > 0.0 => Truth::Hit(t, error),
                        _ => Truth::Nothing,
                    }
                }
                other => other,
            };
            tally.check(quad.intersect(&ray), truth, || format!("{quad:?} {ray:?}"));
        }
    }
    tally.assert_covers_all();
}

#[test]
fn disk_distances_match_double_precision_within_the_rim() {
    let stream = &mut Stream::new(4, 0, 0);
    let mut tally = Tally::default();
    for scale in SCALES {
        for _ in 0..80_000 {
            let centre = direction(stream) * scale * 2.0 * stream.random::<f64>();
            let radius = scale * stream.random_range(0.3..3.0);
            let disk = Disk::new(centre, direction(stream), radius);
            let ray = ray(stream, centre, radius);
            let truth = match plane_truth(&ray, disk.normal, disk.distance) {
                Truth::Hit(t, error) => {
                    let p = wide(ray.o) + wide(ray.d) * t;
                    let largest = wide(ray.o).length() + t + centre.length() + radius;
                    // The position error, and the extension of the disk beyond its rim.
                    let margin = error + 8.0 * U * largest + overlap(centre.length() + radius, radius);
                    match radius - p.distance(centre) {
                        inside if inside.abs() <= margin => Truth::Doubtful,
                        inside if inside > 0.0 => Truth::Hit(t, error),
                        _ => Truth::Nothing,
                    }
                }
                other => other,
            };
            tally.check(disk.intersect(&ray), truth, || format!("{disk:?} {ray:?}"));
        }
    }
    tally.assert_covers_all();
}

/// As for a sphere across the axis; both roots are compared with the ends along it.
fn cylinder_truth(cylinder: &Cylinder, ray: &Ray<f32>) -> Truth {
    let axis = array(cylinder.axis).normalize();
    let (w, d) = (wide(ray.o) - array(cylinder.middle), wide(ray.d));
    let [r, half] = [cylinder.radius, cylinder.half].map(f64::from);
    let (m, e) = (w - axis * w.dot(axis), d - axis * d.dot(axis));
    let (a, b, c) = (e.dot(e), m.dot(e), m.length_squared() - r * r);
    // The rounding errors of both components.
    let (m_error, e_error) = (5.0 * U * w.length(), 4.0 * U);
    let nearest = m - e * (b / a);
    let discriminant = r * r - nearest.length_squared();
    let nearest_error = m_error + e_error * b.abs() / a + 3.0 * U * m.length();
    let discriminant_error = 2.0 * nearest.length() * nearest_error
        + nearest_error * nearest_error
        + 4.0 * U * (nearest.length_squared() + r * r);
    if discriminant < -discriminant_error {
        return Truth::Nothing;
    }
    if discriminant <= 4.0 * discriminant_error {
        return Truth::Doubtful;
    }
    let (root, e_share) = ((discriminant * a).sqrt(), e_error / a.sqrt());
    let q = -b - root.copysign(b);
    let b_error = m_error * a.sqrt() + e_error * m.length() + 3.0 * U * m.length() * a.sqrt();
    let q_error = b_error + root * (discriminant_error / discriminant + e_share) + 2.0 * U * q.abs();
    let c_error = 2.0 * m.length() * m_error + 4.0 * U * (m.length_squared() + r * r);
    let small = (c / q, c_error / q.abs() + (c / q).abs() * q_error / q.abs());
    let large = (q / a, q_error / a + (q / a).abs() * 2.0 * e_share);
    let mut roots = [small, large].map(|(t, error)| (t, 2.0 * error + 2.0 * U * t.abs()));
    roots.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (t, error) in roots {
        let inside = half - (w + d * t).dot(axis).abs();
        let margin = error * d.dot(axis).abs() + 8.0 * U * (w.length() + t.abs());
        if t < -error || inside < -margin {
            continue;
        }
        return if t > error && inside > margin { Truth::Hit(t, error) } else { Truth::Doubtful };
    }
    Truth::Nothing
}

#[test]
fn cylinder_distances_match_double_precision_between_the_ends() {
    let stream = &mut Stream::new(5, 0, 0);
    let mut tally = Tally::default();
    for scale in SCALES {
        for _ in 0..80_000 {
            let from = direction(stream) * scale * [0.0, 3.0, 30.0][stream.random_range(0..3)];
            let along = direction(stream) * scale * [0.1, 1.0, 10.0][stream.random_range(0..3)];
            let cylinder = Cylinder::new(from, from + along, scale);
            let place = from + along * stream.random::<f64>();
            let ray = ray(stream, place, scale);
            let truth = cylinder_truth(&cylinder, &ray);
            tally.check(cylinder.intersect(&ray), truth, || format!("{cylinder:?} {ray:?}"));
        }
    }
    tally.assert_covers_all();
}

#[test]
fn no_ray_escapes_from_a_box_or_a_capped_cylinder() {
    let stream = &mut Stream::new(6, 0, 0);
    type Distance<'a> = &'a dyn Fn(&Ray<f32>) -> f32;
    let met = |shapes: &[Distance<'_>], ray: &Ray<f32>| shapes.iter().any(|f| f(ray) < NOTHING);
    let (mut rays, mut out) = (0, 0);
    for scale in SCALES {
        for place in [0.0, 1.0, 10.0] {
            let middle = direction(stream) * scale * place;
            let size = DVec3::from([(); 3].map(|()| scale * stream.random_range(0.2..1.0)));
            let sides =
                Quad::sides(middle - size, middle + size).map(|side| move |ray: &_| side.intersect(ray));
            let (axis, radius) = (direction(stream), scale * stream.random_range(0.2..1.0));
            let ends = [-1.0, 1.0].map(|end| middle + axis * size.x * end);
            let disks = ends.map(|end| Disk::new(end, axis, radius)).map(|d| move |ray: &_| d.intersect(ray));
            let tube = Cylinder::new(ends[0], ends[1], radius);
            for _ in 0..30_000 {
                let from =
                    |within: f64, stream: &mut Stream| direction(stream) * within * stream.random::<f64>();
                // Towards an edge of the box,
                let mut to = DVec3::from([(); 3].map(|()| [-1.0, 1.0][stream.random_range(0..2)]));
                to[stream.random_range(0..3)] = stream.random_range(-1.0..1.0);
                let o = middle + from(size.min_element(), stream);
                let d = narrow(middle + size * to - wide(narrow(o))).normalized();
                let shapes = sides.each_ref().map(|side| side as &dyn Fn(&_) -> _);
                out += u32::from(!met(&shapes, &Ray::new(narrow(o), d)));
                // and towards a rim of the capped cylinder.
                let rim =
                    ends[stream.random_range(0..2)] + axis.cross(direction(stream)).normalize() * radius;
                let o = middle + from(radius.min(size.x), stream);
                let d = narrow(rim - wide(narrow(o))).normalized();
                let shapes = [&disks[0] as &dyn Fn(&_) -> _, &disks[1], &|ray| tube.intersect(ray)];
                out += u32::from(!met(&shapes, &Ray::new(narrow(o), d)));
                rays += 2;
            }
        }
    }
    assert!(rays >= 900_000 && out == 0, "{out} of {rays} rays escape");
}

#[test]
fn a_cylinder_is_open_at_its_ends() {
    let cylinder = Cylinder::new(DVec3::NEG_Z, DVec3::Z, 1.0);
    // From the side, from inside, away from it.
    assert_eq!(cylinder.intersect(&at([3.0, 0.0, 0.5], [-1.0, 0.0, 0.0])), 2.0);
    assert_eq!(cylinder.intersect(&at([0.5, 0.0, 0.5], [-1.0, 0.0, 0.0])), 1.5);
    assert_eq!(cylinder.intersect(&at([3.0, 0.0, 0.5], [1.0, 0.0, 0.0])), NOTHING);
    // Past the ends, and along the axis, inside and outside.
    assert_eq!(cylinder.intersect(&at([3.0, 0.0, 1.5], [-1.0, 0.0, 0.0])), NOTHING);
    for x in [0.0, 0.5, 1.0, 2.0] {
        assert_eq!(cylinder.intersect(&at([x, 0.0, 5.0], [0.0, 0.0, -1.0])), NOTHING);
    }
    // Down through the open end to the far side.
    let t = cylinder.intersect(&at([2.0, 0.0, 3.0], [-0.6, 0.0, -0.8]));
    assert!((t - 5.0).abs() < 1e-5 && cylinder.intersect(&at([0.0, 0.0, 3.0], [-0.6, 0.0, -0.8])) == NOTHING);
    // From the surface outwards there is no hit, and inwards the far side.
    assert_eq!(cylinder.intersect(&at([1.0, 0.0, 0.0], [1.0, 0.0, 0.0])), NOTHING);
    assert_eq!(cylinder.intersect(&at([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0])), 2.0);
}

#[test]
fn the_sides_of_a_box_face_outwards() {
    let (min, max) = (DVec3::new(1.0, -2.0, 3.0), DVec3::new(2.0, 2.0, 8.0));
    let middle = narrow((min + max) * 0.5);
    for side in Quad::sides(min, max) {
        let n = Vec3::<f32>::splat(side.normal);
        assert!(side.intersect(&Ray::new(middle, n)) < NOTHING && n.max_abs() == 1.0, "{side:?}");
        assert_eq!(side.intersect(&Ray::new(middle, -n)), NOTHING);
        // v runs along the last axis that lies in the side.
        let up = if n.z == 0.0 { side.v[2] } else { side.v[1] };
        assert!(up > 0.0 && side.v.iter().filter(|v| **v != 0.0).count() == 1, "{side:?}");
    }
}

#[test]
fn a_wrong_distance_is_detected() {
    // The error in the report: b² − 4c, where b is half the linear coefficient.
    let sphere = Sphere::new(DVec3::Z * 5.0, 1.0);
    let ray = Ray::new(Vec3::splat([0.3, 0.0, 0.0]), Vec3::splat([0.0, 0.0, 1.0]));
    let check = |got| {
        let one = || Tally::default().check(got, sphere_truth(&sphere, &ray), String::new);
        std::panic::catch_unwind(one).is_ok()
    };
    let right = sphere.intersect(&ray);
    assert!(check(right));
    assert!(!check(right * (1.0 + 1e-5)) && !check(NOTHING));
    let tube = Cylinder::new(DVec3::new(-2.0, 0.0, 5.0), DVec3::new(2.0, 0.0, 5.0), 1.0);
    let check = |got| {
        let one = || Tally::default().check(got, cylinder_truth(&tube, &ray), String::new);
        std::panic::catch_unwind(one).is_ok()
    };
    let right = tube.intersect(&ray);
    assert!(check(right) && !check(right * (1.0 + 1e-5)) && !check(NOTHING));
}

fn at(o: [f32; 3], d: [f32; 3]) -> Ray<f32> {
    Ray::new(Vec3::splat(o), Vec3::splat(d))
}

#[test]
fn a_root_at_or_before_the_origin_is_not_a_hit() {
    let plane = Plane { normal: [0.0, 0.0, 1.0], distance: -3.0 };
    let quad = Quad::new(DVec3::new(-1.0, -1.0, -3.0), DVec3::X * 2.0, DVec3::Y * 2.0);
    for (z, d, t) in [
        (-3.0, 1.0, NOTHING),
        (-3.0, -1.0, NOTHING),
        (-2.0, 1.0, NOTHING),
        (-2.0, -1.0, 1.0),
        (-5.0, 1.0, 2.0),
        (-5.0, -1.0, NOTHING),
    ] {
        assert_eq!(plane.intersect(&at([0.5, 0.5, z], [0.0, 0.0, d])), t, "plane from {z}");
        assert_eq!(quad.intersect(&at([0.5, 0.5, z], [0.0, 0.0, d])), t, "quad from {z}");
    }
    let sphere = Sphere::new(DVec3::X * 2.0, 1.0);
    for (x, d, t) in [
        (0.0, 1.0, 1.0),
        (0.0, -1.0, NOTHING),
        (1.0, -1.0, NOTHING),
        // On the surface the near root is not a hit, so that the far one counts.
        (1.0, 1.0, 2.0),
        (3.0, -1.0, 2.0),
        (3.0, 1.0, NOTHING),
        (2.0, 1.0, 1.0),
        (2.0, -1.0, 1.0),
        (4.0, 1.0, NOTHING),
    ] {
        assert_eq!(sphere.intersect(&at([x, 0.0, 0.0], [d, 0.0, 0.0])), t, "sphere from {x} towards {d}");
    }
}

#[test]
fn a_ray_parallel_to_a_flat_surface_has_no_hit() {
    let plane = Plane { normal: [0.0, 0.0, 1.0], distance: 2.0 };
    let quad = Quad::new(DVec3::new(0.0, 0.0, 2.0), DVec3::X, DVec3::Y);
    for z in [1.0, 2.0, 3.0] {
        for d in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, -0.0]] {
            assert_eq!(plane.intersect(&at([0.5, 0.5, z], d)), NOTHING);
            assert_eq!(quad.intersect(&at([0.5, 0.5, z], d)), NOTHING);
        }
    }
}

#[test]
fn areas_match_geometry() {
    let plane = Plane { normal: [0.0, 1.0, 0.0], distance: 0.0 };
    assert_eq!(plane.surface().area, f32::INFINITY);
    let sphere = Sphere::new(DVec3::ONE, 2.0);
    assert!((sphere.surface().area - 16.0 * std::f32::consts::PI).abs() < 1e-5);
    // 3 × 2 with an angle of 30° between.
    let oblique = Quad::new(DVec3::ZERO, DVec3::X * 3.0, DVec3::new(3.0_f64.sqrt(), 1.0, 0.0));
    assert!((oblique.surface().area - 3.0).abs() < 1e-6);
    assert_eq!(oblique.surface().normal, [0.0, 0.0, 1.0]);
    let disk = Disk::new(DVec3::ONE, DVec3::Y, 2.0);
    assert!((disk.surface().area / (4.0 * std::f32::consts::PI) - 1.0).abs() < 1e-5);
    let cylinder = Cylinder::new(DVec3::ONE, DVec3::new(1.0, 4.0, 5.0), 2.0);
    assert!((cylinder.surface().area / (20.0 * std::f32::consts::PI) - 1.0).abs() < 1e-5);
    // The extension beyond the edges is invisible, however far away they are.
    let far = Quad::sides(DVec3::splat(1e9), DVec3::splat(1e9 + 1.0));
    assert!(far.iter().all(|side| side.surface().area < 1.001), "{far:?}");
}

#[test]
fn triangles_of_all_sizes_are_hit() {
    for exponent in -12..=18 {
        let size = 10_f64.powi(exponent);
        let corners = [DVec3::ZERO, DVec3::X * size, DVec3::Y * size].map(narrow);
        let target = DVec3::new(0.25, 0.25, 0.0) * size;
        for d in [DVec3::NEG_Z, DVec3::new(0.6, 0.0, -0.8), DVec3::new(0.0, -0.8, -0.6)] {
            let ray = Ray::new(narrow(target - d * size), narrow(d));
            let met = ShearedRays::new(&ray).intersect(corners, true);
            assert!((f64::from(met.t) / size - 1.0).abs() < 1e-5, "10^{exponent}: {met:?}");
            assert!(met.weights.iter().all(|w| (w - 0.25).abs() < 1e-5), "10^{exponent}: {met:?}");
            let beside = Ray::new(narrow(target * 3.0 - d * size), narrow(d));
            assert_eq!(ShearedRays::new(&beside).intersect(corners, true).t, NOTHING, "10^{exponent}");
        }
    }
}

#[test]
fn an_offset_origin_lies_on_the_side_that_the_direction_points_to() {
    let n = Vec3::<f32>::splat([0.0, 0.0, 1.0]);
    let origin = |z| offset_origin(Vec3::splat([1.0, 2.0, 3.0]), n, 0.25, Vec3::splat([0.6, 0.0, z]));
    assert_eq!(origin(0.8), Vec3::splat([1.0, 2.0, 3.25]));
    assert_eq!(origin(-0.8), Vec3::splat([1.0, 2.0, 2.75]));
}

/// The samples stand for all kinds: a new one without a sample would be left out of every test that uses them.
#[test]
fn there_is_one_sample_of_every_kind() {
    use crate::parameter::Family;
    let all = samples::samples();
    let declared = AnyShape::DECLARATIONS.iter().map(|declaration| declaration.name);
    for name in declared.chain(["mesh"]) {
        let count = all.iter().filter(|(sample, _)| *sample == name).count();
        assert_eq!(count, 1, "{name}: its sample has to be in tests/common/shapes.rs");
    }
    for (name, shape) in &all {
        let declared = shape.place().map_or("mesh", |place| AnyShape::DECLARATIONS[place].name);
        assert_eq!(declared, *name);
    }
}

/// Hits of custom shapes have a normal of length one and finite numbers everywhere, also where the surface has no normal
/// or uv converge: in the middle, on the axes through it, and at the corners and the centres of the sides of the bounds.
#[test]
fn custom_shapes_have_a_normal_and_finite_uv_everywhere() {
    let stream = &mut Stream::new(12, 0, 0);
    let mut points = 0;
    for (name, shape) in samples::samples() {
        for scale in SCALES {
            let place = DAffine3::from_scale(DVec3::splat(scale));
            let custom = samples::placed(&shape, &place).0.into_iter().flat_map(|shape| shape.pieces());
            for piece in custom.filter(|piece| matches!(piece, Piece::Custom(_))) {
                let (surface, bounds) = (piece.surface(), piece.bounds());
                let SurfaceKind::Custom(kind) = surface.kind else { panic!("{name}: {:?}", surface.kind) };
                let (kind, form) = (Wrapping(kind.number()), surface.custom_surface());
                let [low, high] = [array(bounds.low), array(bounds.high)];
                let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
                let steps = [-1.0, 0.0, 1.0];
                let grid = steps.map(|x| steps.map(|y| steps.map(|z| DVec3::new(x, y, z))));
                let mut all: Vec<Vec3<f32>> = grid
                    .as_flattened()
                    .as_flattened()
                    .iter()
                    .map(|step| narrow(middle + half * *step))
                    .collect();
                all.push(form.anchor);
                for axis in [form.axis, form.u_axis, form.v_axis] {
                    all.extend([-0.5, 1e-3, 1.0].map(|t| form.anchor + axis * (t * scale as f32)));
                }
                all.extend((0..1000).map(|_| narrow(middle + half * direction(stream))));
                for p in all {
                    points += 1;
                    let (n, distance) = form.point(kind, p);
                    assert!((n.length() - 1.0).abs() < 1e-5, "{name} at {p:?}: normal {n:?}");
                    let [u, v] = form.uv(kind, p, n);
                    let [a, b] = form.uv_gradients(kind, p);
                    let tangent = form.tangent(kind, p);
                    let area = form.uv_per_area(kind, p);
                    let vectors =
                        [a, b, tangent].iter().all(|d| d.x.is_finite() && d.y.is_finite() && d.z.is_finite());
                    let numbers = [distance, u, v, area].iter().all(|x| x.is_finite());
                    assert!(
                        vectors && numbers && area >= 0.0,
                        "{name} at {p:?}: {n:?}, {distance}, {u}, {v}, {area}"
                    );
                }
            }
        }
    }
    assert!(points > 10_000, "{points}");
}
