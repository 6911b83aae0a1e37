//! Dielectrics with absorption, and overlapping ones.

use crate::common;
use crate::common::scenes::{
    cuboid, dielectric, emitting, glass, icosphere, interiors, matte, mesh, point_light, quad, scene, sphere,
    v,
};
use crate::common::{blocks::compare, estimate, for_each_sample};
use stride::integrator::{Event, FirstHit, Passage, Paths};
use stride::math::lanes::Level;
use stride::sampling::{Pixel, Region};
use stride::scene::{
    ConductorParameters, DielectricParameters, Entity, Integrator, Material, MaterialKind, Modifiers, Scene,
};
use stride::world::{AcceleratorChoice, World, compile};

/// Absorption coefficients of red, green and blue.
const SIGMA: [f64; 3] = [0.0, 0.3, 1.5];

/// Objects before a luminous wall, in the dark.
fn before_a_wall(materials: Vec<Material>, things: Vec<Entity>) -> Scene {
    let mut materials = materials;
    materials.push(matte([0.0; 3]));
    let black = materials.len() - 1;
    let mut entities = things;
    entities.push(emitting(quad(v(20.0, -60.0, -60.0), v(0.0, 0.0, 120.0), v(0.0, 120.0, 0.0), black), 1.0));
    let mut scene = scene(materials, entities);
    scene.render.max_depth = 30;
    scene.render.samples = 1;
    scene
}

/// The same seen along x, at nearly normal incidence.
fn along_the_axis(mut scene: Scene) -> Scene {
    scene.camera.vertical_fov = 1e-4;
    scene
}

/// The means of the channels over an image, and their standard errors.
fn means(scene: &Scene, integrator: Integrator, samples: u32) -> [(f64, f64); 3] {
    let mut scene = scene.clone();
    scene.render.integrator = integrator;
    scene.render.samples = samples;
    let (mut count, mut sums, mut squares) = (0.0, [0.0; 3], [0.0; 3]);
    for_each_sample(&scene, |_, radiance| {
        count += 1.0;
        for (i, x) in radiance.map(f64::from).into_iter().enumerate() {
            sums[i] += x;
            squares[i] += x * x;
        }
    });
    [0, 1, 2].map(|i| {
        let mean: f64 = sums[i] / count;
        (mean, ((squares[i] / count - mean * mean).max(0.0) / count).sqrt())
    })
}

/// Whether the integrators find this radiance through an object: `whitted`, which follows all branches, up to rounding,
/// and paths within five standard errors.
fn show(scene: &Scene, expected: [f64; 3]) -> Result<(), String> {
    for (integrator, samples) in
        [(Integrator::Whitted, 1), (Integrator::Path, 64), (Integrator::PathNaive, 64)]
    {
        let found = means(scene, integrator, samples);
        for ((mean, error), expected) in found.into_iter().zip(expected) {
            let most = if integrator == Integrator::Whitted { 2e-4 } else { 5.0 * error + 2e-4 };
            assert!(integrator == Integrator::Whitted || error < 0.005, "{error} is too noisy");
            if (mean - expected).abs() > most {
                return Err(format!("{integrator:?}: {mean} ± {error} is not {expected}"));
            }
        }
    }
    Ok(())
}

/// Transmittance of a slab at normal incidence, including internal reflections.
fn slab(ior: f64, thickness: f64, sigma: f64) -> f64 {
    let r = ((ior - 1.0) / (ior + 1.0)).powi(2);
    let a = (-sigma * thickness).exp();
    (1.0 - r) * (1.0 - r) * a / (1.0 - r * r * a * a)
}

#[test]
fn a_slab_transmits_by_beer_lambert_and_fresnel() {
    let through = |ior, priority, sigma| {
        let box_of = cuboid(v(3.0, -2.0, -2.0), v(4.25, 2.0, 2.0), 0);
        along_the_axis(before_a_wall(vec![dielectric(ior, 0.0, priority, sigma)], vec![box_of]))
    };
    for (ior, priority) in [(1.5, 0), (2.4, 7), (1.0, 0)] {
        show(&through(ior, priority, SIGMA), SIGMA.map(|sigma| slab(ior, 1.25, sigma))).unwrap();
    }
    // Negative control: a tenth more.
    show(&through(1.5, 0, SIGMA), SIGMA.map(|sigma| slab(1.5, 1.25, 1.1 * sigma))).unwrap_err();
}

#[test]
fn a_sphere_transmits_along_its_axis_like_a_slab() {
    let ball = sphere(v(5.0, 0.0, 0.0), 0.75, 0);
    let scene = along_the_axis(before_a_wall(vec![dielectric(1.5, 0.0, 0, SIGMA)], vec![ball]));
    show(&scene, SIGMA.map(|sigma| slab(1.5, 1.5, sigma))).unwrap();
}

#[test]
fn a_camera_may_be_inside_a_dielectric() {
    // In a pool with its surface above and a wall behind: light is reflected between the ends.
    for priority in [0, 3] {
        let pool = cuboid(v(-1.0, -2.0, -2.0), v(4.0, 2.0, 2.0), 0);
        let scene = along_the_axis(before_a_wall(vec![dielectric(1.5, 0.0, priority, SIGMA)], vec![pool]));
        let expected = SIGMA.map(|sigma| {
            let (r, whole): (f64, f64) = (0.04, (-5.0 * sigma).exp());
            // Radiance is greater by the square of the index inside.
            2.25 * (1.0 - r) * (-4.0 * sigma).exp() / (1.0 - r * r * whole * whole)
        });
        show(&scene, expected).unwrap();
    }
}

#[test]
fn a_bubble_of_smooth_glass_does_not_absorb() {
    // Its index is that of air relative to the surrounding glass, because no priority is set.
    let things = vec![
        cuboid(v(3.0, -2.0, -2.0), v(5.0, 2.0, 2.0), 0),
        cuboid(v(3.5, -1.0, -1.0), v(4.5, 1.0, 1.0), 1),
    ];
    let with = |bubble| vec![dielectric(1.5, 0.0, 0, SIGMA), bubble];
    // Four interfaces: with small losses the series is long, so the index is close to one.
    let faint = |bubble| {
        along_the_axis(before_a_wall(vec![dielectric(1.001, 0.0, 0, SIGMA), bubble], things.clone()))
    };
    show(&faint(glass(1.0 / 1.001)), SIGMA.map(|sigma| (-sigma).exp())).unwrap();
    let scene = along_the_axis(before_a_wall(with(glass(1.0 / 1.5)), things.clone()));
    let [(red, _), ..] = means(&scene, Integrator::Whitted, 1);
    assert!((0.8..0.9).contains(&red), "{red}");
}

/// Walls of glass with water between them: the water extends into the glass, which has the higher priority.
fn overlapping(of_glass: u32, of_water: u32) -> Scene {
    let wall = |from, to| cuboid(v(from, -50.0, -50.0), v(to, 50.0, 50.0), 0);
    let water = cuboid(v(2.9, -50.0, -50.0), v(4.5, 50.0, 50.0), 1);
    let materials = vec![
        dielectric(1.5, 0.0, of_glass, [0.2, 0.0, 0.4]),
        dielectric(1.33, 0.0, of_water, [0.0, 0.3, 0.6]),
    ];
    before_a_wall(materials, vec![wall(2.0, 3.0), water, wall(4.4, 5.0)])
}

/// The same with interfaces that have the relative indices of both sides: water within glass.
fn explicit() -> Scene {
    let of = |from, to, material| cuboid(v(from, -50.0, -50.0), v(to, 50.0, 50.0), material);
    let materials =
        vec![dielectric(1.5, 0.0, 0, [0.2, 0.0, 0.4]), dielectric(1.33 / 1.5, 0.0, 0, [0.0, 0.3, 0.6])];
    before_a_wall(materials, vec![of(2.0, 5.0, 0), of(3.0, 4.4, 1)])
}

/// The radiance of each pixel by `whitted`.
fn pixels(scene: &Scene) -> Vec<[f32; 3]> {
    let mut scene = scene.clone();
    scene.render.integrator = Integrator::Whitted;
    scene.render.max_depth = 12;
    scene.camera.vertical_fov = 50_f64.to_radians();
    let mut pixels = vec![[0.0; 3]; (scene.film.width * scene.film.height) as usize];
    for_each_sample(&scene, |pixel, radiance| pixels[pixel] = radiance);
    pixels
}

/// The largest difference between two images.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn overlapping_water_and_glass_equal_touching_ones() {
    let expected = pixels(&explicit());
    assert!(expected.as_flattened().iter().all(|&x| x > 0.1 && x < 1.0), "{expected:?}");
    let overlap = difference(&pixels(&overlapping(2, 1)), &expected);
    assert!(overlap < 1e-4, "{overlap}");
    // Negative controls: the water matters; without priorities, each interface ignores the other body.
    for priorities in [[1, 2], [0, 0]] {
        let other = difference(&pixels(&overlapping(priorities[0], priorities[1])), &expected);
        assert!(other > 5e-3, "{other} with {priorities:?}");
    }
    // Paths agree with `whitted`.
    let axis = along_the_axis(overlapping(2, 1));
    show(&axis, means(&axis, Integrator::Whitted, 1).map(|(mean, _)| mean)).unwrap();
}

#[test]
fn traces_record_surfaces_that_are_not_interfaces() {
    // On the straight way, the water begins and ends within the walls.
    for integrator in [Integrator::Whitted, Integrator::Path, Integrator::PathNaive] {
        let most_passed = |priorities: [u32; 2]| {
            let mut scene = along_the_axis(overlapping(priorities[0], priorities[1]));
            scene.render.integrator = integrator;
            let integrator = common::integrator(&scene);
            let passed = |sample| {
                let (_, events) = integrator.explain(Pixel { index: 0, x: 0, y: 0 }, sample);
                let none = Event::Pass { through: Passage::NoInterface };
                events.iter().filter(|event| **event == none).count()
            };
            (0..8).map(passed).max()
        };
        assert!(most_passed([2, 1]) >= Some(2), "{integrator:?}");
        assert_eq!(most_passed([0, 0]), Some(0), "{integrator:?}");
    }
}

/// The first hits of a scene's samples.
fn first_hits(scene: &Scene) -> Vec<FirstHit> {
    let region = Region::whole(scene.film.width, scene.film.height);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let mut hits = Vec::new();
    let paths = Paths { pixels: &pixels, first_sample: 0, samples: 2 };
    common::integrator(scene).first_hits(Level::available()[0], &paths, &mut hits);
    hits
}

#[test]
fn first_hits_are_those_of_interfaces() {
    // In water, before a block of a lower priority, whose surface is no interface, with a matte wall behind.
    let seen = |priority| {
        let water = cuboid(v(-9.0, -50.0, -50.0), v(9.0, 50.0, 50.0), 0);
        let block = cuboid(v(2.0, -40.0, -40.0), v(3.0, 40.0, 40.0), 1);
        let wall = quad(v(5.0, -45.0, -45.0), v(0.0, 90.0, 0.0), v(0.0, 0.0, 90.0), 2);
        let materials =
            vec![dielectric(1.33, 0.0, 2, SIGMA), dielectric(1.5, 0.0, priority, SIGMA), matte([0.5; 3])];
        first_hits(&before_a_wall(materials, vec![water, block, wall]))
    };
    assert!(seen(1).iter().all(|hit| hit.entity == 2 && (hit.depth - 5.0).abs() < 1e-4), "{:?}", seen(1)[0]);
    assert!(seen(3).iter().all(|hit| hit.entity == 1 && (hit.depth - 2.0).abs() < 1e-4), "{:?}", seen(3)[0]);
}

#[test]
fn metals_and_sheets_reflect_by_their_index_relative_to_the_medium() {
    // Seen from inside a medium with a priority, at nearly normal incidence, without absorption.
    let mirrored = |around: f64, thing: Material| {
        let medium = cuboid(v(-50.0, -50.0, -50.0), v(50.0, 50.0, 50.0), 0);
        let plate = quad(v(2.0, -40.0, -40.0), v(0.0, 80.0, 0.0), v(0.0, 0.0, 80.0), 1);
        let lamp = quad(v(-20.0, -45.0, -45.0), v(0.0, 90.0, 0.0), v(0.0, 0.0, 90.0), 2);
        let materials = vec![dielectric(around, 0.0, 1, [0.0; 3]), thing, matte([0.0; 3])];
        let mut scene = along_the_axis(scene(materials, vec![medium, plate, emitting(lamp, 1.0)]));
        scene.render.max_depth = 1;
        scene
    };
    let of = |kind: MaterialKind| Material { name: "thing".into(), kind, ..Material::default() };
    let (eta, k) = ([0.2, 0.9, 1.1], [3.9, 2.4, 2.2]);
    let metal =
        of(ConductorParameters { metal: None, eta: Some(eta), k: Some(k), roughness: [0.0; 2] }.into());
    let of_metal = |around: f64| {
        [0, 1, 2].map(|i| {
            let (n, k): (f64, f64) = (eta[i] / around, k[i] / around);
            ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
        })
    };
    let sheet = DielectricParameters {
        ior: 1.5,
        roughness: [0.0; 2],
        absorption: [0.0; 3],
        thin_walled: true,
        priority: 0.0,
        reflectance: [1.0; 3],
        transmittance: [1.0; 3],
    };
    let sheet = of(sheet.into());
    let of_sheet = |around: f64| {
        let r = ((1.5 - around) / (1.5 + around)).powi(2);
        [2.0 * r / (1.0 + r); 3]
    };
    for around in [1.33, 1.8] {
        show(&mirrored(around, metal.clone()), of_metal(around)).unwrap();
        show(&mirrored(around, sheet.clone()), of_sheet(around)).unwrap();
        // Negative controls: as in air.
        show(&mirrored(around, metal.clone()), of_metal(1.0)).unwrap_err();
        show(&mirrored(around, sheet.clone()), of_sheet(1.0)).unwrap_err();
    }
}

#[test]
fn a_tree_finds_the_media_of_the_camera_as_a_list_does() {
    let ball = |z, radius, material| mesh(icosphere(v(0.0, 0.1, z), radius, 8, false), material);
    let materials = vec![dielectric(1.5, 0.0, 2, SIGMA), dielectric(1.33, 0.0, 1, SIGMA)];
    let scene =
        scene(materials, vec![ball(0.0, 1.0, 0), ball(0.0, 2.0, 1), ball(0.5, 0.3, 0), ball(0.0, 3.0, 0)]);
    let (compiled, surfaces) = compile(&scene, 16, 16).unwrap();
    assert_eq!(compiled.inside, [0; 2], "until a world is known");
    let inside = |accelerator| {
        let world = World::new(&surfaces, accelerator);
        assert_eq!(world.tree.is_some(), accelerator == AcceleratorChoice::Bvh);
        compiled.clone().with_camera_media(&world).inside
    };
    let found = inside(AcceleratorChoice::Bvh);
    assert_eq!(found, inside(AcceleratorChoice::Simple));
    // Two of the first medium, then one of the second.
    assert_eq!(found, [1 | 1 << 16, 2]);
}

#[test]
fn passing_straight_through_is_no_bounce() {
    // The way through takes four bounces, although there are more surfaces.
    let mut scene = along_the_axis(overlapping(2, 1));
    scene.render.max_depth = 4;
    let [(red, _), ..] = means(&scene, Integrator::Whitted, 1);
    assert!(red > 0.5, "{red}");
    scene.render.max_depth = 3;
    assert_eq!(means(&scene, Integrator::Whitted, 1)[0].0, 0.0);
}

#[test]
fn overlapping_dielectrics_in_a_white_sky_are_invisible_unless_they_absorb() {
    let furnace = |absorption: [f64; 3]| {
        let mut scene = interiors(16, 12);
        // The dielectrics alone; clear ones except for one.
        scene.entities.drain(8..);
        scene.entities.remove(6);
        scene.entities.drain(..2);
        scene.materials[1] = dielectric(1.5, 0.0, 2, [0.0; 3]);
        scene.materials[2] = dielectric(1.33, 0.0, 1, absorption);
        // The rough one loses energy, as it has no multiple scattering between microfacets.
        scene.materials[4] = dielectric(1.6, 0.0, 3, [0.0; 3]);
        scene.lights.clear();
        scene.environment = [1.0; 3];
        scene.render.max_depth = 500;
        scene
    };
    for integrator in [Integrator::Path, Integrator::PathNaive] {
        for (mean, error) in means(&furnace([0.0; 3]), integrator, 64) {
            assert!((mean - 1.0).abs() < 5.0 * error + 2e-4, "{integrator:?}: {mean} ± {error}");
        }
        let [(red, _), (green, _), (blue, _)] = means(&furnace([0.0, 0.2, 1.0]), integrator, 64);
        assert!(red > 0.999 && green < 0.99 && blue < green, "{integrator:?}: {red} {green} {blue}");
    }
}

#[test]
fn shadow_rays_are_absorbed_like_paths() {
    let with = |integrator, samples, seed| {
        let mut scene = interiors(32, 24);
        scene.render.integrator = integrator;
        (scene.render.samples, scene.render.seed) = (samples, seed);
        // A small lamp is rarely found by chance.
        scene.entities[8] = emitting(sphere(v(4.6, 0.2, -0.5), 0.3, 5), 3.0);
        scene
    };
    let naive = estimate(&with(Integrator::PathNaive, 2048, 1));
    let path = estimate(&with(Integrator::Path, 512, 2));
    let verdict = compare(&naive.blocks(), &path.blocks());
    println!("{verdict}");
    assert!(verdict.agrees(), "{verdict}");
    assert!(verdict.rms > 0.5, "{verdict}");
    // Negative control: water with two thirds of the absorption.
    let mut other = with(Integrator::Path, 512, 2);
    other.materials[2] = dielectric(1.33, 0.0, 1, [0.8, 0.33, 0.07]);
    let verdict = compare(&naive.blocks(), &estimate(&other).blocks());
    assert!(!verdict.agrees(), "{verdict}");
}

/// A black sheet across the view, with the last material.
fn add_sheet(scene: &mut Scene, x: f64, opacity: f64) {
    let modifiers = Modifiers { opacity, ..Modifiers::default() };
    scene.materials.push(Material { modifiers, ..matte([0.0; 3]) });
    let sheet = quad(v(x, -40.0, -40.0), v(0.0, 80.0, 0.0), v(0.0, 0.0, 80.0), scene.materials.len() - 1);
    scene.entities.push(sheet);
}

#[test]
fn at_a_hole_no_medium_changes() {
    // In the glass, in the overlap, in the water and behind everything; no sheet is a bounce.
    let open = along_the_axis(overlapping(2, 1));
    let mut sheets = open.clone();
    [2.5, 2.95, 3.7, 6.0].into_iter().for_each(|x| add_sheet(&mut sheets, x, 0.0));
    (sheets.render.max_depth, sheets.render.samples) = (4, 1);
    let of = |scene: &Scene, integrator| means(scene, integrator, 1);
    for integrator in [Integrator::Whitted, Integrator::Path, Integrator::PathNaive] {
        let open = Scene { render: sheets.render.clone(), ..open.clone() };
        for ((found, _), (expected, _)) in of(&sheets, integrator).into_iter().zip(of(&open, integrator)) {
            assert!((found - expected).abs() < 1e-4 * expected, "{integrator:?}: {found}, not {expected}");
        }
    }
}

#[test]
fn light_is_absorbed_along_its_entire_way_through_holes() {
    // A wall, a point light and the camera within one dielectric, with two sheets between the wall and both others.
    let lit = |sheets: usize, sigma| {
        let wall = quad(v(2.0, -9.0, -9.0), v(0.0, 0.0, 18.0), v(0.0, 18.0, 0.0), 1);
        let body = cuboid(v(-9.0, -30.0, -30.0), v(9.0, 30.0, 30.0), 0);
        let materials = vec![dielectric(1.5, 0.0, 0, sigma), matte([0.5; 3])];
        let mut scene = along_the_axis(scene(materials, vec![body, wall]));
        [0.7, 1.1].into_iter().take(sheets).for_each(|x| add_sheet(&mut scene, x, 0.5));
        scene.lights = vec![point_light(v(0.2, 0.5, 0.5), 5.0)];
        scene.render.max_depth = 1;
        scene
    };
    for integrator in [Integrator::Whitted, Integrator::Path, Integrator::PathNaive] {
        let (open, clear) = (means(&lit(0, SIGMA), integrator, 1), means(&lit(0, [0.0; 3]), integrator, 1));
        let length = 2.0 + f64::sqrt(1.8 * 1.8 + 0.5);
        for (i, ((mean, error), (full, _))) in
            means(&lit(2, SIGMA), integrator, 64).into_iter().zip(open).enumerate()
        {
            let expected = clear[i].0 * (-SIGMA[i] * length).exp();
            assert!((full / expected - 1.0).abs() < 1e-3, "{integrator:?}: {full}, not {expected}");
            let off = |share: f64| (mean - full * share).abs() / error;
            assert!(off(1.0 / 16.0) < 5.0, "{integrator:?}: {mean} ± {error} of {full}");
            // Negative control.
            assert!(off(1.0 / 14.0) > 5.0, "{integrator:?}: {mean} ± {error} of {full}");
        }
    }
}
