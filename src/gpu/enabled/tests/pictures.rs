//! Images of the GPU and the CPU, compared statistically with different seeds.
//!
//! The tests are those for integrators, at the level stated in `tests/common/tiles.rs`, once for all comparisons of a
//! test. As seeds are fixed, results are reproducible on one device.

use super::gallery::{gallery, glow, groups, interiors, modified, sunny};
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
        (scene.film.width, scene.film.height) = (48, 32);
        (path.file_stem().unwrap().to_string_lossy().into_owned(), scene)
    };
    files.iter().map(|path| small(path)).collect()
}

/// Compares every scene × integrator × sampler with the CPU.
fn hold_all(scenes: &[(String, Scene)], integrators: &[Integrator], samples: u32) {
    hold(scenes, integrators, &SAMPLERS, samples);
}

/// Holds a scene whose program a device in software takes long over, with every integrator and one sampler.
fn hold_one(name: &str, scene: Scene, integrators: &[Integrator], samples: u32) {
    hold(&[(name.to_owned(), scene)], integrators, &[Sampler::Sobol], samples);
}

fn hold(scenes: &[(String, Scene)], integrators: &[Integrator], samplers: &[Sampler], samples: u32) {
    let Some(device) = device() else { return };
    let comparisons = scenes.len() * integrators.len() * samplers.len();
    let mut refused = Vec::new();
    let mut tiles = 0;
    for &integrator in integrators {
        for &sampler in samplers {
            let mut programs: Vec<Program> = Vec::new();
            for (seed, (name, scene)) in (0..).step_by(100).zip(scenes) {
                let mut scene = scenes::with(scene.clone(), integrator, sampler);
                scene.render.seed = seed;
                let plan = plan(&device, &scene);
                if !programs.iter().any(|program| program.plan == plan) {
                    programs.push(compiled(&device, &scene));
                }
                let program = programs.iter().find(|program| program.plan == plan).unwrap();
                let (ours, theirs) = (on_cpu(&scene, samples), on_gpu(&device, program, &scene, samples));
                let verdict = welch(&ours, &theirs);
                println!("{name}, {integrator:?}, {sampler:?}: {verdict}");
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
    // An empty scene would agree with anything.
    assert!(tiles > 12 * comparisons, "only {tiles} tiles have anything in them");
}

#[test]
fn every_scene_agrees_with_every_integrator_and_sampler() {
    let scenes = shipped();
    assert!(scenes.len() >= 12);
    // Not every product of both: a device in software takes minutes for the programs.
    hold(&scenes, &INTEGRATORS, &[Sampler::Sobol], 4);
    hold(&scenes, &[Integrator::Path], &[Sampler::Independent], 4);
}

#[test]
fn features_without_a_scene_agree() {
    // Large spheres: with a zero offset, rays would hit the wall that they leave.
    let scenes = [
        ("bazaar", scenes::bazaar(48, 32)),
        ("large spheres", scenes::large_spheres(48, 32)),
        ("lamps", scenes::lamps(48, 32)),
    ];
    hold_all(&scenes.map(|(name, scene)| (name.to_owned(), scene)), &INTEGRATORS, 16);
    // With lamps on the floor and shades around lamps, the variance of `whitted` may be infinite.
    let mut shop = scenes::shop(48, 32);
    hold_all(&[("shop".to_owned(), shop.clone())], &[Integrator::Path, Integrator::PathNaive], 16);
    shop.entities[2..].iter_mut().for_each(|entity| entity.emission = [0.0; 3]);
    hold_all(&[("shop with one lamp".to_owned(), shop)], &[Integrator::Whitted], 16);
}

#[test]
fn textures_agree() {
    hold_one("gallery", gallery(48, 32), &INTEGRATORS, 6);
}

#[test]
fn an_environment_map_agrees() {
    hold_one("sunny", sunny(48, 32), &INTEGRATORS, 8);
}

#[test]
fn overlapping_dielectrics_agree() {
    hold_one("interiors", interiors(48, 32), &INTEGRATORS, 6);
}

#[test]
fn mixes_holes_and_maps_agree() {
    hold_one("modified", modified(48, 32), &[Integrator::Path, Integrator::Whitted], 6);
}

#[test]
fn textured_lights_and_second_uv_agree() {
    hold_one("glow", glow(48, 32), &[Integrator::Path], 6);
}

#[test]
fn meshes_and_trees_agree() {
    let scenes = [("crowd", scenes::crowd(48, 32)), ("copies", scenes::copies(48, 32))];
    assert!(Prepared::new(&scenes[1].1, 0).scene.surfaces.instances().is_some_and(|all| all.len() == 5));
    let scenes = scenes.map(|(name, scene)| (name.to_owned(), scene));
    hold_all(&scenes, &[Integrator::Path, Integrator::PathNaive], 8);
    // `whitted` samples every light at every point; for lights near the point, the variance of a random point on them
    // may be infinite.
    let few_lamps = ("few lamps".to_owned(), scenes::crowd_with_few_lamps(48, 32));
    let of_triangles = ("lamps of many triangles".to_owned(), scenes::lamps_of_triangles(48, 32));
    hold_all(&[few_lamps, of_triangles], &[Integrator::Whitted], 8);
}

#[test]
fn groups_agree() {
    let scene = groups(48, 32);
    // Five instances of seven shapes, each with a lamp.
    assert!(Prepared::new(&scene, 0).scene.surfaces.instances().is_some_and(|all| all.of_groups() == 5));
    hold_all(&[("groups".to_owned(), scene)], &[Integrator::Path], 6);
}

#[test]
fn paths_without_a_depth_limit_agree() {
    let Some(device) = device() else { return };
    let mut scene = scenes::with(scenes::lamps(48, 32), Integrator::Path, Sampler::Sobol);
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
    let mut unnoticed = Vec::new();
    let (cover, bazaar) = (scenes::cover(48, 32), scenes::bazaar(48, 32));
    let (large, lamps) = (scenes::large_spheres(48, 32), scenes::lamps(48, 32));
    let (crowd, copies) = (scenes::crowd(48, 32), scenes::copies(48, 32));
    let (shop, of_triangles) = (scenes::shop(48, 32), scenes::lamps_of_triangles(48, 32));
    let grouped = groups(48, 32);
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
        (&crowd, Path, Sobol, 16, "triangle_weights(u)", "triangle_weights(u * 0.7f)"),
        (&shop, Path, Independent, 16, "dot(at, at) <= 1.0", "dot(at, at) <= 0.8"),
        // A triangle of a mesh light is sampled with one probability and weighted with another.
        (&of_triangles, Whitted, Independent, 16, "pmf = chosen.pmf;", "pmf = 0.9 * chosen.pmf;"),
        // Shading normals differ from those of the vertices.
        (
            &crowd,
            PathNaive,
            Sobol,
            16,
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
        let Some(verdict) = verdict_on(&scene, samples, right, wrong) else { return };
        if verdict.agrees(1) {
            unnoticed.push(format!("{right:?} → {wrong:?}: {verdict}"));
        }
    }
    assert_eq!(unnoticed, Vec::<String>::new());
}

#[test]
fn branches_beyond_the_limit_are_chosen_at_random_without_bias() {
    let Some(device) = device() else { return };
    let scene = scenes::with(scenes::bazaar(48, 32), Integrator::Whitted, Sampler::Sobol);
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
