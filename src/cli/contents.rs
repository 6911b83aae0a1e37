//! `stride info` of scenes and meshes: their contents, and the memory that they need.

use super::failure::Failure;
use super::loading::Loading;
use super::reading::ReadingArguments;
use crate::math::Bounds;
use crate::parameter::Family;
use crate::scene::mesh::{self, MeshFile, Split};
use crate::scene::{self, MaterialKind, Scene, Texture};
use crate::texture::Tile;
use crate::world::{AcceleratorChoice, CompiledScene, Simple, Triangles, World, compile, extent};
use glam::{DAffine3, DVec3};
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

/// The output: one fact per line.
#[derive(Default)]
struct Facts(String);

impl Facts {
    fn line(&mut self, name: &str, value: impl std::fmt::Display) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.0, "{name:<12}{value}");
    }

    fn bounds(&mut self, Bounds { low, high }: Bounds) {
        let point = |[x, y, z]: [f32; 3]| format!("({x}, {y}, {z})");
        self.line("bounds", format!("{} to {}", point(low), point(high)));
    }

    /// The acceleration structure, and the memory that it needs.
    fn structure(&mut self, surfaces: &Simple) {
        match World::new(surfaces, AcceleratorChoice::Fastest).tree {
            Some(tree) => self.line("tree", format!("{} levels, {}", tree.depth(), bytes(tree.bytes()))),
            None => {
                self.line("tree", "none: there are few surfaces, and rays are tested against all of them")
            }
        }
        if !surfaces.triangles.is_empty() {
            self.line("triangles", format!("{} of their own", bytes(surfaces.triangles.bytes())));
        }
    }
}

/// "12.5 MiB".
fn bytes(count: usize) -> String {
    let (mut size, mut unit) = (count as f64, "bytes");
    for larger in ["KiB", "MiB", "GiB", "TiB"] {
        if size < 1024.0 {
            break;
        }
        (size, unit) = (size / 1024.0, larger);
    }
    if unit == "bytes" { format!("{count} bytes") } else { format!("{size:.1} {unit}") }
}

/// "1 quad", "2 quads".
fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// The contents of a scene, compiled as for a render.
pub(super) fn of_scene(path: &Path, reading: &ReadingArguments) -> Result<String, Failure> {
    let loaded = reading.load(path, false)?;
    let scene = &loaded.scene;
    let (compiled, surfaces) = compile(scene, scene.film.width, scene.film.height)?;
    let mut facts = Facts::default();
    facts.line("scene", format!("{}×{} pixels", scene.film.width, scene.film.height));
    facts.line("entities", scene.entities.len());
    groups(scene, &mut facts);
    let meshes = [
        (surfaces.triangles.len(), ["triangle", "triangles"]),
        (
            surfaces.instances.len() - surfaces.instances.of_groups(),
            ["instance of a mesh", "instances of meshes"],
        ),
        (surfaces.instances.of_groups(), ["instance of a group", "instances of groups"]),
    ];
    let kinds = declared(scene.entities.iter().map(|entity| &entity.shape)).into_iter().chain(meshes);
    facts.line("surfaces", counts(kinds));
    let around = extent(scene, &compiled.surfaces, &surfaces);
    if around.low[0] <= around.high[0] {
        facts.bounds(around);
    }
    facts.line("lights", lights(scene, compiled.lights.len()));
    facts.line(
        "materials",
        or_none(list(scene.materials.iter().map(|m| format!("{} ({})", m.name, kind(&m.kind))))),
    );
    environment(scene, &compiled, &mut facts);
    textures(scene, &compiled, &mut facts);
    facts.structure(&surfaces);
    loaded.warnings.iter().for_each(|warning| facts.line("warning", warning));
    Ok(facts.0)
}

/// The environment picture, and the grid that samples it.
fn environment(scene: &Scene, compiled: &CompiledScene, facts: &mut Facts) {
    let Some(around) = scene.environment_picture else { return };
    let name = &scene.images[around.file.0].name;
    let smooth = compiled.lights.grids().smooth();
    let grid = match (*smooth.columns(), *smooth.rows()) {
        (0, 0) => "it is dark".to_owned(),
        (columns, rows) => format!("sampled by a grid of {columns}×{rows}, {}", bytes(smooth.bytes())),
    };
    facts.line("environment", format!("{name}, {grid}"));
}

/// The groups, and the number of places of each in the world, if there are any.
fn groups(scene: &Scene, facts: &mut Facts) {
    if scene.groups.is_empty() {
        return;
    }
    let places = scene.place_counts();
    let group = |(index, group): (usize, &scene::Group)| {
        let own = scene.entities.iter().filter(|entity| entity.within == Some(index)).count();
        let own = count(own, "entity", "entities");
        format!("{} ({own} at {})", group.name, count(places[index] as usize, "place", "places"))
    };
    facts.line("groups", list(scene.groups.iter().enumerate().map(group)));
}

/// The textures, and the memory of their pictures, if there are any.
fn textures(scene: &Scene, compiled: &CompiledScene, facts: &mut Facts) {
    if scene.images.is_empty() && scene.textures.is_empty() {
        return;
    }
    let kind = |texture: &Texture| texture.kind.declaration().map_or("", |declaration| declaration.name);
    if !scene.textures.is_empty() {
        facts.line(
            "textures",
            list(scene.textures.iter().map(|texture| format!("{} ({})", texture.name, kind(texture)))),
        );
    }
    for image in &scene.images {
        for Tile { number, picture } in &image.tiles {
            let tile = if image.is_tiled { format!(" {number}") } else { String::new() };
            let (width, height) = (picture.width(), picture.height());
            let channels = count(picture.channels() as usize, "channel", "channels");
            let (depth, taken) = (picture.depth().name(), bytes(picture.bytes()));
            facts.line(
                "picture",
                format!("{}{tile}: {width}×{height}, {channels}, {depth}, {taken}", image.name),
            );
        }
    }
    let taken = compiled.materials.textures().pictures().iter().map(|picture| picture.bytes()).sum();
    facts.line("pictures", format!("{} in use", bytes(taken)));
}

fn lights(scene: &Scene, sampled: usize) -> String {
    let shines = |c: &[f64; 3]| c.iter().any(|&x| x > 0.0);
    let emitters = scene.entities.iter().filter(|entity| entity.emits()).count();
    let sky = if shines(&scene.environment) { ", and the environment" } else { "" };
    let emitters = (emitters, ["entity that emits", "entities that emit"]);
    let kinds = declared(scene.lights.iter()).into_iter().chain([emitters]);
    format!("{}; {sampled} to sample{sky}", counts(kinds))
}

/// The numbers of each kind that occurs.
fn counts(kinds: impl Iterator<Item = (usize, [&'static str; 2])>) -> String {
    let kinds = kinds.filter(|(n, _)| *n > 0).map(|(n, [one, many])| count(n, one, many));
    or_none(kinds.collect::<Vec<_>>().join(", "))
}

/// The numbers of each declaration of a family, with the singular and the plural of its name.
fn declared<'f, F: Family>(all: impl Iterator<Item = &'f F>) -> Vec<(usize, [&'static str; 2])> {
    let mut counts: Vec<_> = F::DECLARATIONS.iter().map(|declaration| (0, declaration.counted)).collect();
    for place in all.filter_map(F::place) {
        counts[place].0 += 1;
    }
    counts
}

fn kind(kind: &MaterialKind) -> &'static str {
    kind.declaration().map_or("", |declaration| declaration.name)
}

/// The first dozen names.
fn list(names: impl Iterator<Item = String>) -> String {
    const MOST: usize = 12;
    let names: Vec<_> = names.collect();
    let shown = names.iter().take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
    if names.len() > MOST { format!("{shown}, … ({} in all)", names.len()) } else { shown }
}

fn or_none(text: String) -> String {
    if text.is_empty() { "none".into() } else { text }
}

/// The total area of a mesh's triangles.
fn area(mesh: &mesh::Mesh) -> f64 {
    let point = |i: u32| DVec3::from(mesh.positions[i as usize].map(f64::from));
    let twice = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(point);
        (b - a).cross(c - a).length()
    };
    mesh.triangles.iter().map(twice).sum::<f64>() / 2.0
}

/// The contents of a mesh file, without a transform.
pub(super) fn of_mesh(path: &Path) -> Result<String, Failure> {
    let loading = Loading::stderr(false);
    let mut watch = loading.watch();
    let MeshFile { parts, names, notes, .. } =
        mesh::read(path, &Split::Whole, &mut |n, of| watch(path, n, of))?;
    drop(watch);
    let mut facts = Facts::default();
    let mut triangles = Triangles::default();
    for (_, mesh) in &parts {
        facts.line(
            "mesh",
            format!(
                "{}, {}",
                count(mesh.triangles.len(), "triangle", "triangles"),
                count(mesh.positions.len(), "vertex", "vertices")
            ),
        );
        facts.bounds(Bounds::of(mesh.positions.iter().copied()));
        facts.line("area", area(mesh));
        let has = [
            (!mesh.normals.is_empty(), "normals"),
            (!mesh.uv.is_empty(), "uv"),
            (!mesh.second_uv.is_empty(), "second uv"),
        ];
        let has: Vec<_> = has.into_iter().filter_map(|(has, what)| has.then_some(what)).collect();
        facts.line(
            "vertices",
            if has.is_empty() { "positions alone".into() } else { format!("with {}", has.join(" and ")) },
        );
        triangles.push(mesh, &DAffine3::IDENTITY, 0);
    }
    facts.line("parts", or_none(list(names.into_iter())));
    notes.iter().for_each(|note| facts.line("note", note));
    facts.structure(&Simple { triangles: Arc::new(triangles), ..Simple::default() });
    Ok(facts.0)
}
