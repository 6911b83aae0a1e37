//! Lights that are not surfaces, by their parameters: spots, suns and power.

use super::*;
use crate::light::{
    DirectionalLightParameters, Falloff, LightParameters, PointLightParameters, Ramp, SpotLight,
    SpotLightParameters,
};
use crate::sampling::warp;

pub(super) fn spot(cone: f64, penumbra: f64, falloff: Falloff) -> SpotLight {
    let [outer, inner] = [cone, cone - penumbra].map(f64::to_radians);
    let ramp = Ramp { outer, inner, falloff };
    SpotLight { position: [1.0, 2.0, -3.0], axis: [0.0, 0.6, 0.8], intensity: [5.0; 3], ramp }
}

pub(super) const FALLOFFS: [Falloff; 3] = [Falloff::Smoothstep, Falloff::Angle, Falloff::Squared];

/// From every side, the irradiance of a spot is its intensity by the formula of its falloff, over the distance squared.
#[test]
fn the_irradiance_of_a_spot_follows_its_falloff() {
    let stream = &mut Stream::new(51, 0, 0);
    for falloff in FALLOFFS {
        for (cone, penumbra) in [(30.0, 5.0), (60.0, 60.0), (10.0, 0.0), (150.0, 120.0), (180.0, 10.0)] {
            let light = spot(cone, penumbra, falloff);
            let mut table = LightTable::default();
            table.push(light);
            let mut lit = 0;
            for _ in 0..20_000 {
                let d = DVec3::from(
                    warp::uniform_sphere([stream.random::<f32>(), stream.random()]).lane(0).map(f64::from),
                );
                let distance = stream.random_range(0.1..10.0);
                let p = DVec3::from(light.position.map(f64::from)) + d * distance;
                let sample =
                    table.sample_one(Wrapping(0), Vec3::splat(p.to_array().map(|x| x as f32)), [0.0; 2]);
                let angle = libm::acos(d.dot(DVec3::new(0.0, 0.6, 0.8)).clamp(-1.0, 1.0)).to_degrees();
                let share = |angle: f64| {
                    let fall = |x: fn(f64) -> f64| {
                        let [x, outer, inner] = [angle, cone, cone - penumbra].map(|a| x(a.to_radians()));
                        ((x - outer) / (inner - outer)).clamp(0.0, 1.0)
                    };
                    match falloff {
                        _ if angle >= cone => 0.0,
                        _ if angle <= cone - penumbra => 1.0,
                        Falloff::Smoothstep => fall(libm::cos).powi(2) * (3.0 - 2.0 * fall(libm::cos)),
                        Falloff::Angle => fall(|angle| angle),
                        Falloff::Squared => fall(libm::cos).powi(2),
                    }
                };
                // At a sharp edge either side is correct.
                if penumbra == 0.0 && (angle - cone).abs() < 1e-3 {
                    continue;
                }
                let expected = 5.0 * share(angle) / (distance * distance);
                let got = f64::from(sample.weight().r);
                let room = 5.0 / (distance * distance) * 2e-4;
                assert!((got - expected).abs() < room, "{falloff:?}, {cone}, {angle}: {got}, not {expected}");
                lit += u32::from(got > 0.0);
            }
            // The choice includes all illuminated points.
            assert!(lit > 100, "{lit} points are illuminated");
        }
    }
}

/// In single precision the cosines of narrow cones are all one.
#[test]
fn a_narrow_spot_emits_its_power() {
    let stream = &mut Stream::new(55, 0, 0);
    for falloff in FALLOFFS {
        for cone in [0.01, 0.1, 1.0] {
            for penumbra in [0.0, cone / 2.0, cone] {
                let light = spot(cone, penumbra, falloff);
                let mut table = LightTable::default();
                table.push(light);
                let (mut flux, draws) = (0.0, 100_000);
                for _ in 0..draws {
                    let u = [stream.random(), stream.random(), stream.random(), stream.random()];
                    flux += f64::from(table.emit_one(Wrapping(0), u).flux().r);
                }
                let ratio = flux / f64::from(draws) / light.power();
                assert!((ratio - 1.0).abs() < 1e-2, "{falloff:?}, {cone}, {penumbra}: {ratio} of the power");
            }
        }
    }
}

/// All points in the cone of a spot can choose it, whatever other lights there are.
#[test]
fn spots_are_chosen_from_all_points_that_they_illuminate() {
    let stream = &mut Stream::new(52, 0, 0);
    for falloff in FALLOFFS {
        for (cone, penumbra) in [(30.0, 5.0), (60.0, 60.0), (3.0, 0.0), (150.0, 120.0), (180.0, 10.0)] {
            let mut table = LightTable::default();
            table.push(spot(cone, penumbra, falloff));
            for x in 0..7_u8 {
                table.push(PointLight { position: [f32::from(x), 0.0, 1.0], intensity: [1.0; 3] });
            }
            table.build_tree();
            let (mut lit, mut dark) = (0, 0);
            for _ in 0..20_000 {
                let [d, n] =
                    [(); 2].map(|()| warp::uniform_sphere([stream.random::<f32>(), stream.random()]));
                let p = Vec3::splat([1.0, 2.0, -3.0]) + d * stream.random_range(0.1..10.0_f32);
                let gives = table.sample_one(Wrapping(0), p, [0.0; 2]).weight().r > 0.0;
                let pmf = table.pmf_one(p, n, Wrapping(0));
                assert!(pmf > 0.0 || !gives, "{falloff:?}, {cone}, {penumbra}: {p:?}");
                lit += u32::from(gives);
                dark += u32::from(pmf == 0.0);
            }
            assert!(
                lit > 2 && (dark > 1000 || cone > 100.0),
                "{cone}: {lit} illuminated, {dark} with a pmf of zero"
            );
        }
    }
}

/// A disk at infinity gives the requested irradiance, has a density that integrates to one, and is visible to rays
/// where it is sampled.
#[test]
fn a_distant_disk_gives_its_irradiance() {
    for diameter in [0.01, 0.53, 20.0, 120.0, 180.0] {
        let parameters = DirectionalLightParameters {
            direction: DVec3::new(0.0, 0.0, -2.0),
            irradiance: [3.0; 3],
            angular_diameter: diameter,
        };
        let mut table = LightTable::default();
        parameters.add_to(&mut table);
        table.build_tree();
        assert_eq!(table.kinds().collect::<Vec<_>>(), [LightKind::DistantDisk]);
        let got = irradiance(&table, 300);
        assert!((got / 3.0 - 1.0).abs() < 2e-4, "{diameter}: {got} is not 3");
        let stream = &mut Stream::new(53, 0, 0);
        let mut missed = 0;
        for _ in 0..10_000 {
            let u = [stream.random::<f32>(), stream.random()];
            let sample = table.sample_one(Wrapping(0), Vec3::zero(), u);
            let pdf = std::cell::Cell::new(0.0);
            let seen = table.escaped(sample.wi, |given| {
                pdf.set(given);
                1.0
            });
            // At the rim a rounded direction may miss the disk.
            missed += u32::from(seen.r == 0.0);
            assert!(seen.r == 0.0 || (seen.r, pdf.get()) == (sample.radiance.r, sample.pdf));
        }
        assert!(missed < 20, "{diameter}: {missed} are missed");
        // At twice the angle of the rim there is no light.
        let beyond = (diameter.to_radians()).min(3.0);
        let d = Vec3::splat([libm::sin(beyond) as f32, 0.0, libm::cos(beyond) as f32]);
        assert_eq!(table.escaped(d, |_| 1.0), Rgb::black());
    }
    // Too small to be a disk.
    let direction = DVec3::new(0.0, 0.6, -0.8);
    let mut table = LightTable::default();
    DirectionalLightParameters { direction, irradiance: [3.0; 3], angular_diameter: 0.009 }
        .add_to(&mut table);
    assert_eq!(table.delta_lights(), [0]);
    let sample = table.sample_one(Wrapping(0), Vec3::<f32>::zero(), [0.0; 2]);
    assert_eq!((sample.wi.lane(0), sample.weight().r), ([0.0, -0.6, 0.8], 3.0));
}

/// Power and intensity correspond by the solid angle of emission.
#[test]
fn power_is_the_emitted_flux() {
    let stream = &mut Stream::new(54, 0, 0);
    let position = DVec3::new(1.0, 2.0, 3.0);
    let mut power_of = |add: &dyn Fn(&mut LightTable) -> u32| {
        let mut table = LightTable::default();
        add(&mut table);
        let (mut flux, draws) = (0.0, 200_000);
        for _ in 0..draws {
            let u = [stream.random(), stream.random(), stream.random(), stream.random()];
            flux += f64::from(table.emit_one(Wrapping(0), u).flux().r);
        }
        flux / f64::from(draws)
    };
    let point = PointLightParameters { position, intensity: None, power: Some([7.0; 3]) };
    assert!((power_of(&|table| point.add_to(table)) / 7.0 - 1.0).abs() < 1e-5);
    for falloff in FALLOFFS {
        for (cone_angle, penumbra_angle) in [(30.0, 5.0), (60.0, 60.0), (10.0, 0.0), (180.0, 90.0)] {
            let spot = SpotLightParameters {
                position,
                direction: DVec3::new(0.0, 3.0, 4.0),
                intensity: None,
                power: Some([7.0; 3]),
                cone_angle,
                penumbra_angle: Some(penumbra_angle),
                falloff,
            };
            let power = power_of(&|table| spot.add_to(table));
            assert!((power / 7.0 - 1.0).abs() < 1e-2, "{cone_angle}, {penumbra_angle}, {falloff:?}: {power}");
        }
    }
}
