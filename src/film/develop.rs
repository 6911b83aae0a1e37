//! Makes films from recorded samples. Their sums equal those of the render that made the samples.

use super::reject::Reject;
use super::splat::{Made, Splatter};
use super::sums::Film;
use super::{Layout, MemoryError};
use crate::integrator::Finished;
use crate::math::lanes::Level;
use crate::sampling::Sample;

/// Samples per band: a sixteenth of what its words can hold.
const MOST_IN_BAND: usize = 1 << 13;

/// A sample whose position is outside the pixel that it names.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("sample {} of pixel {} lies at {}, {}, which is not in that pixel", .0.sample, .0.pixel, .0.x, .0.y)]
pub struct Misplaced(pub Sample);

/// Adds recorded samples to a film.
#[derive(Clone, Debug)]
pub struct Developer {
    film: Film,
    splatter: Splatter,
    level: Level,
    /// Pixels in a row of the full film, and the index on it of the film's first pixel.
    full_width: u32,
    origin: [u32; 2],
    /// Pixels that share a band; `None` if a row is too long for a band.
    window: Option<u32>,
    waiting: Vec<Finished>,
    /// The index of the current band.
    at: u32,
}

impl Developer {
    /// An empty film whose first pixel has this column and row on a full film of `full_width` pixels a row.
    pub fn new(
        layout: Layout,
        splatter: Splatter,
        full_width: u32,
        origin: [u32; 2],
        level: Level,
    ) -> Result<Developer, MemoryError> {
        let film = Film::with_layout(layout)?;
        let places = splatter.places_from(0, layout.width);
        let window = places.is_multiple_of(layout.width).then_some(places);
        Ok(Developer { film, splatter, level, full_width, origin, window, waiting: Vec::new(), at: 0 })
    }

    /// Adds samples in any order. Samples of pixels outside the film are ignored.
    pub fn add(&mut self, samples: &[Sample]) -> Result<(), Misplaced> {
        for &sample in samples {
            let pixel = [sample.pixel % self.full_width, sample.pixel / self.full_width];
            let within =
                |at: f32, pixel: u32| (f64::from(pixel)..=f64::from(pixel) + 1.0).contains(&f64::from(at));
            if !within(sample.x, pixel[0]) || !within(sample.y, pixel[1]) {
                return Err(Misplaced(sample));
            }
            let [Some(x), Some(y)] = [0, 1].map(|axis| pixel[axis].checked_sub(self.origin[axis])) else {
                continue;
            };
            if x >= self.film.width() || y >= self.film.height() {
                continue;
            }
            self.put(y * self.film.width() + x, sample);
        }
        Ok(())
    }

    /// The film.
    pub fn finish(mut self) -> Film {
        self.flush();
        self.film
    }

    fn put(&mut self, place: u32, sample: Sample) {
        let Some(window) = self.window else {
            // The film counts the samples that it rejects.
            let _: Result<(), Reject> = self.film.splat(&self.splatter, place as usize, &sample);
            return;
        };
        if self.at != place / window || self.waiting.len() == MOST_IN_BAND {
            self.flush();
            self.at = place / window;
        }
        self.waiting.push(Finished { slot: place % window, sample });
    }

    fn flush(&mut self) {
        let Some(window) = self.window.filter(|_| !self.waiting.is_empty()) else { return };
        let first = self.at * window;
        let end = self.film.layout().len().min(u64::from(first) + u64::from(window)) as u32;
        let mut band = self.splatter.band(first, end - 1, self.film.width());
        let mut made = vec![Made::default(); (end - first) as usize];
        let unusual = self.splatter.add(self.level, &self.waiting, &mut band, &mut made);
        self.film.add_band(&band);
        for (place, made) in (first as usize..).zip(made) {
            self.film.add_made(place, made);
        }
        for index in unusual {
            let Finished { slot, sample } = self.waiting[index];
            let _: Result<(), Reject> = self.film.splat(&self.splatter, (first + slot) as usize, &sample);
        }
        self.waiting.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Weights;
    use crate::sampling::Stream;
    use crate::scene::Filter;
    use rand::RngExt;

    #[test]
    fn samples_in_any_order_give_the_sums_of_single_samples() {
        let stream = &mut Stream::new(3, 0, 0);
        // A part of a film of 100 columns, with more rows than fit into a band.
        let (layout, origin) = (Layout { weighted: true, ..Layout::plain(30, 50) }, [10, 5]);
        let splatter = Splatter::new(Weights::new(Filter::Lanczos { radius: 3.0 }), origin);
        let mut samples: Vec<Sample> = (0..20_000)
            .map(|i| {
                let [x, y] = [stream.random_range(0.0..100.0_f32), stream.random_range(0.0..80.0)];
                let radiance = [[f32::NAN, 0.0, 0.0], [2e9, 0.0, 0.0], [1e6; 3], [x, y, 0.5]][(i % 7).min(3)];
                Sample { pixel: y as u32 * 100 + x as u32, sample: i as u32, x, y, radiance }
            })
            .collect();
        let mut plain = Film::with_layout(layout).unwrap();
        for sample in &samples {
            let [x, y] = [sample.pixel % 100, sample.pixel / 100];
            if (10..40).contains(&x) && (5..55).contains(&y) {
                let _ = plain.splat(&splatter, ((y - 5) * 30 + x - 10) as usize, sample);
            }
        }
        let develop = |samples: &[Sample]| {
            let mut developer =
                Developer::new(layout, splatter.clone(), 100, origin, Level::PORTABLE).unwrap();
            developer.add(samples).unwrap();
            developer.finish()
        };
        assert!(develop(&samples) == plain && plain.rejected() > 100);
        samples.sort_by_key(|sample| sample.pixel);
        assert!(develop(&samples) == plain);
        // Negative controls: a sample outside all pixels, and one in another pixel.
        assert!(develop(&samples[samples.len() / 2..]) != plain);
        let mut developer = Developer::new(layout, splatter.clone(), 100, origin, Level::PORTABLE).unwrap();
        for x in [9.9, 11.1, f32::NAN] {
            let sample = Sample { pixel: 510, sample: 0, x, y: 5.5, radiance: [0.0; 3] };
            assert!(developer.add(&[sample]).is_err(), "{x}");
        }
        let on_border = Sample { pixel: 510, sample: 0, x: 11.0, y: 5.0, radiance: [0.0; 3] };
        assert_eq!(developer.add(&[on_border]), Ok(()));
    }
}
