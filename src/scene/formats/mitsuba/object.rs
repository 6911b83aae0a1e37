//! The objects of a scene and their properties, as in the XML files.

use super::files::Folders;
use super::report::{Place, Read, Reports};
use super::spectrum::Spectrum;
use crate::scene::spelling::{quote, shorten};
use glam::DMat4;
use std::cell::Cell;

/// The type of an object: the name of its element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Tag {
    Scene,
    Bsdf,
    Emitter,
    Film,
    Integrator,
    Medium,
    Phase,
    Filter,
    Sampler,
    Sensor,
    Shape,
    Texture,
    Volume,
}

impl Tag {
    /// All tags with the names of their elements.
    pub(super) const ALL: [(&'static str, Tag); 13] = [
        ("scene", Tag::Scene),
        ("bsdf", Tag::Bsdf),
        ("emitter", Tag::Emitter),
        ("film", Tag::Film),
        ("integrator", Tag::Integrator),
        ("medium", Tag::Medium),
        ("phase", Tag::Phase),
        ("rfilter", Tag::Filter),
        ("sampler", Tag::Sampler),
        ("sensor", Tag::Sensor),
        ("shape", Tag::Shape),
        ("texture", Tag::Texture),
        ("volume", Tag::Volume),
    ];

    pub(super) fn of(element: &str) -> Option<Tag> {
        Tag::ALL.iter().find(|(name, _)| *name == element).map(|(_, tag)| *tag)
    }

    pub(super) fn word(self) -> &'static str {
        Tag::ALL.iter().find(|(_, tag)| *tag == self).map_or("?", |(name, _)| name)
    }
}

/// The value of a property.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Number(f64),
    Whole(i64),
    Flag(bool),
    Text(String),
    /// A point or a vector.
    Triple([f64; 3]),
    Rgb([f64; 3]),
    Spectrum(Spectrum),
    /// Boxed, because it is larger than the other values.
    Transform(Box<DMat4>),
    /// The index of an object.
    Object(usize),
}

impl Value {
    /// The name of the element for such a value.
    fn element(&self) -> &'static str {
        match self {
            Value::Number(_) => "float",
            Value::Whole(_) => "integer",
            Value::Flag(_) => "boolean",
            Value::Text(_) => "string",
            Value::Triple(_) => "vector",
            Value::Rgb(_) => "rgb",
            Value::Spectrum(_) => "spectrum",
            Value::Transform(_) => "transform",
            Value::Object(_) => "object",
        }
    }
}

/// A property of an object.
#[derive(Clone, Debug)]
pub(super) struct Property {
    /// The name; empty for an object without one.
    pub(super) name: String,
    pub(super) value: Value,
    pub(super) place: Place,
    /// Whether the property has been read.
    pub(super) used: Cell<bool>,
}

/// An object of a scene.
#[derive(Clone, Debug)]
pub(super) struct Object {
    pub(super) tag: Tag,
    /// The value of the element's attribute `type`.
    pub(super) plugin: String,
    pub(super) id: String,
    pub(super) place: Place,
    pub(super) properties: Vec<Property>,
    /// The folders in which the object's files are searched for.
    pub(super) folders: Folders,
    /// Whether the object has been converted.
    pub(super) read: Cell<bool>,
    /// The indices of properties with names, sorted by name: an object may have a million.
    by_name: Vec<u32>,
    /// The child objects, sorted by tag.
    children: Vec<usize>,
    /// The tags whose children have been read, one bit each.
    looked_at: Cell<u16>,
}

/// All objects of a scene. The first one is the scene itself. No object contains itself, directly or indirectly.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) objects: Vec<Object>,
}

impl Document {
    /// A document of objects whose references are resolved.
    pub(super) fn new(mut objects: Vec<Object>) -> Document {
        for index in 0..objects.len() {
            let mut children: Vec<usize> = objects[index].objects().map(|(named, _)| named).collect();
            children.sort_by_key(|&child| objects[child].tag);
            objects[index].children = children;
        }
        Document { objects }
    }

    /// The children of an object with a tag, in order. They are marked as read.
    pub(super) fn children<'o>(&self, object: &'o Object, tag: Tag) -> &'o [usize] {
        object.looked_at.set(object.looked_at.get() | 1 << tag as u16);
        let all = &object.children;
        let of = |&child: &usize| self.objects[child].tag;
        let first = all.partition_point(|child| of(child) < tag);
        &all[first..all.partition_point(|child| of(child) <= tag)]
    }

    /// The properties of an object that have not been read.
    pub(super) fn unused<'o>(&'o self, object: &'o Object) -> impl Iterator<Item = &'o Property> {
        object.properties.iter().filter(|property| match property.value {
            Value::Object(child) => {
                let of = &self.objects[child];
                let is_looked_at = object.looked_at.get() & 1 << of.tag as u16 != 0;
                // An object of the scene may be converted where others refer to it.
                let is_elsewhere = object.tag == Tag::Scene && of.read.get();
                !is_looked_at && !is_elsewhere && !property.used.get()
            }
            _ => !property.used.get(),
        })
    }
}

impl Object {
    /// An object without properties.
    pub(super) fn new(tag: Tag, plugin: &str, id: &str, place: Place, folders: Folders) -> Object {
        Object {
            tag,
            plugin: plugin.to_owned(),
            id: id.to_owned(),
            place,
            properties: Vec::new(),
            folders,
            read: Cell::new(false),
            by_name: Vec::new(),
            children: Vec::new(),
            looked_at: Cell::new(0),
        }
    }

    /// Sorts the properties by name, when all have been added. Returns those whose name an earlier one has.
    pub(super) fn sort(&mut self) -> Vec<&Property> {
        let name = |&at: &u32| self.properties[at as usize].name.as_str();
        let mut sorted: Vec<u32> =
            (0..self.properties.len() as u32).filter(|at| !name(at).is_empty()).collect();
        sorted.sort_by(|a, b| name(a).cmp(name(b)));
        let again =
            |pair: &[u32]| (name(&pair[0]) == name(&pair[1])).then(|| &self.properties[pair[1] as usize]);
        let again: Vec<_> = sorted.windows(2).filter_map(again).collect();
        self.by_name = sorted;
        again
    }

    /// The child objects, and the places where they are referred to.
    pub(super) fn objects(&self) -> impl Iterator<Item = (usize, Place)> {
        self.properties.iter().filter_map(|property| match property.value {
            Value::Object(named) => Some((named, property.place)),
            _ => None,
        })
    }

    /// The property with a name, which is marked as read.
    pub(super) fn find(&self, name: &str) -> Option<&Property> {
        let of = |at: u32| &self.properties[at as usize];
        let at = self.by_name.partition_point(|&at| of(at).name.as_str() < name);
        let found = self.by_name.get(at).map(|&at| of(at)).filter(|property| property.name == name)?;
        found.used.set(true);
        Some(found)
    }

    /// Marks properties as read that do not affect an image in stride.
    pub(super) fn ignore(&self, names: &[&str]) {
        names.iter().for_each(|name| {
            self.find(name);
        });
    }

    /// Marks all properties as read.
    pub(super) fn ignore_all(&self) {
        self.properties.iter().for_each(|property| property.used.set(true));
    }

    /// The object's description in messages: `bsdf "diffuse"`.
    pub(super) fn what(&self) -> String {
        format!("{} {}", self.tag.word(), quote(&self.plugin))
    }

    fn wrong<T>(&self, property: &Property, expected: &str, reports: &mut Reports) -> Read<T> {
        let message = format!(
            "{} of {} must be {expected}, not a {}",
            shorten(&property.name),
            self.what(),
            property.value.element()
        );
        Err(reports.error(property.place, message))
    }

    /// A number, or the default if it is absent.
    pub(super) fn number(&self, name: &str, default: f64, reports: &mut Reports) -> Read<f64> {
        match self.find(name) {
            None => Ok(default),
            Some(property) => match property.value {
                Value::Number(number) => Ok(number),
                Value::Whole(number) => Ok(number as f64),
                _ => self.wrong(property, "a float", reports),
            },
        }
    }

    /// A whole number, or the default if it is absent.
    pub(super) fn whole(&self, name: &str, default: i64, reports: &mut Reports) -> Read<i64> {
        match self.find(name) {
            None => Ok(default),
            Some(property) => match property.value {
                Value::Whole(number) => Ok(number),
                _ => self.wrong(property, "an integer", reports),
            },
        }
    }

    /// A flag, or the default if it is absent.
    pub(super) fn flag(&self, name: &str, default: bool, reports: &mut Reports) -> Read<bool> {
        match self.find(name) {
            None => Ok(default),
            Some(property) => match property.value {
                Value::Flag(flag) => Ok(flag),
                _ => self.wrong(property, "a boolean", reports),
            },
        }
    }

    /// A text and its place, if present.
    pub(super) fn text(&self, name: &str, reports: &mut Reports) -> Read<Option<(&str, Place)>> {
        match self.find(name) {
            None => Ok(None),
            Some(property) => match &property.value {
                Value::Text(text) => Ok(Some((text, property.place))),
                _ => self.wrong(property, "a string", reports),
            },
        }
    }

    /// A point or a vector, if present.
    pub(super) fn triple(&self, name: &str, reports: &mut Reports) -> Read<Option<[f64; 3]>> {
        match self.find(name) {
            None => Ok(None),
            Some(property) => match property.value {
                Value::Triple(triple) => Ok(Some(triple)),
                _ => self.wrong(property, "a point or a vector", reports),
            },
        }
    }

    /// A transform and its place, if present.
    pub(super) fn transform(&self, name: &str, reports: &mut Reports) -> Read<Option<(DMat4, Place)>> {
        match self.find(name) {
            None => Ok(None),
            Some(property) => match property.value {
                Value::Transform(ref transform) => Ok(Some((**transform, property.place))),
                _ => self.wrong(property, "a transform", reports),
            },
        }
    }

    /// One of several words. The first one is the default.
    pub(super) fn word<T: Copy>(
        &self,
        name: &str,
        words: &[(&'static str, T)],
        reports: &mut Reports,
    ) -> Read<T> {
        let Some((text, place)) = self.text(name, reports)? else { return Ok(words[0].1) };
        let lower = text.to_ascii_lowercase();
        if let Some((_, meant)) = words.iter().find(|(known, _)| *known == lower) {
            return Ok(*meant);
        }
        let known: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        let message =
            format!("{name} of {} must be {}, not {}", self.what(), known.join(" or "), quote(text));
        Err(reports.error(place, message))
    }
}
