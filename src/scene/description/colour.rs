//! Colours of a scene.

/// A linear Rec. 709 colour or radiance.
pub type Colour = [f64; 3];
