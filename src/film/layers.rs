//! Layers (AOVs): the contents of a picture file beside colour, each of some channels.

use super::cryptomatte::{self, Mattes, Names};

/// A layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The fraction of light that the first surface reflects or transmits, per channel.
    Albedo,
    /// The outward normal of the first surface, in world space.
    Normal,
    /// The position of the first hit, in world space.
    Position,
    /// The distance of the first hit from the eye along the direction of view; [`NO_DEPTH`] for a miss.
    Depth,
    /// The texture coordinates of the first hit.
    Uv,
    /// The estimated variance of the pixel's mean radiance, summed over red, green and blue.
    Variance,
    /// The number of samples in the pixel.
    Samples,
    /// The visible entities and their coverage: see [`super::cryptomatte`].
    CryptoEntity,
    /// The visible materials and their coverage.
    CryptoMaterial,
}

/// The depth of a miss: larger than any other, and finite, as compositors require.
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

    /// Its name in options and files. The names of its channels begin with it, except for Cryptomatte layers.
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

    /// The last parts of the names of its channels.
    pub fn components(self) -> &'static [&'static str] {
        match self {
            Layer::Albedo => &["R", "G", "B"],
            Layer::Normal | Layer::Position => &["X", "Y", "Z"],
            Layer::Depth => &["Z"],
            Layer::Uv => &["U", "V"],
            Layer::Variance | Layer::Samples => &["Y"],
            // Two ranks of one id and one coverage each.
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

    /// The names that a Cryptomatte layer refers to; `None` for other layers.
    pub fn names(self, mattes: &Mattes) -> Option<&Names> {
        match self {
            Layer::CryptoEntity => Some(&mattes.entities),
            Layer::CryptoMaterial => Some(&mattes.materials),
            _ => None,
        }
    }

    /// Whether it is made of the sums of radiance, which every film has. Other layers are made of first hits, whose
    /// sums a film has only if it was begun with them.
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
