//! Groups: hits and images are those of the same surfaces, written out for each instance.
//!
//! Images are compared at the level stated in `common::blocks`.

mod leaks;

use crate::common::blocks::compare;
use crate::common::estimate;
use crate::common::scenes::*;
use crate::common::shapes::{is_linear, placed};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use rand::RngExt;
use std::sync::Arc;
use stride::film::film_offset;
use stride::integrator::{self, Paths};
use stride::math::Ray;
use stride::math::lanes::Level;
use stride::parameter::Varying;
use stride::sampling::{Region, Stream};
use stride::scene::{ConstantTexture, Entity, Instance, Integrator, Scene, Shape, Texture};
use stride::shape::NOTHING;
use stride::world::{AcceleratorChoice, CompiledScene, Simple, Size, World, compile};

fn transform(scale: DVec3, angle: f64, at: DVec3) -> DAffine3 {
    let turn = DQuat::from_axis_angle(v(0.3, -0.4, 1.0).normalize(), angle);
    DAffine3::from_scale_rotation_translation(scale, turn, at)
}

/// Transforms that preserve shapes, one of which mirrors.
fn similar() -> Vec<DAffine3> {
    vec![
        transform(DVec3::splat(1.2), 0.5, v(5.0, 1.5, 0.2)),
        transform(v(0.8, 0.8, -0.8), 2.0, v(5.0, -1.8, -0.3)),
    ]
}

fn squeezed() -> Vec<DAffine3> {
    vec![
        transform(v(1.5, 0.6, 1.0), 0.5, v(5.0, 1.5, 0.2)),
        transform(v(0.4, -1.1, 0.9), 2.0, v(5.0, -1.8, -0.3)),
    ]
}

fn materials() -> Vec<stride::scene::Material> {
    let mut materials = vec![
        matte([0.7, 0.6, 0.5]),
        matte([0.3, 0.6, 0.2]),
        mirror([0.9; 3]),
        matte([0.2, 0.3, 0.8]),
        matte([0.8; 3]),
        matte([0.6, 0.2, 0.2]),
    ];
    // One for each shape, at least.
    materials.resize(materials.len().max(shapes_of_all_kinds().len()), matte([0.5; 3]));
    materials
}

/// A group of some entities with some instances.
fn grouped(members: Vec<Entity>, places: &[DAffine3]) -> Scene {
    let mut scene = scene(materials(), Vec::new());
    let group = scene.add_group("group");
    scene.entities = members.into_iter().map(|entity| Entity { within: Some(group), ..entity }).collect();
    for place in places {
        scene.add_instance("place", group, *place);
    }
    assert_eq!(scene.problems(), []);
    scene
}

/// An entity under a transform that preserves shapes.
fn written(entity: &Entity, place: &DAffine3) -> Vec<Entity> {
    let (shapes, is_turned) = placed(&entity.shape, place);
    let flip_normal = is_turned != entity.flip_normal;
    shapes.into_iter().map(|shape| Entity { shape, flip_normal, ..entity.clone() }).collect()
}

/// A scene without groups, with these entities under all transforms.
fn written_out(members: &[Entity], places: &[DAffine3]) -> Scene {
    let all = places.iter().flat_map(|place| members.iter().flat_map(|member| written(member, place)));
    scene(materials(), all.collect())
}

fn compiled(scene: &Scene) -> (CompiledScene, Simple) {
    compile(scene, scene.film.width, scene.film.height).unwrap()
}

/// A ray through the instances.
fn ray(stream: &mut Stream) -> Ray<f32> {
    let o = v(5.0, 0.0, 0.5) + direction(stream) * stream.random_range(0.1..8.0);
    let target = v(5.0, 0.0, 0.0) + direction(stream) * 3.0;
    Ray::new(narrow(o), narrow((target - o).normalize()).normalized())
}

#[test]
fn hits_on_groups_are_those_of_the_same_surfaces() {
    let differences = |nudge: f64| {
        let members = shapes_of_all_kinds();
        let keep_uv: Vec<_> = members.iter().map(|member| is_linear(&member.shape)).collect();
        let (copied_tables, copied) = compiled(&written_out(&members, &similar()));
        let places: Vec<_> =
            similar().iter().map(|p| DAffine3::from_translation(DVec3::X * nudge) * *p).collect();
        let (tables, surfaces) = compiled(&grouped(members, &places));
        assert_eq!((surfaces.instances.len(), copied.instances.len()), (2, 0));
        let tree = World::new(&surfaces, AcceleratorChoice::Bvh);
        let others = World::new(&copied, AcceleratorChoice::Simple);
        let stream = &mut Stream::new(51, 0, 0);
        let (mut met, mut differ) = (vec![0; keep_uv.len()], 0);
        for _ in 0..20_000 {
            let ray = ray(stream);
            let (a, b) = (tree.intersect(&ray, true), others.intersect(&ray, true));
            if !a.is_some() || !b.is_some() {
                differ += u32::from(a.is_some() != b.is_some());
                continue;
            }
            let (p, q) = (tables.surfaces.point(&ray, &a), copied_tables.surfaces.point(&ray, &b));
            let material = tables.surfaces.material(&p).0;
            met[material as usize] += 1;
            let mut away = (p.p - q.p).max_abs();
            // Round shapes that are transformed individually have different uv.
            if keep_uv[material as usize] {
                let [u, v] = tables.surfaces.uv(&p, a.instance, true);
                let [s, t] = copied_tables.surfaces.uv(&q, b.instance, true);
                away = away.max((u - s).abs()).max((v - t).abs());
            }
            let turned = (p.n - q.n).max_abs().max((p.shading - q.shading).max_abs());
            let same = material == copied_tables.surfaces.material(&q).0;
            differ += u32::from(!same || away > 1e-3 || turned > 1e-3);
        }
        assert!(met.iter().all(|&met| met > 100), "{met:?}");
        differ
    };
    // At an edge, a rounding error decides.
    let few = differences(0.0);
    assert!(few < 40, "{few}");
    // Negative control: everything is farther away by a hundredth.
    let many = differences(0.01);
    assert!(many > 1000, "{many}");
}

#[test]
fn an_unevenly_scaled_sphere_is_an_ellipsoid() {
    let place = transform(v(2.0, -0.5, 1.0), 1.1, v(6.0, 0.5, -0.3));
    let (tables, surfaces) = compiled(&grouped(vec![sphere(v(0.1, 0.2, -0.1), 0.9, 0)], &[place]));
    let world = World::new(&surfaces, AcceleratorChoice::Simple);
    let inverse = place.inverse();
    let stream = &mut Stream::new(52, 0, 0);
    let (mut met, mut wrong) = (0, 0);
    for _ in 0..5000 {
        let ray = ray(stream);
        let hit = world.intersect(&ray, true);
        // At² + 2Bt + C = 0 in double precision.
        let (o, d) = (wide(ray.o), wide(ray.d));
        let (w, e) = (inverse.transform_point3(o) - v(0.1, 0.2, -0.1), inverse.transform_vector3(d));
        let (a, b, c) = (e.dot(e), w.dot(e), w.dot(w) - 0.81);
        let discriminant = b * b - a * c;
        let roots = [-1.0, 1.0].map(|sign| (-b + sign * discriminant.sqrt()) / a);
        let expected = roots.into_iter().find(|&t| t > 0.0);
        // Where the ray grazes it, a rounding error decides.
        if discriminant.abs() < 1e-3 * a {
            continue;
        }
        assert_eq!(hit.is_some(), expected.is_some(), "{ray:?}");
        let Some(t) = expected else { continue };
        met += 1;
        let point = tables.surfaces.point(&ray, &hit);
        let normal = (inverse.matrix3.transpose() * (w + e * t)).normalize();
        wrong += u32::from((f64::from(hit.t) - t).abs() > 1e-4);
        wrong += u32::from((wide(point.n) - normal).length() > 1e-4);
        wrong += u32::from((wide(point.p) - (o + d * t)).length() > 1e-4);
        // The bound holds, and is not too large.
        let local = inverse.transform_point3(wide(point.p)) - v(0.1, 0.2, -0.1);
        let off = (local.length() - 0.9).abs() / (inverse.matrix3.transpose() * local.normalize()).length();
        assert!(off < f64::from(point.error) && point.error < 1e-4, "{off}, {}", point.error);
    }
    assert!(met > 400 && wrong == 0, "{wrong} of {met}");
}

#[test]
fn hits_are_identical_in_every_world() {
    let mut scene = scene(materials(), vec![plane(DVec3::Z, -2.0, 0), sphere(v(5.0, 0.0, 1.5), 0.4, 1)]);
    add_groups_to(&mut scene);
    for place in squeezed() {
        scene.add_instance("squeezed", 0, place);
        // Two coincident instances: the lower one wins.
        scene.add_instance("again", 0, place);
    }
    assert_eq!(scene.problems(), []);
    let (_, surfaces) = compiled(&scene);
    assert_eq!(surfaces.instances.of_groups(), 9);
    let simple = World::new(&surfaces, AcceleratorChoice::Simple);
    let tree = World::new(&surfaces, AcceleratorChoice::Bvh);
    let meshes = World::with_tree_scope(&surfaces, stride::world::TreeScope::Meshes);
    let stream = &mut Stream::new(53, 0, 0);
    let mut met = 0;
    for _ in 0..20_000 {
        let ray = ray(stream);
        let limit = stream.random_range(0.1..8.0_f32);
        let bits = |world: &World| {
            let hit = world.intersect(&ray, true);
            let weights = hit.weights.map(f32::to_bits);
            let occluded = [limit, NOTHING].map(|limit| world.occluded(&ray, limit, true, false));
            let is_some = hit.is_some();
            (is_some.then_some((hit.t.to_bits(), hit.surface.0, hit.instance.0, weights)), occluded)
        };
        let truth = bits(&simple);
        met += u32::from(truth.0.is_some_and(|hit| hit.2 > 0));
        assert_eq!(bits(&tree), truth, "{ray:?}");
        assert_eq!(bits(&meshes), truth, "{ray:?}");
        let before = truth.0.map_or(NOTHING, |hit| f32::from_bits(hit.0));
        assert_eq!(truth.1, [before < limit, before < NOTHING], "{ray:?}");
    }
    assert!(met > 5000, "{met}");
}

/// The bits of a small picture of groups.
fn bits(accelerator: AcceleratorChoice, level: Level) -> Vec<[u32; 3]> {
    let mut scene = sized(scene(materials(), vec![plane(DVec3::Z, -2.0, 0)]), 24, 18);
    add_groups_to(&mut scene);
    scene.environment = [0.3; 3];
    scene.render.max_depth = 4;
    scene.render.integrator = Integrator::Path;
    let (tables, surfaces) = compiled(&scene);
    let (world, offset) = (World::new(&surfaces, accelerator), film_offset(&scene.film));
    let tracer = integrator::build(&scene.render, offset, Arc::new(tables), Arc::new(world));
    let region = Region::whole(scene.film.width, scene.film.height);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let mut out = Vec::new();
    tracer.trace(level, &Paths { pixels: &pixels, first_sample: 0, samples: 2 }, &mut out);
    out.sort_by_key(|f| (f.sample.pixel, f.sample.sample));
    out.into_iter().map(|f| f.sample.radiance.map(f32::to_bits)).collect()
}

#[test]
fn images_are_identical_in_every_world_at_every_level() {
    let truth = bits(AcceleratorChoice::Simple, Level::available()[0]);
    for level in Level::available() {
        assert!(bits(AcceleratorChoice::Bvh, level) == truth, "{level}");
    }
    assert!(truth.iter().any(|radiance| *radiance != truth[0]));
}

#[test]
fn images_of_groups_agree_with_the_same_surfaces() {
    let picture = |mut scene: Scene, seed: u32| {
        scene.entities.push(plane(DVec3::Z, -2.2, 4));
        scene.environment = [0.2; 3];
        scene.render.integrator = Integrator::Path;
        scene.render.max_depth = 4;
        (scene.render.samples, scene.render.seed) = (96, seed);
        estimate(&sized(scene, 32, 24)).blocks()
    };
    let members = |radiance: f64| {
        // Most shapes are lights, but neither the disk nor the mirrors.
        let mut members = shapes_of_all_kinds();
        for i in [0, 1, 4, 5] {
            members[i].emission = [radiance, 0.7 * radiance, 0.5];
        }
        members
    };
    let written = picture(written_out(&members(1.5), &similar()), 1);
    let groups = picture(grouped(members(1.5), &similar()), 2);
    let verdict = compare(&written, &groups);
    assert!(verdict.agrees(), "{verdict}");
    // Negative control: lights that are brighter by a tenth.
    let verdict = compare(&written, &picture(grouped(members(1.65), &similar()), 2));
    assert!(!verdict.agrees(), "{verdict}");
}

#[test]
fn emissive_shapes_are_sampled_where_transforms_preserve_them() {
    let lit = || {
        let mut members = shapes_of_all_kinds();
        members.iter_mut().for_each(|entity| entity.emission = [1.0; 3]);
        members
    };
    let lights = |scene: &Scene| compiled(scene).0.lights.len();
    // A side of a box and a triangle of a mesh are a light each.
    let count = |entities: &[Entity]| {
        let of = |entity: &Entity| match &entity.shape {
            Shape::Mesh { mesh, .. } => mesh.triangles.len(),
            shape => shape.pieces().len(),
        };
        entities.iter().map(of).sum::<usize>()
    };
    let shapes = shapes_of_all_kinds();
    let all = count(&shapes);
    let linear = count(&shapes.iter().filter(|entity| is_linear(&entity.shape)).cloned().collect::<Vec<_>>());
    assert!(all >= 14 && linear >= 11 && linear < all, "{linear} of {all}");
    let are_linear: Vec<_> = shapes.iter().map(|entity| is_linear(&entity.shape)).collect();
    let scene = grouped(lit(), &similar());
    assert_eq!(scene.written_out(&scene.group_places()), vec![true; shapes.len()]);
    assert_eq!(lights(&scene), 2 * all);
    // Nothing else is stored of the group.
    assert_eq!(compiled(&scene).1.instances.len(), 0);
    // If one instance scales it unevenly, its emission is found only by chance.
    let scene = grouped(lit(), &[similar()[0], squeezed()[0]]);
    assert_eq!(scene.written_out(&scene.group_places()), are_linear);
    assert_eq!(lights(&scene), 2 * linear);
    // The same holds for rotated textures.
    let mut scene = grouped(lit(), &similar()[..1]);
    scene.materials.push(checkerboard(0, 1, 4.0));
    scene.entities[0].material = scene.materials.len() - 1;
    let mut all_but_one = vec![true; shapes.len()];
    all_but_one[0] = false;
    assert_eq!(scene.written_out(&scene.group_places()), all_but_one);
    scene.instances[0].transform = DAffine3::from_scale(DVec3::splat(3.0));
    assert_eq!(scene.written_out(&scene.group_places()), vec![true; shapes.len()]);
    // So it does for textures that they emit.
    let mut glowing = grouped(shapes_of_all_kinds(), &similar());
    let kind = ConstantTexture { value: Varying::Colour([2.0; 3]) }.into();
    glowing.textures = vec![Texture { name: "glow".into(), kind }];
    glowing.entities.iter_mut().for_each(|entity| entity.emission_texture = Some(0));
    assert_eq!(glowing.written_out(&glowing.group_places()), are_linear);
    assert_eq!(lights(&glowing), 2 * linear);
    let away = |x: f64| DAffine3::from_translation(v(x, 0.0, 0.0)) * DAffine3::from_scale(DVec3::splat(3.0));
    (glowing.instances[0].transform, glowing.instances[1].transform) = (away(0.0), away(9.0));
    assert_eq!(lights(&glowing), 2 * all);
    // A group without instances emits nothing.
    scene.instances.clear();
    assert_eq!(lights(&scene), 0);
}

#[test]
fn nested_groups_combine_their_transforms() {
    let [inner, outer] = [squeezed()[0], transform(v(0.9, 1.1, 0.7), 1.0, v(-1.0, 0.4, 0.2))];
    let flat = grouped(shapes_of_all_kinds(), &[outer * inner, outer * outer * inner, inner]);
    let mut nested = grouped(shapes_of_all_kinds(), &[]);
    let (a, b) = (nested.add_group("a"), nested.add_group("b"));
    let mut add = |group, within, transform| {
        nested.instances.push(Instance { name: "i".into(), group, within, transform });
    };
    add(0, Some(a), inner);
    add(a, Some(b), outer);
    add(a, None, outer);
    add(b, None, outer);
    add(0, None, inner);
    assert_eq!(nested.problems(), []);
    assert_eq!(nested.place_counts(), [3, 2, 1]);
    let (own, expected) = (compiled(&nested).1.instances, compiled(&flat).1.instances);
    for instance in 0..3 {
        let [a, b] = [own.place(instance), expected.place(instance)];
        for (a, b) in a.to_world.iter().zip(&b.to_world) {
            assert!((*a - *b).max_abs() < 1e-6);
        }
        assert!((a.origin - b.origin).max_abs() < 1e-6);
    }
    assert_eq!((own.len(), own.groups.len()), (3, 1));
}

#[test]
fn a_group_is_stored_once() {
    let places: Vec<_> = (0..1000).map(|i| DAffine3::from_translation(DVec3::X * f64::from(i))).collect();
    let scene = grouped(shapes_of_all_kinds(), &places);
    let (tables, surfaces) = compiled(&scene);
    assert_eq!((surfaces.triangles.len(), surfaces.triangles.placed()), (4, 0));
    // A mesh is one surface of four triangles.
    let pieces: usize = shapes_of_all_kinds().iter().map(|entity| entity.shape.pieces().len()).sum();
    assert_eq!((tables.surfaces.len(), surfaces.instances.len()), (pieces + 1, 1000));
    let Size { primitives, vertices, media: _ } = Size::of(&scene);
    assert_eq!((primitives, vertices), (pieces as u64 + 4 + 1000, 4));
}

#[test]
fn invalid_groups_are_reported() {
    let told = |change: fn(&mut Scene)| {
        let mut scene = grouped(shapes_of_all_kinds(), &similar());
        change(&mut scene);
        scene.problems().iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    };
    let shear = |s: &mut Scene| {
        let sheared = DMat3::from_cols(DVec3::X, v(1e4, 1.0, 0.0), DVec3::Z);
        s.instances[1].transform = DAffine3::from_mat3(sheared);
    };
    let deep = |s: &mut Scene| {
        for group in 0..17 {
            s.add_group("g");
            s.instances.push(Instance { group, within: Some(group + 1), ..Instance::default() });
        }
    };
    let many = |s: &mut Scene| {
        for group in 0..9 {
            s.add_group("g");
            let held = Instance { group, within: Some(group + 1), ..Instance::default() };
            s.instances.extend(std::iter::repeat_n(held, 8));
        }
        s.add_instance("all", 9, DAffine3::IDENTITY);
    };
    // 128³ instances of a box make six times as many lights, but are no more instances than there may be.
    let bright = |s: &mut Scene| {
        let ball = s.add_group("lamp");
        let corner = DVec3::splat(0.1);
        let lamp = cuboid(DVec3::ZERO, corner, 0);
        s.entities.push(Entity { within: Some(ball), ..emitting(lamp, 1.0) });
        for group in ball..ball + 3 {
            s.add_group("g");
            let held = Instance { group, within: Some(group + 1), ..Instance::default() };
            s.instances.extend(std::iter::repeat_n(held, 128));
        }
        s.add_instance("all", ball + 3, DAffine3::IDENTITY);
    };
    type Change = fn(&mut Scene);
    let cases: [(Change, &str); 10] = [
        (
            bright,
            "it emits with 6 triangles or surfaces in each of 2097152 instances: with it there are more than 8388608 lights in groups",
        ),
        (|s| s.entities[1].within = Some(7), "entity 2 (\"entity\"): there is no group 8, only 1"),
        (
            |s| s.entities[1].shape = plane(DVec3::Z, 0.0, 0).shape,
            "a plane is unbounded and cannot be in a group",
        ),
        (|s| s.instances[0].group = 3, "instance 1 (\"place\"): there is no group 4, only 1"),
        (|s| s.instances[0].within = Some(0), "its group 1 does not precede the group that contains it"),
        (|s| s.instances[0].transform = DAffine3::from_scale(v(1.0, 0.0, 1.0)), "the transform is singular"),
        (|s| s.instances[0].transform = DAffine3::from_scale(DVec3::splat(1e18)), "farther than 1e18"),
        (shear, "instance 2 (\"place\"): the transform shears the group"),
        (deep, "it is nested more than 16 levels deep"),
        (many, "more than 16777216 instances of groups"),
    ];
    for (change, part) in cases {
        let told = told(change);
        assert!(told.contains(part), "{told:?} is not {part:?}");
    }
    assert_eq!(told(|_| {}), "");
}
