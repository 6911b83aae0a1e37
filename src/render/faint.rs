//! Detects radiance that is too small for a film, which stores multiples of a quantum.

use crate::film::Film;
use crate::film::MAX_RADIANCE;
use crate::film::fixed::QUANTUM;
use crate::integrator::Finished;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Radiance below this, 2⁻²⁷, loses visible precision: half a quantum is a 64th of it.
const FAINT: f32 = 32.0 * QUANTUM as f32;

/// Counts of samples or pixels that are not black, and of those that are too dark for a film.
///
/// CPU workers count the samples with index 0, before rounding: on a film a sample that was rounded to zero looks like
/// a black one. Other samples cost nothing. A GPU worker counts nothing: if it renders alone, the pixels of the film
/// are counted at the end, and beside CPU workers their share of the samples decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Faint {
    /// Samples, or pixels.
    counted: u64,
    /// Those that are not black.
    lit: u64,
    /// Those that are not black but darker than [`FAINT`] in all channels.
    faint: u64,
    /// The largest channel of the faint ones.
    brightest_faint: f32,
    /// The largest channel of all.
    brightest: f32,
    /// Whether pixels of a film were counted.
    is_of_film: bool,
}

impl Faint {
    /// Counts the samples with index 0 among these.
    pub fn count(&mut self, finished: &[Finished]) {
        finished.iter().filter(|f| f.sample.sample == 0).for_each(|f| self.add(f.sample.radiance));
    }

    /// Counts the pixels of a film.
    pub fn of_film(film: &Film) -> Faint {
        let mut all = Faint { is_of_film: true, ..Faint::default() };
        film.layout().places().for_each(|place| all.add(film.mean(place)));
        all
    }

    fn add(&mut self, radiance: [f32; 3]) {
        let largest = radiance.into_iter().fold(0.0, f32::max);
        self.counted += 1;
        self.lit += u64::from(largest > 0.0);
        if largest > 0.0 && largest < FAINT {
            self.faint += 1;
            self.brightest_faint = self.brightest_faint.max(largest);
        }
        // Infinite radiance is reported separately.
        self.brightest = if largest.is_finite() { self.brightest.max(largest) } else { self.brightest };
    }

    /// Adds other counts.
    pub fn merge(&mut self, other: &Faint) {
        self.counted += other.counted;
        self.lit += other.lit;
        self.faint += other.faint;
        self.brightest_faint = self.brightest_faint.max(other.brightest_faint);
        self.brightest = self.brightest.max(other.brightest);
    }

    /// The warning at the end of a render with this film, from the counts of first samples if there are any.
    pub fn warning(&self, film: &Film, has_light: bool) -> Option<String> {
        let of_film = Faint::of_film(film);
        let known = if self.is_known() { self } else { &of_film };
        if known.is_majority() {
            return Some(known.to_string());
        }
        // Samples that were rounded to zero look like black ones.
        let unknown = has_light && of_film.is_black() && !self.is_known();
        unknown.then(|| {
            format!(
                "the picture is black: all samples are black or below {QUANTUM:.0e}, the precision of a film. If the scene should be lit, multiply all emissions, intensities and radiances by one number and lower its exposure"
            )
        })
    }

    /// Whether anything was counted.
    pub fn is_known(&self) -> bool {
        self.counted > 0
    }

    /// Whether everything counted is black.
    pub fn is_black(&self) -> bool {
        self.lit == 0
    }

    /// Whether more than half of the samples or pixels that are not black are too dark.
    pub fn is_majority(&self) -> bool {
        2 * self.faint > self.lit
    }

    /// The power of two by which to multiply all light: it brings the brightest faint value to about one, or is limited
    /// by the brightest value of all. `None` if that is too little to bring it above [`FAINT`].
    fn stops(&self) -> Option<i32> {
        let highest = libm::ilogbf(MAX_RADIANCE) - 1;
        let stops = (-libm::ilogbf(self.brightest_faint)).min(highest - libm::ilogbf(self.brightest));
        (libm::ilogbf(self.brightest_faint) + stops >= libm::ilogbf(FAINT)).then_some(stops)
    }
}

/// A warning with a remedy.
impl fmt::Display for Faint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Faint { lit, faint, brightest, is_of_film, .. } = *self;
        let counted = if is_of_film { "pixels" } else { "samples" };
        write!(
            f,
            "{faint} of the first {lit} {counted} that are not black are below {FAINT:.0e}, too close to the precision of a film ({QUANTUM:.0e}). "
        )?;
        match self.stops() {
            Some(stops) => write!(
                f,
                "Multiply all emissions, intensities and radiances of the scene by 2^{stops} (about {:.0e}) and lower its exposure by {stops} stops. With point lights, a larger unit of length also helps",
                libm::exp2(f64::from(stops))
            ),
            None => write!(
                f,
                "Others are as bright as {brightest:.0e}, and no common factor brings both into the range of a film, which ends at {MAX_RADIANCE:.0e}. Make the bright lights darker or keep them out of view, then multiply all light"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sample;

    fn finished(sample: u32, radiance: f32) -> Finished {
        let sample = Sample { pixel: 0, sample, x: 0.0, y: 0.0, radiance: [0.0, radiance, 0.0] };
        Finished { slot: 0, sample }
    }

    fn counted(radiance: &[f32]) -> Faint {
        let (mut all, mut rest) = (Faint::default(), Faint::default());
        let samples: Vec<_> = radiance.iter().map(|&radiance| finished(0, radiance)).collect();
        let (some, others) = samples.split_at(samples.len() / 2);
        all.count(some);
        rest.count(others);
        all.merge(&rest);
        all
    }

    #[test]
    fn the_majority_of_samples_that_are_not_black_decides() {
        let faint = FAINT / 2.0;
        for (radiance, is_majority) in [
            (&[0.0, 0.0, 0.0, faint][..], true),
            (&[1e-30, 0.0], true),
            (&[faint, faint, 1.0], true),
            (&[faint, 1.0], false),
            (&[FAINT, FAINT, FAINT], false),
            (&[0.0, 0.0], false),
            (&[], false),
        ] {
            assert_eq!(counted(radiance).is_majority(), is_majority, "{radiance:?}");
        }
        assert!(counted(&[0.0]).is_black() && counted(&[0.0]).is_known() && !counted(&[]).is_known());
        // Samples with other indices are not counted, so that the result does not depend on the number of threads.
        let mut all = Faint::default();
        all.count(&[finished(1, faint), finished(7, faint)]);
        assert!(!all.is_known());
    }

    #[test]
    fn the_pixels_of_a_film_are_counted() {
        let mut film = Film::new(3, 1).unwrap();
        let add = |film: &mut Film, pixel, radiance: f32| film.add_sample(pixel, [radiance; 3]).unwrap();
        add(&mut film, 0, 2.0 * QUANTUM as f32);
        assert!(Faint::of_film(&film).is_majority());
        add(&mut film, 1, 1.0);
        assert!(!Faint::of_film(&film).is_majority());
        let mut film = Film::new(1, 1).unwrap();
        add(&mut film, 0, 0.25 * QUANTUM as f32);
        assert!(Faint::of_film(&film).is_black() && !Faint::of_film(&film).is_majority());
        // A black film gives no warning by itself; its samples do, and there may be no light.
        let warning = |faint: Faint, has_light| faint.warning(&film, has_light);
        assert!(warning(Faint::default(), true).unwrap().starts_with("the picture is black"));
        assert_eq!(warning(Faint::default(), false), None);
        assert_eq!(warning(counted(&[0.0, 0.0]), true), None);
        assert!(warning(counted(&[0.0, 1e-12]), true).unwrap().starts_with("1 of the first 1 samples"));
    }

    #[test]
    fn the_remedy_makes_the_brightest_about_one() {
        let text = counted(&[3e-13, 1e-13, 0.0]).to_string();
        assert!(text.starts_with("2 of the first 2 samples that are not black are below 7e-9"), "{text}");
        assert!(text.contains("by 2^42 (about 4e12) and lower its exposure by 42 stops"), "{text}");
    }
    #[test]
    fn the_remedy_keeps_bright_samples_within_the_range() {
        // A visible lamp above a floor that is too dark.
        let floor = [3e-9_f32, 1e-9, 2e-9];
        let mixed = counted(&[floor[0], floor[1], 100.0, floor[2]]);
        assert!(mixed.is_majority());
        let stops = mixed.stops().unwrap();
        assert_eq!(stops, 23, "the most that 100 allows");
        let times = libm::exp2f(stops as f32);
        assert!(floor[0] * times >= FAINT && 100.0 * times <= MAX_RADIANCE);
        assert!(
            mixed.to_string().contains("by 2^23 (about 8e6) and lower its exposure by 23 stops"),
            "{mixed}"
        );
        // Without the lamp there is room for all.
        assert_eq!(counted(&floor).stops(), Some(29));
        // A lamp that is too bright for any factor.
        let wide = counted(&[1e-15, 1e-15, 1e8]);
        assert!(wide.is_majority() && wide.stops().is_none());
        assert!(wide.to_string().contains("no common factor brings both"), "{wide}");
    }
}
