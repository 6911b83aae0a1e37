//! The state of a conversion: the objects of the file, the scene so far, and the origin of its parts.

use super::files::Files;
use super::object::{Document, Object, Tag};
use super::report::{Place, Read, Reported, Reports, UNREADABLE};
use super::serialized;
use super::shade::{Shade, Taken};
use crate::scene::check::{Part, SceneProblem};
use crate::scene::dark_lights::Dark;
use crate::scene::description::{
    Entity, Group, Instance, Material, MaterialKind, Mesh, Scene, Texture, TextureKind, Textured,
};
use crate::scene::images::{self, ImageCache};
use crate::scene::mesh::cache::MeshCache;
use crate::scene::spelling::quote;
use glam::DAffine3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The state of a conversion.
pub(super) struct Builder<'a, 'w> {
    pub(super) document: &'a Document,
    pub(super) reports: &'a mut Reports,
    pub(super) files: &'a Files,
    pub(super) scene: Scene,
    pub(super) meshes: MeshCache<'w>,
    /// Meshes by their origin, so that each is made once.
    pub(super) made: HashMap<MeshKey, Arc<Mesh>>,
    /// Mesh files in which no triangle has an area.
    pub(super) flat: HashSet<PathBuf>,
    /// Whether a mesh has a border, by the mesh's address. Meshes stay in memory, so addresses are unique.
    pub(super) borders: HashMap<usize, bool>,
    images: ImageCache,
    /// The serialized meshes that were read.
    pub(super) serialized: serialized::Cache,
    /// The number of bytes that meshes other than those in files may still take.
    pub(super) room: u64,
    /// The index of the material of each object that was converted.
    pub(super) materials: HashMap<usize, Read<usize>>,
    /// The materials of shapes without a bsdf: the grey and the black one.
    pub(super) plain: [Option<usize>; 2],
    /// Whether each material, or a material that it refers to, depends on uv.
    pub(super) looks_at_uv: Vec<bool>,
    /// The index of the variant of each material that is black on the back.
    pub(super) one_sided: HashMap<usize, usize>,
    /// Whether each bsdf is black on the back.
    pub(super) are_one_sided: HashMap<usize, bool>,
    /// The results of converting textures, by their purpose.
    pub(super) shades: HashMap<Purpose, Read<Shade>>,
    /// The texture of each object, by what is taken from it. For pictures that does not matter.
    pub(super) textures: HashMap<(usize, Option<Taken>), usize>,
    /// The emission of emitters inside shapes, by the address of the emitter.
    pub(super) area_lights: HashMap<usize, Read<Emission>>,
    /// The group of each object that was converted, or none if the group is empty.
    pub(super) groups: HashMap<usize, Read<Option<usize>>>,
    /// The number of shapes so far, including those without a counterpart. `merge` may refer to a shape many times.
    pub(super) shapes: usize,
    /// The group to which shapes are added, or none for the world.
    pub(super) within: Option<usize>,
    /// The places in the files from which the parts of the scene come, in the scene's order.
    pub(super) places: Places,
}

/// The places in the files from which the parts of the scene come, in the scene's order.
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

/// A texture and its purpose: what is taken from it, and the bits of the default.
pub(super) type Purpose = (usize, Taken, u64);

/// A radiance, or a texture of it.
pub(super) type Emission = ([f64; 3], Option<usize>);

/// The key by which equal meshes are found.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum MeshKey {
    Cube,
    /// A file, the index of a mesh in it, whether its v runs down, and whether its normals are ignored.
    File(Arc<Path>, usize, bool, bool),
    /// A mesh whose normals are computed in the world: its file, index, direction of v, and transform.
    Placed(Arc<Path>, usize, bool, [u64; 9]),
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
            images: ImageCache::new(files.folder()),
            serialized: serialized::Cache::default(),
            room: super::limits::MOST_UNPACKED,
            materials: HashMap::new(),
            plain: [None; 2],
            looks_at_uv: Vec::new(),
            one_sided: HashMap::new(),
            are_one_sided: HashMap::new(),
            shades: HashMap::new(),
            textures: HashMap::new(),
            area_lights: HashMap::new(),
            groups: HashMap::new(),
            within: None,
            places: Places::default(),
        }
    }

    /// An object that is being converted.
    pub(super) fn object(&self, index: usize) -> &'a Object {
        let object = &self.document.objects[index];
        object.read.set(true);
        object
    }

    /// The first child of an object with a tag. Further ones are reported.
    pub(super) fn child(&mut self, object: &Object, tag: Tag) -> Option<&'a Object> {
        let children = self.document.children(object, tag);
        if let Some(&second) = children.get(1) {
            let place = self.document.objects[second].place;
            let what = format!("a second {} in a {}", tag.word(), object.tag.word());
            self.reports.lacks(place, what, "the first one is used");
        }
        children.first().map(|&first| self.object(first))
    }

    /// The file that a property of an object names.
    pub(super) fn file(&mut self, object: &Object, name: &str) -> Read<Arc<Path>> {
        match object.text(name, self.reports)? {
            None => Err(self.reports.error(object.place, format!("{} has no {name}", object.what()))),
            Some((file, place)) => {
                let found = self.files.find(file, &object.folders);
                found.map_err(|(message, help)| self.reports.error_with(place, message, || help))
            }
        }
    }

    /// The index of the image in a file.
    pub(super) fn image(&mut self, object: &Object, name: &str) -> Read<usize> {
        let path = self.file(object, name)?;
        let place = object.find(name).map_or(object.place, |property| property.place);
        // Files of tiles are found here, without the check of their folder.
        if path.to_string_lossy().contains("<UDIM>") {
            return Err(self
                .reports
                .error(place, "Mitsuba has no tiles: the name of a file cannot contain <UDIM>"));
        }
        let name = self.files.name(&path);
        let Some(name) = name.to_str() else {
            return Err(self.reports.error(place, "the path of this file is not UTF-8"));
        };
        self.images.get(name).map_err(|error| match error {
            images::Unreadable::First(error) => self.reports.error(place, error.to_string()),
            images::Unreadable::Again => self.reports.error(place, UNREADABLE),
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
        self.push_material(Material { name, kind: kind.into(), textures, ..Material::default() }, place)
    }

    fn push_material(&mut self, material: Material, place: Place) -> usize {
        // The materials that it refers to were added before it.
        let looks_at_uv = self.is_placed_by_uv(&material);
        self.looks_at_uv.push(looks_at_uv);
        self.scene.materials.push(material);
        self.places.materials.push(place);
        self.scene.materials.len() - 1
    }

    /// Adds a modified copy of a material, and returns its index.
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
        self.push_material(material, object.place)
    }

    /// Adds a texture, and returns its index.
    pub(super) fn add_texture(&mut self, object: &Object, kind: impl Into<TextureKind>) -> usize {
        let number = self.scene.textures.len() + 1;
        let name = match object.id.as_str() {
            "" => format!("{} {number}", object.plugin),
            // An object may have several textures.
            id => format!("{id} {number}"),
        };
        self.scene.textures.push(Texture { name, kind: kind.into() });
        self.places.textures.push(object.place);
        self.scene.textures.len() - 1
    }

    /// Adds an entity. It has the name of its object, or a number.
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

    /// Adds a group, and returns its index. Groups are sorted by name.
    pub(super) fn add_group(&mut self, object: &Object) -> usize {
        let number = self.scene.groups.len() + 1;
        let id = if object.id.is_empty() { &object.plugin } else { &object.id };
        self.scene.groups.push(Group { name: format!("{number:06} {id}") });
        self.places.groups.push(object.place);
        number - 1
    }

    /// Adds an instance of a group to the world.
    pub(super) fn add_instance(&mut self, object: &Object, group: usize, transform: DAffine3) {
        let number = self.scene.instances.len() + 1;
        let name =
            if object.id.is_empty() { format!("{} {number}", object.plugin) } else { object.id.clone() };
        self.scene.instances.push(Instance { name, group, transform, within: None });
        self.places.instances.push(object.place);
    }

    /// Sorts entities as a TOML file has them: those of the world, then those of each group. The order determines how
    /// lights are chosen.
    fn sort_entities(&mut self) {
        let entities = std::mem::take(&mut self.scene.entities);
        let places = std::mem::take(&mut self.places.entities);
        let mut placed: Vec<_> = entities.into_iter().zip(places).collect();
        placed.sort_by_key(|(entity, _)| entity.within.map_or(0, |group| group + 1));
        (self.scene.entities, self.places.entities) = placed.into_iter().unzip();
    }

    /// Removes the materials that no entity uses: wrappers have copies of what is in them.
    fn drop_unused_materials(&mut self) {
        let mut is_used = vec![false; self.scene.materials.len()];
        self.scene.entities.iter().for_each(|entity| is_used[entity.material] = true);
        // A material follows those that it refers to.
        for (i, material) in self.scene.materials.iter().enumerate().rev() {
            if is_used[i] {
                material.named().for_each(|named| is_used[named] = true);
            }
        }
        let mut count = 0;
        let place = |&used: &bool| {
            count += usize::from(used);
            count - usize::from(used)
        };
        let new: Vec<usize> = is_used.iter().map(place).collect();
        let mut used = is_used.iter();
        self.scene.materials.retain(|_| used.next().is_some_and(|&used| used));
        let mut used = is_used.iter();
        self.places.materials.retain(|_| used.next().is_some_and(|&used| used));
        for material in &mut self.scene.materials {
            if let MaterialKind::Mix(mix) = &mut material.kind {
                (mix.a, mix.b) = (new[mix.a], new[mix.b]);
            }
            material.modifiers.back = material.modifiers.back.map(|back| new[back]);
        }
        self.scene.entities.iter_mut().for_each(|entity| entity.material = new[entity.material]);
    }

    /// Reports the properties that no code has read, of all objects that were converted.
    pub(super) fn report_unused(&mut self) {
        for object in self.document.objects.iter().filter(|object| object.read.get()) {
            for property in self.document.unused(object) {
                let what = match &property.value {
                    super::object::Value::Object(index) => {
                        format!("{} in {}", self.document.objects[*index].what(), object.what())
                    }
                    _ => format!("{} of {}", quote(&property.name), object.what()),
                };
                self.reports.lacks(property.place, what, "it is left out");
            }
        }
    }

    /// Checks the scene and returns it with its images, and the places of its parts. Errors have the places of the parts
    /// that cause them.
    pub(super) fn finish(mut self) -> Read<(Scene, crate::scene::fingerprint::Sources, Places)> {
        self.scene.images = self.images.take();
        self.sort_entities();
        self.drop_unused_materials();
        let sources = self.sources();
        match self.scene.checked() {
            Ok(scene) => Ok((scene, sources, self.places)),
            Err(mut problems) => {
                // The channels of a colour have one message.
                problems.dedup_by(|a, b| (&a.part, &a.message) == (&b.part, &b.message));
                let mut outcome = None;
                for SceneProblem { part, message } in problems {
                    let place = self.places.of(&part);
                    let reported: Reported = self.reports.error(place, format!("{part}: {message}"));
                    outcome = Some(reported);
                }
                outcome.map_or_else(
                    || Err(self.reports.error(Place::default(), "the scene could not be converted")),
                    Err,
                )
            }
        }
    }

    /// The meshes from files, and their names in messages.
    fn sources(&self) -> crate::scene::fingerprint::Sources {
        let mut sources = self.meshes.sources();
        for (key, mesh) in &self.made {
            let (MeshKey::File(path, number, ..) | MeshKey::Placed(path, number, ..)) = key else { continue };
            sources.0.push((format!("{} {number}", self.files.name(path).display()), Arc::clone(mesh)));
        }
        sources.0.sort_by(|a, b| a.0.cmp(&b.0));
        sources
    }
}

impl Places {
    /// The place of a light, in a checked scene.
    pub(super) fn of_light(&self, light: Dark) -> Place {
        let place = match light {
            Dark::Entity(index) => self.entities.get(index),
            Dark::Light(index) => self.lights.get(index),
        };
        place.copied().unwrap_or_default()
    }

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
