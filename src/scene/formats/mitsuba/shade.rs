//! The value of a parameter on a surface.

use super::spectrum::Of;

/// What a parameter takes from a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Taken {
    /// A colour.
    Colour(Of),
    /// One number.
    Number,
    /// One number, α of a microfacet distribution: its square root is the roughness.
    Alpha,
}

impl Taken {
    /// The quantity of spectra.
    pub(super) fn of(self) -> Of {
        match self {
            Taken::Colour(of) => of,
            Taken::Number | Taken::Alpha => Of::Number,
        }
    }
}

/// A colour, or the index of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shade {
    Colour([f64; 3]),
    Texture(usize),
}

impl Shade {
    /// The colour, or for a texture `instead`.
    pub(super) fn colour_or(self, instead: [f64; 3]) -> [f64; 3] {
        match self {
            Shade::Colour(colour) => colour,
            Shade::Texture(_) => instead,
        }
    }
}
