use super::*;
use crate::film::MAX_RADIANCE;
use crate::film::filter::profile;
use crate::film::filter::tests::WIDE;
use crate::film::sums::{FilmPixel, MAX_COUNT, MAX_SUMMED};
use crate::film::{Layout, Picture};
use crate::sampling::Stream;
use crate::scene::Filter;
use rand::RngExt;

const WIDTH: u32 = 15;
const HEIGHT: u32 = 14;

fn film() -> Film {
    Film::with_layout(Layout { weighted: true, ..Layout::plain(WIDTH, HEIGHT) }).unwrap()
}

fn splatter(filter: Filter) -> Splatter {
    Splatter::new(Weights::new(filter), [0, 0])
}

fn sample(pixel: u32, [x, y]: [f32; 2], radiance: [f32; 3]) -> Sample {
    Sample { pixel, sample: 0, x, y, radiance }
}

/// Samples over the whole film, of all magnitudes that its sums accept.
fn samples(seed: u32, brightest: f32) -> Vec<Sample> {
    let stream = &mut Stream::new(seed, 0, 0);
    let radiance = |stream: &mut Stream| match stream.random_range(0..6) {
        0 => 0.0,
        1 => brightest,
        2 => f32::from_bits(stream.random_range(0..0x0080_0000)),
        _ => (stream.random_range(-36.0..30.0_f32).exp2() * stream.random::<f32>()).min(brightest),
    };
    let one = |i: u32| {
        let pixel = i % (WIDTH * HEIGHT);
        let offset =
            if i.is_multiple_of(11) { [0.0, 1.0] } else { [stream.random::<f32>(), stream.random()] };
        let at = [(pixel % WIDTH) as f32 + offset[0], (pixel / WIDTH) as f32 + offset[1]];
        sample(pixel, at, [radiance(stream), radiance(stream), radiance(stream)])
    };
    (0..25 * WIDTH * HEIGHT).map(one).collect()
}

/// Adds samples of the rows from..to as a worker does.
fn add_as_band(film: &mut Film, splatter: &Splatter, level: Level, rows: [u32; 2], samples: &[Sample]) {
    let [first, end] = rows.map(|row| row * WIDTH);
    let mine: Vec<Finished> = samples
        .iter()
        .filter(|sample| (first..end).contains(&sample.pixel))
        .map(|&sample| Finished { slot: sample.pixel - first, sample })
        .collect();
    let mut band = splatter.band(first, end - 1, WIDTH);
    let mut made = vec![Made::default(); (end - first) as usize];
    let unusual = splatter.add(level, &mine, &mut band, &mut made);
    film.add_band(&band);
    (first..).zip(made).for_each(|(pixel, made)| film.add_made(pixel as usize, made));
    for index in unusual {
        let sample = mine[index].sample;
        let _ = film.splat(splatter, sample.pixel as usize, &sample);
    }
}

#[test]
fn bands_and_single_samples_give_the_same_words_at_every_level_and_in_any_order() {
    for (seed, filter) in (0..).zip(WIDE) {
        let (splatter, mut samples) = (splatter(filter), samples(seed, MAX_RADIANCE));
        samples.push(sample(5, [5.5, 0.5], [f32::NAN, 0.0, 0.0]));
        samples.push(sample(6, [6.5, 0.5], [0.0, -1.0, 0.0]));
        let mut one_by_one = film();
        for sample in &samples {
            let _ = one_by_one.splat(&splatter, sample.pixel as usize, sample);
        }
        assert_eq!((one_by_one.rejected(), one_by_one.seen(5)), (2, 26));
        samples.reverse();
        for level in Level::available() {
            for cuts in [vec![0, HEIGHT], vec![0, 3, 4, 9, HEIGHT]] {
                let mut bands = film();
                for rows in cuts.windows(2).rev() {
                    add_as_band(&mut bands, &splatter, level, [rows[0], rows[1]], &samples);
                }
                assert!(bands == one_by_one, "{filter} at {level}");
            }
        }
        // Negative controls: one sample fewer, and a slightly different position.
        let mut other = film();
        samples[7].x += 0.001;
        add_as_band(&mut other, &splatter, Level::SCALAR, [0, HEIGHT], &samples);
        assert!(other != one_by_one || matches!(filter, Filter::Box { .. }), "{filter}");
        let mut fewer = film();
        add_as_band(&mut fewer, &splatter, Level::SCALAR, [0, HEIGHT], &samples[1..]);
        assert!(fewer != one_by_one);
    }
}

/// A float times 2³² times a weight of 2⁻²⁸, in integers, rounded half to even.
fn product(radiance: f32, weight: i64) -> i128 {
    let bits = radiance.to_bits();
    let (exponent, fraction) = ((bits >> 23) as i32, i128::from(bits & 0x7f_ffff));
    let mantissa = if exponent == 0 { fraction } else { fraction | 0x80_0000 } * i128::from(weight);
    match exponent.max(1) - 127 - 23 + 32 - 28 {
        shift @ 0.. => mantissa << shift,
        shift @ -100..0 => {
            let (whole, rest) = (mantissa >> -shift, mantissa & ((1 << -shift) - 1));
            let half = 1_i128 << (-shift - 1);
            whole + i128::from(rest > half || (rest == half && whole & 1 == 1))
        }
        _ => 0,
    }
}

#[test]
fn a_sample_adds_its_exact_product_rounded_once() {
    let filter = Filter::Mitchell { radius: 2.0, b: 0.2, c: 0.4 };
    let (splatter, stream) = (splatter(filter), &mut Stream::new(9, 0, 0));
    let rows = splatter.weights().rows::<4>();
    for i in 0..2000 {
        let at = [stream.random_range(5.0..6.0_f32), stream.random_range(4.0..5.0)];
        let radiance = [
            stream.random_range(-36.0..30.0_f32).exp2(),
            MAX_RADIANCE * stream.random::<f32>(),
            (stream.random_range(0..4096_u32) as f32 + 0.5) * 2.0_f32.powi(-32),
        ];
        let mut film = film();
        film.splat(&splatter, 0, &sample(0, at, radiance)).unwrap();
        let (column, across) = taps::<4>(rows, splatter.weights().shift(), at[0]);
        let (row, down) = taps::<4>(rows, splatter.weights().shift(), at[1]);
        for (y, down) in (row..).zip(down) {
            for (x, across) in (column..).zip(across) {
                let weight = i64::from(down) * i64::from(across);
                let (rgb, sum) = film.pixels[(y * i64::from(WIDTH) + x) as usize].words();
                assert_eq!(rgb, radiance.map(|c| product(c, weight)), "sample {i} at {x}, {y}");
                assert_eq!(sum, i128::from(weight));
            }
        }
    }
}

#[test]
fn the_fullest_bands_fit() {
    // The sum in a pixel of one sample from each pixel around it, at any position: less than nine times its own.
    for filter in WIDE.into_iter().chain([Filter::Lanczos { radius: 16.0 }, Filter::Box { radius: 16.0 }]) {
        let weights = Weights::new(filter);
        let (width, table) = (weights.width(), weights.table());
        let most =
            |tap: usize| table.iter().skip(tap).step_by(width).map(|w| w.unsigned_abs()).max().unwrap();
        let sum: u32 = (0..width).map(most).sum();
        assert!(f64::from(sum) < 3.0 * f64::from(1 << (TAP_BITS + 8)), "{filter}: {sum}");
    }
    assert!(9.0 * f64::from(MAX_COUNT) * f64::from(MAX_SUMMED) * SCALE < 2.0_f64.powi(63));
    assert!(f64::from(MAX_SUMMED) * SCALE < 2.0_f64.powi(51), "rounding is correct up to there");
}

/// Black samples on a regular grid over the film, and one of radiance 1.
fn impulse(splatter: &Splatter, at: [f32; 2]) -> Picture {
    const GRID: u32 = 16;
    let mut film = film();
    for i in 0..WIDTH * GRID * HEIGHT * GRID {
        let place = [i % (WIDTH * GRID), i / (WIDTH * GRID)].map(|i| (i as f32 + 0.5) / GRID as f32);
        let pixel = place[1] as u32 * WIDTH + place[0] as u32;
        film.splat(splatter, pixel as usize, &sample(pixel, place, [0.0; 3])).unwrap();
    }
    let pixel = at[1] as u32 * WIDTH + at[0] as u32;
    film.splat(splatter, pixel as usize, &sample(pixel, at, [1.0, 0.5, 0.0])).unwrap();
    film.picture()
}

/// The largest difference between a picture and a filter around a point, as a fraction of the filter's height.
fn off(picture: &Picture, filter: Filter, at: [f32; 2]) -> f64 {
    let value =
        |x: f64, y: f64| profile(filter, x - f64::from(at[0])) * profile(filter, y - f64::from(at[1]));
    let centre = |i: u32| f64::from(i) + 0.5;
    // Away from the border all pixels have the same weight; its inverse is the picture's height.
    let (mut mine, mut theirs, mut worst) = (0.0, 0.0, 0.0_f64);
    let inside =
        |i: usize| (value(centre(i as u32 % WIDTH), centre(i as u32 / WIDTH)), f64::from(picture.rgb[i][0]));
    for i in 0..picture.rgb.len() {
        let (filter, seen) = inside(i);
        mine += filter * filter;
        theirs += filter * seen;
    }
    let scale = theirs / mine;
    for i in 0..picture.rgb.len() {
        let (filter, seen) = inside(i);
        worst = worst.max((filter * scale - seen).abs());
    }
    worst / (scale.abs() * profile(filter, 0.0).powi(2))
}

#[test]
fn the_picture_of_an_impulse_is_the_filter() {
    let mut all = WIDE.to_vec();
    all.extend([
        Filter::Tent { radius: 2.0 },
        Filter::Gaussian { radius: 2.0, sigma: 0.7 },
        Filter::Mitchell { radius: 2.0, b: 0.0, c: 0.5 },
    ]);
    for filter in all {
        let splatter = splatter(filter);
        for at in [[7.5, 6.5], [7.2, 6.9], [7.03, 6.61]] {
            let picture = impulse(&splatter, at);
            let error = off(&picture, filter, at);
            // Two taps with an error of 2⁻¹⁴ each, where the highest are at least 0.4 of the whole; and the weight of
            // the impulse itself, a 256th of a pixel's.
            assert!(error < 8.0 / f64::from(1 << TAP_BITS), "{filter} is off by {error}");
            assert!(picture.rgb.iter().all(|rgb| rgb[2] == 0.0 && (rgb[1] - rgb[0] / 2.0).abs() < 1e-7));
            // Negative controls: slightly wider filters. At a pixel centre all Lanczos filters are equal.
            let wider = match filter {
                Filter::Box { .. } => Filter::Box { radius: 1.0 },
                Filter::Tent { radius } => Filter::Tent { radius: radius * 1.01 },
                Filter::Gaussian { radius, sigma } => Filter::Gaussian { radius, sigma: sigma * 1.01 },
                Filter::Mitchell { radius, b, c } => Filter::Mitchell { radius, b: b + 0.01, c },
                Filter::BlackmanHarris { radius } => Filter::BlackmanHarris { radius: radius * 1.01 },
                Filter::Lanczos { radius } => Filter::Lanczos { radius: radius * 1.1 },
                Filter::None => filter,
            };
            assert!(
                at == [7.5, 6.5] || off(&picture, wider, at) > 8.0 / f64::from(1 << TAP_BITS),
                "{wider} passes for {filter}"
            );
        }
    }
}

#[test]
fn uniform_radiance_stays_uniform_and_pixels_without_weight_are_black() {
    for filter in WIDE {
        let splatter = splatter(filter);
        let mut film = film();
        assert!(film.picture().rgb.iter().all(|rgb| *rgb == [0.0; 3]));
        let stream = &mut Stream::new(4, 0, 0);
        for pixel in (0..WIDTH * HEIGHT).chain(0..WIDTH * HEIGHT) {
            let at = [
                (pixel % WIDTH) as f32 + stream.random::<f32>(),
                (pixel / WIDTH) as f32 + stream.random::<f32>(),
            ];
            film.splat(&splatter, pixel as usize, &sample(pixel, at, [0.7, 1e-3, 900.0])).unwrap();
        }
        for rgb in film.picture().rgb {
            for (c, expected) in rgb.into_iter().zip([0.7, 1e-3, 900.0]) {
                assert!((c / expected - 1.0).abs() < 1e-5, "{filter}: {c} is not {expected}");
            }
        }
    }
}

#[test]
fn the_faintest_and_the_brightest_radiance_fit_in_2_to_the_32_samples_of_a_pixel() {
    for filter in WIDE {
        let splatter = splatter(filter);
        for radiance in [(-30.0_f32).exp2() * 8.0, MAX_RADIANCE] {
            let mut film = film();
            for pixel in 0..WIDTH * HEIGHT {
                let at = [(pixel % WIDTH) as f32 + 0.5, (pixel / WIDTH) as f32 + 0.5];
                film.splat(&splatter, pixel as usize, &sample(pixel, at, [radiance; 3])).unwrap();
            }
            let (rgb, weight) = film.pixels[(4 * WIDTH + 6) as usize].words();
            assert!(
                rgb[0] > 0 && rgb[0] < 1 << 63 && weight <= 1 << (WEIGHT_BITS + 1),
                "{filter} {radiance:e}"
            );
            let mean = film.mean((4 * WIDTH + 6) as usize)[0];
            assert!((mean / radiance - 1.0).abs() < 0.1, "{filter}: {mean:e} is not {radiance:e}");
        }
    }
}

// An integrator may place samples anywhere: those beyond a band are not lost, and no other pixel changes.
#[test]
fn samples_beyond_a_band_are_reported_and_added_singly() {
    for spreads in [false, true] {
        let splatter = splatter(Filter::Mitchell { radius: 2.0, b: 0.2, c: 0.4 }).with_spreads(spreads);
        let layout = Layout { weighted: true, spreads, ..Layout::plain(WIDTH, HEIGHT) };
        let stream = &mut Stream::new(12, 0, 0);
        let mut anywhere = || stream.random_range(-9.0..25.0_f32);
        let mut samples: Vec<Sample> = (0..3000)
            .map(|i| sample(3 * WIDTH + i % (2 * WIDTH), [anywhere(), anywhere()], [0.25; 3]))
            .collect();
        samples.extend(
            [-1e30, f32::NEG_INFINITY, f32::INFINITY, 1e30, f32::NAN]
                .map(|x| sample(3 * WIDTH, [x, 4.0], [0.25; 3])),
        );
        let mut one_by_one = Film::with_layout(layout).unwrap();
        for sample in &samples {
            one_by_one.splat(&splatter, sample.pixel as usize, sample).unwrap();
        }
        for level in Level::available() {
            let mut film = Film::with_layout(layout).unwrap();
            add_as_band(&mut film, &splatter, level, [3, 5], &samples);
            assert!(film == one_by_one, "{level}, spreads {spreads}");
        }
        // The reported range of pixels contains all that a sample is added to.
        for sample in &samples {
            let mut film = Film::with_layout(layout).unwrap();
            film.splat(&splatter, sample.pixel as usize, sample).unwrap();
            let [first, last] = splatter.places(sample, sample.pixel, WIDTH, HEIGHT);
            let changed = |place: &u32| film.pixels[*place as usize] != FilmPixel::default();
            assert!((0..WIDTH * HEIGHT).filter(changed).all(|place| (first..=last).contains(&place)));
        }
    }
}

#[test]
fn a_band_is_clipped_to_the_film_and_bounded_in_memory() {
    let lanczos = Filter::Lanczos { radius: 16.0 };
    for (filter, film_width) in
        [(lanczos, 65_536), (Filter::Tent { radius: 1.0 }, 640), (Filter::Box { radius: 0.5 }, 1)]
    {
        for spreads in [false, true] {
            let splatter = splatter(filter).with_spreads(spreads);
            for first in [0, 7, film_width - 1, 5 * film_width + 3] {
                let places = splatter.places_from(first, film_width);
                assert!(places >= 1);
                let band = splatter.band(first, first + places - 1, film_width);
                assert!(band.bytes() <= BAND_BYTES && band.width * band.height == band.sums.len());
                assert_eq!(band.spreads.is_some(), spreads);
            }
        }
    }
    let band = splatter(Filter::Tent { radius: 1.0 }).band(WIDTH + 1, 2 * WIDTH + 6, WIDTH);
    // Rows 1 and 2, one more on each side, and a margin for taps.
    assert_eq!(band.places(WIDTH, HEIGHT), Some([0, 6 * WIDTH - 1]));
    assert_eq!(Band::empty().places(WIDTH, HEIGHT), None);
}
