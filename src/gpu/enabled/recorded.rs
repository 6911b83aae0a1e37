//! The functions of the program that are recorded from the code that lanes run (see [`super::record`]), and where the
//! numbers that they read lie on the device.

use super::record::{RecordedFloat, RecordedMask, RecordedUint, Recording, Registry};
use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::integrator::{
    Asked, Lit, Observer, Settings, Spawned, State, Stepped, Transport, View, camera_ray, step,
};
use crate::light::{Groups, LightChoice};
use crate::material::{Branch, Bsdf, Bxdf, BxdfSample, TransportMode};
use crate::math::lanes::Function;
use crate::math::{ColumnReader, Float, Mask, Ray, Rgb, Vec3};
use crate::sampling::warp::FilmOffset;
use crate::sampling::{PathId, Sampler, independent};
use crate::scene::Integrator;
use crate::world::{CompiledScene, Corners, Hit, Instances, Place, SurfacePoint, Triangles, World};

type F = RecordedFloat;

/// What is recorded: an integrator over a scene.
pub(super) struct Source<'a> {
    pub(super) scene: &'a CompiledScene,
    pub(super) world: &'a World,
    pub(super) settings: &'a Settings,
    pub(super) integrator: Integrator,
}

/// A table whose columns are fields of the rows that a function of the program reads.
struct Rows<'r, 'a> {
    registry: &'r mut Registry<'a>,
    reader: &'static str,
}

impl<'a> ColumnReader<'a> for Rows<'_, 'a> {
    fn floats(&mut self, name: &'static str, column: &'a [f32]) {
        self.registry.column(column, self.reader, name);
    }

    fn words(&mut self, name: &'static str, column: &'a [u32]) {
        self.registry.words(column, self.reader, name);
    }

    fn vectors(&mut self, name: &'static str, columns: &'a [Vec<f32>; 3]) {
        self.registry.columns(columns, self.reader, name);
    }
}

/// The numbers and tables of a scene, by their names on the device.
fn registry<'a>(source: &Source<'a>) -> Registry<'a> {
    let CompiledScene { camera, surfaces, materials, lights, .. } = source.scene;
    let mut registry = Registry::new();
    let Camera { eye, left, up, forward, centre, pixel_side, near, aperture_radius, focus_distance } = camera;
    for (vector, name) in
        [(eye, "scene.eye"), (left, "scene.left"), (up, "scene.up"), (forward, "scene.forward")]
    {
        registry.vector(vector, name);
    }
    registry.vector(centre, "scene.centre");
    for (number, name) in [
        (pixel_side, "scene.pixel_side"),
        (near, "scene.near"),
        (aperture_radius, "scene.aperture_radius"),
        (focus_distance, "scene.focus_distance"),
    ] {
        registry.number(number, name);
    }
    let Settings { sampler, offset, max_depth } = source.settings;
    registry.word(max_depth, "scene.max_depth");
    match sampler {
        Sampler::Independent(independent) => registry.word(&independent.seed, "scene.seed"),
        Sampler::Sobol(sobol) => registry.word(&sobol.seed, "scene.seed"),
    };
    match offset {
        FilmOffset::Centre => {}
        FilmOffset::Uniform(radius) | FilmOffset::Tent(radius) => {
            registry.number(radius, "scene.offset_radius");
        }
        FilmOffset::Drawn(nodes) => {
            registry.array(nodes, "offset_node");
        }
    }
    registry.vector(&lights.environment().radiance, "scene.environment");
    let (centre, radius) = lights.extent();
    registry.vector(centre, "scene.extent_centre");
    registry.number(radius, "scene.extent_radius");
    registry.word(lights.delta_count(), "scene.delta_lights");
    registry.words(lights.delta_lights(), "light_at", "delta_light");
    let Groups { infinite, count, share } = lights.groups();
    registry.word(infinite, "scene.infinite_lights");
    registry.word(count, "scene.light_groups");
    registry.number(share, "scene.light_group_share");
    registry.words(lights.infinite_lights(), "light_at", "infinite_light");
    lights.columns(&mut Rows { registry: &mut registry, reader: "light_at" });
    materials.columns(&mut Rows { registry: &mut registry, reader: "material_at" });
    surfaces.columns(&mut Rows { registry: &mut registry, reader: "surface_at" });
    registry.column(surfaces.errors(), "surface_at", "error");
    if let Some(Triangles { rows, normals, uv: [u, v], .. }) = surfaces.triangles() {
        registry.words(rows, "triangle_at", "surface");
        registry.columns(normals, "vertex_at", "normal");
        registry.column(u, "vertex_at", "u").column(v, "vertex_at", "v");
    }
    if let Some(Instances { rows, .. }) = surfaces.instances() {
        registry.words(rows, "place_row_at", "surface");
    }
    registry
}

/// Records a function for the program, whether or not another one calls it: `function`; or the functions that it calls:
/// `callees`.
macro_rules! record {
    (
        $recording:ident.$method:ident,
        $name:ident($($parameter:ident: $Type:ty),* $(,)?) -> $Output:ty $body:block
    ) => {
        $recording.$method::<($($Type,)*), $Output>(
            const {
                &Function {
                    name: stringify!($name),
                    parameters: &[$(stringify!($parameter)),*],
                    module: module_path!(),
                }
            },
            |($($parameter,)*)| $body,
        )
    };
}

/// The structures and functions of an integrator over a scene as WGSL, for the hand-written rest of the program.
pub(super) fn text(source: &Source<'_>) -> Result<String, GpuError> {
    let program = record(source, false)?;
    Ok(program.text())
}

/// The same as a program; with `checks`, two functions of one name are an error.
pub(super) fn record(source: &Source<'_>, checks: bool) -> Result<super::record::Program, GpuError> {
    let Source { scene, world, settings, integrator } = source;
    let mut recording = Recording::new(registry(source), &[]);
    if checks {
        recording = recording.checked();
    }
    // The hand-written functions use these.
    recording.structure::<Ray<F>>();
    recording.structure::<Hit<F>>();
    recording.structure::<SurfacePoint<F>>();
    recording.structure::<LightChoice<F>>();
    recording.structure::<Corners<F>>();
    recording.structure::<Place<F>>();
    record!(recording.callees, calls_pcg4d(words: [RecordedUint; 4]) -> [RecordedUint; 4] { independent::pcg4d::<F>(words) });
    record!(recording.function, film_position(path: PathId<F>, centre: [F; 2]) -> [F; 2] {
        let (x, y, _) = camera_ray(settings, &scene.camera, path, centre);
        [x, y]
    });
    record!(recording.function, start_path(path: PathId<F>, centre: [F; 2]) -> State<F> {
        let (_, _, ray) = camera_ray(settings, &scene.camera, path, centre);
        State::start(path, ray)
    });
    let view = View { scene, world, settings };
    match Transport::of(*integrator) {
        Some(transport) => record!(recording.function, step_path(state: State<F>) -> Stepped<F> {
            step(transport, &view, state, RecordedMask::splat(true), &mut Observer::none())
        }),
        None => whitted(&mut recording, scene),
    }
    recording.finish().map_err(|error| GpuError::Unsupported(error.to_string()))
}

/// The functions that `whitted` calls: its branches wait in memory, so that it is written by hand.
fn whitted(recording: &mut Recording<'_>, scene: &CompiledScene) {
    const MODE: TransportMode = TransportMode::Radiance;
    record!(recording.function, escaped_radiance(d: Vec3<F>) -> Rgb<F> {
        scene.lights.escaped(d, |_| F::splat(1.0))
    });
    record!(recording.function, lit_point(ray: Ray<F>, hit: Hit<F>) -> Lit<F> { Lit::new(scene, &ray, &hit) });
    record!(recording.callees, calls_bsdf_albedo(bsdf: Bsdf<F>) -> Rgb<F> { bsdf.albedo() });
    record!(recording.callees, calls_bsdf_sample(bsdf: Bsdf<F>, wo: Vec3<F>, u: [F; 2], choice: F) -> BxdfSample<F> {
        bsdf.sample(wo, u, choice, MODE)
    });
    record!(recording.callees, calls_bsdf_branches(bsdf: Bsdf<F>, wo: Vec3<F>) -> [Branch<F>; 2] { bsdf.branches(wo, MODE) });
    record!(recording.function, spawn(lit: Lit<F>, wi: Vec3<F>) -> Spawned<F> { lit.spawn(scene, wi) });
    record!(recording.function, light_share(lit: Lit<F>, light: RecordedUint, chance: F, u: [F; 2]) -> Asked<F> {
        lit.share_of(scene, light, chance, u)
    });
}
