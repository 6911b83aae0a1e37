//! Colours of a scene.

/// A linear Rec. 709 colour or radiance.
pub type Colour = [f64; 3];

/// The largest radiance that a scene may state: the film holds no more.
pub const MOST_RADIANCE: f64 = (1u32 << 30) as f64;
