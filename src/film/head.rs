//! What a film file says of itself before its pixels, and in what two films differ.

use super::cryptomatte::Mattes;
use super::identity::{Difference, Identity};
use super::layers::Layer;
use super::layout::Layout;
use crate::scene::fingerprint;
use std::io::{self, ErrorKind};
use std::ops::Range;

/// The longest text: half a million names for mattes fit into it.
pub(super) const LONGEST_TEXT: u32 = 1 << 24;

/// The most facts, and the most notes. A program writes two dozen in all; those of two films are compared each with each.
const MOST_LINES: usize = 64;

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
    /// (those that its picture was to have), `parts` (the outline of the scene). And the names that mattes are about,
    /// `entities` and `materials`: no sample's bits depend on them, but films of one render have them in common.
    pub notes: Identity,
}

impl Head {
    pub(super) fn text(&self) -> String {
        format!("{}\n{}", self.identity, self.notes)
    }

    /// From such a text; none if it is not written as it should be.
    pub(super) fn parse(layout: Layout, text: &[u8]) -> Option<Head> {
        let (identity, notes) = std::str::from_utf8(text).ok()?.split_once("\n\n")?;
        let fits = |lines: &&str| lines.lines().nth(MOST_LINES).is_none();
        let parse = |lines: &str| Some(lines).filter(fits).and_then(Identity::parse);
        Some(Head { layout, identity: parse(identity)?, notes: parse(notes)? })
    }

    /// Whether a film can say all this; why not, otherwise. A reader takes a longer text for damage.
    pub fn check(&self) -> io::Result<()> {
        let length = self.text().len();
        if length > LONGEST_TEXT as usize {
            let most = format!("what it is of takes {length} bytes, and a film has room for {LONGEST_TEXT}");
            let remedy = self.without_names().map(|remedy| format!("; {remedy}")).unwrap_or_default();
            return Err(io::Error::new(ErrorKind::InvalidInput, most + &remedy));
        }
        Ok(())
    }

    /// How the text gets shorter, if there are names in it.
    fn without_names(&self) -> Option<String> {
        let mattes = NAMES.into_iter().zip([Layer::CryptoEntity, Layer::CryptoMaterial]);
        let named = mattes.filter(|(name, _)| self.notes.get(name).is_some());
        let layers: Vec<&str> = named.map(|(_, layer)| layer.name()).collect();
        match layers[..] {
            [] => None,
            [one] => Some(format!("leave out the layer {one}, whose names take most of it")),
            _ => Some(format!("leave out the layers {}, whose names take most of it", layers.join(" and "))),
        }
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

    /// The layers of the pictures that were written with the film.
    pub fn layers_shown(&self) -> Vec<Layer> {
        let names = self.notes.get("layers").unwrap_or_default();
        Layer::ALL.into_iter().filter(|layer| names.split(',').any(|name| name == layer.name())).collect()
    }
}
