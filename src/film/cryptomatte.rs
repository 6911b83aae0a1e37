//! Cryptomatte: the entities and materials that a pixel shows, and the coverage of each.
//!
//! Psyop's Cryptomatte 1.2.0 (Friedman & Jones 2015). The id of a name is its MurmurHash3, stored as the bits of a
//! 32-bit float that all programs preserve. A pixel stores ids in ranks of decreasing coverage, each with its coverage.
//! Two ranks fill a layer of four channels, and a manifest in the file's header maps names to ids.
//!
//! Coverage is a number of samples over the number of all samples, and so does not depend on the order of samples.

use crate::scene::Scene;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Ranks that a pixel stores, those of the largest coverage: the usual number in production.
pub const RANKS: usize = 6;

/// Channels of all ranks: one id and one coverage each.
pub const CHANNELS: usize = 2 * RANKS;

/// The names of the EXR layers of a Cryptomatte layer, which hold two ranks each: "CryptoEntity00", "CryptoEntity01",
/// ….
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

/// The id of a name: its hash, changed if its bits would be a zero, subnormal, infinite or NaN float.
pub fn id(name: &str) -> u32 {
    let hash = hash(name);
    match hash >> 23 & 0xff {
        0 | 0xff => hash ^ 1 << 23,
        _ => hash,
    }
}

/// The names that a Cryptomatte layer refers to, indexed by the entity or material numbers of first hits.
#[derive(Clone, Debug, PartialEq)]
pub struct Names {
    /// The name of the layer, with which the names of its channels begin.
    pub layer: &'static str,
    names: Vec<String>,
    ids: Vec<u32>,
}

impl Names {
    /// Makes the layer from the names of entities or materials, in the order of their numbers.
    pub fn new(layer: &'static str, names: Vec<String>) -> Names {
        let ids = names.iter().map(|name| id(name)).collect();
        Names { layer, names, ids }
    }

    /// The number of entities or materials; several may share a name.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The names in the order of their numbers, as JSON in ASCII on one line, for a film file.
    pub fn list(&self) -> String {
        let names = self.names.iter().map(|name| quoted(name));
        format!("[{}]", names.collect::<Vec<_>>().join(","))
    }

    /// Parses the output of [`Names::list`]; `None` if it is malformed.
    pub fn of_list(layer: &'static str, list: &str) -> Option<Names> {
        Some(Names::new(layer, serde_json::from_str(list).ok()?))
    }

    /// The Cryptomatte manifest: the id of each name, as JSON in ASCII, sorted by name.
    pub fn manifest(&self) -> String {
        let sorted: BTreeMap<&String, u32> = self.names.iter().zip(self.ids.iter().copied()).collect();
        let entries = sorted.into_iter().map(|(name, id)| format!("{}:\"{id:08x}\"", quoted(name)));
        format!("{{{}}}", entries.collect::<Vec<_>>().join(","))
    }

    /// The ranks of a pixel for which `samples` first hits were traced, and those that met a surface met the entities
    /// or materials with the numbers `met`. Ids and coverages alternate, as in the channels. Nameless ones are left
    /// out.
    pub fn ranks(&self, met: impl Iterator<Item = u32>, samples: usize) -> [f32; CHANNELS] {
        let mut counts: Vec<(u32, u32)> = Vec::new();
        for number in met {
            // Entities or materials of one name count as one.
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

/// The name of the layer of entities, with which the names of its channels begin.
pub const ENTITIES: &str = "CryptoEntity";
/// The name of the layer of materials.
pub const MATERIALS: &str = "CryptoMaterial";

/// The names in a scene, for its Cryptomatte layers.
#[derive(Clone, Debug, PartialEq)]
pub struct Mattes {
    /// The names of its entities.
    pub entities: Names,
    /// The names of the materials of its entities; a checkerboard is one material, whatever its checks are made of.
    pub materials: Names,
}

impl Mattes {
    /// The names in a scene.
    pub fn of(scene: &Scene) -> Mattes {
        let entities = scene.entities.iter().map(|entity| entity.name.clone()).collect();
        let materials = scene.materials.iter().map(|material| material.name.clone()).collect();
        Mattes { entities: Names::new(ENTITIES, entities), materials: Names::new(MATERIALS, materials) }
    }

    /// Two empty lists.
    pub fn none() -> Mattes {
        Mattes { entities: Names::new(ENTITIES, Vec::new()), materials: Names::new(MATERIALS, Vec::new()) }
    }

    /// Parses the lists of a film file, each of which may be missing; `None` if one is malformed.
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
                    // Writing to a String cannot fail.
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
    fn hashes_match_the_reference_implementation() {
        // From the C++ code of its author, and from the example in the specification ("hello").
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
    fn ids_are_normal_floats() {
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
    fn ranks_are_ordered_by_coverage() {
        let names = names(&["a", "b", "c", "b"]);
        let float = |name| f32::from_bits(id(name));
        // Numbers 1 and 3 share a name.
        let ranks = names.ranks([0, 1, 2, 3, 0, 3].into_iter(), 8);
        assert_eq!(ranks[..6], [float("b"), 0.375, float("a"), 0.25, float("c"), 0.125]);
        assert_eq!(ranks[6..], [0.0; 6]);
        assert_eq!(names.ranks([3, 0, 0, 2, 1, 1].into_iter(), 8), ranks);
        assert_ne!(names.ranks([3, 0, 2, 2, 1, 1].into_iter(), 8), ranks);
        assert_eq!(names.ranks(std::iter::empty(), 8), [0.0; CHANNELS]);
    }

    #[test]
    fn the_least_coverages_are_left_out() {
        let list = ["a", "b", "c", "d", "e", "f", "g", "h"];
        let names = names(&list);
        // Entity i is met i + 1 times.
        let met: Vec<u32> = (0..8).flat_map(|i| std::iter::repeat_n(i, i as usize + 1)).collect();
        let ranks = names.ranks(met.iter().rev().copied(), met.len());
        let seen: Vec<u32> = ranks.chunks(2).map(|rank| rank[0].to_bits()).collect();
        assert_eq!(seen, ["h", "g", "f", "e", "d", "c"].map(id));
    }

    #[test]
    fn lists_of_names_are_read_back_in_order() {
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
