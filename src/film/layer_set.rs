//! The set of first-hit layers of a film, and the words that a pixel takes for each.

use super::layers::Layer;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The number of samples of a pixel that contribute to layers: those with a lower index. This many are well distributed
/// by every low-discrepancy sampler, and make edges smooth.
pub const LAYER_SAMPLES: u32 = 32;

/// All layers made of first hits, in the order of their words.
const ALL: [Layer; 7] = [
    Layer::Albedo,
    Layer::Normal,
    Layer::Position,
    Layer::Depth,
    Layer::Uv,
    Layer::CryptoEntity,
    Layer::CryptoMaterial,
];

/// The number of layers with one bit in the code, from the lowest bit on; each matte has two bits after these.
const PLAIN: usize = 5;

/// A set of layers that are made of first hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct LayerSet {
    /// The code in a film file: see [`LayerSet::code`]. The other fields follow from it.
    code: u32,
    /// Words per pixel for each of [`ALL`].
    words: [u8; ALL.len()],
    words_of_pixel: u8,
}

impl LayerSet {
    /// The empty set.
    pub const NONE: LayerSet = LayerSet { code: 0, words: [0; ALL.len()], words_of_pixel: 0 };

    /// Bits of a [`LayerSet::code`].
    pub const BITS: u32 = 9;

    /// The maximum number of words per pixel.
    pub(super) const MOST_WORDS: usize = 1 + 6 + 12 + 2 * 4 * LAYER_SAMPLES as usize / size_of::<u64>();

    /// The set of those of `layers` that are made of first hits, for a scene with these numbers of entities and
    /// materials.
    pub fn new(layers: &[Layer], entities: usize, materials: usize) -> LayerSet {
        let of_things = |things: usize| match things {
            0..=0x100 => 1,
            0x101..=0x1_0000 => 2,
            _ => 3,
        };
        let code = |(index, layer): (usize, &Layer)| {
            let field = match layer {
                _ if !layers.contains(layer) => 0,
                Layer::CryptoEntity => of_things(entities),
                Layer::CryptoMaterial => of_things(materials),
                _ => 1,
            };
            field << shift(index)
        };
        LayerSet::of(ALL.iter().enumerate().map(code).sum())
    }

    /// Decodes a [`LayerSet::code`]; `None` if it is invalid.
    pub fn from_code(code: u32) -> Option<LayerSet> {
        (code < 1 << LayerSet::BITS).then(|| LayerSet::of(code))
    }

    fn of(code: u32) -> LayerSet {
        let words = std::array::from_fn(|index| {
            let components = ALL[index].components().len();
            let words = match index {
                // One word per component of at most one, two per component of any magnitude.
                0 | 1 => components,
                2..PLAIN => 2 * components,
                // One number per sample.
                _ => number_bytes(code, index) * LAYER_SAMPLES as usize / size_of::<u64>(),
            };
            if field(code, index) > 0 { words as u8 } else { 0 }
        });
        // One more word for the samples whose first hit was traced.
        let words_of_pixel = words.iter().sum::<u8>() + u8::from(code > 0);
        LayerSet { code, words, words_of_pixel }
    }

    /// The code of the set: a bit each for albedo, normal, position, depth and uv, from the lowest on, then two bits
    /// each for the mattes of entities and of materials. These are 0 without the matte, and 1, 2 or 3 if the number of
    /// an entity or a material takes 1, 2 or 4 bytes.
    pub fn code(self) -> u32 {
        self.code
    }

    /// Whether the set is empty.
    pub fn is_empty(self) -> bool {
        self.code == 0
    }

    /// Whether a layer is in the set.
    pub fn contains(self, layer: Layer) -> bool {
        self.words(layer) > 0
    }

    /// The layers, in the order of their words.
    pub fn layers(self) -> impl Iterator<Item = Layer> {
        ALL.into_iter().filter(move |&layer| self.contains(layer))
    }

    /// The union of two sets.
    pub fn with(self, other: LayerSet) -> LayerSet {
        self.joined(other, u32::max)
    }

    /// The layers that another set lacks.
    pub fn without(self, other: LayerSet) -> LayerSet {
        self.joined(other, |ours, theirs| if theirs > 0 { 0 } else { ours })
    }

    fn joined(self, other: LayerSet, join: impl Fn(u32, u32) -> u32) -> LayerSet {
        let joined = |index| join(field(self.code, index), field(other.code, index)) << shift(index);
        LayerSet::of((0..ALL.len()).map(joined).sum())
    }

    /// Bytes of an entity's or material's number in a Cryptomatte layer; zero without the layer.
    pub(super) fn number_bytes(self, layer: Layer) -> usize {
        self.words(layer) * size_of::<u64>() / LAYER_SAMPLES as usize
    }

    /// Words of 64 bits that a pixel takes for a layer.
    #[inline(always)]
    pub(super) fn words(self, layer: Layer) -> usize {
        let index = match layer {
            Layer::Albedo => 0,
            Layer::Normal => 1,
            Layer::Position => 2,
            Layer::Depth => 3,
            Layer::Uv => 4,
            Layer::CryptoEntity => 5,
            Layer::CryptoMaterial => 6,
            Layer::Variance | Layer::Samples => return 0,
        };
        usize::from(self.words[index])
    }

    /// Words that a pixel takes for all layers.
    #[inline(always)]
    pub(super) fn words_of_pixel(self) -> usize {
        usize::from(self.words_of_pixel)
    }

    /// Bytes that a pixel takes for all layers.
    pub fn pixel_bytes(self) -> u64 {
        (self.words_of_pixel() * size_of::<u64>()) as u64
    }
}

/// The lowest bit of a layer in a code.
fn shift(index: usize) -> usize {
    index + index.saturating_sub(PLAIN)
}

/// The bits of a layer in a code.
fn field(code: u32, index: usize) -> u32 {
    code >> shift(index) & if index < PLAIN { 1 } else { 3 }
}

/// Bytes of an entity's or material's number in a Cryptomatte layer.
fn number_bytes(code: u32, index: usize) -> usize {
    [0, 1, 2, 4][field(code, index) as usize]
}

impl From<LayerSet> for u32 {
    fn from(set: LayerSet) -> u32 {
        set.code
    }
}

impl TryFrom<u32> for LayerSet {
    type Error = &'static str;

    fn try_from(code: u32) -> Result<LayerSet, &'static str> {
        LayerSet::from_code(code).ok_or("no set of layers has this code")
    }
}

/// "albedo,depth" in the notation of `--layers`, or "none".
impl fmt::Display for LayerSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("none");
        }
        let names: Vec<&str> = self.layers().map(Layer::name).collect();
        f.write_str(&names.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_decoded_and_mattes_are_as_wide_as_needed() {
        let of = |layers: &[Layer], things| LayerSet::new(layers, things, 1);
        assert_eq!(of(&[], 9), LayerSet::NONE);
        let plain = of(&[Layer::Depth, Layer::Albedo, Layer::Variance], 9);
        assert_eq!((plain.code(), plain.pixel_bytes()), (0b01001, 8 * (1 + 3 + 2)));
        assert_eq!(plain.to_string(), "albedo,depth");
        for (things, code, words) in
            [(0, 1, 4), (256, 1, 4), (257, 2, 8), (65_536, 2, 8), (65_537, 3, 16), (1 << 31, 3, 16)]
        {
            let set = of(&[Layer::CryptoEntity], things);
            assert_eq!((set.code(), set.words_of_pixel()), (code << 5, 1 + words), "{things} things");
        }
        let all = of(&Layer::ALL, 300);
        assert_eq!((all.code(), all.words_of_pixel()), (0b0_1101_1111, 1 + 6 + 12 + 8 + 4));
        assert_eq!(all.to_string(), "albedo,normal,position,depth,uv,crypto-entity,crypto-material");
        assert_eq!(LayerSet::from_code(all.code()), Some(all));
        assert_eq!(LayerSet::from_code(1 << LayerSet::BITS), None);
        let full = LayerSet::from_code((1 << LayerSet::BITS) - 1).unwrap();
        assert_eq!(full.words_of_pixel(), LayerSet::MOST_WORDS);
    }

    #[test]
    fn sets_have_unions_and_differences() {
        let depth = LayerSet::new(&[Layer::Depth, Layer::CryptoEntity], 5, 5);
        let uv = LayerSet::new(&[Layer::Uv, Layer::CryptoEntity], 500, 5);
        let both = LayerSet::new(&[Layer::Depth, Layer::Uv, Layer::CryptoEntity], 500, 5);
        assert_eq!((depth.with(uv), uv.with(depth)), (both, both));
        assert_eq!(both.without(uv).to_string(), "depth");
        assert_eq!(depth.without(both), LayerSet::NONE);
    }
}
