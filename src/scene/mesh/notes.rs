//! Notes about omissions, repairs and approximations of a reader.

use super::source::FilePosition;
use std::collections::HashSet;
use std::fmt;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};

/// A kind of omission, repair or approximation. It displays as `faces of fewer than three corners are left out: 3, the
/// first in line 12`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The items in the plural, and their treatment. The count is that of the items.
    pub message: String,
    /// The number of items.
    pub count: u64,
    /// The location of the first item; `None` if it concerns the entire file.
    pub first: Option<FilePosition>,
    /// Whether it concerns a material of the file, so that it is irrelevant if the scene gives the mesh another
    /// material.
    pub is_of_material: bool,
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

/// The maximum number of kinds of notes; messages that quote a file could otherwise be unlimited.
const MOST_KINDS: usize = 100;

/// The notes about a file, one for each kind.
#[derive(Clone, Debug, Default)]
pub(super) struct Notes {
    kept: Vec<Note>,
    /// Hashes of the messages of further kinds.
    further: HashSet<u64>,
}

impl Notes {
    /// Counts one more item of a kind, which its message identifies.
    pub(super) fn add(&mut self, message: &str, place: Option<FilePosition>) {
        self.add_several(message, 1, place);
    }

    /// Counts several items of a kind, with the location of the first; zero items add no note.
    pub(super) fn add_several(&mut self, message: &str, count: u64, place: Option<FilePosition>) {
        if count == 0 {
            return;
        }
        if let Some(note) = self.kept.iter_mut().find(|note| note.message == message) {
            note.count += count;
        } else if self.kept.len() < MOST_KINDS {
            self.kept.push(Note { message: message.to_owned(), count, first: place, is_of_material: false });
        } else {
            self.further.insert(BuildHasherDefault::<DefaultHasher>::default().hash_one(message));
        }
    }

    /// Counts one more item of a kind that concerns a material of the file.
    pub(super) fn add_of_material(&mut self, message: &str, place: Option<FilePosition>) {
        self.add(message, place);
        if let Some(note) = self.kept.iter_mut().find(|note| note.message == message) {
            note.is_of_material = true;
        }
    }

    /// All notes, in the order of their first items. The last one counts the kinds beyond the limit.
    pub(super) fn into_all(self) -> Vec<Note> {
        let mut all = self.kept;
        let count = self.further.len() as u64;
        if count > 0 {
            let message = format!("further kinds of notes: {count}");
            all.push(Note { message, count: 1, first: None, is_of_material: false });
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_reported_once_with_count_and_location() {
        let mut notes = Notes::default();
        notes.add("faces of two corners are left out", Some(FilePosition::Line(12)));
        notes.add("faces of two corners are left out", Some(FilePosition::Line(15)));
        notes.add("textures are not read", None);
        notes.add("strips are cut", Some(FilePosition::Item("meshes[3]".into())));
        let reported: Vec<_> = notes.into_all().iter().map(Note::to_string).collect();
        assert_eq!(
            reported,
            [
                "faces of two corners are left out: 2, the first in line 12",
                "textures are not read",
                "strips are cut: 1, in meshes[3]"
            ]
        );
    }

    #[test]
    fn kinds_beyond_the_limit_are_counted() {
        let mut notes = Notes::default();
        for i in (0..MOST_KINDS + 7).chain(0..MOST_KINDS + 5) {
            notes.add(&format!("kind {i}"), None);
        }
        let all = notes.into_all();
        assert_eq!((all.len(), all[MOST_KINDS - 1].to_string()), (MOST_KINDS + 1, "kind 99: 2".into()));
        assert_eq!(all[MOST_KINDS].to_string(), "further kinds of notes: 7");
    }
}
