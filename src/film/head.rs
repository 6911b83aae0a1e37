//! What a film file says of itself before its pixels, and in what two films differ.

use super::cryptomatte::Mattes;
use super::identity::{Difference, Identity};
use super::layout::Layout;
use crate::scene::fingerprint;
use std::io::{self, ErrorKind};
use std::ops::Range;

/// The longest text: half a million names for mattes fit into it.
pub(super) const LONGEST_TEXT: u32 = 1 << 24;

/// What a difference in layers is called.
pub const LAYERS: &str = "set of layers";

/// The notes that say the names of the things that mattes are about, for each of these kinds of things.
pub const NAMES: [&str; 2] = ["entities", "materials"];

/// What a film file says beside its pixels and their samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// How the film lies in memory, and what its words are.
    pub layout: Layout,
    /// What determines the bits.
    pub identity: Identity,
    /// What does not: `exposure`, `tone`, `asked` (the range of samples that the film is to have in the end), `layers`
    /// (those that its picture was to have), `parts` (the outline of the scene), `entities` and `materials` (the names that
    /// mattes are about, which films of one render have in common).
    pub notes: Identity,
}

impl Head {
    pub(super) fn text(&self) -> String {
        format!("{}\n{}", self.identity, self.notes)
    }

    /// Whether a film can say all this; why not, otherwise. A reader takes a longer text for damage.
    pub fn check(&self) -> io::Result<()> {
        let length = self.text().len();
        if length > LONGEST_TEXT as usize {
            let most = format!("what it is of takes {length} bytes, and a film has room for {LONGEST_TEXT}");
            return Err(io::Error::new(ErrorKind::InvalidInput, most));
        }
        Ok(())
    }

    /// Whether a milestone with an error has a plan: where samples go where the error is.
    pub(super) fn plans(&self) -> bool {
        self.identity.get("adaptive").is_some()
    }

    /// What makes another film one of another render, if it is one. Of a scene that differs, what of it does.
    pub fn difference(&self, other: &Head) -> Option<Difference> {
        let Some(mut difference) = self.identity.difference(&other.identity) else {
            return self.difference_of_layers(other);
        };
        if difference.name == "scene" {
            let outlines = self.notes.get("parts").zip(other.notes.get("parts"));
            difference.within = outlines.map(|(ours, theirs)| fingerprint::differing(ours, theirs));
        }
        Some(difference)
    }

    /// In what the sums of layers differ: they add up only if they are of the same layers, and of things of the same names.
    fn difference_of_layers(&self, other: &Head) -> Option<Difference> {
        let [ours, theirs] = [self, other].map(|head| head.layout.layers);
        if ours != theirs {
            let [ours, theirs] = [ours, theirs].map(|set| Some(set.to_string()));
            return Some(Difference { name: LAYERS.to_owned(), ours, theirs, within: None });
        }
        let differs = |name: &&&str| self.notes.get(name) != other.notes.get(name);
        let name = NAMES.iter().find(differs)?;
        let within = Some(format!("the names of {name}, which its mattes are about"));
        Some(Difference { name: "scene".to_owned(), ours: None, theirs: None, within })
    }

    /// The names that the film's mattes are about; none if they are not written as they should be.
    pub fn mattes(&self) -> Option<Mattes> {
        let [entities, materials] = NAMES.map(|name| self.notes.get(name));
        Mattes::of_lists(entities, materials)
    }

    /// The range of samples that the film was to have when it was written.
    pub fn asked(&self) -> Option<Range<u32>> {
        let (first, end) = self.notes.get("asked")?.split_once("..")?;
        Some(first.parse().ok()?..end.parse().ok()?)
    }
}
