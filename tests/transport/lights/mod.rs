//! Lights: sampled directions follow their densities, and the choice among lights omits none.
//!
//! Directions are tested at the significance level stated in `common::chi_square`.

mod seen;

use crate::common::chi_square::{Polar, compare, compare_some, draw, narrow, pearson, wide};
use crate::common::scenes::{cylinder, disk, entity, flipped, mesh, quad, sphere, v};
use crate::common::shapes::{bounded_samples, placed};
use crate::common::statistics::sidak;
use glam::{DAffine3, DQuat, DVec3};
use rand::RngExt;
use seen::{CENTRE, Seen, all, ball, plate, sheet, textured, tube};
use stride::light::{AreaLight, DirectionalLightParameters, LightParameters, LightTable, PointLight};
use stride::math::lanes::scalar::Wrapping;
use stride::math::{Ray, Vec3};
use stride::sampling::Stream;
use stride::scene::{Entity, Mesh, Shape};
use stride::shape::{Cylinder, Disk, Quad, Sphere};
use stride::world::Uv;

#[test]
fn a_light_does_not_shadow_itself_at_any_distance() {
    let stream = &mut Stream::new(46, 0, 0);
    let triangle = |wide: f64, stream: &mut Stream| {
        let (u, w) = (direction(stream), direction(stream));
        let corners = [CENTRE, CENTRE + u, CENTRE + u.cross(w).normalize() * wide + u * 0.3];
        let positions = corners.map(|p| p.to_array().map(|x| x as f32)).to_vec();
        mesh(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }, 0)
    };
    type Make<'a> = &'a dyn Fn(&mut Stream) -> Entity;
    // Samples of all kinds whose light is chosen as one. Meshes, and boxes, are several.
    let samples = bounded_samples(DVec3::ZERO, 1.0).into_iter().filter(|(_, shape)| {
        let scene = Seen::new(entity(shape.clone(), 0), CENTRE);
        shape.pieces().len() == 1 && scene.tables.lights.len() == 1
    });
    let samples: Vec<_> = samples.collect();
    assert!(samples.len() >= 4, "{samples:?}");
    let turned = |shape: &Shape, stream: &mut Stream| {
        let turn = DQuat::from_axis_angle(direction(stream), stream.random_range(0.0..6.0));
        entity(placed(shape, &DAffine3::from_rotation_translation(turn, CENTRE)).0.swap_remove(0), 0)
    };
    let turned: Vec<_> = samples
        .iter()
        .map(|(name, shape)| (*name, move |stream: &mut Stream| turned(shape, stream)))
        .collect();
    let special: [(&str, Make<'_>); 3] = [
        ("rectangle", &|stream| {
            let u = direction(stream);
            quad(CENTRE, u, u.any_orthonormal_vector() * 0.7, 0)
        }),
        ("triangle", &|stream| triangle(0.8, stream)),
        ("needle", &|stream| triangle(1e-3, stream)),
    ];
    let turned = turned.iter().map(|(name, make)| (*name, make as Make<'_>));
    for (name, make) in turned.chain(special) {
        // The fraction of light that would be lost to self-shadowing, and the fraction with shadow rays of the greatest
        // possible length.
        for distance in [3.0, 30.0, 1e3, 1e5] {
            let (mut all, mut lost, mut lost_beyond) = (0.0, 0.0, 0.0);
            for _ in 0..300 {
                let light = make(stream);
                for _ in 0..20 {
                    let seen = Seen::new(light.clone(), CENTRE + direction(stream) * distance);
                    for i in 0..10 {
                        let sample = seen.sample(draw(47, i));
                        if sample.pdf <= 0.0 {
                            continue;
                        }
                        let given = f64::from(sample.weight().r);
                        let (shadow, length) = sample.shadow_ray(narrow(seen.p));
                        all += given;
                        let is_hidden = |length| seen.world.occluded(&shadow, length, true, false);
                        lost += if is_hidden(length) { given } else { 0.0 };
                        lost_beyond += if is_hidden(length * 1.00001) { given } else { 0.0 };
                    }
                }
            }
            println!("{name}, {distance}: {:.5} lost, {:.5} beyond", lost / all, lost_beyond / all);
            assert!(lost <= 5e-4 * all, "{name} at {distance}: {} of {all} is lost", lost);
            // Negative control: rays that end beyond the light's surface.
            assert!(distance != 1e3 || lost_beyond > 0.01 * all, "{name}: {lost_beyond} of {all}");
        }
    }
}

#[test]
fn directions_to_a_light_follow_the_density_of_hits() {
    let all = all();
    for (i, (name, (seen, polar))) in all.iter().enumerate() {
        let outcome = seen.compare(*polar, 100 + 2 * i as u32);
        assert!(outcome.agrees(all.len()), "{name}: {outcome:?}");
    }
}

/// Those of textured lights. Samples on surfaces that face away are lost. Surfaces that are sampled by area have an
/// unbounded density at their outlines, where its integral over a bin would be noise: densities above a limit are left
/// out on both sides.
#[test]
fn directions_to_a_textured_light_follow_the_density_of_hits() {
    const MOST: f32 = 300.0;
    let all = textured();
    for (i, (name, (seen, polar))) in all.iter().enumerate() {
        let sample = |u: [f32; 4]| {
            let sample = seen.sample(u);
            (sample.pdf > 0.0 && sample.pdf < MOST).then_some(sample.wi)
        };
        let pdf = |d| Some(seen.pdf(d)).filter(|&pdf| pdf < MOST).unwrap_or(0.0);
        let seed = 600 + 2 * i as u32;
        let outcome = compare_some(*polar, seed, sample, pdf);
        assert!(outcome.agrees(all.len()), "{name}: {outcome:?}");
        // Negative control: a density 5% too high.
        let outcome = compare_some(*polar, seed, sample, |d| pdf(d) * 1.05);
        assert!(!outcome.agrees(1_000_000), "{name}: {outcome:?}");
    }
}

#[test]
fn a_sample_of_a_textured_light_has_the_density_and_the_radiance_of_a_hit() {
    for (name, (seen, _)) in textured() {
        let (mut off, mut wrong, mut used, mut hidden) = (0, 0, 0, 0);
        for i in 0..20_000 {
            let sample = seen.sample(draw(31, i));
            if sample.pdf <= 0.0 {
                continue;
            }
            used += 1;
            let ray = Ray::new(narrow(seen.p), sample.wi);
            let hit = seen.world.intersect(&ray, true);
            if !hit.is_some() {
                off += 1;
                continue;
            }
            off += u32::from((sample.pdf / seen.pdf(sample.wi) - 1.0).abs() > 0.02);
            let at = seen.tables.interaction(&ray, &hit, true, Uv::IfTextured);
            let emitted = seen.tables.emitted(&at);
            let far = |a: f32, b: f32| (a - b).abs() > 0.01;
            wrong += u32::from(far(emitted.r, sample.radiance.r) || far(emitted.b, sample.radiance.b));
            let (shadow, length) = sample.shadow_ray(narrow(seen.p));
            hidden += u32::from(seen.world.occluded(&shadow, length, true, false));
        }
        // Between cells, a rounded point may be in the other one, and at an outline it may miss.
        assert!(used > 1000, "{name}: {used}");
        assert!(off <= used / 100, "{name}: {off} of {used} samples have another density");
        assert!(wrong <= used / 200, "{name}: {wrong} of {used} samples have another radiance");
        assert!(hidden <= used / 200, "{name}: {hidden} of {used} samples are hidden by their light");
    }
}

/// For a disk at infinity, the density is that of rays that leave the scene.
#[test]
fn directions_to_a_sun_follow_the_density_of_escaping_rays() {
    let towards = v(0.48, 0.6, 0.64);
    let diameters = [0.0101, 0.53, 20.0, 180.0];
    for (i, angular_diameter) in diameters.into_iter().enumerate() {
        let mut table = LightTable::default();
        let irradiance = [1.0; 3];
        DirectionalLightParameters { direction: -towards, irradiance, angular_diameter }.add_to(&mut table);
        table.build_tree();
        let pdf = |d: Vec3<f32>, scale: f32| {
            let found = std::cell::Cell::new(0.0);
            table.escaped(d, |pdf| {
                found.set(pdf * scale);
                1.0
            });
            found.get()
        };
        let sample = |u: [f32; 4]| table.sample(Wrapping(0), Vec3::zero(), [u[0], u[1]]).wi;
        let polar = Polar::new(towards, DVec3::X);
        let outcome = compare(polar, 400 + 2 * i as u32, sample, |d| pdf(d, 1.0));
        assert!(outcome.agrees(diameters.len()), "{angular_diameter}: {outcome:?}");
        // Negative control: a density 2% too high.
        let outcome = compare(polar, 400 + 2 * i as u32, sample, |d| pdf(d, 1.02));
        assert!(!outcome.agrees(1_000_000), "{angular_diameter}: {outcome:?}");
    }
}

#[test]
fn a_sample_has_the_density_of_a_hit() {
    for (name, (seen, _)) in all() {
        let (mut off, draws) = (0, 20_000);
        for i in 0..draws {
            let sample = seen.sample(draw(31, i));
            // Textured quads emit in every colour, but not in a single one.
            let shines =
                if name.starts_with("a screen") { sample.radiance.r > 0.0 } else { sample.radiance.r == 1.0 };
            assert!(sample.pdf > 0.0 && shines, "{name}: {sample:?} hits nothing");
            let pdf = seen.pdf(sample.wi);
            off += u32::from((sample.pdf / pdf - 1.0).abs() > 0.01);
        }
        // At an outline a rounded ray misses, or hits it at a cosine with few digits. That is an error of the sample's
        // own size, in few of them.
        assert!(off <= draws / 200, "{name}: {off} of {draws} samples have another density");
    }
}

#[test]
fn no_sample_is_on_a_side_that_does_not_emit() {
    let turned = Seen::new(flipped(quad(CENTRE, DVec3::X, DVec3::Y, 0)), CENTRE + DVec3::Z);
    let hollow = Seen::new(flipped(sphere(CENTRE, 1.0, 0)), CENTRE + DVec3::Z * 3.0);
    let inside = Seen::new(sphere(CENTRE, 1.0, 0), CENTRE + DVec3::Z * 0.5);
    let plate = Seen::new(flipped(disk(CENTRE, DVec3::Z, 1.0, 0)), CENTRE + DVec3::Z);
    let tube = || cylinder(CENTRE - DVec3::Z, CENTRE + DVec3::Z, 1.0, 0);
    let above = Seen::new(tube(), CENTRE + v(0.5, 0.2, 3.0));
    let within = Seen::new(tube(), CENTRE + v(0.5, 0.2, 0.0));
    for seen in [turned, hollow, inside, plate, above, within] {
        for i in 0..1000 {
            let sample = seen.sample(draw(32, i));
            assert_eq!((sample.weight().lane(0), sample.pdf), ([0.0; 3], 0.0));
        }
    }
}

#[test]
fn wrong_cones_and_wrong_densities_are_detected() {
    let (seen, polar) = ball(3.0);
    // The cone to a sphere that is larger by a hundredth.
    let wrong = Seen::new(sphere(CENTRE, 1.01, 0), seen.p);
    let outcome = compare(polar, 200, |u| wrong.sample(u).wi, |d| seen.pdf(d));
    assert!(!outcome.agrees(1_000_000), "{outcome:?}");
    // A cone whose axis is off by a hundredth of its width.
    let wrong = Seen::new(sphere(CENTRE + DVec3::X * 0.02, 1.0, 0), seen.p);
    let outcome = compare(polar, 201, |u| wrong.sample(u).wi, |d| seen.pdf(d));
    assert!(!outcome.agrees(1_000_000), "{outcome:?}");
    // A cylinder longer by a hundredth.
    let (seen, polar) = tube(v(1.0, 2.0, 0.3));
    let n = v(0.6, -0.8, 0.0);
    let wrong = Seen::new(cylinder(CENTRE - n * 1.01, CENTRE + n * 1.01, 0.5, 0), seen.p);
    let outcome = compare(polar, 205, |u| wrong.sample(u).wi, |d| seen.pdf(d));
    assert!(!outcome.agrees(1_000_000), "{outcome:?}");
    for (name, (seen, polar)) in [
        ("sphere", ball(3.0)),
        ("quad", sheet(v(-3.0, 2.0, 1.0))),
        ("disk", plate(v(-3.0, 2.0, 1.0))),
        ("cylinder", tube(v(1.0, 2.0, 0.3))),
        ("cylinder from inside", tube(v(0.2, 0.1, 0.3))),
    ] {
        // A density 2% too high.
        let outcome = compare(polar, 202, |u| seen.sample(u).wi, |d| seen.pdf(d) * 1.02);
        assert!(!outcome.agrees(1_000_000), "{name}: {outcome:?}");
        // A density that is 2% too high at one end and too low by as much at the other.
        let middle = wide(seen.sample([0.5; 4]).wi);
        let tilted = |d: Vec3<f32>| {
            let across = middle.any_orthogonal_vector();
            seen.pdf(d) * (1.0 + 0.02_f32.copysign(wide(d).dot(across) as f32))
        };
        let outcome = compare(polar, 203, |u| seen.sample(u).wi, tilted);
        assert!(!outcome.agrees(1_000_000), "{name}: {outcome:?}");
    }
    // The density of a quad without the cosine at the light.
    let (seen, polar) = sheet(v(-3.0, 2.0, 1.0));
    let n = v(0.6, -0.8, 0.0);
    let without = |d: Vec3<f32>| seen.pdf(d) * (wide(d).dot(n).abs() / 0.25) as f32;
    let outcome = compare(polar, 204, |u| seen.sample(u).wi, without);
    assert!(!outcome.agrees(1_000_000), "{outcome:?}");
}

fn direction(stream: &mut Stream) -> DVec3 {
    let z = stream.random_range(-1.0..1.0_f64);
    let phi = stream.random_range(0.0..std::f64::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    v(r * phi.cos(), r * phi.sin(), z)
}

/// A fan of triangles of different areas around a point.
fn dome(place: DVec3, size: f64, height: f64, triangles: usize) -> Vec<[[f32; 3]; 3]> {
    let rim = |i: usize| {
        let phi = (i as f64 / triangles as f64).powi(2) * std::f64::consts::TAU;
        place + v(phi.cos(), phi.sin(), -height) * size
    };
    let corner = |p: DVec3| p.to_array().map(|x| x as f32);
    (0..triangles).map(|i| [corner(place), corner(rim(i)), corner(rim(i + 1))]).collect()
}

/// Lights of every kind, most of them small, of very different powers, in a cube of side 20.
fn medley(count: u32, stream: &mut Stream) -> LightTable {
    let mut table = LightTable::default();
    while table.len() < count as usize {
        let place = direction(stream) * stream.random_range(0.0..10.0);
        let size = 10_f64.powf(stream.random_range(-2.0..0.5));
        let strength = [10_f32.powf(stream.random_range(-1.0..1.0)); 3];
        let flipped = stream.random_bool(0.3);
        match stream.random_range(0..6) {
            0 => table.push(PointLight { position: place.to_array().map(|x| x as f32), intensity: strength }),
            1 => table.push(AreaLight { shape: Sphere::new(place, size), flipped, emission: strength }),
            2 => {
                let (a, b) = (direction(stream) * size, direction(stream) * size * 0.5);
                table.push(AreaLight { shape: Quad::new(place, a, b), flipped, emission: strength })
            }
            3 => {
                let disk = Disk::new(place, direction(stream), size);
                table.push(AreaLight { shape: disk, flipped, emission: strength })
            }
            4 => {
                let cylinder = Cylinder::new(place, place + direction(stream) * size * 3.0, size);
                table.push(AreaLight { shape: cylinder, flipped, emission: strength })
            }
            // From a distance they are one light, chosen by power: flatter and rounder domes, of a few triangles or of
            // many.
            _ => {
                let most = count as usize - table.len();
                let triangles = dome(place, size, stream.random_range(0.0..1.0), most.min(40));
                table.push_mesh(triangles.into_iter(), flipped, strength)
            }
        };
    }
    table.build_tree();
    table
}

/// Receivers anywhere, some of them on or next to a light's own position.
fn receiver(stream: &mut Stream) -> (Vec3<f32>, Vec3<f32>) {
    let reach = 10_f64.powf(stream.random_range(-1.0..1.5));
    (narrow(direction(stream) * reach), narrow(direction(stream)).normalized())
}

/// The contribution of a light to a matte receiver that scatters on both sides, up to its reflectance: the irradiance
/// from either side, by stratified samples.
fn contribution(table: &LightTable, light: u32, p: Vec3<f32>, n: Vec3<f32>, strata: u32) -> f64 {
    let mut sum = 0.0;
    for i in 0..strata * strata {
        let u = [(i / strata) as f32 + 0.5, (i % strata) as f32 + 0.5].map(|x| x / strata as f32);
        let sample = table.sample(Wrapping(light), p, u);
        sum += f64::from(sample.weight().r * sample.wi.dot(n).abs());
    }
    sum / f64::from(strata * strata)
}

#[test]
fn the_pmf_sums_to_one_and_includes_every_light_that_contributes() {
    let stream = &mut Stream::new(41, 0, 0);
    let (mut receivers, mut without) = (0, 0);
    for count in [1, 2, 3, 10, 100, 1000] {
        let table = medley(count, stream);
        for _ in 0..20_000 / count.max(100) {
            let (p, n) = receiver(stream);
            let mut sum = 0.0;
            for light in 0..count {
                let pmf = table.pmf(p, n, Wrapping(light), true);
                sum += f64::from(pmf);
                if pmf > 0.0 {
                    continue;
                }
                without += 1;
                let missed = contribution(&table, light, p, n, 8);
                assert!(
                    missed == 0.0,
                    "light {light} of {count} has a pmf of zero but contributes {missed} to {p:?}"
                );
            }
            receivers += 1;
            assert!((sum - 1.0).abs() < 1e-4, "{count} lights: the sum of the pmf is {sum}");
        }
    }
    // The test is not trivial: many lights have a pmf of zero, correctly.
    assert!(receivers > 700 && without > 1000, "{receivers} receivers, {without} lights with a pmf of zero");
}

#[test]
fn frequencies_of_lights_follow_the_pmf() {
    const DRAWS: u32 = 100_000;
    // Over all comparisons together.
    const LEVEL: f64 = 0.01;
    let stream = &mut Stream::new(42, 0, 0);
    let counts = [2, 7, 60, 400];
    let receivers = 8;
    let level = sidak(LEVEL, counts.len() * receivers);
    let mut controls = 0;
    for count in counts {
        let table = medley(count, stream);
        for receiver_index in 0..receivers {
            let (p, n) = receiver(stream);
            let pmfs: Vec<f64> =
                (0..count).map(|light| f64::from(table.pmf(p, n, Wrapping(light), true))).collect();
            let mut seen = vec![0.0; count as usize];
            for i in 0..DRAWS {
                let [u, ..] = draw(43 + receiver_index as u32, i);
                let (light, pmf) = table.choose(p, n, u, true);
                let expected = pmfs[light.0 as usize];
                assert!((f64::from(pmf) / expected - 1.0).abs() < 1e-4, "{pmf}, not {expected}");
                seen[light.0 as usize] += 1.0;
            }
            let p_value = frequencies(&seen, &pmfs, f64::from(DRAWS));
            assert!(p_value > level, "{count} lights: the choice follows the pmf with p = {p_value:e}");
            // Negative control: the most likely light is chosen too seldom by a twentieth. Only if its probability is
            // neither small nor near one, and the others are few enough for the difference to be significant.
            let most = (0..pmfs.len()).max_by(|&a, &b| pmfs[a].total_cmp(&pmfs[b])).unwrap();
            if count < 100 && (0.1..0.9).contains(&pmfs[most]) {
                let rest = (1.0 - 0.95 * pmfs[most]) / (1.0 - pmfs[most]);
                let wrong: Vec<f64> = (0..pmfs.len())
                    .map(|light| pmfs[light] * if light == most { 0.95 } else { rest })
                    .collect();
                assert!(
                    frequencies(&seen, &wrong, f64::from(DRAWS)) < level,
                    "{count} lights: an error of 5% is not detected"
                );
                controls += 1;
            }
        }
    }
    assert!(controls >= 5, "only {controls} controls");
}

/// The p-value of counts against probabilities.
fn frequencies(seen: &[f64], pmfs: &[f64], draws: f64) -> f64 {
    let expected: Vec<f64> = pmfs.iter().map(|pmf| pmf * draws).collect();
    let outcome = pearson(seen, &expected);
    // If one light has probability one, there is nothing to compare.
    if outcome.degrees == 0 { 1.0 } else { outcome.p }
}

/// The variance of the estimate by one light, relative to the squared expectation: Σ c²/pmf − (Σ c)².
fn relative_variance(contributions: &[f64], pmf: impl Fn(usize) -> f64) -> f64 {
    let sum: f64 = contributions.iter().sum();
    let lit = contributions.iter().enumerate().filter(|(_, c)| **c > 0.0);
    let second: f64 = lit.map(|(light, c)| c * c / pmf(light)).sum();
    (second - sum * sum) / (sum * sum)
}

#[test]
fn with_two_hundred_lights_the_tree_has_a_small_fraction_of_the_variance_of_uniform_choice() {
    // Small lights slightly above a floor, most of which are distant.
    let stream = &mut Stream::new(44, 0, 0);
    const LIGHTS: u32 = 200;
    let mut table = LightTable::default();
    for _ in 0..LIGHTS {
        let place = v(
            stream.random_range(-10.0..10.0),
            stream.random_range(-10.0..10.0),
            stream.random_range(0.5..2.0),
        );
        let strength = [stream.random_range(0.5..2.0_f32); 3];
        table.push(AreaLight { shape: Sphere::new(place, 0.05), flipped: false, emission: strength });
    }
    table.build_tree();
    let (mut tree, mut uniform) = (0.0, 0.0);
    for _ in 0..200 {
        let p = v(stream.random_range(-10.0..10.0), stream.random_range(-10.0..10.0), 0.0);
        let (p, n) = (narrow(p), narrow(DVec3::Z));
        let contributions: Vec<f64> = (0..LIGHTS).map(|light| contribution(&table, light, p, n, 2)).collect();
        tree += relative_variance(&contributions, |light| {
            f64::from(table.pmf(p, n, Wrapping(light as u32), true))
        });
        uniform += relative_variance(&contributions, |_| 1.0 / f64::from(LIGHTS));
    }
    println!(
        "relative variance, mean over the floor: tree {:.3}, uniform {:.3}",
        tree / 200.0,
        uniform / 200.0
    );
    assert!(tree < uniform / 5.0, "tree {tree}, uniform {uniform}");
}
