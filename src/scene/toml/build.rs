//! From tables whose keys are known to a [`Scene`]: what no single key can check.

use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::form::{Fields, Named, Placed};
use super::keys;
use super::materials::{self, Raw};
use super::report::{Reported, Reports, instead, quote};
use super::value::unit;
use crate::scene::description::{
    CameraSettings, Colour, Entity, FilmMode, FilmSettings, Filter, Integrator, Light, Material, Mesh,
    RenderSettings, Sampler, Scene, Shape, Tone, endless,
};
use crate::scene::mesh::{FileMaterial, MeshFile, Split};
use crate::scene::open_glass::{Warning, open_glass};

/// The sine of the angle below which two directions count as parallel: a basis built on them in 32 bits would
/// be noise.
const PARALLEL: f64 = 1e-6;

/// A normal whose length is one but for this much is one whose components were rounded to three digits.
const UNIT_LENGTH: f64 = 1e-3;

type Read<T> = Result<T, Reported>;

/// An entity whose material is still a name. Its parts are kept apart, so that a wrong shape does not hide a
/// wrong material.
pub(super) struct RawEntity {
    name: Read<Option<Placed<String>>>,
    shape: Read<RawShape>,
    material: Read<Placed<String>>,
    emission: Read<Colour>,
    flip_normal: Read<bool>,
}

/// A shape, or the parts of a mesh, each of which becomes an entity.
pub(super) enum RawShape {
    One(Shape),
    Parts(Vec<RawPart>),
}

/// A part of a mesh.
pub(super) struct RawPart {
    /// Its group or material in the file; empty for what no name is for.
    name: String,
    shape: Shape,
    material: RawMaterial,
}

/// Where a part has its material from.
enum RawMaterial {
    /// Its entity.
    Entity,
    /// The scene's of this name.
    Named(Placed<String>),
    /// The mesh file at this path, as the scene names it.
    OfFile(String, FileMaterial),
}

/// What a scene says of the materials of a mesh's parts.
#[derive(Clone, Debug)]
pub(super) enum PartMaterials {
    /// They are the file's.
    OfFile,
    /// Those of groups and materials of the file.
    Named(Vec<Named<Placed<String>>>),
}

pub(super) fn scene(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Scene> {
    let film = fields.get(&keys::FILM, reports);
    let camera = fields.get(&keys::CAMERA, reports);
    let render = fields.get(&keys::RENDER, reports);
    let raw_materials = fields.get(&keys::MATERIALS, reports);
    let raw_entities = fields.get(&keys::ENTITIES, reports);
    let lights = fields.get(&keys::LIGHTS, reports);
    let environment = fields.get(&keys::ENVIRONMENT, reports);

    let raw_materials = raw_materials?;
    let names = materials::Names::new(&raw_materials);
    let mut of_files = OfFiles { first: raw_materials.len(), materials: Vec::new(), seen: HashMap::new() };
    let entities = raw_entities.and_then(|raw| link_entities(raw, &names, &mut of_files, reports));
    let mut resolved = materials::resolve(&raw_materials, &names, reports)?;
    let Linked { mut entities, places, mut used } = entities?;

    for entity in &mut entities {
        // Those of mesh files come after the scene's own.
        entity.material = match resolved.index_of.get(entity.material) {
            Some(&index) => index,
            None => entity.material,
        };
    }
    let mut used_in_order = vec![false; raw_materials.len()];
    used.drain(..).for_each(|material| used_in_order[resolved.index_of[material]] = true);
    materials::warn_of_unused(&raw_materials, &resolved, used_in_order, reports);
    resolved.materials.extend(of_files.materials);

    let scene = Scene {
        film: film?,
        camera: camera?,
        render: render?,
        materials: resolved.materials,
        entities,
        lights: lights?,
        environment: environment?,
    };
    warn_of_darkness(&scene, reports);
    for Warning { first, message, help } in open_glass(&scene, quote) {
        reports.warn(Some(places[first]), message, help);
    }
    Ok(scene)
}

/// Entities whose materials are indices.
#[derive(Default)]
struct Linked {
    entities: Vec<Entity>,
    /// Where each names its material.
    places: Vec<usize>,
    /// The materials that are named.
    used: Vec<usize>,
}

/// The materials of mesh files, numbered after the scene's own.
struct OfFiles {
    first: usize,
    materials: Vec<Material>,
    seen: HashMap<(String, String), usize>,
}

impl OfFiles {
    /// The index of a material of the file at a path.
    fn index(&mut self, path: String, material: FileMaterial) -> usize {
        let next = self.first + self.materials.len();
        let FileMaterial { name, kind, .. } = material;
        *self.seen.entry((path, name)).or_insert_with_key(|(path, name)| {
            self.materials.push(Material { name: format!("{path}: {name}"), kind });
            next
        })
    }
}

/// Resolves material names to indices in the order of the file. Parts of meshes become entities of their own.
fn link_entities(
    raw: Vec<RawEntity>,
    materials: &materials::Names<'_>,
    of_files: &mut OfFiles,
    reports: &mut Reports<'_>,
) -> Read<Linked> {
    let mut seen = HashMap::new();
    let Linked { mut entities, mut places, mut used } = Linked::default();
    let mut outcome = Ok(());
    for (i, raw) in raw.into_iter().enumerate() {
        let place = raw.material.as_ref().map_or(0, |name| name.at);
        let material = raw.material.and_then(|name| materials.find(&name, reports));
        if let Ok(Some(name)) = &raw.name
            && let Some(first) = seen.insert(name.value.clone(), i + 1)
        {
            // Legal: nothing refers to an entity by name but messages, which would be ambiguous.
            let message = format!("entity {} has the name of entity {first}, {}", i + 1, quote(&name.value));
            reports.warn(Some(name.at), message, "messages will not tell them apart");
        }
        let link = || {
            let (shape, material) = (raw.shape?, material?);
            let name = raw.name?.map_or_else(|| format!("entity {}", i + 1), |name| name.value);
            let (emission, flip_normal) = (raw.emission?, raw.flip_normal?);
            let parts = match shape {
                RawShape::One(shape) => {
                    vec![RawPart { name: String::new(), shape, material: RawMaterial::Entity }]
                }
                RawShape::Parts(parts) => parts,
            };
            used.push(material);
            let mut linked = Ok(());
            for part in parts {
                let (material, emission) = match part.material {
                    RawMaterial::Entity => (material, emission),
                    RawMaterial::Named(name) => match materials.find(&name, reports) {
                        Ok(material) => (material, emission),
                        Err(reported) => {
                            linked = Err(reported);
                            continue;
                        }
                    },
                    RawMaterial::OfFile(path, material) => {
                        let dark = material.emission == [0.0; 3];
                        let emission = if dark { emission } else { material.emission };
                        (of_files.index(path, material), emission)
                    }
                };
                if material < of_files.first {
                    used.push(material);
                }
                let separator = if part.name.is_empty() { "" } else { ": " };
                let name = format!("{name}{separator}{}", part.name);
                entities.push(Entity { name, shape: part.shape, material, emission, flip_normal });
                places.push(place);
            }
            linked
        };
        if let Err(reported) = link() {
            outcome = Err(reported);
        }
    }
    outcome.map(|()| Linked { entities, places, used })
}

/// Warns of a scene that can only be black.
fn warn_of_darkness(scene: &Scene, reports: &mut Reports<'_>) {
    if scene.entities.is_empty() {
        reports.warn(None, "there is nothing in this scene", "add [[entities]] with a shape and a material");
    }
    if !scene.has_light() {
        let help = "give an entity an emission, or add [[lights]] or an [environment]";
        reports.warn(None, "there is no light in this scene: the picture will be black", help);
    }
}

pub(super) fn film(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<FilmSettings> {
    let width = fields.get(&keys::WIDTH, reports);
    let height = fields.get(&keys::HEIGHT, reports);
    let exposure = fields.get(&keys::EXPOSURE, reports);
    let tone = fields.get(&keys::TONE, reports);
    let filter = fields.get(&keys::FILTER, reports);
    let mode = fields.find(&keys::MODE, reports);
    let film = FilmSettings {
        width: width?,
        height: height?,
        exposure: exposure?,
        tone: tone?,
        filter: filter?,
        mode: mode?,
    };
    match film.problem() {
        None => Ok(film),
        Some(problem) => {
            let given = fields.has(&keys::MODE);
            let at = if given { fields.place_of(&keys::MODE) } else { fields.place_of(&keys::FILTER) };
            Err(reports.error(at, problem))
        }
    }
}

pub(super) fn no_filter(_: &Fields<'_, '_>, _: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::None)
}

pub(super) fn box_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::Box { radius: fields.get(&keys::BOX_RADIUS, reports)? })
}

pub(super) fn tent_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::Tent { radius: fields.get(&keys::TENT_RADIUS, reports)? })
}

pub(super) fn gaussian_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    let radius = fields.get(&keys::GAUSSIAN_RADIUS, reports);
    let sigma = fields.get(&keys::SIGMA, reports);
    Ok(Filter::Gaussian { radius: radius?, sigma: sigma? })
}

pub(super) fn mitchell_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    let radius = fields.get(&keys::MITCHELL_RADIUS, reports);
    let b = fields.get(&keys::MITCHELL_B, reports);
    let c = fields.get(&keys::MITCHELL_C, reports);
    Ok(Filter::Mitchell { radius: radius?, b: b?, c: c? })
}

pub(super) fn blackman_harris_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::BlackmanHarris { radius: fields.get(&keys::BLACKMAN_HARRIS_RADIUS, reports)? })
}

pub(super) fn lanczos_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::Lanczos { radius: fields.get(&keys::LANCZOS_RADIUS, reports)? })
}

pub(super) fn camera(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<CameraSettings> {
    let eye = fields.get(&keys::EYE, reports);
    let forward = view_direction(fields, eye, reports);
    let up = fields.get(&keys::UP, reports);
    let vertical_fov = fields.get(&keys::VERTICAL_FOV, reports);
    let near = fields.get(&keys::NEAR, reports);
    let focal_length = fields.get(&keys::FOCAL_LENGTH, reports);
    let aperture_radius = fields.get(&keys::APERTURE_RADIUS, reports);
    let focus_distance = fields.find(&keys::FOCUS_DISTANCE, reports);

    let up = match (forward, up) {
        (Ok((forward, at)), Ok(up)) if forward.cross(up).length() < PARALLEL => {
            let given = fields.has(&keys::UP);
            let at = if given { fields.place_of(&keys::UP) } else { at };
            let message = if given {
                "up is parallel to the direction of view"
            } else {
                "the direction of view is parallel to up, which is [0, 0, 1] unless the file says otherwise"
            };
            let other = if forward.z.abs() < 0.5 { "[0, 0, 1]" } else { "[0, 1, 0]" };
            Err(reports.error_with(at, message, |_| Some(format!("up = {other} would do"))))
        }
        (_, up) => up,
    };
    let focus_distance = match (focus_distance, &aperture_radius) {
        (Ok(None), Ok(_)) if fields.has(&keys::APERTURE_RADIUS) => {
            let at = fields.place_of(&keys::APERTURE_RADIUS);
            let message = "missing key \"focus_distance\" in the camera: a lens needs one";
            let help = "give focus_distance, or take aperture_radius away for a pinhole";
            Err(reports.error_with(at, message, |_| Some(help.into())))
        }
        (focus_distance, _) => focus_distance,
    };

    let focal_length = focal_length?;
    Ok(CameraSettings {
        eye: eye?,
        forward: forward?.0,
        up: up?,
        vertical_fov: vertical_fov?.to_radians(),
        focal_length,
        near: near?,
        aperture_radius: aperture_radius?,
        // A pinhole renders every distance sharp.
        focus_distance: focus_distance?.unwrap_or(focal_length),
    })
}

/// The direction of view, of length one, and where the file says so.
fn view_direction(
    fields: &Fields<'_, '_>,
    eye: Read<DVec3>,
    reports: &mut Reports<'_>,
) -> Read<(DVec3, usize)> {
    let forward = fields.get(&keys::FORWARD, reports);
    let look_at = fields.find(&keys::LOOK_AT, reports);
    if !fields.has(&keys::LOOK_AT) {
        return Ok((forward?, fields.place_of(&keys::FORWARD)));
    }
    let at = fields.place_of(&keys::LOOK_AT);
    if fields.has(&keys::FORWARD) {
        let message = "the camera has both forward and look_at";
        return Err(reports.error_with(at, message, |_| Some("keep one of them".into())));
    }
    let way = look_at?.map_or(DVec3::ZERO, |point| point) - eye?;
    if way == DVec3::ZERO {
        return Err(reports.error(at, "look_at is the same point as eye: there is no direction of view"));
    }
    Ok((unit(way), at))
}

pub(super) fn render(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RenderSettings> {
    let integrator = fields.get(&keys::INTEGRATOR, reports);
    let sampler = fields.get(&keys::SAMPLER, reports);
    let max_depth = fields.get(&keys::MAX_DEPTH, reports);
    let samples = fields.get(&keys::SAMPLES, reports);
    let adaptive = fields.get(&keys::ADAPTIVE, reports);
    let seed = fields.get(&keys::SEED, reports);
    let ambient = fields.get(&keys::AMBIENT, reports);
    let (integrator, max_depth, ambient) = (integrator?, max_depth?, ambient?);
    if let Some(problem) = endless(integrator, max_depth) {
        return Err(reports.error(fields.place_of(&keys::MAX_DEPTH), problem));
    }
    if integrator != Integrator::Whitted && ambient.value != [0.0; 3] {
        let message = "ambient has no effect: only integrator \"whitted\" has an ambient term";
        reports.warn(Some(ambient.at), message, "light the scene with an [environment] instead");
    }
    Ok(RenderSettings {
        integrator,
        sampler: sampler?,
        max_depth,
        samples: samples?,
        adaptive: adaptive?,
        seed: seed?,
        ambient: ambient.value,
    })
}

pub(super) fn environment(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Colour> {
    fields.get(&keys::ENVIRONMENT_RADIANCE, reports)
}

pub(super) fn matte(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    Ok(Raw::Matte { reflectance: fields.get(&keys::REFLECTANCE, reports)? })
}

pub(super) fn mirror(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    Ok(Raw::Mirror { reflectance: fields.get(&keys::REFLECTANCE, reports)? })
}

pub(super) fn glass(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    let ior = fields.get(&keys::IOR, reports);
    let reflectance = fields.get(&keys::GLASS_REFLECTANCE, reports);
    let transmittance = fields.get(&keys::TRANSMITTANCE, reports);
    Ok(Raw::Glass { ior: ior?, reflectance: reflectance?, transmittance: transmittance? })
}

pub(super) fn checkerboard(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    let even = fields.get(&keys::EVEN, reports);
    let odd = fields.get(&keys::ODD, reports);
    let checks_per_unit = fields.get(&keys::CHECKS_PER_UNIT, reports);
    Ok(Raw::Checkerboard { even, odd, checks_per_unit })
}

#[cfg(feature = "broken-material")]
pub(super) fn broken(_: &Fields<'_, '_>, _: &mut Reports<'_>) -> Read<Raw> {
    Ok(Raw::Broken)
}

pub(super) fn entity(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawEntity> {
    Ok(RawEntity {
        name: fields.find(&keys::NAME, reports),
        shape: fields.get(&keys::SHAPE, reports),
        material: fields.get(&keys::ENTITY_MATERIAL, reports),
        emission: fields.get(&keys::EMISSION, reports),
        flip_normal: fields.get(&keys::FLIP_NORMAL, reports),
    })
}

pub(super) fn plane(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let normal = fields.get(&keys::NORMAL, reports);
    let distance = fields.get(&keys::PLANE_DISTANCE, reports);
    let (normal, distance) = (normal?, distance?);
    let length = normal.length();
    if distance != 0.0 && (length - 1.0).abs() > UNIT_LENGTH {
        let at = fields.place_of(&keys::PLANE_DISTANCE);
        let length = shown(length);
        let message = format!("the normal's length is {length}, and distance is a length all the same");
        let help =
            format!("if X·normal = distance is meant with the normal as it is, divide both by {length}");
        reports.warn(Some(at), message, &help);
    }
    Ok(RawShape::One(Shape::Plane { normal: unit(normal), distance }))
}

/// A length in four digits or so, for messages.
fn shown(length: f64) -> String {
    match (1e-2..1e6).contains(&length) {
        true => format!("{length:.4}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => format!("{length:.3e}"),
    }
}

pub(super) fn sphere(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let center = fields.get(&keys::CENTER, reports);
    let radius = fields.get(&keys::RADIUS, reports);
    Ok(RawShape::One(Shape::Sphere { center: center?, radius: radius? }))
}

pub(super) fn quad(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let corner = fields.get(&keys::CORNER, reports);
    let u = fields.get(&keys::U, reports);
    let v = fields.get(&keys::V, reports);
    let (u, v) = (u?, v?);
    if unit(u).cross(unit(v)).length() < PARALLEL {
        let at = fields.place_of(&keys::V);
        return Err(reports.error(at, "v is parallel to u: the quad has no area"));
    }
    Ok(RawShape::One(Shape::Quad { corner: corner?, u, v }))
}

pub(super) fn disk(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let center = fields.get(&keys::DISK_CENTER, reports);
    let normal = fields.get(&keys::DISK_NORMAL, reports);
    let radius = fields.get(&keys::DISK_RADIUS, reports);
    Ok(RawShape::One(Shape::Disk { center: center?, normal: normal?, radius: radius? }))
}

pub(super) fn cylinder(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let from = fields.get(&keys::FROM, reports);
    let to = fields.get(&keys::TO, reports);
    let radius = fields.get(&keys::CYLINDER_RADIUS, reports);
    let (from, to) = (from?, to?);
    if from.distance(to) < keys::SHORTEST {
        let at = fields.place_of(&keys::TO);
        return Err(reports.error(at, "to is the same point as from: the cylinder has no length"));
    }
    Ok(RawShape::One(Shape::Cylinder { from, to, radius: radius? }))
}

pub(super) fn cuboid(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let min = fields.get(&keys::MIN, reports);
    let max = fields.get(&keys::MAX, reports);
    let (min, max) = (min?, max?);
    // Shapes are kept in single precision, in which sides that are far out and close together are one.
    let single = |x: f64| f64::from(x as f32);
    let size = |axis: usize| single(max[axis]) - single(min[axis]);
    if let Some(axis) = (0..3).find(|&axis| size(axis) < keys::SHORTEST) {
        let (at, name) = (fields.place_of(&keys::MAX), ["x", "y", "z"][axis]);
        let swapped = size(axis) < 0.0;
        let why = if swapped { "there min is above it along" } else { "the box has no extent along" };
        let message = format!("max must be above min in each of x, y, z: {why} {name}");
        let remedy = if swapped { "swap the two" } else { "a quad is flat" };
        return Err(reports.error_with(at, message, |_| Some(remedy.into())));
    }
    Ok(RawShape::One(Shape::Box { min, max }))
}

pub(super) fn mesh(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let file = fields.get(&keys::MESH_FILE, reports);
    let transform = fields.get(&keys::TRANSFORM, reports);
    let materials = fields.find(&keys::PART_MATERIALS, reports);
    let (file, transform, materials) = (file?, transform?, materials?);
    let split = match &materials {
        None => Split::Whole,
        Some(PartMaterials::OfFile) => Split::Materials,
        Some(PartMaterials::Named(names)) => {
            // Sorted, for the order of keys says nothing, and that of entities does.
            let mut names: Vec<_> = names.iter().map(|name| name.name.clone()).collect();
            names.sort_unstable();
            Split::Named(names)
        }
    };
    let read = reports.mesh(&file, split)?;
    if let Some(PartMaterials::Named(names)) = &materials {
        parts_are_there(names, &read, reports)?;
    }
    // Coordinates as far out have squares that do not fit 32 bits.
    let fits = |p: &[f32; 3]| {
        let p = transform.transform_point3(DVec3::from(p.map(f64::from)));
        p.abs().max_element() <= keys::LONGEST
    };
    let is_near = |mesh: &Arc<Mesh>| mesh.positions.iter().all(fits);
    if !read.parts.iter().all(|(_, mesh)| is_near(mesh)) {
        let at = fields.place_of(&keys::TRANSFORM);
        return Err(reports.error(at, "the transform takes some of the mesh farther than 1e18"));
    }
    let parts = read.parts.iter().map(|(_, mesh)| &**mesh);
    let [narrower, longest] = sizes_in_place(parts, &transform);
    if longest < keys::SMALLEST_MESH || narrower == 0.0 {
        let at = fields.place_of(&keys::TRANSFORM);
        let message = "the mesh is smaller than 1e-15 where it stands, or than what 32-bit numbers tell apart there: nothing of it would be seen; give the transform a larger scale, or move the mesh nearer to the origin";
        return Err(reports.error(at, message));
    }
    let part = |(name, mesh): &(String, Arc<Mesh>)| {
        let material = match &materials {
            Some(PartMaterials::OfFile) => {
                let own = read.materials.iter().find(|material| material.name == *name);
                own.map(|own| RawMaterial::OfFile(file.value.clone(), own.clone()))
            }
            Some(PartMaterials::Named(names)) => {
                let given = names.iter().find(|given| given.name == *name);
                given.map(|given| RawMaterial::Named(given.value.clone()))
            }
            None => None,
        };
        let shape = Shape::Mesh { mesh: Arc::clone(mesh), transform };
        RawPart { name: name.clone(), shape, material: material.unwrap_or(RawMaterial::Entity) }
    };
    Ok(RawShape::Parts(read.parts.iter().map(part).collect()))
}

/// The two longest sides of the box around meshes where a transform takes them, in 32-bit numbers, the longest last.
fn sizes_in_place<'a>(meshes: impl Iterator<Item = &'a Mesh>, transform: &DAffine3) -> [f64; 2] {
    let place = |p: &[f32; 3]| {
        let p = transform.transform_point3(DVec3::from(p.map(f64::from)));
        DVec3::from(p.to_array().map(|x| f64::from(x as f32)))
    };
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let around = |(low, high): (DVec3, DVec3), p: DVec3| (low.min(p), high.max(p));
    let (low, high) = meshes.flat_map(|mesh| &mesh.positions).map(place).fold(empty, around);
    let mut sides = (high - low).to_array();
    sides.sort_by(f64::total_cmp);
    [sides[1], sides[2]]
}

/// That every part that is given a material is in the file.
fn parts_are_there(names: &[Named<Placed<String>>], read: &MeshFile, reports: &mut Reports<'_>) -> Read<()> {
    let mut outcome = Ok(());
    let missing = |name: &&Named<_>| !read.parts.iter().any(|(part, _)| *part == name.name);
    for name in names.iter().filter(missing) {
        let message = format!("nothing in the mesh is of the group or material {}", quote(&name.name));
        outcome = Err(reports
            .error_with(name.at, message, |_| instead(&name.name, read.names.iter().map(String::as_str))));
    }
    outcome
}

pub(super) fn transform(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<DAffine3> {
    let scale = fields.get(&keys::SCALE, reports);
    let rotate = fields.get(&keys::ROTATE, reports);
    let translate = fields.get(&keys::TRANSLATE, reports);
    let matrix = fields.find(&keys::MATRIX, reports);
    let (scale, rotate, translate, matrix) = (scale?, rotate?, translate?, matrix?);
    let transform = match matrix {
        Some(_)
            if [fields.has(&keys::SCALE), fields.has(&keys::ROTATE), fields.has(&keys::TRANSLATE)]
                .contains(&true) =>
        {
            let at = fields.place_of(&keys::MATRIX);
            let message = "the transform has a matrix and scale, rotate or translate";
            return Err(reports.error_with(at, message, |_| Some("keep the matrix or the others".into())));
        }
        Some([x, y, z]) => {
            let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
            DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
        }
        None => {
            let [x, y, z] = rotate.to_array().map(f64::to_radians);
            let rotate = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
            DAffine3 { matrix3: rotate * DMat3::from_diagonal(scale), translation: translate }
        }
    };
    // Against the largest that vectors of these lengths could have.
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    let largest = x.length() * y.length() * z.length();
    if largest == 0.0 || transform.matrix3.determinant().abs() < 1e-9 * largest {
        let at = match matrix {
            Some(_) => fields.place_of(&keys::MATRIX),
            None => fields.place_of(&keys::SCALE),
        };
        return Err(reports.error(at, "the transform makes everything flat"));
    }
    Ok(transform)
}

pub(super) fn point_light(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Light> {
    let position = fields.get(&keys::POSITION, reports);
    let intensity = fields.get(&keys::INTENSITY, reports);
    Ok(Light::Point { position: position?, intensity: intensity? })
}

/// Reads one word as a file would have it, outside any file.
fn word<T>(read: impl FnOnce(&mut Reports<'_>) -> Read<T>, text: &str) -> Result<T, String> {
    let mut reports = Reports::new(text);
    read(&mut reports).map_err(|_| reports.into_text())
}

impl FromStr for Filter {
    type Err = String;

    /// The filter of this name with its usual radius, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| keys::FILTERS.read_word(name, 0, reports), name)
    }
}

/// "tent 1", "gaussian 1.5, sigma 0.5": the name, the radius, and what else there is to it.
impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Filter::None => f.write_str("none"),
            Filter::Box { radius } => write!(f, "box {radius}"),
            Filter::Tent { radius } => write!(f, "tent {radius}"),
            Filter::Gaussian { radius, sigma } => write!(f, "gaussian {radius}, sigma {sigma}"),
            Filter::Mitchell { radius, b, c } => write!(f, "mitchell {radius}, b {b}, c {c}"),
            Filter::BlackmanHarris { radius } => write!(f, "blackman-harris {radius}"),
            Filter::Lanczos { radius } => write!(f, "lanczos {radius}"),
        }
    }
}

/// The name, as in a scene file.
impl fmt::Display for FilmMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(keys::MODES.name(*self))
    }
}

impl FromStr for FilmMode {
    type Err = String;

    /// The mode of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| keys::MODES.pick(name, 0, reports), name)
    }
}

/// The name, as in a scene file.
impl fmt::Display for Sampler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(keys::SAMPLERS.name(*self))
    }
}

/// The name, as in a scene file.
impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(keys::INTEGRATORS.name(*self))
    }
}

impl FromStr for Sampler {
    type Err = String;

    /// The sampler of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| keys::SAMPLERS.pick(name, 0, reports), name)
    }
}

impl FromStr for Tone {
    type Err = String;

    /// The tone curve of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| keys::TONES.pick(name, 0, reports), name)
    }
}

impl FromStr for Integrator {
    type Err = String;

    /// The integrator of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| keys::INTEGRATORS.pick(name, 0, reports), name)
    }
}
