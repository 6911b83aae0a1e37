//! What a scene is made in: the objects that it is made of, what was made so far, and where from.

use super::files::Files;
use super::object::{Document, Object, Tag};
use super::report::{Place, Read, Reported, Reports};
use crate::scene::check::{Part, SceneProblem};
use crate::scene::description::{
    Entity, Group, Instance, Material, MaterialKind, Mesh, Scene, Texture, TextureKind, Textured,
};
use crate::scene::images::{self, ImageCache};
use crate::scene::mesh::cache::MeshCache;
use glam::DAffine3;
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

/// What a scene is made in.
pub(super) struct Builder<'a, 'w> {
    pub(super) document: &'a Document,
    pub(super) reports: &'a mut Reports,
    files: &'a Files,
    pub(super) scene: Scene,
    pub(super) meshes: MeshCache<'w>,
    /// Meshes that are made here, of files and otherwise, each once.
    pub(super) made: HashMap<MeshKey, Arc<Mesh>>,
    /// Mesh files in which no triangle has an area.
    pub(super) flat: HashSet<PathBuf>,
    /// Whether meshes have a border, by their addresses: they are all kept.
    pub(super) borders: HashMap<usize, bool>,
    images: ImageCache,
    /// The materials that were made of objects.
    pub(super) materials: HashMap<usize, Read<usize>>,
    /// The same materials with nothing to be seen from behind.
    pub(super) one_sided: HashMap<usize, usize>,
    /// The textures that were made of objects, by whether square roots of their values are meant.
    pub(super) textures: HashMap<(usize, bool), usize>,
    /// The groups that were made of objects, those aside in which there is nothing.
    pub(super) groups: HashMap<usize, Read<Option<usize>>>,
    /// How many shapes were come by so far, those without a counterpart too: `merge` may hold one many times.
    pub(super) shapes: usize,
    /// The group in which shapes stand now.
    pub(super) within: Option<usize>,
    /// Where things come from, in their order.
    pub(super) places: Places,
}

/// Where things come from, in their order.
#[derive(Default)]
pub(super) struct Places {
    pub(super) film: Place,
    pub(super) camera: Place,
    pub(super) render: Place,
    pub(super) environment: Place,
    pub(super) has_environment: bool,
    materials: Vec<Place>,
    textures: Vec<Place>,
    entities: Vec<Place>,
    pub(super) groups: Vec<Place>,
    pub(super) instances: Vec<Place>,
    pub(super) lights: Vec<Place>,
}

/// What makes two meshes the same.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum MeshKey {
    Cube,
    /// A file, the number of a mesh in it, whether v runs down in it, and whether its normals are left out.
    File(PathBuf, usize, bool, bool),
    /// A file whose normals are computed where it stands in the world.
    Placed(PathBuf, usize, bool, [u64; 9]),
    Ellipse,
}

impl<'a, 'w> Builder<'a, 'w> {
    pub(super) fn new(
        document: &'a Document,
        reports: &'a mut Reports,
        files: &'a Files,
        meshes: MeshCache<'w>,
    ) -> Self {
        Builder {
            document,
            reports,
            files,
            scene: Scene::default(),
            shapes: 0,
            meshes,
            made: HashMap::new(),
            flat: HashSet::new(),
            borders: HashMap::new(),
            images: ImageCache::new(std::path::Path::new("")),
            materials: HashMap::new(),
            one_sided: HashMap::new(),
            textures: HashMap::new(),
            groups: HashMap::new(),
            within: None,
            places: Places::default(),
        }
    }

    /// An object, of which something is made now.
    pub(super) fn object(&self, index: usize) -> &'a Object {
        let object = &self.document.objects[index];
        object.read.set(true);
        object
    }

    /// The first object of a tag that an object has; what there is of them beyond is reported.
    pub(super) fn child(&mut self, object: &Object, tag: Tag) -> Option<&'a Object> {
        let children = self.document.children(object, tag);
        if let Some(&second) = children.get(1) {
            let place = self.document.objects[second].place;
            let what = format!("a second {} in a {}", tag.word(), object.tag.word());
            self.reports.lacks(place, what, "the first one counts");
        }
        children.first().map(|&first| self.object(first))
    }

    /// The file that a property of an object names.
    pub(super) fn file(&mut self, object: &Object, name: &str) -> Read<PathBuf> {
        match object.text(name, self.reports)? {
            None => Err(self.reports.error(object.place, format!("{} has no {name}", object.what()))),
            Some((file, place)) => {
                let found = self.files.find(file, &object.folders);
                found.map_err(|(message, help)| self.reports.error_with(place, message, help))
            }
        }
    }

    /// The index of the image in a file.
    pub(super) fn image(&mut self, object: &Object, name: &str) -> Read<usize> {
        let path = self.file(object, name)?;
        let place = object.find(name).map_or(object.place, |property| property.place);
        // Tiles are files that no rule about folders has seen.
        if path.to_string_lossy().contains("<UDIM>") {
            return Err(self
                .reports
                .error(place, "Mitsuba has no tiles: the name of a file cannot contain <UDIM>"));
        }
        let Some(path) = path.to_str() else {
            return Err(self.reports.error(place, "the path of this file is not UTF-8"));
        };
        self.images.get(path).map_err(|error| match error {
            images::Unreadable::First(error) => self.reports.error(place, error.to_string()),
            images::Unreadable::Again => self.reports.error(place, "this file cannot be read either"),
        })
    }

    /// Adds a material, and returns its index.
    pub(super) fn add_material(
        &mut self,
        object: Option<&Object>,
        place: Place,
        kind: impl Into<MaterialKind>,
        textures: Vec<Textured>,
    ) -> usize {
        let number = self.scene.materials.len() + 1;
        let name = match object {
            Some(object) if !object.id.is_empty() => object.id.clone(),
            Some(object) => format!("{} {number}", object.plugin),
            None => format!("default {number}"),
        };
        self.scene.materials.push(Material { name, kind: kind.into(), textures, ..Material::default() });
        self.places.materials.push(place);
        self.scene.materials.len() - 1
    }

    /// Adds a material that is another one but for a change, and returns its index.
    pub(super) fn add_changed(
        &mut self,
        object: &Object,
        inner: usize,
        change: impl FnOnce(&mut Material),
    ) -> usize {
        let mut material = self.scene.materials[inner].clone();
        let number = self.scene.materials.len() + 1;
        material.name = match object.id.as_str() {
            "" => format!("{} {number}", object.plugin),
            id => id.to_owned(),
        };
        change(&mut material);
        self.scene.materials.push(material);
        self.places.materials.push(object.place);
        self.scene.materials.len() - 1
    }

    /// Adds a texture, and returns its index.
    pub(super) fn add_texture(&mut self, object: &Object, kind: impl Into<TextureKind>) -> usize {
        let number = self.scene.textures.len() + 1;
        let name = match object.id.as_str() {
            "" => format!("{} {number}", object.plugin),
            // One object may be several textures.
            id => format!("{id} {number}"),
        };
        self.scene.textures.push(Texture { name, kind: kind.into() });
        self.places.textures.push(object.place);
        self.scene.textures.len() - 1
    }

    /// Adds an entity. Its name is that of its object, or its number.
    pub(super) fn add_entity(&mut self, object: &Object, mut entity: Entity) -> Read<()> {
        if self.scene.entities.len() >= super::limits::MOST_ENTITIES {
            let message = format!("the scene has more than {} shapes", super::limits::MOST_ENTITIES);
            return Err(self.reports.error(object.place, message));
        }
        let number = self.scene.entities.len() + 1;
        entity.name = match object.id.as_str() {
            "" => format!("{} {number}", object.plugin),
            id => id.to_owned(),
        };
        entity.within = self.within;
        self.scene.entities.push(entity);
        self.places.entities.push(object.place);
        Ok(())
    }

    /// Adds a group, and returns its index. Groups are in the order of their names.
    pub(super) fn add_group(&mut self, object: &Object) -> usize {
        let number = self.scene.groups.len() + 1;
        let id = if object.id.is_empty() { &object.plugin } else { &object.id };
        self.scene.groups.push(Group { name: format!("{number:06} {id}") });
        self.places.groups.push(object.place);
        number - 1
    }

    /// Places a group in the world.
    pub(super) fn add_instance(&mut self, object: &Object, group: usize, transform: DAffine3) {
        let number = self.scene.instances.len() + 1;
        let name =
            if object.id.is_empty() { format!("{} {number}", object.plugin) } else { object.id.clone() };
        self.scene.instances.push(Instance { name, group, transform, within: None });
        self.places.instances.push(object.place);
    }

    /// Puts the entities of the world before those of groups, in the order of these, as a file in TOML has them: lights are
    /// chosen by their order.
    fn sort_entities(&mut self) {
        let entities = std::mem::take(&mut self.scene.entities);
        let places = std::mem::take(&mut self.places.entities);
        let mut placed: Vec<_> = entities.into_iter().zip(places).collect();
        placed.sort_by_key(|(entity, _)| entity.within.map_or(0, |group| group + 1));
        (self.scene.entities, self.places.entities) = placed.into_iter().unzip();
    }

    /// Reports what nobody looked at in objects of which something was made.
    pub(super) fn report_unused(&mut self) {
        for object in self.document.objects.iter().filter(|object| object.read.get()) {
            for property in object.properties.iter().filter(|property| !property.used.get()) {
                let what = match &property.value {
                    super::object::Value::Object(index) => {
                        format!("{} in {}", self.document.objects[*index].what(), object.what())
                    }
                    _ => format!("{:?} of {}", property.name, object.what()),
                };
                self.reports.lacks(property.place, what, "it is left out");
            }
        }
    }

    /// The scene with its images, if it keeps its promises; what breaks them is told where it comes from.
    pub(super) fn finish(mut self) -> Read<(Scene, crate::scene::fingerprint::Sources)> {
        self.scene.images = self.images.take();
        self.sort_entities();
        let sources = self.sources();
        match self.scene.checked() {
            Ok(scene) => Ok((scene, sources)),
            Err(problems) => {
                let mut outcome = None;
                for SceneProblem { part, message } in problems {
                    let place = self.places.of(&part);
                    let reported: Reported = self.reports.error(place, format!("{part}: {message}"));
                    outcome = Some(reported);
                }
                outcome.map_or_else(|| Err(self.reports.error(Place::default(), "no scene came of it")), Err)
            }
        }
    }

    /// The meshes of files, and what those are called.
    fn sources(&self) -> crate::scene::fingerprint::Sources {
        let mut sources = self.meshes.sources();
        for (key, mesh) in &self.made {
            let (MeshKey::File(path, number, ..) | MeshKey::Placed(path, number, ..)) = key else { continue };
            sources.0.push((format!("{} {number}", path.display()), Arc::clone(mesh)));
        }
        sources.0.sort_by(|a, b| a.0.cmp(&b.0));
        sources
    }
}

impl Places {
    fn of(&self, part: &Part) -> Place {
        let at = |places: &[Place], index: usize| places.get(index).copied().unwrap_or_default();
        match part {
            Part::Film => self.film,
            Part::Camera => self.camera,
            Part::Render => self.render,
            Part::Material(index, _) => at(&self.materials, *index),
            Part::Texture(index, _) => at(&self.textures, *index),
            Part::Entity(index, _) => at(&self.entities, *index),
            Part::Group(index, _) => at(&self.groups, *index),
            Part::Instance(index, _) => at(&self.instances, *index),
            Part::Light(index) => at(&self.lights, *index),
            Part::Environment => self.environment,
        }
    }
}
