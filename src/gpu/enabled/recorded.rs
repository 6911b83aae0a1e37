//! The functions that are recorded from the code that lanes run (see [`super::record`]), and the locations on the
//! device of the numbers that they read.

use super::layout::Scene;
use super::record::{RecordedFloat, RecordedMask, RecordedUint, Recording, Registry};
use crate::camera::Camera;
use crate::gpu::GpuError;
use crate::integrator::{
    Around, LampSample, Lit, Settings, Spawned, State, Stepped, TraceContext, Transport, absorbed,
    camera_ray, step_with,
};
use crate::light::{LightChoice, LightGroups};
use crate::material::{Branch, Bxdf, BxdfSample, Local, TransportMode};
use crate::math::lanes::Function;
use crate::math::{ColumnReader, Float, Mask, Ray, Rgb, Vec3};
use crate::sampling::warp::FilmOffset;
use crate::sampling::{PathId, Sampler, independent};
use crate::scene::Integrator;
use crate::world::{
    CompiledScene, Corners, Hit, InstanceTransform, Instances, SurfacePoint, Triangles, World,
};

type F = RecordedFloat;

/// The input of a recording: an integrator and a scene.
pub(super) struct Source<'a> {
    pub(super) scene: &'a CompiledScene,
    pub(super) world: &'a World,
    pub(super) settings: &'a Settings,
    pub(super) integrator: Integrator,
}

/// A table whose columns are fields of the rows that a device function reads.
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

/// Reads the numbers of a scene, each under the name of its field in [`Scene`].
trait NumberReader<'a> {
    fn float(&mut self, name: &'static str, number: &'a f32);
    fn word(&mut self, name: &'static str, number: &'a u32);
    fn vector<const N: usize>(&mut self, name: &'static str, vector: &'a [f32; N]);
}

impl<'a> NumberReader<'a> for Registry<'a> {
    fn float(&mut self, name: &'static str, number: &'a f32) {
        self.number(number, &format!("scene.{name}"));
    }

    fn word(&mut self, name: &'static str, number: &'a u32) {
        Registry::word(self, number, &format!("scene.{name}"));
    }

    fn vector<const N: usize>(&mut self, name: &'static str, vector: &'a [f32; N]) {
        Registry::vector(self, vector, &format!("scene.{name}"));
    }
}

impl<'a> NumberReader<'a> for Scene {
    fn float(&mut self, name: &'static str, number: &'a f32) {
        self.set(name, &[number.to_bits()]);
    }

    fn word(&mut self, name: &'static str, number: &'a u32) {
        self.set(name, &[*number]);
    }

    fn vector<const N: usize>(&mut self, name: &'static str, vector: &'a [f32; N]) {
        self.set(name, &vector.map(f32::to_bits));
    }
}

/// The numbers of a scene that its program looks up.
fn read_numbers<'a>(scene: &'a CompiledScene, settings: &'a Settings, reader: &mut impl NumberReader<'a>) {
    let CompiledScene { camera, lights, inside: [inside_x, inside_y], .. } = scene;
    let Camera {
        eye,
        left,
        up,
        forward,
        centre,
        pixel_side,
        is_orthographic: _,
        near,
        aperture_radius,
        focus_distance,
    } = camera;
    reader.vector("eye", eye);
    reader.vector("left", left);
    reader.vector("up", up);
    reader.vector("forward", forward);
    reader.vector("centre", centre);
    reader.float("pixel_side", pixel_side);
    reader.float("near", near);
    reader.float("aperture_radius", aperture_radius);
    reader.float("focus_distance", focus_distance);
    let Settings { sampler, offset, max_depth } = settings;
    reader.word("max_depth", max_depth);
    match sampler {
        Sampler::Independent(independent) => reader.word("seed", &independent.seed),
        Sampler::Sobol(sobol) => reader.word("seed", &sobol.seed),
    }
    if let FilmOffset::Uniform(radius) | FilmOffset::Tent(radius) = offset {
        reader.float("offset_radius", radius);
    }
    reader.vector("environment", &lights.environment().radiance);
    let smooth = lights.grids().smooth();
    reader.word("smooth_columns", smooth.columns());
    reader.word("smooth_rows", smooth.rows());
    let (centre, radius) = lights.extent();
    reader.vector("extent_centre", centre);
    reader.float("extent_radius", radius);
    reader.word("delta_lights", lights.delta_count());
    reader.word("inside_x", inside_x);
    reader.word("inside_y", inside_y);
    let LightGroups { infinite, count } = lights.groups();
    reader.word("infinite_lights", infinite);
    reader.word("light_groups", count);
}

/// The numbers of a scene that its program looks up, in the device's layout; all others are zero.
pub(super) fn numbers(scene: &CompiledScene, settings: &Settings) -> Scene {
    let mut numbers = Scene::default();
    read_numbers(scene, settings, &mut numbers);
    numbers
}

/// The numbers and tables of a scene, by their names on the device.
fn registry<'a>(source: &Source<'a>) -> Registry<'a> {
    let CompiledScene { surfaces, materials, lights, .. } = source.scene;
    let mut registry = Registry::new();
    read_numbers(source.scene, source.settings, &mut registry);
    if let FilmOffset::Drawn(nodes) = &source.settings.offset {
        registry.array(nodes, "offset_node");
    }
    registry.words(lights.delta_lights(), "light_at", "delta_light");
    registry.words(lights.infinite_lights(), "light_at", "infinite_light");
    lights.columns(&mut Rows { registry: &mut registry, reader: "light_at" });
    materials.columns(&mut Rows { registry: &mut registry, reader: "material_at" });
    materials.media_columns(&mut Rows { registry: &mut registry, reader: "medium_at" });
    materials.bindings().columns(&mut Rows { registry: &mut registry, reader: "binding_at" });
    let textures = materials.textures();
    textures.instruction_columns(&mut Rows { registry: &mut registry, reader: "instruction_at" });
    textures.picture_columns(&mut Rows { registry: &mut registry, reader: "picture_at" });
    lights.grids().columns(&mut Rows { registry: &mut registry, reader: "cell_at" });
    lights.corner_uv().columns(&mut Rows { registry: &mut registry, reader: "corner_at" });
    surfaces.columns(&mut Rows { registry: &mut registry, reader: "surface_at" });
    registry.column(surfaces.errors(), "surface_at", "error");
    if let Some(Triangles { rows, normals, uv: [u, v], second_uv: [u1, v1], .. }) = surfaces.triangles() {
        registry.words(rows, "triangle_at", "surface");
        registry.columns(normals, "vertex_at", "normal");
        registry.column(u, "vertex_at", "u").column(v, "vertex_at", "v");
        registry.column(u1, "vertex_at", "second_u").column(v1, "vertex_at", "second_v");
    }
    if let Some(Instances { rows, .. }) = surfaces.instances() {
        registry.words(rows, "place_row_at", "surface");
    }
    registry
}

/// Records a function for the program, whether or not another one calls it (`function`), or only its callees
/// (`callees`).
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

/// The structures and functions of an integrator for a scene as WGSL, for the hand-written rest of the program.
pub(super) fn text(source: &Source<'_>) -> Result<String, GpuError> {
    let program = record(source, false)?;
    Ok(program.text())
}

/// The recorded program; with `checks`, different functions with one name are an error.
pub(super) fn record(source: &Source<'_>, checks: bool) -> Result<super::record::Program, GpuError> {
    let Source { scene, world, settings, integrator } = source;
    let mut recording = Recording::new(registry(source), &[]);
    if checks {
        recording = recording.checked();
    }
    // Used by the hand-written functions.
    recording.structure::<Ray<F>>();
    recording.structure::<Hit<F>>();
    recording.structure::<SurfacePoint<F>>();
    recording.structure::<LightChoice<F>>();
    recording.structure::<Corners<F>>();
    recording.structure::<InstanceTransform<F>>();
    record!(recording.callees, calls_pcg4d(words: [RecordedUint; 4]) -> [RecordedUint; 4] { independent::pcg4d::<F>(words) });
    record!(recording.function, film_position(path: PathId<F>, centre: [F; 2]) -> [F; 2] {
        let (x, y, _) = camera_ray(settings, &scene.camera, path, centre);
        [x, y]
    });
    record!(recording.function, start_path(path: PathId<F>, centre: [F; 2]) -> State<F> {
        let (_, _, ray) = camera_ray(settings, &scene.camera, path, centre);
        State::start(path, ray)
    });
    record!(recording.function, start_around() -> Around<F> { Around::at_camera(scene) });
    let context = TraceContext { scene, world, settings };
    match Transport::of(*integrator) {
        Some(transport) => record!(
            recording.function,
            step_path(state: State<F>, around: Around<F>) -> (Stepped<F>, Around<F>) {
                step_with(transport, &context, state, around, RecordedMask::splat(true))
            }
        ),
        None => whitted(&mut recording, &context),
    }
    recording.finish().map_err(|error| GpuError::Unsupported(error.to_string()))
}

/// The functions that `whitted` calls. It is hand-written itself because its branches are stored in memory.
fn whitted(recording: &mut Recording<'_>, context: &TraceContext<'_>) {
    const MODE: TransportMode = TransportMode::Radiance;
    let scene = context.scene;
    let bsdf = |local| scene.materials.bsdf_of::<F>(local);
    record!(recording.function, escaped_radiance(d: Vec3<F>) -> Rgb<F> {
        scene.lights.escaped(d, |_| F::splat(1.0))
    });
    record!(recording.function, absorbed_along(around: Around<F>, beta: Rgb<F>, t: F) -> Rgb<F> {
        absorbed(scene, &around, beta, t)
    });
    record!(recording.function, lit_point(state: State<F>, around: Around<F>, hit: Hit<F>) -> Lit<F> {
        Lit::new(context, &state, around, &hit)
    });
    record!(recording.function, light_through(lamp_sample: LampSample<F>, state: State<F>, around: Around<F>) -> Rgb<F> {
        lamp_sample.through(context, &state, &around)
    });
    record!(recording.function, pass_on(lit: Lit<F>, ray: Ray<F>) -> Spawned<F> { lit.pass_on(&ray) });
    record!(recording.callees, calls_bsdf_albedo(local: Local<F>) -> Rgb<F> { bsdf(local).albedo() });
    record!(recording.callees, calls_bsdf_sample(local: Local<F>, wo: Vec3<F>, u: [F; 2], choice: F) -> BxdfSample<F> {
        bsdf(local).sample(wo, u, choice, MODE)
    });
    record!(recording.callees, calls_bsdf_branches(local: Local<F>, wo: Vec3<F>) -> [Branch<F>; 2] { bsdf(local).branches(wo, MODE) });
    record!(recording.function, spawn(lit: Lit<F>, wi: Vec3<F>) -> Spawned<F> { lit.spawn(scene, wi) });
    record!(recording.function, light_share(lit: Lit<F>, light: RecordedUint, pmf: F, u: [F; 2]) -> LampSample<F> {
        lit.share_of(scene, light, pmf, u)
    });
}
