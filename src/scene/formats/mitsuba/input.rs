//! Text files, and errors of the XML parser.

use super::limits::{MOST_BYTES, MOST_ELEMENTS};
use crate::texture::access;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

/// The text of a file of at most `most` bytes; `larger` returns the error for a larger one.
pub(super) fn limited(path: &Path, most: u64, larger: impl FnOnce() -> String) -> Result<Arc<str>, String> {
    if !path.is_file() {
        return Err("this is not a file".into());
    }
    let mut text = String::new();
    let open = || access::opening(path).and_then(|()| File::open(path));
    let read = open().and_then(|file| file.take(most + 1).read_to_string(&mut text));
    match read {
        Err(error) => Err(format!("cannot be read: {error}")),
        Ok(_) if text.len() as u64 > most => Err(larger()),
        Ok(_) => Ok(text.into()),
    }
}

/// The error for XML files that are too large in all.
pub(super) fn too_much_xml() -> String {
    format!("the XML files of this scene are larger than {} MiB", MOST_BYTES >> 20)
}

/// The byte offset of a position that the XML parser reports.
pub(super) fn offset(text: &str, at: roxmltree::TextPos) -> usize {
    let line_start = match at.row.saturating_sub(2) {
        _ if at.row < 2 => 0,
        before => text.match_indices('\n').nth(before as usize).map_or(text.len(), |(i, _)| i + 1),
    };
    let line = &text[line_start..];
    let column = at.col.saturating_sub(1) as usize;
    line_start + line.char_indices().nth(column).map_or(line.len(), |(i, _)| i)
}

/// The message of an error of the XML parser, without its position.
pub(super) fn explained(error: &roxmltree::Error) -> String {
    match error {
        roxmltree::Error::DtdDetected => "document type declarations are not supported".into(),
        roxmltree::Error::NodesLimitReached => {
            format!("the scene has more than {MOST_ELEMENTS} elements")
        }
        other => {
            let text = other.to_string();
            let text = text.rsplit_once(" at ").map_or(text.as_str(), |(message, _)| message);
            format!("this is not XML: {text}")
        }
    }
}
