//! The constant environment: radiance along rays that leave the scene. One that is a picture is a light: see
//! [`DistantPicture`](super::DistantPicture).

/// The same radiance from all directions, behind all lights.
///
/// It is not in the table of lights, and never sampled: for a matte surface under constant radiance, sampling the BxDF
/// alone is already optimal, and shadow rays would gain nothing. So its density is zero, and its radiance counts in
/// full where rays leave the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Environment {
    /// Radiance in W·m⁻²·sr⁻¹.
    pub radiance: [f32; 3],
}
