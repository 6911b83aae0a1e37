//! Integrators: what follows light from the camera into the scene.

/// One sample: where it fell on the film and what it saw.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Sample {
    /// The pixel it was made for: its index on the full film, row-major from the top left.
    pub pixel: u32,
    /// Its index among the pixel's samples.
    pub sample: u32,
    /// Film position in pixels from the film's left edge.
    pub x: f32,
    /// Film position in pixels from the film's top edge.
    pub y: f32,
    /// Radiance in W·m⁻²·sr⁻¹, linear Rec. 709.
    pub radiance: [f32; 3],
}
