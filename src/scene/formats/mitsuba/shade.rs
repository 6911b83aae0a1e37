//! What a parameter is on a surface.

/// The same everywhere, or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shade {
    Colour([f64; 3]),
    Texture(usize),
}

impl Shade {
    /// Its colour; `instead` for a texture, which stands in the place of a parameter beside it.
    pub(super) fn colour_or(self, instead: [f64; 3]) -> [f64; 3] {
        match self {
            Shade::Colour(colour) => colour,
            Shade::Texture(_) => instead,
        }
    }
}
