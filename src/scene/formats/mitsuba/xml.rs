//! From XML files to objects: elements, variables, included files, and references.

use super::contents::Contents;
use super::files::{Files, Folders};
use super::input::{explained, offset, too_much_xml};
use super::limits::{
    LONGEST_SUBSTITUTED, MOST_BYTES, MOST_ELEMENTS, MOST_FOLDERS, MOST_GROWTH, MOST_INCLUDES, MOST_NESTING,
};
use super::nesting;
use super::object::{Document, Object, Property, Tag, Value};
use super::report::{Place, Read, Reports};
use super::spectrum::Spectrum;
use super::tags;
use super::text::{number, triple};
use super::transform;
use super::variables::Variables;
use crate::scene::spelling::{instead, quote, shorten};
use glam::DMat4;
use roxmltree::{Node, ParsingOptions};
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Elements that are not objects.
const OTHERS: [&str; 14] = [
    "alias",
    "boolean",
    "default",
    "float",
    "include",
    "integer",
    "path",
    "point",
    "ref",
    "rgb",
    "spectrum",
    "string",
    "transform",
    "vector",
];

/// A reference to an object that may be defined later.
struct Reference {
    object: usize,
    property: usize,
    id: String,
    place: Place,
}

/// The state of reading.
pub(super) struct Parser<'a> {
    pub(super) reports: &'a mut Reports,
    files: &'a Files,
    variables: Variables,
    objects: Vec<Object>,
    ids: HashMap<String, usize>,
    references: Vec<Reference>,
    folders: Folders,
    contents: Contents,
    elements: usize,
    bytes: u64,
    /// The growth of attributes by values of variables, in bytes.
    grown: u64,
}

/// An element, its attributes with the values of variables inserted, and its file.
struct Element<'a> {
    name: &'a str,
    attributes: Vec<(&'a str, Cow<'a, str>)>,
    place: Place,
}

impl Element<'_> {
    fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| *known == name).map(|(_, value)| value.as_ref())
    }
}

/// Reads the text of a scene file and the files that it includes.
pub(super) fn parse(
    path: &Path,
    text: Arc<str>,
    defines: &[(String, String)],
    (files, folders): (&Files, Folders),
    reports: &mut Reports,
) -> Read<Document> {
    let mut parser = Parser {
        reports,
        files,
        variables: Variables::given(defines),
        objects: Vec::new(),
        ids: HashMap::new(),
        references: Vec::new(),
        folders,
        contents: Contents::default(),
        elements: 0,
        bytes: 0,
        grown: 0,
    };
    let file = parser.reports.add_file(path, Arc::clone(&text));
    let whole = Place { file, at: 0 };
    parser.file(text, whole, None, 0)?;
    for name in parser.variables.unused() {
        let message = format!("the scene has no variable {}", quote(&format!("${name}")));
        let help = instead(&name, parser.variables.known());
        parser.reports.warn(whole, message, help);
    }
    parser.resolve()?;
    Ok(Document::new(parser.objects))
}

impl Parser<'_> {
    /// Reads the text of a file, which may be included inside an object.
    fn file(
        &mut self,
        text: Arc<str>,
        whole: Place,
        parent: Option<(usize, &str)>,
        depth: usize,
    ) -> Read<()> {
        let file = whole.file;
        self.bytes += text.len() as u64;
        if self.bytes > MOST_BYTES {
            return Err(self.reports.error(whole, too_much_xml()));
        }
        if let Some((at, message)) = tags::problem(&text) {
            return Err(self.reports.error(Place { file, at }, message));
        }
        let left = MOST_ELEMENTS - self.elements.min(MOST_ELEMENTS);
        // Nodes are elements, comments, and the texts between them.
        let options = ParsingOptions { nodes_limit: (4 * left + 1024) as u32, ..ParsingOptions::default() };
        let tree = match roxmltree::Document::parse_with_options(&text, options) {
            Ok(tree) => tree,
            Err(error) => {
                let at = offset(&text, error.pos());
                let place = Place { file, at };
                return Err(self.reports.error(place, explained(&error)));
            }
        };
        let root = tree.root_element();
        let element = self.element(root, file)?;
        match parent {
            None => {
                if element.name != "scene" {
                    let message = format!("the outermost element is {}, not \"scene\"", quote(element.name));
                    let is_part = Tag::of(element.name).is_some() || OTHERS.contains(&element.name);
                    let help = match is_part {
                        true => "name the file that includes this one",
                        false => "this is not a scene of Mitsuba",
                    };
                    return Err(self.reports.error_with(element.place, message, || Some(help.into())));
                }
                self.version(&element)?;
                let scene = self.object(Tag::Scene, &element)?;
                // The names in it have no meaning, and are never read.
                self.inside(root, scene, file, depth)
            }
            Some((object, _)) if element.name == "scene" => self.inside(root, object, file, depth),
            Some((object, name)) => self.child(root, object, file, depth, Some(name)),
        }
    }

    /// Checks the version of a scene.
    fn version(&mut self, element: &Element<'_>) -> Read<()> {
        let Some(version) = element.get("version") else {
            let help = || Some("write <scene version=\"3.0.0\">".into());
            return Err(self.reports.error_with(element.place, "<scene> has no version", help));
        };
        let major = version.trim().split('.').next().and_then(|major| major.parse::<u32>().ok());
        match major {
            Some(2..) => Ok(()),
            Some(_) => {
                let message = format!("this file is of Mitsuba {}", quote(version));
                let help = "files of Mitsuba 2 and 3 are read; Mitsuba 3 itself converts older ones";
                Err(self.reports.error_with(element.place, message, || Some(help.into())))
            }
            None => {
                let message = format!("{} is not a version", quote(version));
                Err(self.reports.error(element.place, message))
            }
        }
    }

    /// An element with the values of variables inserted.
    fn element<'n>(&mut self, node: Node<'n, '_>, file: usize) -> Read<Element<'n>> {
        let place = Place { file, at: node.range().start };
        self.elements += 1;
        if self.elements > MOST_ELEMENTS {
            let message = format!("the scene has more than {MOST_ELEMENTS} elements");
            return Err(self.reports.error(place, message));
        }
        let mut attributes = Vec::new();
        for attribute in node.attributes() {
            let value = match attribute.value() {
                plain if !plain.contains('$') => Cow::Borrowed(plain),
                text => match self.variables.put_into(text) {
                    Ok(value) if value.len() <= LONGEST_SUBSTITUTED => {
                        self.grown += value.len().saturating_sub(text.len()) as u64;
                        if self.grown > MOST_GROWTH + self.bytes {
                            let message =
                                "the values of variables take more room than all files of the scene";
                            return Err(self.reports.error(place, message));
                        }
                        Cow::Owned(value)
                    }
                    Ok(_) => {
                        let message =
                            format!("{} is too long with the values of its variables", attribute.name());
                        return Err(self.reports.error(place, message));
                    }
                    Err(name) => {
                        let message = format!("there is no variable {}", quote(&format!("${name}")));
                        let help = format!("set it with -D {name}=VALUE or <default>");
                        return Err(self.reports.error_with(place, message, || Some(help)));
                    }
                },
            };
            attributes.push((attribute.name(), value));
        }
        Ok(Element { name: node.tag_name().name(), attributes, place })
    }

    /// Reports unknown attributes of an element.
    fn only(&mut self, element: &Element<'_>, known: &[&'static str]) -> Read<()> {
        match element.attributes.iter().find(|(name, _)| !known.contains(name)) {
            None => Ok(()),
            Some((name, _)) => {
                let message = format!("<{}> has no attribute {}", element.name, quote(name));
                let help = || instead(name, known.iter().copied());
                Err(self.reports.error_with(element.place, message, help))
            }
        }
    }

    /// A required attribute.
    fn needed<'e>(&mut self, element: &'e Element<'_>, name: &str) -> Read<&'e str> {
        element
            .get(name)
            .ok_or_else(|| self.reports.error(element.place, format!("<{}> has no {name}", element.name)))
    }

    /// Adds an object without properties.
    fn object(&mut self, tag: Tag, element: &Element<'_>) -> Read<usize> {
        let plugin = match tag {
            Tag::Scene => "scene",
            _ => {
                self.only(element, &["type", "id", "name"])?;
                self.needed(element, "type")?
            }
        };
        let index = self.objects.len();
        let id = element.get("id").unwrap_or_default();
        if !id.is_empty() && self.ids.insert(id.to_owned(), index).is_some() {
            return Err(self.reports.error(element.place, format!("two objects have the id {}", quote(id))));
        }
        self.objects.push(Object::new(tag, plugin, id, element.place, self.folders.clone()));
        Ok(index)
    }

    /// Reads the children of an object's element.
    fn inside(&mut self, node: Node<'_, '_>, object: usize, file: usize, depth: usize) -> Read<()> {
        let mut outcome = Ok(());
        for child in node.children().filter(Node::is_element) {
            // Each error is reported once, and reading continues.
            if let Err(reported) = self.child(child, object, file, depth + 1, None) {
                outcome = Err(reported);
            }
        }
        outcome
    }

    /// Reads a child of an object's element. An included element may have another name than its own.
    fn child(
        &mut self,
        node: Node<'_, '_>,
        parent: usize,
        file: usize,
        depth: usize,
        name: Option<&str>,
    ) -> Read<()> {
        let element = self.element(node, file)?;
        if depth > MOST_NESTING {
            let message = format!("elements are nested more than {MOST_NESTING} deep");
            return Err(self.reports.error(element.place, message));
        }
        let name =
            name.filter(|name| !name.is_empty()).or(element.get("name")).unwrap_or_default().to_owned();
        let is_plugin = element.name == "spectrum" && element.get("type").is_some();
        let tag = if is_plugin { Some(Tag::Texture) } else { Tag::of(element.name) };
        if let Some(tag) = tag.filter(|&tag| tag != Tag::Scene) {
            let object = self.object(tag, &element)?;
            self.property(parent, name, Value::Object(object), element.place);
            let outcome = self.inside(node, object, file, depth);
            return self.sorted(object).and(outcome);
        }
        let value = match element.name {
            "include" => return self.include(&element, parent, &name, depth),
            "path" => return self.path(&element, parent),
            "default" => {
                self.only(&element, &["name", "value"])?;
                let (name, value) = (self.needed(&element, "name")?, self.needed(&element, "value")?);
                if name.is_empty() || name.contains('$') {
                    let message = format!("a variable cannot be called {}", quote(name));
                    return Err(self.reports.error(element.place, message));
                }
                self.variables.fall_back(name, value);
                return Ok(());
            }
            "alias" => return self.alias(&element),
            "ref" => {
                self.only(&element, &["id", "name"])?;
                let id = self.needed(&element, "id")?.to_owned();
                let (object, place) = (parent, element.place);
                let property = self.objects[parent].properties.len();
                self.references.push(Reference { object, property, id, place });
                Value::Object(usize::MAX)
            }
            "transform" => Value::Transform(Box::new(self.transform(node, &element, file)?)),
            other if OTHERS.contains(&other) => self.value(&element)?,
            other => {
                let message = format!("unknown element <{}>", quote(other).trim_matches('"'));
                let known = Tag::ALL.iter().skip(1).map(|(name, _)| *name).chain(OTHERS);
                return Err(self.reports.error_with(element.place, message, || instead(other, known)));
            }
        };
        if name.is_empty() && !matches!(value, Value::Object(_)) {
            return Err(self.reports.error(element.place, format!("<{}> has no name", element.name)));
        }
        self.property(parent, name, value, element.place);
        Ok(())
    }

    /// Adds a property.
    fn property(&mut self, object: usize, name: String, value: Value, place: Place) {
        self.objects[object].properties.push(Property { name, value, place, used: false.into() });
    }

    /// Sorts the properties of an object, when all have been added. Their names must be unique.
    fn sorted(&mut self, object: usize) -> Read<()> {
        let mut outcome = Ok(());
        for Property { name, place, .. } in self.objects[object].sort() {
            outcome = Err(self.reports.error(*place, format!("{} is given twice", quote(name))));
        }
        outcome
    }

    /// The value of an element that has one.
    fn value(&mut self, element: &Element<'_>) -> Read<Value> {
        let place = element.place;
        if matches!(element.name, "point" | "vector") {
            self.only(element, &["name", "value", "x", "y", "z"])?;
            let vector = transform::vector(&|name| element.get(name), 0.0);
            return vector.map(|v| Value::Triple(v.to_array())).map_err(|e| self.reports.error(place, e));
        }
        if element.name == "spectrum" {
            self.only(element, &["name", "value", "filename"])?;
            return self.spectrum(element).map(Value::Spectrum);
        }
        self.only(element, &["name", "value"])?;
        let text = self.needed(element, "value")?;
        let value = match element.name {
            "float" => number(text).map(Value::Number),
            "integer" => text.trim().parse().ok().map(Value::Whole),
            "boolean" => match text.trim().to_ascii_lowercase().as_str() {
                "true" => Some(Value::Flag(true)),
                "false" => Some(Value::Flag(false)),
                _ => None,
            },
            "rgb" => triple(text).map(Value::Rgb),
            _ => Some(Value::Text(text.to_owned())),
        };
        value.ok_or_else(|| {
            let expected = match element.name {
                "float" => "a number",
                "integer" => "a whole number",
                "boolean" => "true or false",
                _ => "one number or three",
            };
            let name = element.get("name").filter(|name| !name.is_empty()).unwrap_or("value");
            self.reports.error(place, format!("{} must be {expected}, not {}", shorten(name), quote(text)))
        })
    }

    fn spectrum(&mut self, element: &Element<'_>) -> Read<Spectrum> {
        let place = element.place;
        let read = match (element.get("value"), element.get("filename")) {
            (Some(value), None) => Spectrum::parse(value),
            (None, Some(name)) => {
                let path = self.find(name, place)?;
                self.contents.spectrum(&path).map_err(|error| format!("{}: {error}", quote(name)))
            }
            _ => Err("<spectrum> has either a value or a filename".into()),
        };
        read.map_err(|message| self.reports.error(place, message))
    }

    fn transform(&mut self, node: Node<'_, '_>, element: &Element<'_>, file: usize) -> Read<DMat4> {
        self.only(element, &["name"])?;
        let mut all = DMat4::IDENTITY;
        for child in node.children().filter(Node::is_element) {
            let step = self.element(child, file)?;
            let attribute = |name: &str| step.get(name);
            match transform::step(step.name, &attribute) {
                Some(matrix) => {
                    self.only(&step, transform::attributes(step.name))?;
                    all = matrix.map_err(|message| self.reports.error(step.place, message))? * all;
                    if transform::has_long_axis(step.name, &attribute) {
                        let what = "an axis of a rotation that is not of unit length";
                        self.reports.lacks(step.place, what, "it is normalised");
                    }
                }
                None => {
                    let message = format!("<{}> is no step of a transform", step.name);
                    let known = ["translate", "scale", "rotate", "lookat", "matrix"];
                    let help = || instead(step.name, known.into_iter());
                    return Err(self.reports.error_with(step.place, message, help));
                }
            }
        }
        Ok(all)
    }

    fn alias(&mut self, element: &Element<'_>) -> Read<()> {
        self.only(element, &["id", "as"])?;
        let (id, other) = (self.needed(element, "id")?, self.needed(element, "as")?);
        let Some(&object) = self.ids.get(id) else {
            return Err(self
                .reports
                .error(element.place, format!("no object before it has the id {}", quote(id))));
        };
        match self.ids.insert(other.to_owned(), object) {
            None => Ok(()),
            Some(_) => {
                let message = format!("two objects have the id {}", quote(other));
                Err(self.reports.error(element.place, message))
            }
        }
    }

    fn path(&mut self, element: &Element<'_>, parent: usize) -> Read<()> {
        self.only(element, &["value"])?;
        let value = self.needed(element, "value")?;
        if parent != 0 {
            return Err(self.reports.error(element.place, "<path> must be a child of <scene>"));
        }
        let own = self.files.name(self.reports.path(element.place.file));
        let folder = own.parent().unwrap_or(Path::new("")).join(value);
        self.look_first_in(folder, element.place)
    }

    fn include(&mut self, element: &Element<'_>, parent: usize, name: &str, depth: usize) -> Read<()> {
        self.only(element, &["filename", "name"])?;
        let file = self.needed(element, "filename")?;
        let path = self.find(file, element.place)?;
        let text = match self.contents.text(&path, MOST_BYTES - self.bytes.min(MOST_BYTES)) {
            Ok(text) => text,
            Err(error) => return Err(self.reports.error(element.place, format!("{}: {error}", quote(file)))),
        };
        let index = self.reports.add_file(&path, Arc::clone(&text));
        // A file that includes itself ends here.
        if self.includes(element.place.file) >= MOST_INCLUDES {
            let message = format!("files include each other more than {MOST_INCLUDES} deep");
            return Err(self.reports.error(element.place, message));
        }
        self.reports.included_by(index, element.place.file);
        let before = self.folders.clone();
        let own = self.files.name(&path);
        self.look_first_in(own.parent().unwrap_or(Path::new("")).to_path_buf(), element.place)?;
        let outcome = self.file(text, Place { file: index, at: 0 }, Some((parent, name)), depth);
        self.folders = before;
        outcome
    }

    /// Adds a folder by its name, which is searched first.
    fn look_first_in(&mut self, folder: PathBuf, place: Place) -> Read<()> {
        if self.folders.count() >= MOST_FOLDERS {
            let message = format!("files are searched for in more than {MOST_FOLDERS} folders");
            return Err(self.reports.error(place, message));
        }
        self.folders = self.files.before(folder, &self.folders);
        Ok(())
    }

    /// The number of nested inclusions at a file.
    fn includes(&self, file: usize) -> usize {
        std::iter::successors(Some(file), |&file| self.reports.includer(file)).count()
    }

    fn find(&mut self, name: &str, place: Place) -> Read<Arc<Path>> {
        let found = self.files.find(name, &self.folders);
        found.map_err(|(message, help)| self.reports.error_with(place, message, || help))
    }

    /// Replaces references by objects, and checks that no object contains itself and that none is nested too deep.
    fn resolve(&mut self) -> Read<()> {
        let mut outcome = Ok(());
        for Reference { object, property, id, place } in std::mem::take(&mut self.references) {
            match self.ids.get(&id) {
                Some(&named) => self.objects[object].properties[property].value = Value::Object(named),
                None => {
                    let message = format!("no object has the id {}", quote(&id));
                    // In the order of the file, so that the message does not depend on the order of hashes.
                    let ids = self.objects.iter().map(|object| object.id.as_str());
                    let help = || instead(&id, ids.filter(|id| !id.is_empty()));
                    outcome = Err(self.reports.error_with(place, message, help));
                }
            }
        }
        outcome?;
        let wrong = nesting::problem(&self.objects);
        wrong.map_or(Ok(()), |(place, message)| Err(self.reports.error(place, message)))
    }
}
