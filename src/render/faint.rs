//! Whether radiance is too small for a film, which keeps multiples of a quantum.

use crate::film::Film;
use crate::film::fixed::QUANTUM;
use crate::integrator::Finished;
use std::fmt;

/// What is darker than this many quanta loses digits that are seen: half a quantum is a 64th of it.
const FAINT: f32 = 32.0 * QUANTUM as f32;

/// How much of what sees light is too dark for a film.
///
/// Workers count the samples with the number 0, which is what films can no longer tell: one that was rounded to zero
/// looks like one that saw nothing. All other samples cost nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faint {
    /// Samples, or pixels.
    counted: u64,
    /// Those that are not black.
    lit: u64,
    /// Those of them that are darker than [`FAINT`] in all channels.
    faint: u64,
    /// The largest channel of them all.
    brightest: f32,
    /// Whether pixels of a film were counted.
    is_of_film: bool,
}

impl Faint {
    /// Counts those of some samples that have the number 0.
    pub fn count(&mut self, finished: &[Finished]) {
        finished.iter().filter(|f| f.sample.sample == 0).for_each(|f| self.add(f.sample.radiance));
    }

    /// Of the pixels of a film.
    pub fn of_film(film: &Film) -> Faint {
        let mut all = Faint { is_of_film: true, ..Faint::default() };
        film.layout().places().for_each(|place| all.add(film.mean(place)));
        all
    }

    fn add(&mut self, radiance: [f32; 3]) {
        let largest = radiance.into_iter().fold(0.0, f32::max);
        self.counted += 1;
        self.lit += u64::from(largest > 0.0);
        self.faint += u64::from(largest > 0.0 && largest < FAINT);
        // What is infinite is reported as such.
        self.brightest = if largest.is_finite() { self.brightest.max(largest) } else { self.brightest };
    }

    /// Adds what was counted elsewhere.
    pub fn merge(&mut self, other: &Faint) {
        self.counted += other.counted;
        self.lit += other.lit;
        self.faint += other.faint;
        self.brightest = self.brightest.max(other.brightest);
    }

    /// What to warn of at the end of a render with this film, by what was counted of its first samples, if they were.
    pub fn warning(&self, film: &Film, has_light: bool) -> Option<String> {
        let of_film = Faint::of_film(film);
        let known = if self.is_known() { self } else { &of_film };
        if known.is_most() {
            return Some(known.to_string());
        }
        // Samples that were rounded to zero look like samples that saw nothing.
        let unknown = has_light && of_film.is_black() && !self.is_known();
        unknown.then(|| {
            format!(
                "the picture is black: no sample saw light, or all saw less than the {QUANTUM:.0e} that a film keeps; if light is to be seen, multiply every emission, intensity and radiance of the scene and lower its exposure"
            )
        })
    }

    /// Whether anything was counted.
    pub fn is_known(&self) -> bool {
        self.counted > 0
    }

    /// Whether all that was counted is black.
    pub fn is_black(&self) -> bool {
        self.lit == 0
    }

    /// Whether most of what sees light is too dark.
    pub fn is_most(&self) -> bool {
        2 * self.faint > self.lit
    }
}

/// A warning that says what to do.
impl fmt::Display for Faint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Faint { lit, faint, brightest, is_of_film, .. } = *self;
        let what = if is_of_film { "pixels" } else { "samples" };
        // To the power of two that makes the brightest one.
        let stops = -libm::ilogbf(brightest);
        write!(
            f,
            "{faint} of the first {lit} {what} that see light are darker than {FAINT:.0e}, and a film keeps multiples of {QUANTUM:.0e}: multiply every emission, intensity and radiance of the scene by 2^{stops} (about {:.0e}) and lower its exposure by {stops} stops, or, where point lights light it, measure lengths in a larger unit",
            libm::exp2(f64::from(stops))
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::Sample;

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
    fn most_of_what_is_not_black_decides() {
        let faint = FAINT / 2.0;
        for (radiance, is_most) in [
            (&[0.0, 0.0, 0.0, faint][..], true),
            (&[1e-30, 0.0], true),
            (&[faint, faint, 1.0], true),
            (&[faint, 1.0], false),
            (&[FAINT, FAINT, FAINT], false),
            (&[0.0, 0.0], false),
            (&[], false),
        ] {
            assert_eq!(counted(radiance).is_most(), is_most, "{radiance:?}");
        }
        assert!(counted(&[0.0]).is_black() && counted(&[0.0]).is_known() && !counted(&[]).is_known());
        // Samples with other numbers are not counted, so that it is the same for any number of threads.
        let mut all = Faint::default();
        all.count(&[finished(1, faint), finished(7, faint)]);
        assert!(!all.is_known());
    }

    #[test]
    fn a_film_tells_what_it_has_kept() {
        let mut film = Film::new(3, 1).unwrap();
        let add = |film: &mut Film, pixel, radiance: f32| film.add_sample(pixel, [radiance; 3]).unwrap();
        add(&mut film, 0, 2.0 * QUANTUM as f32);
        assert!(Faint::of_film(&film).is_most());
        add(&mut film, 1, 1.0);
        assert!(!Faint::of_film(&film).is_most());
        let mut film = Film::new(1, 1).unwrap();
        add(&mut film, 0, 0.25 * QUANTUM as f32);
        assert!(Faint::of_film(&film).is_black() && !Faint::of_film(&film).is_most());
        // A black film tells nothing by itself; its samples do, and there may be no light.
        let warning = |faint: Faint, has_light| faint.warning(&film, has_light);
        assert!(warning(Faint::default(), true).unwrap().starts_with("the picture is black"));
        assert_eq!(warning(Faint::default(), false), None);
        assert_eq!(warning(counted(&[0.0, 0.0]), true), None);
        assert!(warning(counted(&[0.0, 1e-12]), true).unwrap().starts_with("1 of the first 1 samples"));
    }

    #[test]
    fn the_remedy_makes_the_brightest_about_one() {
        let text = counted(&[3e-13, 1e-13, 0.0]).to_string();
        assert!(text.starts_with("2 of the first 2 samples that see light are darker than 7e-9"), "{text}");
        assert!(text.contains("by 2^42 (about 4e12) and lower its exposure by 42 stops"), "{text}");
    }
}
