//! What a picture file may hold beside colour: layers, each of some channels.

use super::cryptomatte::{self, Mattes, Names};

/// A layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The fraction of light that is reflected by what is seen, or let through.
    Albedo,
    /// Its outward normal, in world space.
    Normal,
    /// Its place, in world space.
    Position,
    /// Its distance from the eye along the direction of view; [`NO_DEPTH`] where nothing is seen.
    Depth,
    /// Its own coordinates.
    Uv,
    /// The variance of the pixel's radiance, red, green and blue together, by the spread of its samples.
    Variance,
    /// Samples in the pixel.
    Samples,
    /// Which entities are seen, and how much of each: see [`super::cryptomatte`].
    CryptoEntity,
    /// Which materials, likewise.
    CryptoMaterial,
}

/// The depth of a pixel in which nothing is seen: farther than anything, and finite, as compositors want it.
pub const NO_DEPTH: f32 = 1e10;

impl Layer {
    /// All layers.
    pub const ALL: [Layer; 9] = [
        Layer::Albedo,
        Layer::Normal,
        Layer::Position,
        Layer::Depth,
        Layer::Uv,
        Layer::Variance,
        Layer::Samples,
        Layer::CryptoEntity,
        Layer::CryptoMaterial,
    ];

    /// What users call it, and what its channels begin with but for mattes.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Albedo => "albedo",
            Layer::Normal => "normal",
            Layer::Position => "position",
            Layer::Depth => "depth",
            Layer::Uv => "uv",
            Layer::Variance => "variance",
            Layer::Samples => "samples",
            Layer::CryptoEntity => "crypto-entity",
            Layer::CryptoMaterial => "crypto-material",
        }
    }

    /// What its channels end in.
    pub fn components(self) -> &'static [&'static str] {
        match self {
            Layer::Albedo => &["R", "G", "B"],
            Layer::Normal | Layer::Position => &["X", "Y", "Z"],
            Layer::Depth => &["Z"],
            Layer::Uv => &["U", "V"],
            Layer::Variance | Layer::Samples => &["Y"],
            // Two ranks of an id and a coverage each.
            Layer::CryptoEntity | Layer::CryptoMaterial => &["R", "G", "B", "A"],
        }
    }

    /// The full names of its channels: "albedo.R", "CryptoEntity00.R".
    pub fn channels(self) -> Vec<String> {
        let prefixes = match self {
            Layer::CryptoEntity => cryptomatte::levels(cryptomatte::ENTITIES),
            Layer::CryptoMaterial => cryptomatte::levels(cryptomatte::MATERIALS),
            _ => vec![self.name().to_owned()],
        };
        let names = |prefix: &String| {
            let prefix = prefix.clone();
            self.components().iter().map(move |component| format!("{prefix}.{component}"))
        };
        prefixes.iter().flat_map(names).collect()
    }

    /// The names that a layer of mattes is about; none of another.
    pub fn names(self, mattes: &Mattes) -> Option<&Names> {
        match self {
            Layer::CryptoEntity => Some(&mattes.entities),
            Layer::CryptoMaterial => Some(&mattes.materials),
            _ => None,
        }
    }

    /// Whether the sums of radiance tell it, as those of every film do; the others are told by first hits, which a film
    /// has the sums of if it was begun with them.
    pub fn is_of_radiance(&self) -> bool {
        matches!(self, Layer::Variance | Layer::Samples)
    }
}

/// One channel of a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its full name: "albedo.R".
    pub name: String,
    /// Its values, row-major from the top left.
    pub values: Vec<f32>,
}
