//! The reader of TOML scene files.
//!
//! | file | contents |
//! |---|---|
//! | `report` | errors and warnings with their positions |
//! | `form` | value forms |
//! | `value` | simple values: numbers, vectors, words |
//! | `varying` | values of textures, and values that may be textures |
//! | `table` | tables and lists |
//! | `declared` | tables whose keys are declared by a shape, texture, material or light |
//! | `one_of` | tables selected by a `type` |
//! | `order` | the order of tables that refer to each other |
//! | `common` | value forms shared by several tables |
//! | `film`, `camera`, `render`, `textures`, `materials`, `shape`, `entity`, `groups`, `light`, `environment` | the keys of a table, and their conversion |
//! | `scene` | the tables of a file, and the resulting [`Scene`] |
//! | `schema` | the JSON Schema |
//!
//! The reader and the JSON Schema both follow the tables of keys: name, form, default and description. Those of shapes,
//! materials and lights come from [`crate::parameter`].
//!
//! Reading continues after an error, so that all errors of a file are reported together. An unreadable value is a
//! `report::Reported`, which only reporting an error creates: no error path yields a scene.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use ::toml::de::{DeTable, DeValue, Error as SyntaxError};

use super::description::Scene;
use super::diagnostic::{Cursor, Diagnostic, SceneErrors};
use super::fingerprint::Sources;
use super::images::ImageCache;
use super::mesh::cache::{MeshCache, Watch};
use crate::texture::access;
use form::{Value, ValueForm};
use report::Diagnostics;

mod camera;
mod common;
mod declared;
mod entity;
mod environment;
mod film;
mod form;
mod groups;
mod light;
mod materials;
mod one_of;
mod order;
mod render;
mod report;
mod scene;
mod schema;
mod shape;
mod table;
mod textures;
mod value;
mod varying;

pub use schema::schema;

/// The maximum size of a scene file in bytes. Text of this size describes a hundred thousand entities.
pub const MAX_FILE_SIZE: u64 = 16 << 20;

/// A scene that can be rendered, and warnings.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Warnings about legal but probably unintended input, in the order of the file.
    pub warnings: Vec<Diagnostic>,
    /// The mesh files from which it was read.
    pub sources: Sources,
    /// The part of the film that is rendered if nothing else is asked for, as column, row, width and height: other formats
    /// have it in their files.
    pub crop: Option<[u32; 4]>,
}

/// Reads the scene file at `path`, with progress of reading the files that it refers to.
pub(super) fn load_watched(path: &Path, watch: Watch<'_>) -> Result<Loaded, SceneErrors> {
    let bytes = read_file(path)?;
    let text = decode(path, &bytes)?;
    parse_watched(text, path, Some(watch))
}

/// Reads a scene from TOML text. `file_name` is what errors call it.
pub fn parse(text: &str, file_name: &Path) -> Result<Loaded, SceneErrors> {
    parse_watched(text, file_name, None)
}

fn parse_watched<'a>(
    text: &'a str,
    file_name: &Path,
    watch: Option<Watch<'a>>,
) -> Result<Loaded, SceneErrors> {
    let (document, syntax_errors) = parse_toml(text);
    let document = Value::new(0..0, DeValue::Table(document));
    let folder = file_name.parent().unwrap_or(Path::new(""));
    let (meshes, images) = (MeshCache::new(folder, watch), ImageCache::new(folder));
    let mut diagnostics = Diagnostics::new(text, meshes, images, scene::places_of);
    // The parser's recovery from invalid TOML is a guess, and errors in a guess would mislead.
    let scene = match diagnostics.syntax_errors(&syntax_errors) {
        Ok(()) => scene::SCENE.read("scene", &document, &mut diagnostics),
        Err(reported) => Err(reported),
    };
    let loaded = match scene {
        Ok(scene) if !diagnostics.has_errors() => {
            let sources = diagnostics.sources();
            Ok(Loaded { scene, warnings: diagnostics.into_warnings(file_name), sources, crop: None })
        }
        _ => Err(diagnostics.into_errors(file_name)),
    };
    dismantle(document);
    loaded
}

/// Parses TOML, with recovery from errors for files of moderate size.
fn parse_toml(text: &str) -> (DeTable<'_>, Vec<SyntaxError>) {
    // The parser stores every error; for a large invalid file, they take gigabytes.
    const RECOVERABLE: usize = 1 << 20;
    if text.len() <= RECOVERABLE {
        let (document, errors) = DeTable::parse_recoverable(text);
        return (document.into_inner(), errors);
    }
    match DeTable::parse(text) {
        Ok(document) => (document.into_inner(), Vec::new()),
        Err(error) => (DeTable::new(), vec![error]),
    }
}

/// Drops a document without recursion: dotted keys inside inline tables nest thousands of tables within the parser's
/// own limit, enough to overflow a small thread's stack.
fn dismantle(document: Value<'_>) {
    let mut pending = vec![document.into_inner()];
    while let Some(value) = pending.pop() {
        match value {
            DeValue::Array(mut array) => {
                pending.extend(
                    array.iter_mut().map(|v| std::mem::replace(v.get_mut(), DeValue::Boolean(false))),
                );
            }
            DeValue::Table(table) => pending.extend(table.into_iter().map(|(_, v)| v.into_inner())),
            _ => {}
        }
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, SceneErrors> {
    let fail = |message: String, help: Option<String>| Err(SceneErrors::one(path, None, message, help));
    let unreadable = |error: &std::io::Error| match error.kind() {
        ErrorKind::PermissionDenied => fail("permission to read this file is denied".into(), None),
        _ => fail(format!("cannot be read: {error}"), None),
    };
    if let Err(error) = access::opening(path) {
        return unreadable(&error);
    }
    // Read up to the limit, as pipes and devices have no length.
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(MAX_FILE_SIZE + 1).read_to_end(&mut bytes));
    match read {
        Err(error) => unreadable(&error),
        Ok(_) if bytes.len() as u64 > MAX_FILE_SIZE => fail(
            format!(
                "this file is larger than {} MiB, the most that a scene file may be",
                MAX_FILE_SIZE >> 20
            ),
            Some("is it a scene file?".into()),
        ),
        Ok(_) => Ok(bytes),
    }
}

/// The text of a scene file, which is UTF-8.
fn decode<'b>(path: &Path, bytes: &'b [u8]) -> Result<&'b str, SceneErrors> {
    let error = match std::str::from_utf8(bytes) {
        Ok(text) if !text.contains('\0') => return Ok(text),
        Ok(_) => None,
        Err(error) => Some(error),
    };
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        let message = "this file is UTF-16; a scene file is UTF-8".into();
        return Err(SceneErrors::one(path, None, message, Some("save it as UTF-8 in your editor".into())));
    }
    if let Some(byte) = bytes.iter().position(|&b| b == 0) {
        let message = format!("this is not a text file: byte {} is zero", byte + 1);
        return Err(SceneErrors::one(path, None, message, Some("a scene file is TOML, in UTF-8".into())));
    }
    let offset = error.map_or(0, |error| error.valid_up_to());
    let valid = std::str::from_utf8(&bytes[..offset]).unwrap_or_default();
    let position = Cursor::new(valid).advance(offset);
    let message = format!("byte {} of the file (0x{:02x}) is not UTF-8", offset + 1, bytes[offset]);
    Err(SceneErrors::one(path, Some(position), message, Some("save it as UTF-8 in your editor".into())))
}
