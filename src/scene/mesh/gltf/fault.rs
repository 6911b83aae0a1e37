//! Errors in a glTF document, and locations for notes.

use crate::scene::mesh::source::FilePosition;
use std::fmt;

/// An error in a document, with its location.
pub(super) struct Fault {
    pub(super) place: String,
    pub(super) message: String,
}

impl Fault {
    pub(super) fn at(place: fmt::Arguments<'_>, message: impl ToString) -> Fault {
        Fault { place: place.to_string(), message: message.to_string() }
    }

    /// The same error, found while another item was read.
    pub(super) fn of(self, place: fmt::Arguments<'_>) -> Fault {
        Fault { place: format!("{place}: {}", self.place), ..self }
    }
}

/// The end of an error about a missing item: the number of existing items.
pub(super) fn only(count: usize) -> String {
    match count {
        0 => "there are none".into(),
        1 => "there is only 1".into(),
        _ => format!("there are only {count}"),
    }
}

/// The location of an item, for a note.
pub(super) fn item(place: fmt::Arguments<'_>) -> Option<FilePosition> {
    Some(FilePosition::Item(place.to_string()))
}
