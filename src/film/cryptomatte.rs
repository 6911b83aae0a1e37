//! Mattes by name: which things a pixel shows, and how much of each.
//!
//! Psyop's Cryptomatte 1.2.0 (Friedman & Jones 2015). A name's id is its MurmurHash3, as the bits of a float that every
//! program keeps; a pixel has its ids in ranks, the one that covers most first, each with its coverage; two ranks are
//! a layer of four channels; a manifest in the file's header tells which name has which id.
//!
//! Coverage is a count of samples over all of them: the same in whatever order the samples come.

use crate::scene::Scene;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Ids that a pixel keeps, those that cover most: what people are used to.
pub const RANKS: usize = 6;

/// Channels of all ranks: an id and a coverage each.
pub const CHANNELS: usize = 2 * RANKS;

/// What the channels of a layer's ranks begin with, two ranks at a time: "CryptoEntity00".
pub fn levels(layer: &str) -> Vec<String> {
    (0..RANKS / 2).map(|level| format!("{layer}{level:02}")).collect()
}

/// MurmurHash3_x86_32 with the seed 0 (Appleby 2011).
pub fn hash(name: &str) -> u32 {
    let scramble = |block: u32| block.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let (blocks, rest) = name.as_bytes().as_chunks::<4>();
    let mut hash = blocks.iter().fold(0_u32, |hash, block| {
        let mixed = hash ^ scramble(u32::from_le_bytes(*block));
        mixed.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64)
    });
    let tail = rest.iter().rev().fold(0_u32, |tail, &byte| tail << 8 | u32::from(byte));
    hash ^= scramble(tail) ^ name.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// A name's id: the hash, which is kept from being zero, subnormal, infinite or no number as a float.
pub fn id(name: &str) -> u32 {
    let hash = hash(name);
    match hash >> 23 & 0xff {
        0 | 0xff => hash ^ 1 << 23,
        _ => hash,
    }
}

/// The names that a layer of mattes is about, in the order in which hits number them.
#[derive(Clone, Debug, PartialEq)]
pub struct Names {
    /// What the layer's channels begin with.
    pub layer: &'static str,
    names: Vec<String>,
    ids: Vec<u32>,
}

impl Names {
    /// Those of things, in the order of their numbers.
    pub fn new(layer: &'static str, names: Vec<String>) -> Names {
        let ids = names.iter().map(|name| id(name)).collect();
        Names { layer, names, ids }
    }

    /// How many things there are, of which several may have one name.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The names in the order of the things' numbers, as JSON in ASCII on one line, for a film file.
    pub fn list(&self) -> String {
        let names = self.names.iter().map(|name| quoted(name));
        format!("[{}]", names.collect::<Vec<_>>().join(","))
    }

    /// From such a list; none if it is no such list.
    pub fn of_list(layer: &'static str, list: &str) -> Option<Names> {
        Some(Names::new(layer, serde_json::from_str(list).ok()?))
    }

    /// Which id each name has, as JSON in ASCII, in the order of the names.
    pub fn manifest(&self) -> String {
        let sorted: BTreeMap<&String, u32> = self.names.iter().zip(self.ids.iter().copied()).collect();
        let entries = sorted.into_iter().map(|(name, id)| format!("{}:\"{id:08x}\"", quoted(name)));
        format!("{{{}}}", entries.collect::<Vec<_>>().join(","))
    }

    /// The ranks of a pixel whose first hits were traced for so many samples, some of which met the things with these
    /// numbers: id and coverage in turns, as the channels have them. What has no name is left out.
    pub fn ranks(&self, met: impl Iterator<Item = u32>, samples: usize) -> [f32; CHANNELS] {
        let mut counts: Vec<(u32, u32)> = Vec::new();
        for number in met {
            // Things of one name are one thing.
            let Some(&id) = self.ids.get(number as usize) else { continue };
            match counts.iter_mut().find(|(known, _)| *known == id) {
                Some((_, count)) => *count += 1,
                None => counts.push((id, 1)),
            }
        }
        counts.sort_unstable_by_key(|&(id, count)| (std::cmp::Reverse(count), id));
        let mut ranks = [0.0; CHANNELS];
        for (rank, (id, count)) in ranks.chunks_exact_mut(2).zip(counts) {
            rank.copy_from_slice(&[f32::from_bits(id), count as f32 / samples as f32]);
        }
        ranks
    }
}

/// What the channels of the layer of entities begin with.
pub const ENTITIES: &str = "CryptoEntity";
/// What the channels of the layer of materials begin with.
pub const MATERIALS: &str = "CryptoMaterial";

/// The names of a scene's things.
#[derive(Clone, Debug, PartialEq)]
pub struct Mattes {
    /// Of its entities.
    pub entities: Names,
    /// Of the materials that entities have; a checkerboard is one, whatever its checks are of.
    pub materials: Names,
}

impl Mattes {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Mattes {
        let entities = scene.entities.iter().map(|entity| entity.name.clone()).collect();
        let materials = scene.materials.iter().map(|material| material.name.clone()).collect();
        Mattes { entities: Names::new(ENTITIES, entities), materials: Names::new(MATERIALS, materials) }
    }

    /// Of no things.
    pub fn none() -> Mattes {
        Mattes { entities: Names::new(ENTITIES, Vec::new()), materials: Names::new(MATERIALS, Vec::new()) }
    }

    /// From the lists of a film file, each of which may be missing; none if one is no list.
    pub fn of_lists(entities: Option<&str>, materials: Option<&str>) -> Option<Mattes> {
        let names = |layer, list: Option<&str>| Names::of_list(layer, list.unwrap_or("[]"));
        Some(Mattes { entities: names(ENTITIES, entities)?, materials: names(MATERIALS, materials)? })
    }
}

/// A JSON string in ASCII.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            ' '..='~' => quoted.push(c),
            _ => {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    // Writing to a string can't fail.
                    let _ = write!(quoted, "\\u{unit:04x}");
                }
            }
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_the_reference_implementation() {
        // From its author's C++, and from the specification's own example ("hello").
        for (name, expected) in [
            ("", 0),
            ("a", 0x3c25_69b2),
            ("hello", 0x248b_fa47),
            ("hello, world", 0x149b_bb7f),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(hash(name), expected, "{name}");
        }
        assert_ne!(hash("hallo"), hash("hello"));
    }

    #[test]
    fn ids_are_floats_that_stay_what_they_are() {
        assert_eq!(id("hello"), 0x248b_fa47);
        assert_eq!(id(""), 1 << 23, "zero's exponent is flipped");
        let names: Vec<String> = (0..20_000).map(|i| format!("entity {i}")).collect();
        let flipped = names.iter().filter(|name| id(name) != hash(name)).count();
        assert!(flipped > 50, "two exponents of 256 are not taken");
        assert!(names.iter().all(|name| f32::from_bits(id(name)).is_normal()));
    }

    fn names(list: &[&str]) -> Names {
        Names::new("CryptoEntity", list.iter().map(|&name| name.to_owned()).collect())
    }

    #[test]
    fn ranks_are_ordered_by_coverage_and_not_by_arrival() {
        let names = names(&["a", "b", "c", "b"]);
        let float = |name| f32::from_bits(id(name));
        // Numbers 1 and 3 are of one name.
        let ranks = names.ranks([0, 1, 2, 3, 0, 3].into_iter(), 8);
        assert_eq!(ranks[..6], [float("b"), 0.375, float("a"), 0.25, float("c"), 0.125]);
        assert_eq!(ranks[6..], [0.0; 6]);
        assert_eq!(names.ranks([3, 0, 0, 2, 1, 1].into_iter(), 8), ranks);
        assert_ne!(names.ranks([3, 0, 2, 2, 1, 1].into_iter(), 8), ranks);
        assert_eq!(names.ranks(std::iter::empty(), 8), [0.0; CHANNELS]);
    }

    #[test]
    fn those_that_cover_least_are_left_out() {
        let list = ["a", "b", "c", "d", "e", "f", "g", "h"];
        let names = names(&list);
        // Thing i is met i + 1 times.
        let met: Vec<u32> = (0..8).flat_map(|i| std::iter::repeat_n(i, i as usize + 1)).collect();
        let ranks = names.ranks(met.iter().rev().copied(), met.len());
        let seen: Vec<u32> = ranks.chunks(2).map(|rank| rank[0].to_bits()).collect();
        assert_eq!(seen, ["h", "g", "f", "e", "d", "c"].map(id));
    }

    #[test]
    fn lists_of_names_are_read_back_in_their_order() {
        let names = names(&["b", "a \"q\"\\", "Größe 東\n𝄞", "b"]);
        let list = names.list();
        assert!(list.is_ascii() && list.lines().count() == 1, "{list}");
        assert_eq!(Names::of_list("CryptoEntity", &list), Some(names));
        assert_eq!(Names::of_list("CryptoEntity", "[\"a\",7]"), None);
        let mattes = Mattes::of_lists(Some("[\"a\"]"), None).unwrap();
        assert_eq!((mattes.entities.len(), mattes.materials.is_empty()), (1, true));
    }

    #[test]
    fn a_manifest_is_json_in_ascii() {
        let list = ["b", "a \"q\"\\", "Größe 東\n𝄞", "b"];
        let manifest = names(&list).manifest();
        assert!(manifest.is_ascii());
        let read: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&manifest).unwrap();
        assert_eq!(read.len(), 3);
        for name in list {
            assert_eq!(read[name], format!("{:08x}", id(name)));
        }
    }
}
