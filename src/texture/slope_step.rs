//! The distances over which the slopes of textures are measured.

/// The distance over which the slope of a texture is measured as a difference of two values, infinite for constants: a
/// fraction of the finest detail of the texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeStep {
    /// Along u and along v.
    pub uv: [f64; 2],
    /// Along the coordinates of the second set of uv, which are the same within a check.
    pub second_uv: [f64; 2],
    /// In the scene's unit of length, for textures that depend on the point in space.
    pub length: f64,
}

impl SlopeStep {
    /// That of a constant.
    pub const NONE: SlopeStep =
        SlopeStep { uv: [f64::INFINITY; 2], second_uv: [f64::INFINITY; 2], length: f64::INFINITY };

    /// The shorter of two.
    pub(super) fn min(self, other: SlopeStep) -> SlopeStep {
        let [uv, second_uv] = [(self.uv, other.uv), (self.second_uv, other.second_uv)]
            .map(|(a, b)| [0, 1].map(|i: usize| a[i].min(b[i])));
        SlopeStep { uv, second_uv, length: self.length.min(other.length) }
    }
}
