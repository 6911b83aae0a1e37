//! The invariants of a scene. The readers of all formats check them, and so can programs that build scenes.

use super::description::{
    CameraSettings, EXPOSURES, Entity, EnvironmentPicture, FilmSettings, Filter, LONGEST_SIDE, Light,
    MOST_BOUNCES, Material, Mesh, RenderSettings, Scene, Shape, UNLIMITED, endless,
};
use super::groups;
use super::names::MAX_NESTING;
use super::placement::{is_flat, misplaced};
use super::second_uv::{Lacking, lacking};
use super::spelling::quote;
use super::textures::{self, Broken};
use crate::parameter::limits::{COORDINATE, DISTANCE, LENGTH, PARALLEL, RADIANCE};
use crate::parameter::{Family, Number, ParameterKind, Value, Varying};
use glam::{DAffine3, DVec3};
use std::collections::HashSet;
use std::f64::consts::PI;
use std::fmt;
use std::sync::Arc;

/// A generous bound on the rounding error of a unit length.
const ROUNDING: f64 = 1e-6;

/// The part of a scene that a problem is in. It displays as `material 3 ("white")`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Part {
    /// The film.
    Film,
    /// The camera.
    Camera,
    /// The render settings.
    Render,
    /// The material of this index and name.
    Material(usize, String),
    /// The texture of this index and name.
    Texture(usize, String),
    /// The entity of this index and name.
    Entity(usize, String),
    /// The group of this index and name.
    Group(usize, String),
    /// The instance of this index and name.
    Instance(usize, String),
    /// The light of this index.
    Light(usize),
    /// The environment.
    Environment,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::Film => f.write_str("the film"),
            Part::Camera => f.write_str("the camera"),
            Part::Render => f.write_str("the render settings"),
            Part::Material(index, name) => write!(f, "material {} ({})", index + 1, quote(name)),
            Part::Texture(index, name) => write!(f, "texture {} ({})", index + 1, quote(name)),
            Part::Entity(index, name) => write!(f, "entity {} ({})", index + 1, quote(name)),
            Part::Group(index, name) => write!(f, "group {} ({})", index + 1, quote(name)),
            Part::Instance(index, name) => write!(f, "instance {} ({})", index + 1, quote(name)),
            Part::Light(index) => write!(f, "light {}", index + 1),
            Part::Environment => f.write_str("the environment"),
        }
    }
}

/// A violated invariant of [`Scene`]. It displays as `the film: width must be from 1 to 65536, not 0`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneProblem {
    /// The part.
    pub part: Part,
    /// The problem.
    pub message: String,
}

impl fmt::Display for SceneProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.part, self.message)
    }
}

impl Scene {
    /// The scene, if it satisfies all invariants. Scenes from files do; scenes that are built in code should be checked
    /// before they are rendered.
    ///
    /// ```
    /// # use stride::Scene;
    /// let mut scene = Scene::default();
    /// scene.film.width = 0;
    /// let problems = scene.checked().unwrap_err();
    /// assert_eq!(problems[0].to_string(), "the film: width must be from 1 to 65536, not 0");
    /// ```
    ///
    /// # Errors
    ///
    /// All violations of invariants.
    pub fn checked(self) -> Result<Scene, Vec<SceneProblem>> {
        let problems = self.problems();
        if problems.is_empty() { Ok(self) } else { Err(problems) }
    }

    /// All violations of the scene's invariants.
    pub fn problems(&self) -> Vec<SceneProblem> {
        let mut problems = Vec::new();
        check_values(self, &mut problems);
        check_materials(&self.materials, &mut problems);
        check_textures(self, &mut problems);
        check_entities(&self.entities, self.materials.len(), &mut problems);
        check_placement(&self.entities, &mut problems);
        check_lights(&self.lights, &mut problems);
        if problems.is_empty() {
            check_groups(self, &mut problems);
            for Lacking { first, message } in lacking(self) {
                problems.push(SceneProblem {
                    part: Part::Entity(first, self.entities[first].name.clone()),
                    message,
                });
            }
        }
        problems
    }
}

/// The problems of one part.
struct Findings<'a> {
    part: &'a dyn Fn() -> Part,
    problems: &'a mut Vec<SceneProblem>,
}

impl Findings<'_> {
    fn add(&mut self, message: impl Into<String>) {
        self.problems.push(SceneProblem { part: (self.part)(), message: message.into() });
    }

    fn number(&mut self, name: &str, number: f64, limits: Number) {
        if let Some(objection) = limits.objection(number) {
            self.add(format!("{name} {objection}, not {number:e}"));
        }
    }

    fn numbers(&mut self, name: &str, numbers: &[f64], limits: Number) {
        numbers.iter().for_each(|&number| self.number(name, number, limits));
    }

    fn integer(&mut self, name: &str, number: u32, [least, most]: [u32; 2]) {
        if !(least..=most).contains(&number) {
            self.add(format!("{name} must be from {least} to {most}, not {number}"));
        }
    }

    fn direction(&mut self, name: &str, direction: DVec3) {
        let is_unit = (direction.length() - 1.0).abs() <= ROUNDING;
        if !is_unit {
            self.add(format!("{name} must have a length of 1, not {:e}", direction.length()));
        }
    }
}

/// Checks the values of film, camera, render settings and environment, each against its limits.
fn check_values(scene: &Scene, problems: &mut Vec<SceneProblem>) {
    check_film(&scene.film, &mut Findings { part: &|| Part::Film, problems });
    check_camera(&scene.camera, &mut Findings { part: &|| Part::Camera, problems });
    check_render(&scene.render, &mut Findings { part: &|| Part::Render, problems });
    check_environment(scene, &mut Findings { part: &|| Part::Environment, problems });
}

fn check_environment(scene: &Scene, found: &mut Findings<'_>) {
    found.numbers("radiance", &scene.environment, RADIANCE);
    let Some(EnvironmentPicture { file, scale, rotate, up }) = &scene.environment_picture else { return };
    found.numbers("scale", scale, RADIANCE);
    found.number("rotate", rotate.to_degrees(), EnvironmentPicture::TURNS);
    found.direction("up", *up);
    match scene.images.get(file.0) {
        None => found.add(format!("there is no image {}, only {}", file.0 + 1, scene.images.len())),
        Some(image) if image.is_tiled => found.add("its picture consists of tiles"),
        Some(image) => image.objection().into_iter().for_each(|message| found.add(message)),
    }
}

fn check_film(film: &FilmSettings, found: &mut Findings<'_>) {
    found.integer("width", film.width, [1, LONGEST_SIDE]);
    found.integer("height", film.height, [1, LONGEST_SIDE]);
    found.number("exposure", film.exposure, EXPOSURES);
    if film.filter != Filter::None {
        found.number("the filter's radius", film.filter.radius(), Filter::RADII);
    }
    match film.filter {
        Filter::Gaussian { sigma, .. } => found.number("the filter's sigma", sigma, Filter::SIGMAS),
        Filter::Mitchell { b, c, .. } => {
            found.number("the filter's b", b, Filter::SHARES);
            found.number("the filter's c", c, Filter::SHARES);
        }
        _ => {}
    }
    if let Some(problem) = film.problem() {
        found.add(problem);
    }
}

fn check_camera(camera: &CameraSettings, found: &mut Findings<'_>) {
    found.numbers("eye", &camera.eye.to_array(), COORDINATE);
    found.direction("forward", camera.forward);
    found.direction("up", camera.up);
    if camera.forward.cross(camera.up).length() < PARALLEL {
        found.add("up is parallel to the viewing direction");
    }
    let has_view = camera.vertical_fov > 0.0 && camera.vertical_fov < PI;
    if !has_view {
        found.add(format!("vertical_fov must be above 0 and below π, not {:e}", camera.vertical_fov));
    }
    if let Some(height) = camera.orthographic_height {
        found.number("orthographic_height", height, LENGTH);
    }
    found.number("focal_length", camera.focal_length, LENGTH);
    found.number("near", camera.near, DISTANCE);
    found.number("aperture_radius", camera.aperture_radius, DISTANCE);
    found.number("focus_distance", camera.focus_distance, LENGTH);
}

fn check_render(render: &RenderSettings, found: &mut Findings<'_>) {
    found.integer("samples", render.samples, [1, u32::MAX]);
    if render.max_depth != UNLIMITED {
        found.integer("max_depth", render.max_depth, [0, MOST_BOUNCES]);
    }
    if let Some(problem) = endless(render.integrator, render.max_depth) {
        found.add(problem);
    }
    found.numbers("ambient", &render.ambient, RADIANCE);
}

/// Checks that materials refer only to preceding materials, and that their nesting is limited.
fn check_materials(materials: &[Material], problems: &mut Vec<SceneProblem>) {
    let mut nesting = vec![0; materials.len()];
    for (i, material) in materials.iter().enumerate() {
        let part = || Part::Material(i, material.name.clone());
        let mut found = Findings { part: &part, problems };
        check_parameters(&material.kind, &mut found);
        check_parameters(&material.modifiers, &mut found);
        for named in material.named() {
            if named >= i {
                found.add(format!("it names material {}, which does not precede it", named + 1));
            } else {
                nesting[i] = nesting[i].max(nesting[named] + 1);
            }
        }
        // Materials that contain it are nested too deeply as well, but one problem is enough.
        if nesting[i] == MAX_NESTING + 1 {
            found.add(format!("it is nested more than {MAX_NESTING} levels deep"));
        }
    }
}

/// Checks the parameters of textures, and references to textures and materials.
fn check_textures(scene: &Scene, problems: &mut Vec<SceneProblem>) {
    let texture = |i: usize| Part::Texture(i, scene.textures[i].name.clone());
    for (i, own) in scene.textures.iter().enumerate() {
        check_parameters(&own.kind, &mut Findings { part: &|| texture(i), problems });
    }
    for broken in textures::broken(scene) {
        let (part, message) = match broken {
            Broken::Texture(i, message) => (texture(i), message),
            Broken::Material(i, message) => (Part::Material(i, scene.materials[i].name.clone()), message),
            Broken::Entity(i, message) => (Part::Entity(i, scene.entities[i].name.clone()), message),
        };
        problems.push(SceneProblem { part, message });
    }
}

/// Checks the parameters of a material, a shape, a texture or a light: each against its limits, then their
/// combinations.
fn check_parameters<F: Family>(member: &F, found: &mut Findings<'_>) {
    let Some(place) = member.place() else { return };
    let declaration = &F::DECLARATIONS[place];
    let (values, before) = (member.values(), found.problems.len());
    for (parameter, value) in declaration.parameters.iter().zip(&values) {
        let name = parameter.name;
        match (parameter.kind, *value) {
            (ParameterKind::Number(limits) | ParameterKind::Amount(limits), Value::Number(number)) => {
                found.number(name, number, limits);
            }
            (ParameterKind::Pair(limits), Value::Pair(pair)) => found.numbers(name, &pair, limits),
            (ParameterKind::Colour(limits), Value::Colour(colour)) => found.numbers(name, &colour, limits),
            (ParameterKind::Varying(limits), Value::Varying(Varying::Colour(colour))) => {
                found.numbers(name, &colour, limits);
            }
            (ParameterKind::Integer(least, most), Value::Number(number)) => {
                found.number(name, number, Number::between(least.into(), most.into()));
            }
            (ParameterKind::Direction(_), Value::Vector(direction)) => found.direction(name, direction),
            (ParameterKind::NonZero(_), Value::Vector(DVec3::ZERO)) => {
                found.add(format!("{name} must not be zero in all of x, y, z"));
            }
            (ParameterKind::Vector(limits) | ParameterKind::NonZero(limits), Value::Vector(vector)) => {
                found.numbers(name, &vector.to_array(), limits);
            }
            (ParameterKind::Word(words), Value::Word(place)) if place >= words.len() => {
                found.add(format!("{name} must be one of {} words, not word {}", words.len(), place + 1));
            }
            // References count by their targets.
            _ => {}
        }
    }
    if found.problems.len() > before {
        return;
    }
    match F::build(place, &values, &mut Vec::new()) {
        Err(problem) => found.add(problem.message),
        Ok(built) => {
            // Readers normalise some directions; here they must be normalised already.
            for ((parameter, value), built) in declaration.parameters.iter().zip(&values).zip(built.values())
            {
                if let (Value::Vector(given), Value::Vector(built)) = (value, built)
                    && given.distance(built) > ROUNDING * built.length()
                {
                    found.add(format!("{} must be {built}, not {given}", parameter.name));
                }
            }
        }
    }
}

/// Checks groups and instances, for a scene whose entities are valid.
fn check_groups(scene: &Scene, problems: &mut Vec<SceneProblem>) {
    for broken in groups::broken(scene) {
        let (part, message) = match broken {
            groups::Broken::Group(i, message) => (Part::Group(i, scene.groups[i].name.clone()), message),
            groups::Broken::Instance(i, message) => {
                (Part::Instance(i, scene.instances[i].name.clone()), message)
            }
            groups::Broken::Entity(i, message) => (Part::Entity(i, scene.entities[i].name.clone()), message),
        };
        problems.push(SceneProblem { part, message });
    }
}

/// Checks the lights that are no surfaces.
fn check_lights(lights: &[Light], problems: &mut Vec<SceneProblem>) {
    for (i, light) in lights.iter().enumerate() {
        check_parameters(light, &mut Findings { part: &|| Part::Light(i), problems });
    }
}

/// Checks the entities: their materials exist, their emission is within the film's range, and their meshes are valid.
fn check_entities(entities: &[Entity], materials: usize, problems: &mut Vec<SceneProblem>) {
    let mut checked = HashSet::new();
    for (i, entity) in entities.iter().enumerate() {
        let part = || Part::Entity(i, entity.name.clone());
        let mut found = Findings { part: &part, problems };
        if entity.material >= materials {
            found.add(format!("there is no material {}, only {materials}", entity.material + 1));
        }
        found.numbers("emission", &entity.emission, RADIANCE);
        check_parameters(&entity.shape, &mut found);
        if let Shape::Mesh { mesh, transform } = &entity.shape {
            // Entities of one file share a mesh.
            if checked.insert(Arc::as_ptr(mesh)) {
                check_mesh(mesh, &mut found);
            }
            if is_flat(transform) {
                found.add("the transform is singular or not finite");
            }
        }
    }
}

/// Checks the extents of transformed meshes: not too far from the origin, and not so small that they are invisible.
/// Parts of one file may be small if the entire file is not; they are consecutive entities with one transform.
fn check_placement(entities: &[Entity], problems: &mut Vec<SceneProblem>) {
    fn transform(entity: &Entity) -> Option<&DAffine3> {
        match &entity.shape {
            Shape::Mesh { transform, .. } => Some(transform),
            _ => None,
        }
    }
    let mut first = 0;
    for together in entities.chunk_by(|a, b| transform(a).is_some() && transform(a) == transform(b)) {
        let meshes = together.iter().filter_map(|entity| match &entity.shape {
            Shape::Mesh { mesh, .. } => Some(&**mesh),
            _ => None,
        });
        if let Some(transform) = transform(&together[0]).filter(|transform| !is_flat(transform))
            && let Some(message) = misplaced(meshes, transform)
        {
            let part = || Part::Entity(first, together[0].name.clone());
            Findings { part: &part, problems }.add(message);
        }
        first += together.len();
    }
}

fn check_mesh(mesh: &Mesh, found: &mut Findings<'_>) {
    let vertices = mesh.positions.len();
    let columns =
        [("normals", mesh.normals.len()), ("uv", mesh.uv.len()), ("second uv", mesh.second_uv.len())];
    for (name, numbers) in columns {
        if ![0, vertices].contains(&numbers) {
            return found.add(format!("its mesh has {vertices} vertices and {numbers} {name}"));
        }
    }
    if let Err(error) = mesh.check() {
        found.add(format!("its mesh is invalid: {error}"));
    }
}

#[cfg(test)]
mod tests;
