//! What a picture file may hold beside colour: layers, each of some channels.

use super::Film;

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
}

/// The depth of a pixel in which nothing is seen: farther than anything, and finite, as compositors want it.
pub const NO_DEPTH: f32 = 1e10;

impl Layer {
    /// All layers.
    pub const ALL: [Layer; 7] = [
        Layer::Albedo,
        Layer::Normal,
        Layer::Position,
        Layer::Depth,
        Layer::Uv,
        Layer::Variance,
        Layer::Samples,
    ];

    /// The name, which its channels begin with.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Albedo => "albedo",
            Layer::Normal => "normal",
            Layer::Position => "position",
            Layer::Depth => "depth",
            Layer::Uv => "uv",
            Layer::Variance => "variance",
            Layer::Samples => "samples",
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
        }
    }

    /// The full names of its channels: "albedo.R".
    pub fn channels(self) -> impl Iterator<Item = String> {
        self.components().iter().map(move |component| format!("{}.{component}", self.name()))
    }

    /// Whether the film's own words tell it; the others are told by first hits.
    pub fn is_of_film(&self) -> bool {
        matches!(self, Layer::Variance | Layer::Samples)
    }

    /// The channels of a layer that the film tells; none of another.
    pub fn channels_of_film(self, film: &Film) -> Vec<Channel> {
        let layout = film.layout();
        let pixels = layout.places();
        let values = match self {
            Layer::Variance => pixels.map(|pixel| film.variance(pixel) as f32).collect(),
            Layer::Samples => pixels.map(|pixel| film.count(pixel) as f32).collect(),
            _ => return Vec::new(),
        };
        self.channels().map(|name| Channel { name, values: Vec::clone(&values) }).collect()
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
