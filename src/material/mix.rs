//! Two materials mixed.

use super::kind::Kind;
use super::program::{Chooser, MaterialParameters};
use super::row::{Row, padded};
use crate::math::Float;
use crate::parameter::{Number, ParameterKind, parameters};

parameters! {
    /// Mixes two materials: light meets one or the other, at each hit by chance. One number that is spread evenly over the
    /// samples of a pixel decides, whatever is nested. Where the two look alike in radiance this adds hardly any noise; a
    /// pixel of black and white at equal shares has a variance of ¼ a sample with `independent`, and with `sobol` an error
    /// that falls as the inverse of the samples.
    pub struct MixParameters: "mix", "a mix", "mix", "mixes" {
        /// The name of the material where `amount` is 0.
        a: usize = ParameterKind::Material,
        /// The name of the material where `amount` is 1.
        b: usize = ParameterKind::Material,
        /// The share of `b`, 0 to 1, or the name of a texture, of which the red channel counts.
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

/// It chooses by no uv, but by a number.
impl Chooser for Mix {}

impl Mix {
    /// Whether the second material is chosen, where `number` is uniform in [0, 1), and a number that is uniform likewise
    /// among those that choose as this one does.
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
    fn shares_are_the_amount_and_what_is_left_of_the_number_is_uniform() {
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
