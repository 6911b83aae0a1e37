use super::*;
use crate::film::MAX_RADIANCE;
use crate::film::fixed::FRACTION_BITS;
use crate::sampling::Stream;
use rand::RngExt;

/// Sums in 128-bit integers, computed from the definition.
#[derive(Default, Clone, Copy)]
struct Exact {
    rgb: [i128; 3],
    squares: i128,
    count: u64,
}

impl Exact {
    fn add(&mut self, radiance: [f32; 3]) {
        for (sum, c) in self.rgb.iter_mut().zip(radiance) {
            // A float times 2³² in integers: its 24 bits, shifted, rounded half to even.
            let bits = c.to_bits();
            let (exponent, fraction) = ((bits >> 23) as i32, i128::from(bits & 0x7f_ffff));
            let mantissa = if exponent == 0 { fraction } else { fraction | 0x80_0000 };
            let shift = exponent.max(1) - 127 - 23 + FRACTION_BITS as i32;
            *sum += match shift {
                0.. => mantissa << shift,
                -60..0 => {
                    let (whole, rest) = (mantissa >> -shift, mantissa & ((1 << -shift) - 1));
                    let half = 1_i128 << (-shift - 1);
                    whole + i128::from(rest > half || (rest == half && whole & 1 == 1))
                }
                _ => 0,
            };
        }
        let [r, g, b] = radiance.map(f64::from);
        self.squares += ((r * r + g * g + b * b) * SCALE + 0.5) as i128;
        self.count += 1;
    }
}

fn words(film: &Film, pixel: usize) -> ([i128; 3], i128, u64) {
    let p = film.pixels[pixel];
    let rgb = [0, 1, 2].map(|c| i128::from(p.rgb_high[c]) << 64 | i128::from(p.rgb_low[c]));
    (rgb, i128::from(p.squares[1]) << 64 | i128::from(p.squares[0]), p.count)
}

/// Radiance of all magnitudes that a film accepts, including ties of the rounding.
fn radiance(stream: &mut Stream, brightest: f32) -> [f32; 3] {
    [0; 3].map(|_| match stream.random_range(0..8) {
        0 => 0.0,
        1 => (stream.random_range(0..64_u32) as f32 + 0.5) * QUANTUM as f32,
        2 => brightest,
        3 => f32::from_bits(stream.random_range(0..0x0080_0000)),
        _ => (stream.random_range(-36.0..30.0_f32).exp2() * stream.random::<f32>()).min(brightest),
    })
}

fn film() -> Film {
    Film::new(2, 1).unwrap()
}

#[test]
fn sums_equal_those_of_wide_integers() {
    let stream = &mut Stream::new(1, 0, 0);
    let (mut film, mut exact) = (film(), Exact::default());
    for _ in 0..100_000 {
        let sample = radiance(stream, MAX_RADIANCE);
        film.add_sample(1, sample).unwrap();
        exact.add(sample);
    }
    assert_eq!(words(&film, 1), (exact.rgb, exact.squares, exact.count));
    assert_eq!(words(&film, 0), ([0; 3], 0, 0), "the neighbour is unchanged");
}

#[test]
fn batches_of_sums_and_single_samples_give_the_same_words_in_any_order() {
    let stream = &mut Stream::new(2, 0, 0);
    let samples: Vec<_> = (0..5000).map(|_| radiance(stream, MAX_SUMMED)).collect();
    let mut one_by_one = film();
    for &sample in &samples {
        one_by_one.add_sample(0, sample).unwrap();
    }
    for _ in 0..20 {
        // A shuffle (Fisher and Yates), cut into batches of random lengths and some single samples.
        let mut shuffled = samples.clone();
        for i in (1..shuffled.len()).rev() {
            shuffled.swap(i, stream.random_range(0..=i));
        }
        let (mut film, mut rest) = (film(), &shuffled[..]);
        while !rest.is_empty() {
            let (batch, after) = rest.split_at(stream.random_range(1..=rest.len().min(MAX_COUNT as usize)));
            rest = after;
            if batch.len() % 3 == 0 {
                batch.iter().for_each(|&sample| film.add_sample(0, sample).unwrap());
            } else {
                let mut sums = PixelSums::default();
                batch.iter().for_each(|&sample| sums.add(sample));
                film.add_sums(0, &sums);
            }
        }
        assert_eq!(film, one_by_one);
    }
}

#[test]
fn the_fullest_sums_fit() {
    let (mut sums, mut film, mut exact) = (PixelSums::default(), film(), Exact::default());
    for _ in 0..MAX_COUNT {
        assert!(fits([MAX_SUMMED; 3]));
        sums.add([MAX_SUMMED; 3]);
        exact.add([MAX_SUMMED; 3]);
    }
    assert_eq!((sums.count, sums.rgb.map(i128::from)), (MAX_COUNT, exact.rgb));
    assert_eq!(i128::from(sums.squares), exact.squares);
    film.add_sums(0, &sums);
    assert_eq!(words(&film, 0), (exact.rgb, exact.squares, u64::from(MAX_COUNT)));
    assert!(!fits([0.0, MAX_SUMMED.next_up(), 0.0]) && !fits([f32::NAN, 0.0, 0.0]));
    assert!(!fits([0.0, 0.0, -1e-30]) && !fits([f32::INFINITY; 3]) && fits([0.0, -0.0, 1024.0]));
}

#[test]
fn the_faintest_and_the_brightest_radiance_fit_in_2_to_the_32_samples() {
    let all = 1_i128 << 32;
    for (radiance, expected) in [((-30.0_f32).exp2(), (-30.0_f32).exp2()), (MAX_RADIANCE, MAX_RADIANCE)] {
        let mut once = film();
        once.add_sample(0, [radiance; 3]).unwrap();
        let (rgb, squares, _) = words(&once, 0);
        assert!(rgb[0] > 0, "{radiance:e} vanishes");
        // As many additions as a film must support, by doubling: words are integers.
        let mut film = film();
        let wide = |sum: i128| (sum as u64, (sum >> 64) as i32);
        let (low, high) = wide(rgb[0] * all);
        assert_eq!(i128::from(high) << 64 | i128::from(low), rgb[0] * all, "{radiance:e} overflows");
        let squares = u128::try_from(squares * all).unwrap();
        film.pixels[0] = FilmPixel {
            rgb_low: [low; 3],
            rgb_high: [high; 3],
            squares: [squares as u64, (squares >> 64) as u64],
            count: 1 << 32,
            rejected: 0,
        };
        assert_eq!(film.mean(0), [expected; 3]);
        // One more can still be added.
        film.add_sample(0, [radiance; 3]).unwrap();
        assert_eq!(words(&film, 0).0, [rgb[0] * (all + 1); 3]);
        assert_eq!(film.mean(0), [expected; 3]);
    }
}

#[test]
fn carries_run_through_to_the_high_words() {
    let (mut film, mut exact) = (film(), 0_i128);
    for i in 0..2000 {
        // 2⁶² times four is 2⁶⁴; the odd quantum sets bits below.
        let value = if i % 2 == 0 { 1_i64 << 62 } else { 1 };
        film.pixels[0].add_radiance(0, value);
        exact += i128::from(value);
        assert_eq!(words(&film, 0).0[0], exact);
    }
    // Values below zero, which filters with negative lobes add.
    for _ in 0..3000 {
        film.pixels[0].add_radiance(0, -(1 << 62));
        exact -= 1 << 62;
        assert_eq!(words(&film, 0).0[0], exact);
    }
}

#[test]
fn invalid_radiance_is_rejected_with_a_reason() {
    use Reject::{Negative, NotANumber, TooBright};
    let cases = [
        ([f32::NAN, 0.0, 0.0], NotANumber),
        ([0.0, f32::INFINITY, 0.0], TooBright),
        ([0.0, 0.0, MAX_RADIANCE.next_up()], TooBright),
        ([0.0, -1e-30, 0.0], Negative),
        ([f32::NEG_INFINITY, 0.0, 0.0], Negative),
        ([-1.0, f32::INFINITY, f32::NAN], NotANumber),
        ([-1.0, f32::INFINITY, 0.0], TooBright),
    ];
    let mut film = film();
    film.add_sample(0, [0.5; 3]).unwrap();
    let before = words(&film, 0);
    for (radiance, reason) in cases {
        assert_eq!(check(radiance), Err(reason));
        assert_eq!(film.add_sample(0, radiance), Err(reason));
    }
    assert_eq!(words(&film, 0), before, "no value and no weight");
    assert_eq!((film.rejected(), film.seen(0), film.mean(0)), (7, 8, [0.5; 3]));
    // The ends of the range, and zeros of both signs, are accepted.
    for radiance in [0.0, -0.0, f32::MIN_POSITIVE, MAX_RADIANCE] {
        assert_eq!(check([radiance; 3]), Ok(()));
    }
}

#[test]
fn means_are_the_nearest_floats_to_the_quotient() {
    let stream = &mut Stream::new(3, 0, 0);
    for _ in 0..20_000 {
        let (mut film, mut exact) = (film(), Exact::default());
        for _ in 0..stream.random_range(1..20) {
            let sample = radiance(stream, MAX_RADIANCE);
            film.add_sample(0, sample).unwrap();
            exact.add(sample);
        }
        for c in 0..3 {
            // The distance to the mean, times 2³²·n: an integer for each float above one.
            let mean = film.mean(0)[c];
            let n = i128::from(exact.count);
            let off = |x: f32| ((f64::from(x) * SCALE) as i128 * n - exact.rgb[c]).abs();
            if mean >= 1.0 {
                // Double rounding may turn a near tie into a tie.
                let nearly = exact.rgb[c] >> 51;
                assert!(off(mean) <= off(mean.next_up()) + nearly);
                assert!(off(mean) <= off(mean.next_down()) + nearly);
            }
            let quotient = exact.rgb[c] as f64 / n as f64 * QUANTUM;
            assert!(
                (f64::from(mean) - quotient).abs()
                    <= quotient * f64::from(f32::EPSILON) / 2.0 + f64::from(f32::from_bits(1))
            );
        }
    }
    assert_eq!(film().mean(0), [0.0; 3], "black without samples");
}

#[test]
fn the_variance_is_the_variance_of_the_mean() {
    let mut film = film();
    assert_eq!(film.variance(0), 0.0);
    film.add_sample(0, [1.0, 0.0, 0.5]).unwrap();
    assert_eq!(film.variance(0), 0.0);
    film.add_sample(0, [3.0, 0.0, 0.25]).unwrap();
    film.add_sample(0, [5.0, 3.0, 0.75]).unwrap();
    // Red has 4, green 3, blue 1/16; divided by three samples.
    assert!((film.variance(0) - (4.0 + 3.0 + 0.0625) / 3.0).abs() < 1e-9, "{}", film.variance(0));
    film.add_sample(0, [f32::NAN; 3]).unwrap_err();
    assert!((film.variance(0) - (4.0 + 3.0 + 0.0625) / 3.0).abs() < 1e-9);
}

#[test]
fn a_film_that_is_too_large_reports_the_memory_it_needs() {
    // 10⁹ pixels: sums of 64 bytes, 12 of a picture, 4 of the owner.
    let error = MemoryError { width: 40_000, height: 25_000, needed: 80_000_000_000, available: None };
    assert!(error.to_string().contains("needs 80.0 GB of memory"), "{error}");
    let most = Film::new(65_536, 65_535).unwrap_err();
    assert_eq!(most.needed, 65_536 * 65_535 * 80);
    let text = most.to_string();
    assert!(text.contains("65536×65535") && text.contains("343.6 GB") && text.contains("`size`"), "{text}");
}

#[test]
fn wide_sums_are_the_sums_of_their_samples() {
    let samples = [[MAX_RADIANCE, 0.0, 1e6], [1.5, MAX_RADIANCE, 3.0e-9], [123_456.79, 2.0, 0.1]];
    let (mut one_by_one, mut at_once) = (Film::new(1, 1).unwrap(), Film::new(1, 1).unwrap());
    let mut wide = WideSums::default();
    let mut counts = PixelSums::default();
    for _ in 0..200 {
        for radiance in samples {
            one_by_one.add_sample(0, radiance).unwrap();
            wide.squares += scaled_square(radiance) as u128;
            for (sum, c) in wide.rgb.iter_mut().zip(radiance) {
                *sum += (f64::from(c) * SCALE).round_ties_even() as i128;
            }
            counts.count += 1;
        }
    }
    at_once.add_sums(0, &counts);
    at_once.add_wide(0, &wide);
    assert!(wide.rgb[0] > i128::from(i64::MAX), "no sum is wide");
    assert_eq!(at_once, one_by_one);
}
