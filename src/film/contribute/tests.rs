use super::*;
use crate::film::filter::profile;
use crate::film::filter::tests::WIDE;
use crate::film::{Layout, LightScale, MAX_RADIANCE, Picture, Weights};
use crate::sampling::Stream;
use crate::scene::Filter;
use rand::RngExt;

const WIDTH: u32 = 15;
const HEIGHT: u32 = 14;
const PIXELS: u32 = WIDTH * HEIGHT;

fn splatter(filter: Filter) -> Splatter {
    Splatter::new(Weights::new(filter), [0, 0])
}

/// A film with a light image and a black sample in each pixel.
fn film(splatter: &Splatter) -> Film {
    let light = Some(LightScale::new(PIXELS, splatter.weights()));
    let mut film = Film::with_layout(Layout { light, ..Layout::plain(WIDTH, HEIGHT) }).unwrap();
    (0..PIXELS).for_each(|pixel| film.add_sample(pixel as usize, [0.0; 3]).unwrap());
    film
}

fn contribution([x, y]: [f32; 2], radiance: [f32; 3]) -> Contribution {
    Contribution { pixel: 0, sample: 0, x, y, radiance }
}

/// The integral of a filter along an axis.
fn integral(filter: Filter) -> f64 {
    let (radius, steps) = (filter.radius(), 1 << 16);
    let step = 2.0 * radius / f64::from(steps);
    (0..steps).map(|i| profile(filter, (f64::from(i) + 0.5) * step - radius)).sum::<f64>() * step
}

#[test]
fn the_picture_of_one_contribution_is_the_filter_with_an_integral_of_one() {
    for filter in WIDE.into_iter().chain([Filter::Lanczos { radius: 2.0 }]) {
        let splatter = splatter(filter);
        let square = integral(filter).powi(2);
        for at in [[7.5, 6.5], [7.2, 6.9], [7.03, 6.61], [0.2, 13.9]] {
            let mut film = film(&splatter);
            film.contribute(&splatter, 3, &contribution(at, [1.0, 0.5, 0.0])).unwrap();
            let Picture { rgb, .. } = film.picture();
            for (place, rgb) in (0..PIXELS).zip(rgb) {
                let off = |centre: u32, at: f32| f64::from(centre) + 0.5 - f64::from(at);
                let [x, y] = [off(place % WIDTH, at[0]), off(place / WIDTH, at[1])];
                // There are as many samples as pixels, so that the sum over the picture is the contribution.
                let expected = profile(filter, x) * profile(filter, y) / square;
                let error = (f64::from(rgb[0]) - expected).abs();
                // Two taps with an error of 2⁻¹⁴ each, and the same error of the integral.
                let most = 4.0 / f64::from(1 << TAP_BITS) * (profile(filter, 0.0).powi(2) / square).max(1.0);
                assert!(error < most, "{filter} at {x}, {y}: {} is not {expected}", rgb[0]);
                assert!(rgb[2] == 0.0 && rgb[1] == rgb[0] / 2.0);
            }
        }
    }
}

/// Adds contributions of equal radiance on a regular grid over the film and its surroundings. Returns their number.
fn flat(film: &mut Film, splatter: &Splatter, radiance: [f32; 3]) -> u32 {
    const GRID: u32 = 16;
    const AROUND: u32 = 4;
    let [across, down] = [WIDTH, HEIGHT].map(|side| (side + 2 * AROUND) * GRID);
    let at = |i: u32| (i as f32 + 0.5) / GRID as f32 - AROUND as f32;
    for i in 0..across * down {
        let position = [at(i % across), at(i / across)];
        film.contribute(splatter, 0, &contribution(position, radiance)).unwrap();
    }
    GRID * GRID
}

#[test]
fn uniform_contributions_make_a_uniform_picture_of_the_expected_radiance() {
    for filter in WIDE {
        let splatter = splatter(filter);
        let mut film = film(&splatter);
        let each = flat(&mut film, &splatter, [0.7, 1e-9, 900.0]);
        for rgb in film.picture().rgb {
            for (c, one) in rgb.into_iter().zip([0.7, 1e-9, 900.0]) {
                let off = f64::from(c) / (one * f64::from(each)) - 1.0;
                assert!(off.abs() < 2e-4, "{filter}: off by {off}");
            }
        }
        // Negative control: the filter's largest taps in place of its integral.
        let scale = LightScale { integral: 1 << 31, ..film.layout().light.unwrap() };
        let off = scale.of(1) / film.layout().light.unwrap().of(1) - 1.0;
        assert!(
            off.abs() > 2e-4 || matches!(filter, Filter::Box { .. } | Filter::Tent { .. }),
            "{filter}: {off}"
        );
    }
}

#[test]
fn sums_do_not_depend_on_the_order_and_films_add_up() {
    for (seed, filter) in (0..).zip(WIDE) {
        let (splatter, stream) = (splatter(filter), &mut Stream::new(seed, 4, 0));
        let mut any = || {
            let at = [stream.random_range(-5.0..20.0_f32), stream.random_range(-5.0..20.0)];
            let radiance = [0; 3].map(|_| stream.random_range(-60.0..30.0_f32).exp2());
            (stream.random_range(0..PIXELS) as usize, contribution(at, radiance))
        };
        let all: Vec<_> = (0..500).map(|_| any()).collect();
        let of = |all: &mut dyn Iterator<Item = &(usize, Contribution)>| {
            let mut film = film(&splatter);
            all.for_each(|(pixel, contribution)| film.contribute(&splatter, *pixel, contribution).unwrap());
            film
        };
        let (whole, [rejected, outside]) = (of(&mut all.iter()), of(&mut all.iter()).lost_contributions());
        assert!(of(&mut all.iter().rev()) == whole && rejected == 0 && (1..400).contains(&outside));
        let mut sum = of(&mut all[..200].iter());
        let rest = of(&mut all[200..].iter());
        sum.light.iter_mut().zip(&rest.light).for_each(|(sum, rest)| sum.merge(rest));
        assert!(sum == whole);
        // Negative controls: one contribution fewer, and a slightly different position.
        assert!(of(&mut all[1..].iter()) != whole);
        let mut bright = all.clone();
        let is_inside =
            |(_, c): &(usize, Contribution)| (1.0..10.0).contains(&c.x) && (1.0..10.0).contains(&c.y);
        let inside = all.iter().position(is_inside).unwrap();
        bright[inside].1.radiance = [1e3; 3];
        let mut moved = bright.clone();
        moved[inside].1.x += 0.01;
        let differ = of(&mut moved.iter()) != of(&mut bright.iter());
        assert!(differ || matches!(filter, Filter::Box { .. }), "{filter}");
    }
}

#[test]
fn rejected_contributions_and_those_that_reach_no_pixel_are_counted() {
    let splatter = splatter(Filter::Tent { radius: 1.0 });
    let mut film = film(&splatter);
    let mut add = |at, radiance| film.contribute(&splatter, 7, &contribution(at, radiance));
    let fine = [1.0; 3];
    assert_eq!(add([3.0, 3.0], [1.0, f32::NAN, -1.0]), Err(Reject::NotANumber));
    assert_eq!(add([3.0, 3.0], [f32::INFINITY, 0.0, 0.0]), Err(Reject::TooBright));
    assert_eq!(add([3.0, 3.0], [2.0 * MAX_RADIANCE, 0.0, 0.0]), Err(Reject::TooBright));
    assert_eq!(add([3.0, 3.0], [-1e-30, 0.0, 0.0]), Err(Reject::Negative));
    assert_eq!(add([f32::NAN, 3.0], fine), Err(Reject::Nowhere));
    for beyond in [-0.6, 15.6, 1e9, -1e9, 1e38, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(add([beyond, 3.0], fine), Ok(()));
        assert_eq!(add([3.0, beyond], fine), Ok(()));
    }
    // Outside the film, but within the filter radius of a pixel.
    assert_eq!(add([-0.4, 14.4], fine), Ok(()));
    assert_eq!((film.lost_contributions(), film.rejected()), ([5, 14], 5));
    assert_eq!((film.light[7].rejected, film.light[7].outside), (5, 14));
    let lit = film.light.iter().filter(|pixel| pixel.rgb != [0; 3]).count();
    assert_eq!(lit, 1);
}

#[test]
fn the_faintest_and_the_brightest_contributions_neither_vanish_nor_overflow() {
    for radiance in [(-36.0_f32).exp2(), MAX_RADIANCE] {
        let splatter = splatter(Filter::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 });
        let mut film = film(&splatter);
        let each = flat(&mut film, &splatter, [radiance; 3]);
        let seen = film.picture().rgb[100][0];
        assert!((seen / (radiance * each as f32) - 1.0).abs() < 0.01, "{seen} of {radiance:e}");
        // 256 a pixel here; a film gets 2³² samples a pixel, of a thousand contributions each.
        let most = film.light.iter().map(|pixel| pixel.rgb[0].unsigned_abs()).max().unwrap();
        assert!(most.leading_zeros() > 1 + 32 + 10 - 8, "{most:x}");
    }
}
