//! Errors and the places of notes in a glTF document.

use crate::scene::mesh::source::Place;
use std::fmt;

/// An error in a document, with its place.
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

/// The end of an error about an item that is not there: the number of those that are.
pub(super) fn only(count: usize) -> String {
    match count {
        0 => "there are none".into(),
        1 => "there is only 1".into(),
        _ => format!("there are only {count}"),
    }
}

/// The place of an item, for a note.
pub(super) fn item(place: fmt::Arguments<'_>) -> Option<Place> {
    Some(Place::Item(place.to_string()))
}
