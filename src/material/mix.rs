//! A mix of two materials.

use super::kind::Kind;
use super::program::{Chooser, MaterialParameters};
use super::row::{Row, padded};
use crate::math::Float;
use crate::parameter::{Number, ParameterKind, parameters};

parameters! {
    /// Mixes two materials: each hit uses one or the other at random. The choice uses one number, stratified over the
    /// samples of a pixel, for all nested mixes. Between materials of similar radiance this adds little noise. A pixel
    /// of black and white in equal parts has a variance of ¼ per sample with `independent`; with `sobol` its error
    /// falls as the inverse of the number of samples.
    pub struct MixParameters: "mix", "a mix", "mix", "mixes" {
        /// The name of the material where `amount` is 0.
        a: usize = ParameterKind::Material,
        /// The name of the material where `amount` is 1.
        b: usize = ParameterKind::Material,
        /// The fraction of `b`, 0 to 1, or the name of a texture, whose red channel is used.
        amount: f64 = ParameterKind::Amount(Number::between(0.0, 1.0)) => "0.5",
    }
}

/// Chooses one of two materials by a number.
#[derive(Clone, Copy, Debug)]
pub struct Mix;

impl MaterialParameters for MixParameters {
    fn row(&self) -> Row {
        Row {
            choices: [self.a, self.b].map(|index| index as u32),
            numbers: padded([self.amount as f32]),
            ..Row::new(Kind::Mix, [0.0; 3])
        }
    }
}

/// The choice depends on a number instead of uv.
impl Chooser for Mix {}

impl Mix {
    /// Whether the second material is chosen, where `number` is uniform in [0, 1); and the rescaled number, uniform
    /// among those with the same choice.
    #[inline(always)]
    pub(super) fn pick<F: Float>(amount: F, number: F) -> (F::Mask, F) {
        let (one, least) = (F::splat(1.0), F::splat(f32::MIN_POSITIVE));
        let is_b = number.lt(amount);
        let of_b = number / amount.max(least);
        let of_a = (number - amount) / (one - amount).max(least);
        let below_one = F::splat(1.0_f32.next_down());
        (is_b, F::select(is_b, of_b, of_a).min(below_one))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_match_the_amount_and_the_rescaled_number_is_uniform() {
        for amount in [0.0_f32, 0.25, 0.5, 0.9, 1.0] {
            let n = 10_000;
            let (mut counts, mut sums) = ([0_u32; 2], [0.0_f64; 2]);
            for i in 0..n {
                let (is_b, left) = Mix::pick(amount, (i as f32 + 0.5) / n as f32);
                assert!((0.0..1.0).contains(&left), "{amount}: {left}");
                counts[usize::from(is_b)] += 1;
                sums[usize::from(is_b)] += f64::from(left);
            }
            assert!(
                (f64::from(counts[1]) - f64::from(amount) * f64::from(n)).abs() <= 1.0,
                "{amount}: {counts:?}"
            );
            for (count, sum) in counts.into_iter().zip(sums).filter(|(count, _)| *count > 0) {
                assert!((sum / f64::from(count) - 0.5).abs() < 1e-3, "{amount}: {sum} of {count}");
            }
        }
        assert!(Mix::pick(1.0_f32, 1.0_f32.next_down()).0 && !Mix::pick(0.0_f32, 0.0).0);
    }
}
