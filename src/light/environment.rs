//! The constant environment: radiance along rays that leave the scene. A picture of the environment is a light: see
//! [`EnvironmentMap`](super::EnvironmentMap).

/// The same radiance from all directions, behind all lights.
///
/// It is not in the table of lights, and never sampled. For a matte surface under constant radiance, sampling the BxDF
/// alone is already optimal, and shadow rays would gain nothing. Its density is therefore zero, and its radiance counts
/// in full for rays that leave the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Environment {
    /// Radiance in W·m⁻²·sr⁻¹.
    pub radiance: [f32; 3],
}
