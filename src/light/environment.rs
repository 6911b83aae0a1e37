//! What rays see that leave the scene.

/// The same radiance from everywhere outside, behind all lights.
///
/// It is no light of the table, and never sampled: under an even sky the BxDF's own density is already the best for a
/// matte surface, and shadow rays would buy nothing. The density with which a direction to it is drawn is therefore
/// zero, and what rays see of it counts in full.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Environment {
    /// Radiance in W·m⁻²·sr⁻¹.
    pub radiance: [f32; 3],
}
