//! The samples that a film rejects, and the reasons.

use serde::{Deserialize, Serialize};
/// The largest radiance that a film accepts, 2³⁰.
pub const MAX_RADIANCE: f32 = 1_073_741_824.0;

/// The reason why a sample or a contribution is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
pub enum Reject {
    /// A channel is NaN.
    #[error("its radiance is not a number")]
    NotANumber,
    /// A channel is infinite or above [`MAX_RADIANCE`].
    #[error("its radiance is infinite or above 2³⁰")]
    TooBright,
    /// A channel is below zero.
    #[error("its radiance is negative")]
    Negative,
    /// The position of a contribution on the film is not a number.
    #[error("its position on the film is not a number")]
    Nowhere,
}

/// Whether a film accepts a radiance, and if not, the reason.
#[inline]
pub fn check(radiance: [f32; 3]) -> Result<(), Reject> {
    if radiance.iter().all(|&c| (0.0..=MAX_RADIANCE).contains(&c)) {
        Ok(())
    } else if radiance.iter().any(|c| c.is_nan()) {
        Err(Reject::NotANumber)
    } else if radiance.iter().any(|&c| c > MAX_RADIANCE) {
        Err(Reject::TooBright)
    } else {
        Err(Reject::Negative)
    }
}

/// Numbers of rejected samples and contributions, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RejectCounts {
    /// Samples with a channel that is NaN.
    pub not_a_number: u64,
    /// Samples with a channel that is infinite or above [`MAX_RADIANCE`].
    pub too_bright: u64,
    /// Samples with a negative channel.
    pub negative: u64,
    /// Contributions whose position is not a number.
    pub nowhere: u64,
}

impl RejectCounts {
    /// Counts rejected samples.
    pub fn add(&mut self, reason: Reject, samples: u64) {
        let count = match reason {
            Reject::NotANumber => &mut self.not_a_number,
            Reject::TooBright => &mut self.too_bright,
            Reject::Negative => &mut self.negative,
            Reject::Nowhere => &mut self.nowhere,
        };
        *count += samples;
    }

    /// Adds other counts.
    pub fn merge(&mut self, other: &RejectCounts) {
        self.not_a_number += other.not_a_number;
        self.too_bright += other.too_bright;
        self.negative += other.negative;
        self.nowhere += other.nowhere;
    }
}
