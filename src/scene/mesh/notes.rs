//! Notes of what a reader left out, repaired or approximated.

use super::source::Place;
use std::fmt;

/// One kind of thing that a reader left out, repaired or approximated. It displays as
/// `faces of fewer than three corners are left out: 3, the first in line 12`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What was found, in the plural, and what became of it.
    pub message: String,
    /// How often it was found.
    pub count: u64,
    /// Where it was found first; absent if it concerns the file as a whole.
    pub first: Option<Place>,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        match (&self.first, self.count) {
            (None, 0 | 1) => Ok(()),
            (None, count) => write!(f, ": {count}"),
            (Some(place), 0 | 1) => write!(f, ": 1, {}", place.within()),
            (Some(place), count) => write!(f, ": {count}, the first {}", place.within()),
        }
    }
}

/// Kinds of notes that are kept; messages that quote a file could otherwise be without end.
const MOST_KINDS: usize = 100;

/// The notes about a file, one for each kind.
#[derive(Clone, Debug, Default)]
pub(super) struct Notes(Vec<Note>);

impl Notes {
    /// Counts one more of a kind, which is told by its message.
    pub(super) fn add(&mut self, message: &str, place: Option<Place>) {
        self.add_several(message, 1, place);
    }

    /// Counts so many more of a kind, of which the first is in this place; none leave no note.
    pub(super) fn add_several(&mut self, message: &str, count: u64, place: Option<Place>) {
        match self.0.iter_mut().find(|note| note.message == message) {
            Some(note) => note.count += count,
            None => {
                if count > 0 && self.0.len() < MOST_KINDS {
                    self.0.push(Note { message: message.to_owned(), count, first: place });
                }
            }
        }
    }

    /// All of them, in the order in which their kinds were first found.
    pub(super) fn into_all(self) -> Vec<Note> {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_told_once_with_its_count_and_its_first_place() {
        let mut notes = Notes::default();
        notes.add("faces of two corners are left out", Some(Place::Line(12)));
        notes.add("faces of two corners are left out", Some(Place::Line(15)));
        notes.add("textures are not read", None);
        notes.add("strips are cut", Some(Place::Item("meshes[3]".into())));
        let told: Vec<_> = notes.into_all().iter().map(Note::to_string).collect();
        assert_eq!(
            told,
            [
                "faces of two corners are left out: 2, the first in line 12",
                "textures are not read",
                "strips are cut: 1, in meshes[3]"
            ]
        );
    }

    #[test]
    fn kinds_without_end_are_not_kept() {
        let mut notes = Notes::default();
        (0..10 * MOST_KINDS).for_each(|i| notes.add(&format!("kind {i}"), None));
        assert_eq!(notes.into_all().len(), MOST_KINDS);
    }
}
