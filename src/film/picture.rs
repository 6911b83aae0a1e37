//! Pictures of radiance.

/// Scene-linear Rec. 709 radiance for every pixel of a rectangle, row-major from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, `width × height` entries; black without samples.
    pub rgb: Vec<[f32; 3]>,
}
