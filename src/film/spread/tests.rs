use super::*;
use crate::film::MAX_RADIANCE;
use crate::film::filter::tests::WIDE;
use crate::film::splat::{Band, Made};
use crate::film::sums::{MAX_COUNT, MAX_SUMMED};
use crate::film::weights::{Weights, taps};
use crate::film::{Film, Layout, Splatter};
use crate::integrator::Finished;
use crate::math::lanes::Level;
use crate::sampling::{Sample, Stream};
use crate::scene::Filter;
use rand::RngExt;

const SIDE: u32 = 10;

fn film() -> Film {
    Film::with_layout(Layout { weighted: true, spreads: true, ..Layout::plain(SIDE, SIDE) }).unwrap()
}

fn splatter(filter: Filter) -> Splatter {
    Splatter::new(Weights::new(filter), [0, 0]).with_spreads(true)
}

/// `spp` samples per pixel, at random positions in it.
fn samples(stream: &mut Stream, spp: u32, mut radiance: impl FnMut(&mut Stream) -> [f32; 3]) -> Vec<Sample> {
    let one = |i: u32| {
        let pixel = i % (SIDE * SIDE);
        let x = (pixel % SIDE) as f32 + stream.random::<f32>();
        let y = (pixel / SIDE) as f32 + stream.random::<f32>();
        Sample { pixel, sample: i, x, y, radiance: radiance(stream) }
    };
    (0..spp * SIDE * SIDE).map(one).collect()
}

/// A film of samples that were added as a band, as workers do.
fn banded(splatter: &Splatter, level: Level, samples: &[Sample]) -> Film {
    let finished: Vec<Finished> =
        samples.iter().map(|&sample| Finished { slot: sample.pixel, sample }).collect();
    let mut film = film();
    let mut band: Band = splatter.band(0, SIDE * SIDE - 1, SIDE);
    let mut made = vec![Made::default(); (SIDE * SIDE) as usize];
    let unusual = splatter.add(level, &finished, &mut band, &mut made);
    film.add_band(&band);
    made.into_iter().enumerate().for_each(|(pixel, made)| film.add_made(pixel, made));
    for index in unusual {
        let _ = film.splat(splatter, samples[index].pixel as usize, &samples[index]);
    }
    film
}

#[test]
fn bands_and_single_samples_give_the_same_words_at_every_level_and_in_any_order() {
    for (seed, filter) in (0..).zip(WIDE) {
        let (splatter, stream) = (splatter(filter), &mut Stream::new(seed, 1, 0));
        let mut samples = samples(stream, 20, |stream| {
            let brightest = if stream.random_range(0..9) == 0 { MAX_RADIANCE } else { MAX_SUMMED };
            [(); 3].map(|()| (stream.random_range(-40.0..30.0_f32).exp2() * 1.3).min(brightest))
        });
        samples[3].radiance[1] = f32::NAN;
        samples[5].radiance = [3.0, 2.0, 1.0];
        let mut one_by_one = film();
        for sample in &samples {
            let _ = one_by_one.splat(&splatter, sample.pixel as usize, sample);
        }
        samples.reverse();
        for level in Level::available() {
            assert!(banded(&splatter, level, &samples) == one_by_one, "{filter} at {level}");
        }
        // The sums of the picture are the same without the extra sums.
        let layout = one_by_one.layout().without_spreads();
        let mut plain = Film::with_layout(layout).unwrap();
        let without = splatter.clone().with_spreads(false);
        for sample in &samples {
            let _ = plain.splat(&without, sample.pixel as usize, sample);
        }
        assert!(plain.pixels == one_by_one.pixels && plain.spreads.is_empty() && !plain.has_variance());
        // Negative control: two channels are swapped.
        samples.iter_mut().filter(|sample| sample.sample == 5).for_each(|sample| sample.radiance.reverse());
        let other = banded(&splatter, Level::SCALAR, &samples);
        assert!(other.spreads != one_by_one.spreads);
    }
}

#[test]
fn a_sample_adds_the_documented_values() {
    let filter = Filter::Mitchell { radius: 2.0, b: 0.2, c: 0.4 };
    let (splatter, stream) = (splatter(filter), &mut Stream::new(9, 0, 0));
    let weights = splatter.weights();
    for i in 0..2000 {
        let [x, y] = [stream.random_range(5.0..6.0_f32), stream.random_range(4.0..5.0)];
        // With so few bits all products of squares are exact.
        let radiance = [(); 3].map(|()| stream.random_range(0..2048_u32) as f32 / 1024.0);
        let mut film = film();
        film.splat(&splatter, 0, &Sample { pixel: 0, sample: 0, x, y, radiance }).unwrap();
        let (column, across) = taps::<4>(weights.rows::<4>(), weights.shift(), x);
        let (row, down) = taps::<4>(weights.rows::<4>(), weights.shift(), y);
        for (y, down) in (row..).zip(down) {
            for (x, across) in (column..).zip(across) {
                let square = |tap: i32| (f64::from(tap * tap) / 16384.0 + 0.5).floor() as u64;
                let weight = square(down) * square(across);
                let words = film.spreads[(y * i64::from(SIDE) + x) as usize].words();
                // Quanta are 2⁻³², and weights multiples of 2⁻²⁸.
                let rgb = radiance.map(|c| (weight as f64 * f64::from(c) * 16.0).round_ties_even() as u128);
                assert_eq!(words.0, rgb, "sample {i}");
                let squares: u128 =
                    radiance.map(|c| (c * 1024.0) as u128 * (c * 1024.0) as u128).iter().sum();
                // Multiples of 2⁻⁴⁸ of products that have 28 and 20 bits.
                assert_eq!((words.1, words.2), (weight, squares * u128::from(weight)), "sample {i}");
            }
        }
    }
}

#[test]
fn the_fullest_bands_and_films_fit() {
    for filter in WIDE.into_iter().chain([Filter::Lanczos { radius: 16.0 }, Filter::Box { radius: 16.0 }]) {
        let weights = Weights::new(filter);
        let (width, table) = (weights.width(), weights.table());
        let most = |tap: usize| {
            let largest = table.iter().skip(tap).step_by(width).map(|w| w.unsigned_abs()).max().unwrap();
            f64::from(largest) / f64::from(1 << 22)
        };
        let sum: f64 = (0..width).map(|tap| most(tap).powi(2)).sum();
        assert!(sum < 3.0, "{filter}: {sum}");
    }
    let word = |squares: f64, low: i32| squares * 2.0_f64.powi(SQUARE_BITS as i32 - low);
    let largest = word(3.0 * f64::from(MAX_SUMMED).powi(2), LOW_BITS as i32);
    assert!(largest < 2.0_f64.powi(51), "rounding is correct up to there");
    assert!(9.0 * f64::from(MAX_COUNT) * largest < 2.0_f64.powi(63));
    assert!(word(9.0 * 3.0 * f64::from(MAX_RADIANCE).powi(2), 0) * 2.0_f64.powi(32) < 2.0_f64.powi(160));
    // Beyond 128 bits the third word takes the carry.
    let (mut spread, one) = (SpreadPixel::default(), u128::MAX - 5);
    (0..9).for_each(|_| spread.add([0; 3], 0, one));
    assert_eq!((spread.squares_high, spread.square_words()), (8, one.wrapping_mul(9)));
    let mut twice = spread;
    twice.merge(&spread);
    assert_eq!((twice.squares_high, twice.square_words()), (17, one.wrapping_mul(18)));
    assert_eq!(SpreadPixel::from_bytes(&twice.to_bytes()), twice);
}

/// The relative excess of the estimated variance over the actual one: the mean over groups of films, and the standard
/// error of that mean.
fn excess(filter: Filter, spp: u32, told: impl Fn(&Film, usize) -> f64) -> [f64; 2] {
    const FILMS: usize = 16;
    const GROUPS: usize = 40;
    let splatter = splatter(filter);
    let groups: Vec<[f64; 2]> = (0..GROUPS)
        .map(|group| {
            let films: Vec<Film> = (0..FILMS)
                .map(|i| {
                    let stream = &mut Stream::new(77, (group * FILMS + i) as u32, 5);
                    // Channels of different variance, one component shared.
                    let samples = samples(stream, spp, |stream| {
                        let u = stream.random::<f32>();
                        [-(1.0 - u).ln(), 2.0 * u, 0.3 + 0.1 * stream.random::<f32>()]
                    });
                    banded(&splatter, Level::available()[0], &samples)
                })
                .collect();
            let (mut difference, mut there) = (0.0, 0.0);
            for pixel in 0..(SIDE * SIDE) as usize {
                let n = FILMS as f64;
                for channel in 0..3 {
                    let values = || films.iter().map(|film| f64::from(film.mean(pixel)[channel]));
                    let mean = values().sum::<f64>() / n;
                    there += values().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
                }
                difference += films.iter().map(|film| told(film, pixel)).sum::<f64>() / n;
            }
            [difference - there, there]
        })
        .collect();
    let n = GROUPS as f64;
    let [difference, there] = [0, 1].map(|i| groups.iter().map(|group| group[i]).sum::<f64>() / n);
    let squares: f64 = groups.iter().map(|group| (group[0] - difference).powi(2)).sum();
    [difference / there, (squares / (n - 1.0) / n).sqrt() / there]
}

// Significance level 1% for all filters together: 3.3 standard errors of each. The delta method itself has a relative
// error of one in the number of samples of a pixel, less than 1% of the variance here.
#[test]
fn the_estimated_variance_matches_the_variance_of_pixels() {
    for filter in WIDE {
        let [excess_told, error] = excess(filter, 36, |film, pixel| film.variance(pixel));
        println!("{filter}: {:.2}% ± {:.2}% excess", 100.0 * excess_told, 100.0 * error);
        assert!(error < 0.02, "{filter}: {error} is too large for this test");
        assert!(excess_told.abs() < 3.3 * error + 0.01, "{filter}: {excess_told} ± {error}");
    }
    // Negative controls: a tenth more, and weights that are not squared, as if each sample counted in one pixel only.
    let tent = Filter::Tent { radius: 1.0 };
    let [more, error] = excess(tent, 36, |film, pixel| 1.1 * film.variance(pixel));
    assert!(more > 3.3 * error + 0.01, "{more} ± {error}");
    let [unshared, error] = excess(tent, 36, |_, _| (1.0 + 1.0 / 3.0 + 0.01 / 12.0) / 36.0);
    assert!(unshared > 3.3 * error + 0.01, "{unshared} ± {error}");
}

#[test]
fn few_samples_and_uniform_ones_have_no_variance() {
    for filter in WIDE {
        let splatter = splatter(filter);
        assert_eq!(film().variance(44), 0.0);
        let mut one = film();
        let sample = Sample { pixel: 44, sample: 0, x: 4.5, y: 4.5, radiance: [3.0, 1.0, 0.5] };
        one.splat(&splatter, 44, &sample).unwrap();
        assert!((0..100).all(|pixel| (0.0..1e-9).contains(&one.variance(pixel))), "{filter}");
        let samples = samples(&mut Stream::new(1, 0, 0), 9, |_| [0.7, 1e-3, 900.0]);
        let flat = banded(&splatter, Level::SCALAR, &samples);
        assert!((0..100).all(|pixel| (0.0..1e-6).contains(&flat.variance(pixel))), "{filter}");
    }
}

#[test]
fn squared_taps_are_rounded_to_nearest() {
    for tap in -(1 << TAP_BITS)..=(1 << TAP_BITS) {
        let exact = f64::from(tap).powi(2) / f64::from(1 << TAP_BITS);
        assert!((f64::from(squared(tap)) - exact).abs() <= 0.5, "{tap}");
    }
}
