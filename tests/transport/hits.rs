//! Hits: points, normals and uv, and rays that leave the surface.

use crate::common;
use crate::common::scenes::*;
use crate::common::shapes::{bounded_samples, placed, unbounded_samples};
use glam::{DAffine3, DQuat, DVec3};
use rand::RngExt;
use stride::integrator::Event;
use stride::math::{Frame, Ray, Vec3};
use stride::sampling::{Region, Stream};
use stride::scene::{
    CylinderParameters, DiskParameters, Entity, PlaneParameters, QuadParameters, Scene, Shape,
    SphereParameters,
};
use stride::shape::{CustomShape, Cylinder, NOTHING, offset_origin};
use stride::world::{AcceleratorChoice, CompiledScene, Hit, SurfacePoint, World, compile};

fn wide(v: Vec3<f32>) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

fn array(v: [f32; 3]) -> DVec3 {
    wide(Vec3::splat(v))
}

fn narrow(v: DVec3) -> Vec3<f32> {
    Vec3::splat(v.to_array().map(|x| x as f32))
}

fn ray(o: DVec3, d: DVec3) -> Ray<f32> {
    Ray::new(narrow(o), narrow(d.normalize()).normalized())
}

fn direction(stream: &mut Stream) -> DVec3 {
    let z = stream.random_range(-1.0..1.0_f64);
    let phi = stream.random_range(0.0..std::f64::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    v(r * phi.cos(), r * phi.sin(), z)
}

/// A scene of one surface.
struct Alone {
    tables: CompiledScene,
    world: World,
}

impl Alone {
    fn new(entity: Entity) -> Alone {
        let (tables, surfaces) = compile(&scene(vec![matte([0.5; 3])], vec![entity]), 16, 16).unwrap();
        Alone { tables, world: World::new(&surfaces, AcceleratorChoice::Simple) }
    }

    fn meet(&self, ray: &Ray<f32>) -> Option<SurfacePoint<f32>> {
        let hit = self.world.intersect(ray, true);
        hit.is_some().then(|| self.tables.surfaces.point(ray, &hit))
    }

    fn uv(&self, ray: &Ray<f32>) -> [f32; 2] {
        self.uv_at(&self.meet(ray).expect("a hit"))
    }

    fn uv_at(&self, point: &SurfacePoint<f32>) -> [f32; 2] {
        self.tables.surfaces.uv(point, Hit::<f32>::none().instance, true)
    }
}

fn close(a: [f32; 2], b: [f32; 2]) {
    assert!((a[0] - b[0]).abs() < 2e-6 && (a[1] - b[1]).abs() < 2e-6, "{a:?} is not {b:?}");
}

#[test]
fn a_planes_uv_are_lengths_from_its_point_nearest_the_origin() {
    let down = DVec3::NEG_Z;
    let floor = Alone::new(plane(DVec3::Z, -3.0, 0));
    close(floor.uv(&ray(v(2.5, -1.25, 0.0), down)), [2.5, -1.25]);
    close(floor.uv(&ray(v(-0.5, 7.0, -5.0), DVec3::Z)), [-0.5, 7.0]);
    // For any plane: the foot of the perpendicular from the origin has uv (0, 0), and uv are distances along the axes
    // of Duff's frame.
    let stream = &mut Stream::new(5, 0, 0);
    for _ in 0..100 {
        let n = direction(stream);
        let tilted = Alone::new(plane(n, 2.0, 0));
        let n32 = narrow(n);
        let frame = Frame::around(n32);
        let (a, b) = (stream.random_range(-5.0..5.0_f64), stream.random_range(-5.0..5.0_f64));
        let target = n * 2.0 + wide(frame.s) * a + wide(frame.t) * b;
        let [u, w] = tilted.uv(&ray(target + n * 3.0 + direction(stream), -n));
        let seen = tilted.meet(&ray(target + n * 3.0, -n)).unwrap();
        let foot = tilted.uv(&ray(DVec3::ZERO, n));
        assert!(foot[0].abs() < 1e-6 && foot[1].abs() < 1e-6, "{foot:?}");
        let [su, sv] = tilted.uv_at(&seen);
        assert!((f64::from(su) - a).abs() < 1e-5 && (f64::from(sv) - b).abs() < 1e-5);
        assert!((f64::from(u) - a).abs() < 1.01 && (f64::from(w) - b).abs() < 1.01);
    }
}

#[test]
fn a_spheres_uv_are_its_angles() {
    let ball = Alone::new(sphere(v(5.0, 0.0, 0.0), 2.0, 0));
    let from = |d: DVec3| ball.uv(&ray(v(5.0, 0.0, 0.0) + d * 4.0, -d));
    close(from(DVec3::X), [0.0, 0.5]);
    close(from(DVec3::Y), [0.25, 0.5]);
    close(from(DVec3::NEG_X), [0.5, 0.5]);
    close(from(DVec3::NEG_Y), [0.75, 0.5]);
    close(from(DVec3::Z), [0.0, 0.0]);
    close(from(DVec3::NEG_Z), [0.0, 1.0]);
    close(from(v(1.0, 1.0, 2.0_f64.sqrt()).normalize()), [0.125, 0.25]);
    // They are the same from inside and with flipped normals.
    close(ball.uv(&ray(v(5.0, 0.0, 0.0), DVec3::Y)), [0.25, 0.5]);
    let turned = Alone::new(flipped(sphere(v(5.0, 0.0, 0.0), 2.0, 0)));
    close(turned.uv(&ray(v(5.0, 0.0, 0.0), DVec3::Y)), [0.25, 0.5]);
}

#[test]
fn a_quads_uv_run_from_zero_to_one_along_its_edges() {
    let (corner, u, w) = (v(1.0, 2.0, 3.0), v(2.0, 0.0, 0.0), v(1.0, 4.0, 0.0));
    let sheet = Alone::new(quad(corner, u, w, 0));
    for (a, b) in [(0.5, 0.5), (0.1, 0.9), (0.75, 0.001), (0.999, 0.3)] {
        let target = corner + u * a + w * b;
        close(sheet.uv(&ray(target + DVec3::Z, DVec3::NEG_Z)), [a as f32, b as f32]);
    }
    for (a, b) in [(-0.001, 0.5), (1.001, 0.5), (0.5, -0.001), (0.5, 1.001)] {
        let target = corner + u * a + w * b;
        assert!(sheet.meet(&ray(target + DVec3::Z, DVec3::NEG_Z)).is_none());
    }
}

#[test]
fn a_disks_uv_are_its_angle_and_the_distance_from_its_centre() {
    let plate = Alone::new(disk(v(1.0, 2.0, 3.0), DVec3::Z, 2.0, 0));
    for (turns, share) in [(0.125, 0.5), (0.0, 0.25), (0.75, 0.999), (0.4, 0.01)] {
        let angle: f64 = turns * std::f64::consts::TAU;
        let target = v(1.0, 2.0, 3.0) + v(angle.cos(), angle.sin(), 0.0) * 2.0 * share;
        for d in [DVec3::NEG_Z, DVec3::Z] {
            let [u, w] = plate.uv(&ray(target - d, d));
            // Near the centre an angle has few digits.
            let off = (f64::from(u) - turns).abs();
            assert!(off.min(1.0 - off) < 1e-6 / share, "{u} is not {turns}");
            assert!((f64::from(w) - share).abs() < 2e-6, "{w} is not {share}");
        }
        assert!(plate.meet(&ray(target + v(angle.cos(), angle.sin(), 1.0) * 2.0, DVec3::NEG_Z)).is_none());
    }
}

#[test]
fn a_cylinders_uv_are_its_angle_and_relative_length() {
    let (from, to) = (v(1.0, 2.0, 3.0), v(1.0, 2.0, 7.0));
    let pillar = Alone::new(cylinder(from, to, 2.0, 0));
    for (turns, share) in [(0.125, 0.5), (0.25, 0.001), (0.75, 0.999), (0.4, 0.25)] {
        let angle: f64 = turns * std::f64::consts::TAU;
        let (out, on_axis) = (v(angle.cos(), angle.sin(), 0.0), from.lerp(to, share));
        close(pillar.uv(&ray(on_axis + out * 5.0, -out)), [turns as f32, share as f32]);
        close(pillar.uv(&ray(on_axis, out)), [turns as f32, share as f32]);
    }
    let turned = Alone::new(flipped(cylinder(from, to, 2.0, 0)));
    close(turned.uv(&ray(v(9.0, 2.0, 4.0), DVec3::NEG_X)), [0.0, 0.25]);
    // For any axis, u increases counter-clockwise as seen from its end, starting at the first axis of Duff's frame.
    let axis = v(0.6, -0.48, 0.64);
    let frame = Frame::around(narrow(axis));
    let tilted = Alone::new(cylinder(from, from + axis * 3.0, 2.0, 0));
    close(tilted.uv(&ray(from + axis * 0.75, wide(frame.s) + wide(frame.t))), [0.125, 0.25]);
}

#[test]
fn a_boxs_uv_cover_each_side_upright() {
    let crate_ = Alone::new(cuboid(v(1.0, 2.0, 3.0), v(3.0, 6.0, 4.0), 0));
    let middle = v(2.0, 4.0, 3.5);
    // Seen from outside, u increases to the right and v upwards; up is z, or y on the top and the bottom.
    for (n, up) in [
        (DVec3::X, DVec3::Z),
        (DVec3::NEG_X, DVec3::Z),
        (DVec3::Y, DVec3::Z),
        (DVec3::NEG_Y, DVec3::Z),
        (DVec3::Z, DVec3::Y),
        (DVec3::NEG_Z, DVec3::Y),
    ] {
        let size = v(2.0, 4.0, 1.0);
        for (a, b) in [(0.5, 0.5), (0.25, 0.75), (0.999, 0.001)] {
            let target = middle + (n * 0.5 + up.cross(n) * (a - 0.5) + up * (b - 0.5)) * size;
            // A side extends beyond its edges by a few ulp.
            let [u, w] = crate_.uv(&ray(target + n, -n)).map(f64::from);
            assert!((u - a).abs() < 1e-5 && (w - b).abs() < 1e-5, "({u}, {w}) is not ({a}, {b})");
            assert_eq!(wide(crate_.meet(&ray(target + n, -n)).unwrap().n), n);
        }
    }
    // One entity, whichever side is hit.
    assert!((0..6).all(|row| crate_.tables.surfaces.entity(row) == 0));
}

#[test]
fn normals_are_outward_from_either_side_and_flip_reverses_them() {
    let outward = |entity: Entity, o: DVec3, d: DVec3| wide(Alone::new(entity).meet(&ray(o, d)).unwrap().n);
    let floor = || plane(DVec3::Z, -3.0, 0);
    let sheet = || quad(v(-1.0, -1.0, -3.0), DVec3::X * 2.0, DVec3::Y * 2.0, 0);
    let ball = || sphere(v(0.0, 0.0, -3.0), 1.0, 0);
    for (z, d) in [(0.0, DVec3::NEG_Z), (-6.0, DVec3::Z)] {
        let o = v(0.1, 0.2, z);
        assert_eq!(outward(floor(), o, d), DVec3::Z);
        assert_eq!(outward(flipped(floor()), o, d), DVec3::NEG_Z);
        assert_eq!(outward(sheet(), o, d), DVec3::Z);
        assert_eq!(outward(flipped(sheet()), o, d), DVec3::NEG_Z);
    }
    assert_eq!(outward(ball(), DVec3::ZERO, DVec3::NEG_Z), DVec3::Z);
    assert_eq!(outward(flipped(ball()), DVec3::ZERO, DVec3::NEG_Z), DVec3::NEG_Z);
    let pipe = || cylinder(v(-1.0, 0.0, -3.0), v(1.0, 0.0, -3.0), 1.0, 0);
    let crate_ = || cuboid(v(-1.0, -1.0, -4.0), v(1.0, 1.0, -2.0), 0);
    let plate = || disk(v(0.0, 0.0, -2.0), DVec3::Z, 1.0, 0);
    for thing in [pipe, crate_, plate] as [fn() -> Entity; 3] {
        assert_eq!(outward(thing(), DVec3::ZERO, DVec3::NEG_Z), DVec3::Z);
        assert_eq!(outward(flipped(thing()), DVec3::ZERO, DVec3::NEG_Z), DVec3::NEG_Z);
        assert_eq!(outward(thing(), v(0.0, 0.0, -3.0), DVec3::Z), DVec3::Z);
    }
    // From inside, outward is still away from the centre.
    assert_eq!(outward(ball(), v(0.0, 0.0, -3.0), DVec3::Z), DVec3::Z);
    assert_eq!(outward(flipped(ball()), v(0.0, 0.0, -3.0), DVec3::Z), DVec3::NEG_Z);
}

/// A scene with every kind of surface.
fn medley() -> Scene {
    let mut entities = vec![
        plane(v(0.1, 0.2, 1.0).normalize(), -3.0, 0),
        plane(v(0.0, 1.0, 0.0), -9.0, 0),
        sphere(v(8.0, 3.0, -1.0), 2.0, 0),
        sphere(v(0.0, 0.0, 0.0), 20.0, 0),
    ];
    let bounded = bounded_samples(DVec3::ZERO, 4.0);
    for (i, (_, shape)) in bounded.iter().enumerate() {
        let (sin, cos) = (i as f64 / bounded.len() as f64 * std::f64::consts::TAU).sin_cos();
        let shapes = placed(shape, &DAffine3::from_translation(v(cos, sin, 0.3 * cos) * 6.0)).0;
        entities.extend(shapes.into_iter().map(|shape| entity(shape, 0)));
    }
    scene(vec![matte([0.5; 3])], entities)
}

#[test]
fn occlusion_agrees_with_the_first_hit() {
    let world = World::new(&compile(&medley(), 16, 16).unwrap().1, AcceleratorChoice::Simple);
    let stream = &mut Stream::new(6, 0, 0);
    let mut seen = [0; 2];
    for _ in 0..200_000 {
        let ray = ray(direction(stream) * stream.random_range(0.0..30.0), direction(stream));
        let t = world.intersect(&ray, true).t;
        for t_max in [t, t.next_up(), t.next_down(), t * stream.random_range(0.5..2.0), 5.0, NOTHING] {
            let occluded = world.occluded(&ray, t_max, true, false);
            assert_eq!(occluded, t < t_max, "{ray:?}: nearest {t}, limit {t_max}");
            seen[usize::from(occluded)] += 1;
        }
    }
    assert!(seen.iter().all(|&n| n > 100_000), "{seen:?}");
}

/// The power of a point with respect to a sphere, as defined by the sphere's own numbers.
fn power(ball: &stride::shape::Sphere, p: DVec3) -> f64 {
    let w = p - array(ball.anchor);
    w.dot(w - 2.0 * array(ball.to_centre)) + f64::from(ball.anchor_power)
}

/// The only surface, which is a cylinder.
fn tube(alone: &Alone) -> Cylinder {
    let CustomShape::Cylinder(tube) = alone.world.simple.custom[0].0 else { unreachable!("no cylinder") };
    tube
}

/// The vector from the axis of a cylinder to a point, as defined by its own numbers.
fn across(tube: &Cylinder, p: DVec3) -> DVec3 {
    (p - array(tube.middle)).reject_from(array(tube.axis))
}

/// Statistics of rays that leave a surface.
#[derive(Default, Debug)]
struct Leaving {
    rays: u32,
    /// The largest distance of a point from its surface, relative to its error bound.
    used: f64,
    /// The largest error bound, in roundings (2⁻²⁴) of the largest number involved.
    roundings: f64,
}

/// Rays leave hits of one surface on both sides, in every direction down to 10⁻⁷ above the horizon; none may hit the
/// surface where it started.
fn leave(shape: Shape, size: f64, near: DVec3, hits: u32, stream: &mut Stream) -> Leaving {
    let alone = Alone::new(entity(shape.clone(), 0));
    let mut seen = Leaving::default();
    while seen.rays < hits * 8 {
        let distance = size * 10_f64.powf(stream.random_range(-2.0..4.0));
        let target = near + direction(stream) * size * stream.random::<f64>();
        let o = target + direction(stream) * distance;
        let Some(point) = alone.meet(&ray(o, target - o)) else { continue };
        // Over a distance of many sizes, a tangential error can carry a hit beyond the scene's own scale.
        if wide(point.p - narrow(near)).length() > 20.0 * size {
            continue;
        }
        let p = wide(point.p);
        let (off, largest) = match shape {
            Shape::Plane(PlaneParameters { normal, distance }) => {
                let n = wide(narrow(normal));
                // The plane is defined by its rounded numbers.
                let distance = f64::from(distance as f32);
                (p.dot(n) - distance, distance.abs().max(p.abs().max_element()))
            }
            Shape::Quad(QuadParameters { corner, u, v }) => {
                let n = wide(point.n);
                let distance = f64::from(u.cross(v).normalize().dot(corner) as f32);
                (p.dot(n) - distance, distance.abs().max(p.abs().max_element()))
            }
            Shape::Sphere(SphereParameters { center, radius }) => {
                let ball = alone.world.simple.spheres[0].0;
                // The centre of a wall is far away, and no relevant number is as large.
                let largest = match array(ball.to_centre) {
                    DVec3::ZERO => center.abs().max_element().max(radius),
                    _ => array(ball.anchor).abs().max_element(),
                };
                (power(&ball, p) / (2.0 * radius), largest.max(p.abs().max_element()))
            }
            Shape::Disk(DiskParameters { center, normal, .. }) => {
                let n = wide(narrow(normal));
                let distance = f64::from(normal.dot(center) as f32);
                (p.dot(n) - distance, distance.abs().max(p.abs().max_element()))
            }
            Shape::Cylinder(_) => {
                let tube = tube(&alone);
                let largest = array(tube.middle).abs().max_element() + f64::from(tube.radius + tube.half);
                (across(&tube, p).length() - f64::from(tube.radius), largest.max(p.abs().max_element()))
            }
            ref other => panic!("the distance of a point from {other:?} has to be stated here"),
        };
        let error = f64::from(point.error);
        seen.used = seen.used.max(off.abs() / error);
        seen.roundings = seen.roundings.max(error / largest * 16_777_216.0);
        let frame = Frame::around(point.n);
        for i in 0..8 {
            let cos = match i % 4 {
                0 => stream.random_range(0.0..1.0_f64),
                1 => stream.random_range(0.0..0.01),
                _ => 10_f64.powf(stream.random_range(-7.0..0.0)),
            } * if i < 4 { 1.0 } else { -1.0 };
            let (sin, phi) = ((1.0 - cos * cos).sqrt(), stream.random_range(0.0..std::f64::consts::TAU));
            let d = frame.to_world(narrow(v(sin * phi.cos(), sin * phi.sin(), cos))).normalized();
            let away = Ray::new(offset_origin(point.p, point.n, point.error, d), d);
            seen.rays += 1;
            let t = alone.world.intersect(&away, true).t;
            let inward = matches!(shape, Shape::Sphere(_)) && point.n.dot(d) < 0.0;
            match shape {
                Shape::Sphere(_) if inward => {
                    // Into a sphere, a ray hits the other end of the chord that it starts inside.
                    let ball = alone.world.simple.spheres[0].0;
                    let inside = -power(&ball, wide(away.o));
                    assert!(inside > 0.0, "{shape:?}: {away:?} starts outside by {inside:e}");
                    let m = wide(away.o) - array(ball.anchor) - array(ball.to_centre);
                    let b = m.dot(wide(away.d).normalize());
                    // c/q for the smaller root.
                    let root = (b * b + inside).sqrt();
                    let chord = if b > 0.0 { inside / (root + b) } else { root - b };
                    let t = f64::from(t);
                    assert!((0.5 * chord..=2.0 * chord).contains(&t), "{shape:?} {away:?}: {t}, not {chord}");
                }
                Shape::Cylinder(_) if point.n.dot(d) < 0.0 => {
                    // The same in a cylinder, unless the ray leaves through an end.
                    let tube = tube(&alone);
                    let (m, d) = (across(&tube, wide(away.o)), wide(away.d));
                    let e = d.reject_from(array(tube.axis));
                    let inside = f64::from(tube.radius).powi(2) - m.length_squared();
                    assert!(inside > 0.0, "{shape:?}: {away:?} starts outside by {inside:e}");
                    let (a, b) = (e.length_squared(), m.dot(e));
                    let root = (b * b + a * inside).sqrt();
                    let chord = if b > 0.0 { inside / (root + b) } else { (root - b) / a };
                    let t = f64::from(t);
                    let is_met = (0.5 * chord..=2.0 * chord).contains(&t);
                    assert!(is_met || t.is_infinite(), "{shape:?} {away:?}: {t}, not {chord}");
                }
                _ => assert!(t == NOTHING, "{shape:?}: {away:?} hits its own surface at {t}"),
            }
        }
    }
    seen
}

#[test]
fn rays_that_leave_a_surface_never_hit_it_at_their_origin() {
    let stream = &mut Stream::new(7, 0, 0);
    let mut total = 0;
    for scale in [1e-4, 1e-2, 1.0, 1e2, 1e5] {
        for place in [0.0, 1.0, 30.0, 1e3] {
            let near = direction(stream) * scale * place;
            let (normal, e) = (direction(stream), direction(stream));
            // Every kind, turned. Meshes have a test of their own, and the sides of a box are quads.
            let turn = DQuat::from_axis_angle(normal, stream.random_range(0.0..6.0));
            let place = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turn, near);
            let bounded = bounded_samples(DVec3::ZERO, 1.0);
            let kinds = bounded.into_iter().chain(unbounded_samples()).map(|(_, shape)| shape);
            let kinds = kinds.filter(|shape| !matches!(shape, Shape::Mesh { .. }));
            let turned = kinds.map(|shape| placed(&shape, &place).0.swap_remove(0));
            let special = [
                Shape::Plane(PlaneParameters { normal: DVec3::Z, distance: near.z }),
                Shape::Quad(QuadParameters {
                    corner: near,
                    u: e * scale,
                    v: e.any_orthogonal_vector() * scale * 0.7,
                }),
                Shape::Quad(QuadParameters { corner: near, u: DVec3::X * scale, v: DVec3::Y * scale }),
                Shape::Disk(DiskParameters { center: near, normal: DVec3::Y, radius: 0.1 * scale }),
                Shape::Cylinder(CylinderParameters {
                    from: near - e * 5.0 * scale,
                    to: near + e * 5.0 * scale,
                    radius: 0.1 * scale,
                }),
                Shape::Cylinder(CylinderParameters {
                    from: near,
                    to: near + DVec3::X * 0.1 * scale,
                    radius: scale,
                }),
                // From close up, almost at a grazing angle.
                Shape::Sphere(SphereParameters { center: near + e * scale * 1e3, radius: scale * 1e3 }),
            ];
            for shape in turned.chain(special) {
                let seen = leave(shape.clone(), scale, near, 2000, stream);
                total += seen.rays;
                assert!(seen.used < 0.5, "{shape:?}: the bound has no margin, {seen:?}");
                // A larger bound would move rays visibly.
                assert!(seen.roundings < 40.0, "{shape:?}: the bound is too large, {seen:?}");
            }
        }
    }
    assert!(total >= 1_000_000, "{total} rays");
}

#[test]
fn a_bound_that_is_too_small_is_detected() {
    // The same rays with a hundredth of the bound.
    let alone = Alone::new(plane(v(0.3, 0.5, 0.8).normalize(), 7.0, 0));
    let stream = &mut Stream::new(8, 0, 0);
    let mut met = 0;
    for _ in 0..20_000 {
        let o = direction(stream) * 30.0;
        let Some(point) = alone.meet(&ray(o, direction(stream))) else { continue };
        let frame = Frame::around(point.n);
        let phi = stream.random_range(0.0..std::f64::consts::TAU);
        let d = frame.to_world(narrow(v(phi.cos(), phi.sin(), 1e-3))).normalized();
        let away = Ray::new(offset_origin(point.p, point.n, point.error * 0.01, d), d);
        met += u32::from(alone.world.intersect(&away, true).t != NOTHING);
    }
    assert!(met > 100, "only {met}");
}

/// The smallpt box with identical surfaces.
fn furnace(mut box_: Scene, material: stride::scene::Material) -> Scene {
    for entity in &mut box_.entities {
        entity.material = 0;
        entity.emission = [1.0; 3];
    }
    box_.materials = vec![material];
    box_
}

#[test]
fn a_box_of_huge_spheres_is_a_perfect_furnace() {
    // Every surface emits 1 and reflects ½, both exact in floats: each path of d bounces has the radiance 2 − 2⁻ᵈ,
    // unless it leaks through a wall or hits a surface from its dark side.
    for material in [matte([0.5; 3]), mirror([0.5; 3])] {
        let mut scene = furnace(smallpt(96, 72), material);
        scene.render.max_depth = 12;
        let expected = 2.0 - 0.5_f32.powi(12);
        let mut samples = 0;
        common::for_each_sample(&scene, |pixel, radiance| {
            samples += 1;
            assert_eq!(radiance, [expected; 3], "pixel {pixel}");
        });
        assert_eq!(samples, 96 * 72 * 16);
    }
}

#[test]
fn no_path_leaves_a_box_of_huge_spheres() {
    for mut scene in [smallpt(64, 48), furnace(smallpt(64, 48), mirror([0.5; 3]))] {
        scene.render.max_depth = 30;
        let integrator = common::integrator(&scene);
        let region = Region::whole(64, 48);
        let mut points = 0;
        for place in 0..region.len() {
            for sample in 0..4 {
                let (_, events) = integrator.explain(region.pixel(place), sample);
                for event in &events {
                    assert!(!matches!(event, Event::Escape { .. }), "{events:?}");
                    let Event::Hit { point, .. } = event else { continue };
                    points += 1;
                    for (x, [low, high]) in point.iter().zip(SMALLPT_BOX) {
                        // The walls deviate from planes by 0.07 over the box, and are rounded to 2⁻⁷.
                        let inside = low - 0.1..high + 0.1;
                        assert!(inside.contains(&f64::from(*x)), "{point:?} is outside: {events:?}");
                    }
                }
            }
        }
        assert!(points > 50_000, "{points}");
    }
}
