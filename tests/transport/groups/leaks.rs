//! Rays that leave surfaces of groups neither hit them again nor leak.

use super::{compiled, grouped, transform};
use crate::common::for_each_sample_in;
use crate::common::scenes::*;
use glam::DVec3;
use rand::RngExt;
use stride::math::{Frame, Ray};
use stride::sampling::Stream;
use stride::scene::{Entity, Scene, Shape};
use stride::shape::offset_origin;
use stride::world::{AcceleratorChoice, World};

/// Rays leave every shape on its convex side, from the hits of random rays.
#[test]
fn rays_that_leave_a_surface_of_a_group_never_hit_it_again() {
    let stream = &mut Stream::new(54, 0, 0);
    let (mut rays, mut met, mut with_less) = (0, 0, 0);
    for scale in [1e-3, 1.0, 1e3] {
        for squeeze in [DVec3::ONE, v(1.0, -0.1, 3.0), v(0.05, 1.0, 1.0)] {
            for away in [0.0, 30.0] {
                for member in shapes_of_all_kinds() {
                    let place = transform(squeeze * scale, 1.3, direction(stream) * away * scale);
                    let (tables, surfaces) = compiled(&grouped(vec![member.clone()], &[place]));
                    let world = World::new(&surfaces, AcceleratorChoice::Simple);
                    // For flat shapes on both sides, for others on the outer one.
                    let both = matches!(member.shape, Shape::Quad(_) | Shape::Disk(_));
                    for _ in 0..400 {
                        let target = place.transform_point3(direction(stream) * 1.4);
                        let far = scale * 10_f64.powf(stream.random_range(-1.0..3.0));
                        let o = narrow(target + direction(stream) * far);
                        let d = narrow((target - wide(o)).normalize_or(DVec3::X)).normalized();
                        let hit = world.intersect(&Ray::new(o, d), true);
                        if !hit.is_some() {
                            continue;
                        }
                        assert_eq!(hit.instance.0, 1);
                        let point = tables.surfaces.point(&Ray::new(o, d), &hit);
                        let frame = Frame::around(point.n);
                        let sign = if both { [1.0, -1.0][stream.random_range(0..2)] } else { 1.0 };
                        let cos: f64 = 10_f64.powf(stream.random_range(-5.0..0.0)) * sign;
                        let phi = stream.random_range(0.0..std::f64::consts::TAU);
                        let sin = (1.0 - cos * cos).sqrt();
                        let d = frame.to_world(narrow(v(sin * phi.cos(), sin * phi.sin(), cos))).normalized();
                        let leaves = |share: f32| {
                            let o = offset_origin(point.p, point.n, point.error * share, d);
                            !world.intersect(&Ray::new(o, d), true).is_some()
                        };
                        rays += 1;
                        met += u32::from(!leaves(1.0));
                        with_less += u32::from(!leaves(0.001));
                        // The bound must not be a gap.
                        assert!(f64::from(point.error) < 1e-2 * scale * (1.0 + away), "{}", point.error);
                    }
                }
            }
        }
    }
    assert!(rays > 2_000, "{rays}");
    assert_eq!(met, 0, "of {rays} rays");
    // Negative control.
    assert!(with_less > 50, "{with_less} of {rays} with a bound that is too small");
}

/// Closed surfaces, made of pieces that meet at edges.
fn closed() -> Vec<Vec<Entity>> {
    let can = || {
        vec![
            cylinder(v(0.0, 0.0, -1.0), v(0.0, 0.0, 1.0), 1.0, 0),
            disk(v(0.0, 0.0, -1.0), -DVec3::Z, 1.0, 0),
            disk(v(0.0, 0.0, 1.0), DVec3::Z, 1.0, 0),
        ]
    };
    vec![
        vec![sphere(DVec3::ZERO, 1.0, 0)],
        vec![cuboid(DVec3::splat(-1.0), DVec3::splat(1.0), 0)],
        can(),
        vec![mesh(icosphere(DVec3::ZERO, 1.0, 3, false), 0)],
    ]
}

/// The number of samples outside of the allowed values, and the number of all samples.
fn other_than(scene: &Scene, values: &[f64]) -> (usize, usize) {
    let (mut other, mut all) = (0, 0);
    for_each_sample_in(scene, AcceleratorChoice::Bvh, |_, radiance| {
        let is = |value: f64| (f64::from(radiance[0]) - value).abs() <= 1e-5 * value;
        other += usize::from(!values.iter().any(|&value| is(value)));
        all += 1;
    });
    (other, all)
}

/// No light enters a closed surface. Inside uniform emission and reflection, every path has the same radiance; outside
/// of a convex shape, every path hits it at most once.
#[test]
fn furnaces_in_groups_lose_no_energy() {
    let mut by_chance = 0;
    for scale in [1e-3, 1.0, 1e3] {
        for (members, squeeze) in closed()
            .into_iter()
            .flat_map(|members| [DVec3::ONE, v(1.0, 0.3, -2.0)].map(|s| (members.clone(), s)))
        {
            let at = v(3.0, -1.0, 2.0) * scale;
            let place = transform(squeeze * scale, 0.8, at);
            let furnace = |look: fn(Entity) -> Entity, eye: DVec3, environment: f64| {
                let mut scene = grouped(members.iter().cloned().map(look).collect(), &[place]);
                scene.materials[0] = matte([0.5; 3]);
                scene.environment = [environment; 3];
                scene.camera.eye = eye;
                scene.render.max_depth = 6;
                scene.render.samples = 4;
                scene
            };
            // At an edge between two pieces, rounding may move the origin of a ray to the other side.
            let few = usize::from(members.len() > 1 || !matches!(members[0].shape, Shape::Sphere(_)));
            let lost = |scene: &Scene, values: &[f64]| {
                let (other, all) = other_than(scene, values);
                assert!(other <= few && all == 1024, "{members:?} at {scale}, {squeeze}: {other} of {all}");
            };
            let middle = at + v(0.1, 0.05, -0.1) * scale;
            lost(&furnace(|entity| entity, middle, 1.0), &[0.0]);
            let shining = furnace(|entity| flipped(emitting(entity, 1.0)), middle, 0.0);
            // Surfaces that are written out are in no group.
            if !shining.written_out(&shining.group_places())[0] {
                by_chance += 1;
                lost(&shining, &[(0..=6).map(|bounce| 0.5_f64.powi(bounce)).sum()]);
            }
            let outside = furnace(|entity| entity, at - DVec3::X * 3.5 * scale, 1.0);
            lost(&outside, &[1.0, 0.5]);
            // Negative control: the image is not empty.
            let seen = other_than(&outside, &[1.0]).0;
            assert!(seen > 5, "{members:?} at {scale}: {seen}");
        }
    }
    // The sphere and the can, with an anisotropic scale.
    assert_eq!(by_chance, 2 * 3);
}
