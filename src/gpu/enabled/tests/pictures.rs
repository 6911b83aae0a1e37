//! Images of the GPU and the CPU, compared statistically with different seeds.
//!
//! The tests are those for integrators, at the level stated in `tests/common/tiles.rs`, once for all comparisons of a
//! test. As seeds are fixed, results are reproducible on one device.

use super::gallery::{gallery, glow, groups, interiors, modified, sunny};
use super::length;
use super::tiles::{Replicates, Verdict, welch};
use super::{Device, DispatchLimits, GpuWorker, Prepared, Program, carry_out, device, scenes};

use crate::gpu::Job;
use crate::gpu::enabled::program;
use crate::gpu::enabled::tables::Tables;
use crate::gpu::enabled::variant::ProgramPlan;
use crate::integrator::Paths;
use crate::math::lanes::Level;
use crate::render::{Order, Payload, Stride};
use crate::scene::{self, Integrator, Sampler, Scene, UNLIMITED};
use std::path::Path;

/// The size of all images: twelve tiles.
const WIDTH: u32 = 32;
const HEIGHT: u32 = 24;

const INTEGRATORS: [Integrator; 3] = [Integrator::Path, Integrator::PathNaive, Integrator::Whitted];
const SAMPLERS: [Sampler; 2] = [Sampler::Independent, Sampler::Sobol];

/// The seeds of a scene: replicates on the CPU start at its own seed, those on the GPU at this offset from it.
const APART: u32 = 100_000;

/// Sums of the samples of each pixel, in parts.
fn sums_on_cpu(prepared: &Prepared, samples: u32, take: &mut dyn FnMut(u32, [f64; 3])) {
    let level = Level::from_environment().unwrap();
    let pixels: Vec<_> = (0..prepared.whole.len()).map(|place| prepared.whole.pixel(place)).collect();
    let mut out = Vec::new();
    prepared.on_cpu().trace(level, &Paths { pixels: &pixels, first_sample: 0, samples }, &mut out);
    out.iter().for_each(|f| take(f.sample.pixel, f.sample.radiance.map(f64::from)));
}

fn sums_on_gpu(
    device: &Device,
    program: &Program,
    (job, tables): (&Job<'_>, &Tables),
    samples: u32,
    take: &mut dyn FnMut(u32, [f64; 3]),
) {
    let mut worker = GpuWorker::with_program(device, job, tables, program.clone()).unwrap();
    for batch in carry_out(&mut worker, &[Order { stride: Stride::ALL, first: 0, end: samples }]) {
        let Payload::Sums { first_slot, sums, wide, .. } = batch.payload else { panic!("no sums") };
        assert!(wide.is_empty(), "none of these is so bright");
        for (slot, sums) in (first_slot..).zip(sums) {
            take(slot, sums.rgb.map(|sum| sum as f64 / 4_294_967_296.0));
        }
    }
}

fn on_cpu(scene: &Scene, samples: u32) -> Replicates {
    let mut prepared = Prepared::new(scene, 0);
    Replicates::of([scene.film.width, scene.film.height], samples, |replicate, take| {
        prepared.render.seed = scene.render.seed + replicate;
        sums_on_cpu(&prepared, samples, take);
    })
}

fn on_gpu(device: &Device, program: &Program, scene: &Scene, samples: u32) -> Replicates {
    let prepared = Prepared::new(scene, 0);
    let job = prepared.job();
    // Recording the program takes longer than a replicate, and the seed is only a number of the scene.
    let mut tables = Tables::new(&job).unwrap();
    Replicates::of([scene.film.width, scene.film.height], samples, |replicate, take| {
        tables.scene.seed = scene.render.seed + APART + replicate;
        sums_on_gpu(device, program, (&job, &tables), samples, take);
    })
}

/// The plan of a scene's program.
fn plan(device: &Device, scene: &Scene) -> ProgramPlan {
    ProgramPlan::of(device, &Tables::new(&Prepared::new(scene, 0).job()).unwrap()).unwrap()
}

fn compiled(device: &Device, scene: &Scene) -> Program {
    Program::new(device, &scene.render, DispatchLimits::of(device), plan(device, scene)).unwrap()
}

/// The program with the first string of each pair replaced by the second.
fn changed(device: &Device, scene: &Scene, replaced: &[(&str, &str)]) -> Program {
    let (dispatch_limits, plan) = (DispatchLimits::of(device), plan(device, scene));
    let text = program::text(&scene.render, dispatch_limits.workgroup_size, &plan);
    let changed = replaced.iter().fold(text, |text, (right, wrong)| {
        assert!(text.contains(right), "{right:?} is not in the program");
        text.replacen(right, wrong, 1)
    });
    Program::from_source(device, &changed, dispatch_limits, plan).unwrap()
}

/// The scenes of the repository, at a small size.
pub(super) fn shipped() -> Vec<(String, Scene)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = folder.read_dir().unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    files.sort();
    let small = |path: &Path| {
        let mut scene = scene::load(path).unwrap().scene;
        (scene.film.width, scene.film.height) = (WIDTH, HEIGHT);
        (path.file_stem().unwrap().to_string_lossy().into_owned(), scene)
    };
    files.iter().map(|path| small(path)).collect()
}

/// Compares every scene × integrator × sampler with the CPU, but for programs that are too long.
fn hold(scenes: &[(&str, Scene)], integrators: &[Integrator], samplers: &[Sampler], samples: u32) {
    let Some(device) = device() else { return };
    let comparisons = scenes.len() * integrators.len() * samplers.len();
    let (mut compared, mut tiles) = (0, 0);
    let mut refused = Vec::new();
    for &integrator in integrators {
        for &sampler in samplers {
            let mut programs: Vec<Program> = Vec::new();
            for (seed, (name, scene)) in (0..).step_by(100).zip(scenes) {
                let mut scene = scenes::with(scene.clone(), integrator, sampler);
                scene.render.seed = seed;
                if is_left_out(&device, name, &scene) {
                    continue;
                }
                let plan = plan(&device, &scene);
                if !programs.iter().any(|program| program.plan == plan) {
                    programs.push(compiled(&device, &scene));
                }
                let program = programs.iter().find(|program| program.plan == plan).unwrap();
                let (ours, theirs) = (on_cpu(&scene, samples), on_gpu(&device, program, &scene, samples));
                let verdict = welch(&ours, &theirs);
                println!("{name}, {integrator:?}, {sampler:?}: {verdict}");
                compared += 1;
                tiles += verdict.tiles;
                if !verdict.agrees(comparisons) {
                    refused.push(format!(
                        "{name}, {integrator:?}, {sampler:?}: {verdict}; means {} and {}",
                        ours.mean(),
                        theirs.mean()
                    ));
                }
            }
        }
    }
    assert_eq!(refused, Vec::<String>::new());
    if compared == 0 {
        length::report_left_out(&scenes.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "));
        return;
    }
    // An empty scene would agree with anything.
    assert!(tiles >= 6 * compared, "only {tiles} tiles of {compared} images have anything in them");
}

/// Whether the program of a scene is too long for a comparison by default.
fn is_left_out(device: &Device, name: &str, scene: &Scene) -> bool {
    let limits = DispatchLimits::of(device);
    let text = program::text(&scene.render, limits.workgroup_size, &plan(device, scene));
    let length = length::lengths(&text)["trace_slots"];
    let is_left_out = length::is_too_long(device, length);
    if is_left_out {
        println!("{name}, {:?}: a length of {length} is left to the nightly set", scene.render.integrator);
    }
    is_left_out
}

#[test]
fn every_scene_agrees_with_every_integrator() {
    let scenes = shipped();
    assert!(scenes.len() >= 12);
    let named: Vec<_> = scenes.iter().map(|(name, scene)| (name.as_str(), scene.clone())).collect();
    hold(&named, &INTEGRATORS, &[Sampler::Sobol], 4);
}

#[test]
fn features_without_a_scene_agree_with_every_sampler() {
    // Large spheres: with a zero offset, rays would hit the wall that they leave.
    let scenes = [
        ("bazaar", scenes::bazaar(WIDTH, HEIGHT)),
        ("large spheres", scenes::large_spheres(WIDTH, HEIGHT)),
        ("lamps", scenes::lamps(WIDTH, HEIGHT)),
    ];
    hold(&scenes, &INTEGRATORS, &SAMPLERS, 8);
    // With lamps on the floor and shades around lamps, the variance of `whitted` may be infinite.
    let mut shop = scenes::shop(WIDTH, HEIGHT);
    hold(&[("shop", shop.clone())], &[Integrator::Path, Integrator::PathNaive], &SAMPLERS, 8);
    shop.entities[2..].iter_mut().for_each(|entity| entity.emission = [0.0; 3]);
    hold(&[("shop with one lamp", shop)], &[Integrator::Whitted], &SAMPLERS, 8);
}

/// Holds a scene with every integrator and one sampler.
fn hold_one(name: &str, scene: Scene, integrators: &[Integrator], samples: u32) {
    hold(&[(name, scene)], integrators, &[Sampler::Sobol], samples);
}

#[test]
fn textures_agree() {
    hold_one("gallery", gallery(WIDTH, HEIGHT), &INTEGRATORS, 6);
}

#[test]
fn an_environment_map_agrees() {
    hold_one("sunny", sunny(WIDTH, HEIGHT), &INTEGRATORS, 8);
}

#[test]
fn overlapping_dielectrics_agree() {
    hold_one("interiors", interiors(WIDTH, HEIGHT), &INTEGRATORS, 6);
}

#[test]
fn mixes_holes_and_maps_agree() {
    hold_one("modified", modified(WIDTH, HEIGHT), &[Integrator::Path, Integrator::Whitted], 6);
}

#[test]
fn textured_lights_and_second_uv_agree() {
    hold_one("glow", glow(WIDTH, HEIGHT), &[Integrator::Path], 6);
}

#[test]
fn meshes_and_trees_agree() {
    let scenes = [("crowd", scenes::crowd(WIDTH, HEIGHT)), ("copies", scenes::copies(WIDTH, HEIGHT))];
    assert!(Prepared::new(&scenes[1].1, 0).scene.surfaces.instances().is_some_and(|all| all.len() == 5));
    hold(&scenes, &[Integrator::Path, Integrator::PathNaive], &[Sampler::Sobol], 8);
    // `whitted` samples every light at every point; for lights near the point, the variance of a random point on them
    // may be infinite.
    hold_one("few lamps", scenes::crowd_with_few_lamps(WIDTH, HEIGHT), &[Integrator::Whitted], 8);
    hold_one("lamps of many triangles", scenes::lamps_of_triangles(WIDTH, HEIGHT), &[Integrator::Whitted], 8);
}

#[test]
fn groups_agree() {
    let scene = groups(WIDTH, HEIGHT);
    // Five instances of seven shapes, each with a lamp.
    assert!(Prepared::new(&scene, 0).scene.surfaces.instances().is_some_and(|all| all.of_groups() == 5));
    hold_one("groups", scene, &[Integrator::Path], 6);
}

#[test]
fn paths_without_a_depth_limit_agree() {
    let Some(device) = device() else { return };
    let mut scene = scenes::with(scenes::lamps(WIDTH, HEIGHT), Integrator::Path, Sampler::Sobol);
    scene.render.max_depth = UNLIMITED;
    let ours = on_cpu(&scene, 8);
    let theirs = on_gpu(&device, &compiled(&device, &scene), &scene, 8);
    let verdict = welch(&ours, &theirs);
    assert!(verdict.agrees(1), "{verdict}");
    // Negative control: at most two bounces.
    scene.render.max_depth = 2;
    let short = on_gpu(&device, &compiled(&device, &scene), &scene, 8);
    let verdict = welch(&ours, &short);
    assert!(!verdict.agrees(1), "{verdict}");
}

/// The result of the comparison for a program with `right` replaced by `wrong`.
fn verdict_on(scene: &Scene, samples: u32, right: &str, wrong: &str) -> Option<Verdict> {
    let device = device()?;
    let program = changed(&device, scene, &[(right, wrong)]);
    let verdict = welch(&on_cpu(scene, samples), &on_gpu(&device, &program, scene, samples));
    println!("{right:?} → {wrong:?}: {verdict}");
    Some(verdict)
}

#[test]
fn changed_constants_are_detected() {
    use Integrator::{Path, PathNaive, Whitted};
    use Sampler::{Independent, Sobol};
    let (mut changed, mut unnoticed) = (0, Vec::new());
    let (cover, bazaar) = (scenes::cover(WIDTH, HEIGHT), scenes::bazaar(WIDTH, HEIGHT));
    let (large, lamps) = (scenes::large_spheres(WIDTH, HEIGHT), scenes::lamps(WIDTH, HEIGHT));
    let (crowd, copies) = (scenes::crowd(WIDTH, HEIGHT), scenes::copies(WIDTH, HEIGHT));
    let (shop, of_triangles) = (scenes::shop(WIDTH, HEIGHT), scenes::lamps_of_triangles(WIDTH, HEIGHT));
    let grouped = groups(WIDTH, HEIGHT);
    // Fewer samples where the error is large.
    for (scene, integrator, sampler, samples, right, wrong) in [
        (
            &cover,
            PathNaive,
            Independent,
            16,
            "vec3f(-wo.x, -wo.y, wo.z), lobe.reflectance",
            "vec3f(-wo.x, -wo.y, wo.z), lobe.reflectance * 0.5f",
        ),
        // With a zero offset, rays hit the wall that they leave.
        (&large, PathNaive, Sobol, 4, "copysign(at.point.error, dot(at.point.n, d))", "0.0f"),
        (&cover, Whitted, Sobol, 4, "lobe.reflectance * 0.31830987f", "lobe.reflectance * 0.3f"),
        (&bazaar, Whitted, Independent, 16, "1.0f / light_sample.pdf", "0.9f / light_sample.pdf"),
        // A light is sampled with one probability and weighted with another.
        (&cover, Path, Sobol, 16, "= light_choice.pmf;", "= 0.9f * light_choice.pmf;"),
        (&lamps, Path, Independent, 16, "row.place, false)", "0u, false)"),
        (&lamps, Path, Sobol, 4, "1.0f / roulette_2.chance", "0.8f / roulette_2.chance"),
        (&cover, Path, Independent, 16, "* 5.9604645e-8f", "* 4.8e-8f"),
        // Triangle lights are sampled with one density and weighted with another.
        (&crowd, Path, Sobol, 8, "triangle_weights(u)", "triangle_weights(u * 0.7f)"),
        (&shop, Path, Independent, 24, "dot(at, at) <= 1.0", "dot(at, at) <= 0.5"),
        // A triangle of a mesh light is sampled with one probability and weighted with another.
        (&of_triangles, Whitted, Independent, 16, "pmf = chosen.pmf;", "pmf = 0.9 * chosen.pmf;"),
        // Shading normals differ from those of the vertices.
        (
            &crowd,
            PathNaive,
            Sobol,
            4,
            "return MeshVertex(bitcast<vec3f>(w0.xyz)",
            "return MeshVertex(bitcast<vec3f>(w0.xyz) + vec3f(0.3, 0.0, 0.0)",
        ),
        // Pending nodes are lost on the way up.
        (
            &crowd,
            PathNaive,
            Independent,
            4,
            "waiting = trail.newest.x & 255u;",
            "waiting = trail.newest.x & 15u;",
        ),
        // Rays that leave a mesh's space are not transformed back.
        (&copies, PathNaive, Sobol, 4, "ray = world_ray;\n                probe", "probe"),
        // In groups, spheres assume directions of unit length.
        (
            &grouped,
            PathNaive,
            Sobol,
            24,
            "t = sphere_intersect_any_length(surface, ray);",
            "t = sphere_intersect(surface, ray);",
        ),
    ] {
        let scene = scenes::with(scene.clone(), integrator, sampler);
        let Some(device) = device() else { return };
        if is_left_out(&device, right, &scene) {
            continue;
        }
        let Some(verdict) = verdict_on(&scene, samples, right, wrong) else { return };
        changed += 1;
        if verdict.agrees(1) {
            unnoticed.push(format!("{right:?} → {wrong:?}: {verdict}"));
        }
    }
    assert_eq!(unnoticed, Vec::<String>::new());
    assert!(changed >= 12, "only {changed} programs were changed");
}

#[test]
fn branches_beyond_the_limit_are_chosen_at_random_without_bias() {
    let Some(device) = device() else { return };
    let scene = scenes::with(scenes::bazaar(WIDTH, HEIGHT), Integrator::Whitted, Sampler::Sobol);
    let ours = on_cpu(&scene, 32);
    let program = changed(&device, &scene, &[("< MOST_BRANCHES", "< 1u")]);
    let verdict = welch(&ours, &on_gpu(&device, &program, &scene, 32));
    assert!(verdict.agrees(1), "{verdict}");
    // Negative control: the probability differs from the weight.
    let wrong = [("< MOST_BRANCHES", "< 1u"), ("choice >= ways.first.probability;", "choice >= 0.5;")];
    let program = changed(&device, &scene, &wrong);
    let verdict = welch(&ours, &on_gpu(&device, &program, &scene, 32));
    assert!(!verdict.agrees(1), "{verdict}");
}
