//! The header of a film file, and the differences between two headers.

use super::cryptomatte::Mattes;
use super::identity::{Difference, Identity};
use super::layers::Layer;
use super::layout::Layout;
use crate::scene::fingerprint;
use std::io::{self, ErrorKind};
use std::ops::Range;

/// The maximum length of the text in bytes: enough for the names of half a million entities and materials.
pub(super) const LONGEST_TEXT: u32 = 1 << 24;

/// The maximum number of facts, and of notes. A program writes two dozen in all; those of two films are compared in
/// pairs.
const MOST_LINES: usize = 64;

/// The name of a difference in layers.
pub const LAYERS: &str = "set of layers";

/// The notes that list the names in Cryptomatte layers.
pub const NAMES: [&str; 2] = ["entities", "materials"];

/// The contents of a film file other than its pixels and their samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// The size of the film, and the kinds of its sums.
    pub layout: Layout,
    /// The facts that determine the bits of the samples.
    pub identity: Identity,
    /// Notes that do not: `exposure`, `tone`, `asked` (the requested range of samples), `layers` (the layers of the
    /// picture),
    /// `parts` (the outline of the scene). Also the names in Cryptomatte layers, `entities` and `materials`: samples do not
    /// depend on them, but films of one render have them in common.
    pub notes: Identity,
}

impl Head {
    pub(super) fn text(&self) -> String {
        format!("{}\n{}", self.identity, self.notes)
    }

    /// Parses the text of a header; `None` if it is malformed.
    pub(super) fn parse(layout: Layout, text: &[u8]) -> Option<Head> {
        let (identity, notes) = std::str::from_utf8(text).ok()?.split_once("\n\n")?;
        let fits = |lines: &&str| lines.lines().nth(MOST_LINES).is_none();
        let parse = |lines: &str| Some(lines).filter(fits).and_then(Identity::parse);
        Some(Head { layout, identity: parse(identity)?, notes: parse(notes)? })
    }

    /// Fails if the text is too long, which readers would report as damage.
    pub fn check(&self) -> io::Result<()> {
        let length = self.text().len();
        if length > LONGEST_TEXT as usize {
            let most = format!(
                "its facts and notes take {length} bytes, and a film can store at most {LONGEST_TEXT}"
            );
            let remedy = self.without_names().map(|remedy| format!("; {remedy}")).unwrap_or_default();
            return Err(io::Error::new(ErrorKind::InvalidInput, most + &remedy));
        }
        Ok(())
    }

    /// A remedy for a text that is too long, if it contains names.
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

    /// Whether a milestone with an error has a plan, because the render is adaptive.
    pub(super) fn plans(&self) -> bool {
        self.identity.get("adaptive").is_some()
    }

    /// The first fact that shows that another film belongs to another render; `None` if it belongs to the same. For a
    /// scene that differs, also the part of the scene.
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

    /// The difference between layers: sums can be added only if they are of the same layers and the same names.
    fn difference_of_layers(&self, other: &Head) -> Option<Difference> {
        let [ours, theirs] = [self, other].map(|head| head.layout.layers);
        if ours != theirs {
            let [ours, theirs] = [ours, theirs].map(|set| Some(set.to_string()));
            return Some(Difference { name: LAYERS.to_owned(), ours, theirs, within: None });
        }
        let differs = |name: &&&str| self.notes.get(name) != other.notes.get(name);
        let name = NAMES.iter().find(differs)?;
        let within = Some(format!("the names of {name}, which its mattes refer to"));
        Some(Difference { name: "scene".to_owned(), ours: None, theirs: None, within })
    }

    /// The names in the film's Cryptomatte layers; `None` if they are malformed.
    pub fn mattes(&self) -> Option<Mattes> {
        let [entities, materials] = NAMES.map(|name| self.notes.get(name));
        Mattes::of_lists(entities, materials)
    }

    /// The requested range of samples when the film was written.
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
