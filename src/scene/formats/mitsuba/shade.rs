//! The value of a parameter on a surface.

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
