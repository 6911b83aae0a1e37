//! The JSON of a glTF file, and the errors in it.

use super::document::Document;
use crate::scene::mesh::source::FilePosition;
use serde::Deserialize;
use serde_json::{Error, Value};

/// The reason why text is not glTF 2.0.
pub(super) struct Unfit {
    pub(super) place: Option<FilePosition>,
    pub(super) message: String,
}

impl Unfit {
    fn whole(message: impl ToString) -> Unfit {
        Unfit { place: None, message: message.to_string() }
    }

    /// An error in the syntax.
    fn syntax(text: &[u8], error: &Error) -> Unfit {
        if text.trim_ascii().is_empty() {
            return Unfit::whole("this is not JSON: it is empty");
        }
        let end = if error.is_eof() { ": it is truncated" } else { "" };
        Unfit::whole(format!("this is not JSON: {}{end}", placed(error)))
    }
}

/// The part of a document that all versions share.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    asset: Value,
}

/// Decodes a document of glTF 2.0.
pub(super) fn decode(text: &[u8]) -> Result<Document, Unfit> {
    let decoded: Result<Document, Error> = serde_json::from_slice(text);
    // Other versions have another structure, which is no error. Only documents with errors are decoded a second time.
    let version = match &decoded {
        Ok(document) => document.asset.version.clone(),
        Err(_) => version(text)?,
    };
    match version {
        None => Err(Unfit::whole(
            "the string \"asset.version\" is missing, as in some files of glTF 1.0; version 2 is read",
        )),
        Some(version) if !version.starts_with("2.") => {
            let version: String = version.chars().take(20).flat_map(char::escape_debug).collect();
            Err(Unfit::whole(format!("this is glTF version {version}; version 2 is read")))
        }
        Some(_) => decoded.map_err(|error| shape(text, &error)),
    }
}

/// The version of a document, ignoring everything else.
fn version(text: &[u8]) -> Result<Option<String>, Unfit> {
    match serde_json::from_slice::<Head>(text) {
        Ok(head) => Ok(head.asset.get("version").and_then(Value::as_str).map(str::to_owned)),
        // It is JSON, but no object.
        Err(error) if error.is_data() => Ok(None),
        Err(error) => Err(Unfit::syntax(text, &error)),
    }
}

/// The location and reason of an error in a document that is valid JSON.
fn shape(text: &[u8], error: &Error) -> Unfit {
    // Tracking paths takes time, and valid documents need none.
    let again: Result<Document, _> =
        serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_slice(text));
    let path = again.err().map(|error| error.path().to_string()).filter(|path| path != ".");
    Unfit {
        place: path.map(FilePosition::Item),
        message: format!("it does not fit glTF 2.0: {}", placed(error)),
    }
}

/// An error with its line and its column in brackets.
fn placed(error: &Error) -> String {
    let (line, column) = (error.line(), error.column());
    let message = error.to_string();
    let bare = message.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&message);
    format!("{bare} (line {line}, column {column})")
}
