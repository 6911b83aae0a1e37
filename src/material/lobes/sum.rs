//! Two lobes on one surface.

use crate::material::bxdf::{Bxdf, BxdfSample, TransportMode};
use crate::math::lanes::Value;
use crate::math::{BELOW_ONE, Float, Rgb, Vec3};

/// The sum of two lobes: f = f₁ + f₂. A direction is sampled from the first lobe with probability c and from the second
/// with 1 − c. Its density is c·p₁ + (1 − c)·p₂, where p₁ and p₂ are the densities of the lobes (the one-sample model
/// of Veach 1997, §9.2.4).
///
/// At least one lobe is not a delta lobe, so that there are no [`Bxdf::branches`]. A sum of sums has more than two
/// lobes.
#[derive(Clone, Copy, Debug)]
pub struct Sum<F, A, B> {
    first: A,
    second: B,
    probability: F,
}

impl<F: Float, A: Bxdf<F>, B: Bxdf<F>> Sum<F, A, B> {
    const HAS_A_SMOOTH_LOBE: () =
        assert!(A::HAS_NON_DELTA || B::HAS_NON_DELTA, "one of the lobes must not be a delta");

    /// The sum of two lobes, of which the first is sampled with this probability, in [0, 1].
    #[inline(always)]
    pub fn new(first: A, second: B, probability: F) -> Self {
        let () = Self::HAS_A_SMOOTH_LOBE;
        Sum { first, second, probability }
    }
}

impl<F: Float, A: Bxdf<F>, B: Bxdf<F>> Bxdf<F> for Sum<F, A, B> {
    const HAS_DELTA: bool = A::HAS_DELTA || B::HAS_DELTA;
    const TRANSMITS: bool = A::TRANSMITS || B::TRANSMITS;

    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, mode: TransportMode) -> Rgb<F> {
        self.first.eval(wo, wi, mode) + self.second.eval(wo, wi, mode)
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F, mode: TransportMode) -> BxdfSample<F> {
        let is_first = lobe.lt(self.probability);
        let rest = -self.probability + 1.0;
        // Within the interval of a lobe the number is rescaled and again uniform. Rounding must not take it to one.
        let of_first = (lobe / self.probability).min(F::splat(BELOW_ONE));
        let of_second = ((lobe - self.probability) / rest).min(F::splat(BELOW_ONE));
        let first = self.first.sample(wo, u, of_first, mode);
        let second = self.second.sample(wo, u, of_second, mode);
        let sample = BxdfSample::blend(is_first, first, second);
        // The other lobe does not scatter into the direction of a delta lobe; in other directions both may.
        let chosen = F::select(is_first, self.probability, rest);
        let pdf = self.pdf(wo, sample.wi);
        let f = match mode {
            TransportMode::Radiance => self.eval(wo, sample.wi, mode),
            TransportMode::Importance => self.eval(sample.wi, wo, mode),
        };
        // At grazing directions a density may be zero, where f·|cos θ| is zero too. NaN is kept, so that it is counted.
        let both = (f * (sample.wi.z.abs() / pdf)).only(!pdf.le(F::zero()));
        BxdfSample {
            weight: Rgb::select(sample.delta, sample.weight * (F::splat(1.0) / chosen), both),
            pdf: F::select(sample.delta, sample.pdf * chosen, pdf),
            ..sample
        }
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        self.first.pdf(wo, wi) * self.probability + self.second.pdf(wo, wi) * (-self.probability + 1.0)
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.first.albedo() + self.second.albedo()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::lobes::{Lambertian, SpecularReflection, same_side};
    use crate::sampling::{Stream, warp};
    use rand::RngExt;
    use std::f32::consts::{FRAC_1_PI, PI};

    const MODE: TransportMode = TransportMode::Radiance;
    const DRAWS: u32 = 200_000;
    /// The mean of this many samples differs from its expectation by more than this, in standard errors, with
    /// probability 10⁻⁶.
    const SIGMAS: f64 = 4.9;

    /// Uniform over the hemisphere: f = 0.2/π.
    #[derive(Clone, Copy)]
    struct Even;

    impl Bxdf<f32> for Even {
        fn eval(&self, wo: Vec3<f32>, wi: Vec3<f32>, _mode: TransportMode) -> Rgb<f32> {
            Rgb::splat([0.2 * FRAC_1_PI; 3]).only(same_side(wo, wi))
        }
        fn sample(&self, wo: Vec3<f32>, u: [f32; 2], _lobe: f32, mode: TransportMode) -> BxdfSample<f32> {
            let mut wi = warp::uniform_sphere(u);
            wi.z = wi.z.copysign(wo.z);
            let pdf = self.pdf(wo, wi);
            let weight = self.eval(wo, wi, mode) * (wi.z.abs() / pdf);
            BxdfSample { wi, weight, pdf, delta: false, eta: 1.0 }
        }
        fn pdf(&self, wo: Vec3<f32>, wi: Vec3<f32>) -> f32 {
            (0.5 * FRAC_1_PI).only(same_side(wo, wi))
        }
        fn albedo(&self) -> Rgb<f32> {
            Rgb::splat([0.2; 3])
        }
    }

    fn matte() -> Lambertian<f32> {
        Lambertian { reflectance: Rgb::splat([0.5, 0.3, 0.1]) }
    }

    fn mirror() -> SpecularReflection<f32> {
        SpecularReflection { reflectance: Rgb::splat([0.3; 3]) }
    }

    fn wo() -> Vec3<f32> {
        Vec3::new(0.48, -0.36, -0.8)
    }

    /// The difference between the mean of a function of three uniform numbers and its expectation, in standard errors.
    fn off(expected: f64, seed: u32, draw: impl Fn([f32; 3]) -> f32) -> f64 {
        let mut stream = Stream::new(seed, 0, 0);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..DRAWS {
            let x = f64::from(draw([stream.random(), stream.random(), stream.random()]));
            sum += x;
            squares += x * x;
        }
        let n = f64::from(DRAWS);
        let mean = sum / n;
        (mean - expected) / ((squares / n - mean * mean) / n).sqrt()
    }

    #[test]
    fn a_sum_scatters_the_light_of_both_lobes() {
        let sum = Sum::new(matte(), Even, 0.3);
        for wi in [Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.6, 0.0, 0.8)] {
            let expected = matte().eval(wo(), wi, MODE) + Even.eval(wo(), wi, MODE);
            assert_eq!(sum.eval(wo(), wi, MODE), expected);
        }
        assert_eq!(sum.albedo(), matte().albedo() + Even.albedo());
    }

    #[test]
    fn the_density_of_a_sum_integrates_to_one() {
        let over_the_sphere = |probability: f32, scale: f32| {
            let sum = Sum::new(matte(), Even, probability);
            off(1.0, 1, |[u, v, _]| sum.pdf(wo(), warp::uniform_sphere([u, v])) * (4.0 * PI * scale))
        };
        for probability in [0.0, 0.3, 0.9, 1.0] {
            let z = over_the_sphere(probability, 1.0);
            assert!(z.abs() < SIGMAS, "with a probability of {probability}, {z} σ");
            // Negative control: densities 2% too high.
            assert!(over_the_sphere(probability, 1.02).abs() > SIGMAS);
        }
    }

    #[test]
    fn directions_of_a_sum_follow_its_density() {
        // The mean cosine is 2/3 for the matte lobe and 1/2 for the uniform one.
        let mean = |probability: f64| probability * 2.0 / 3.0 + (1.0 - probability) / 2.0;
        for (seed, probability) in [(2, 0.3), (3, 0.9)] {
            let sum = Sum::new(matte(), Even, probability as f32);
            let z = |expected| {
                off(expected, seed, |[u, v, lobe]| sum.sample(wo(), [u, v], lobe, MODE).wi.z.abs())
            };
            assert!(z(mean(probability)).abs() < SIGMAS, "{} σ", z(mean(probability)));
            // Negative control: a probability that is too low by 5%.
            assert!(z(mean(probability - 0.05)).abs() > SIGMAS);
        }
    }

    #[test]
    fn samples_carry_the_mixed_density_and_the_weight_of_both_lobes() {
        let sum = Sum::new(matte(), Even, 0.3);
        let mut stream = Stream::new(4, 0, 0);
        let mut apart = 0;
        for _ in 0..10_000 {
            let sample = sum.sample(wo(), [stream.random(), stream.random()], stream.random(), MODE);
            let cos = sample.wi.z.abs();
            let pdf = (0.3 * cos + 0.7 * 0.5) * FRAC_1_PI;
            assert!((sample.pdf - pdf).abs() < 1e-5 && !sample.delta, "{sample:?}, not {pdf}");
            let expected = (0.5 + 0.2) * FRAC_1_PI * cos / pdf;
            assert!((sample.weight.r - expected).abs() < 1e-5, "{sample:?}, not {expected}");
            apart += u32::from((sample.weight.r - matte().reflectance.r).abs() > 1e-3);
        }
        // Negative control: the weight of a single lobe differs.
        assert!(apart > 9000, "{apart} weights");
        // At grazing directions nothing is scattered.
        let along = Sum::new(matte(), matte(), 0.3).sample(wo(), [1.0, 0.0], 0.0, MODE);
        assert_eq!((along.pdf, along.weight), (0.0, Rgb::black()));
    }

    #[test]
    fn a_delta_lobe_keeps_its_probability_and_energy() {
        let sum = Sum::new(mirror(), matte(), 0.25);
        let wi = Vec3::new(-0.48, 0.36, -0.8);
        let (mut deltas, n) = (0, 1000);
        for i in 0..n {
            let sample = sum.sample(wo(), [0.3, 0.6], (i as f32 + 0.5) / n as f32, MODE);
            deltas += u32::from(sample.delta);
            if sample.delta {
                assert_eq!((sample.wi, sample.pdf), (wi, 0.25));
                assert!((sample.weight.r - 0.3 / 0.25).abs() < 1e-6);
            } else {
                assert!((sample.weight.r - 0.5 / 0.75).abs() < 1e-6);
                assert!((sample.pdf - 0.75 * matte().pdf(wo(), sample.wi)).abs() < 1e-6);
            }
        }
        assert_eq!(deltas, 250);
        // The mirror is not part of any density.
        assert_eq!(sum.eval(wo(), wi, MODE), matte().eval(wo(), wi, MODE));
    }

    /// An asymmetric lobe: f(wo, wi) is proportional to 1.5 plus the first coordinate of the direction that light comes
    /// from.
    #[derive(Clone, Copy)]
    struct Asymmetric;

    impl Bxdf<f32> for Asymmetric {
        fn eval(&self, wo: Vec3<f32>, wi: Vec3<f32>, _mode: TransportMode) -> Rgb<f32> {
            Rgb::splat([0.1 * (1.5 + wi.x); 3]).only(same_side(wo, wi))
        }
        fn sample(&self, wo: Vec3<f32>, u: [f32; 2], lobe: f32, mode: TransportMode) -> BxdfSample<f32> {
            Even.sample(wo, u, lobe, mode)
        }
        fn pdf(&self, wo: Vec3<f32>, wi: Vec3<f32>) -> f32 {
            Even.pdf(wo, wi)
        }
        fn albedo(&self) -> Rgb<f32> {
            Rgb::splat([0.2; 3])
        }
    }

    #[test]
    fn a_path_from_a_light_swaps_directions() {
        let sum = Sum::new(Asymmetric, Asymmetric, 0.5);
        for mode in [TransportMode::Radiance, TransportMode::Importance] {
            let sample = sum.sample(wo(), [0.3, 0.6], 0.2, mode);
            let from = if mode == TransportMode::Radiance { sample.wi } else { wo() };
            let expected = 0.2 * (1.5 + from.x) * sample.wi.z.abs() / sample.pdf;
            assert!(
                (sample.weight.r - expected).abs() < 1e-5,
                "{mode:?}: {} is not {expected}",
                sample.weight.r
            );
        }
    }

    /// A lobe with a density of NaN.
    struct Broken;

    impl Bxdf<f32> for Broken {
        fn eval(&self, wo: Vec3<f32>, wi: Vec3<f32>, mode: TransportMode) -> Rgb<f32> {
            Even.eval(wo, wi, mode)
        }
        fn sample(&self, wo: Vec3<f32>, u: [f32; 2], lobe: f32, mode: TransportMode) -> BxdfSample<f32> {
            Even.sample(wo, u, lobe, mode)
        }
        fn pdf(&self, _wo: Vec3<f32>, _wi: Vec3<f32>) -> f32 {
            f32::NAN
        }
        fn albedo(&self) -> Rgb<f32> {
            Rgb::black()
        }
    }

    #[test]
    fn a_density_of_nan_is_kept() {
        assert!(Sum::new(Broken, Broken, 0.5).sample(wo(), [0.3, 0.6], 0.2, MODE).weight.r.is_nan());
    }

    /// Returns its number for the lobe as the x coordinate of a direction.
    struct Number;

    impl Bxdf<f32> for Number {
        fn eval(&self, _wo: Vec3<f32>, _wi: Vec3<f32>, _mode: TransportMode) -> Rgb<f32> {
            Rgb::black()
        }
        fn sample(&self, _wo: Vec3<f32>, _u: [f32; 2], lobe: f32, _mode: TransportMode) -> BxdfSample<f32> {
            let wi = Vec3::new(lobe, 0.0, 1.0);
            BxdfSample { wi, weight: Rgb::black(), pdf: 1.0, delta: true, eta: 1.0 }
        }
        fn pdf(&self, _wo: Vec3<f32>, _wi: Vec3<f32>) -> f32 {
            0.0
        }
        fn albedo(&self) -> Rgb<f32> {
            Rgb::black()
        }
    }

    #[test]
    fn the_rescaled_number_chooses_within_a_lobe() {
        for probability in (0..=1000).map(|i| i as f32 / 1000.0) {
            let number = |lobe| Sum::new(Number, Number, probability).sample(wo(), [0.5; 2], lobe, MODE).wi.x;
            for lobe in [0.0, 0.25, 0.5, 0.75, BELOW_ONE] {
                let expected = if lobe < probability {
                    lobe / probability
                } else {
                    (lobe - probability) / (1.0 - probability)
                };
                assert!((number(lobe) - expected).abs() < 1e-6 && (0.0..1.0).contains(&number(lobe)));
            }
        }
        // A fifth, a fifth and three fifths of the samples.
        let three = Sum::new(mirror(), Sum::new(mirror(), Even, 0.25), 0.2);
        let samples = (0..1000).map(|i| three.sample(wo(), [0.3, 0.6], (i as f32 + 0.5) / 1000.0, MODE));
        let deltas: Vec<_> = samples.filter(|sample| sample.delta).collect();
        assert_eq!(deltas.len(), 400);
        assert!(deltas.iter().all(|sample| (sample.pdf - 0.2).abs() < 1e-6));
    }
}
