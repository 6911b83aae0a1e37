//! Light samples against irradiance by formula; densities against hits.

mod declared;

use super::*;
use crate::light::test_sky::Sky;
use crate::light::{Distant, DistantDisk, Falloff, PointLight, SpotLight};
use crate::math::Ray;
use crate::math::lanes::scalar::Wrapping;
use crate::sampling::Stream;
use crate::sampling::warp;
use crate::shape::{Cylinder, Disk, Quad, Shape, ShearedRays, Sphere};
use declared::{FALLOFFS, spot};
use glam::DVec3;
use rand::RngExt;

fn table<S>(shape: S, flipped: bool, emission: f32) -> LightTable
where
    AreaLight<S>: ListedLight,
{
    let mut table = LightTable::default();
    table.push(AreaLight { shape, flipped, emission: [emission; 3] });
    table.build_tree();
    table
}

/// The mean of `n²` stratified samples of the irradiance on a surface at the origin facing +z.
fn irradiance(table: &LightTable, n: u32) -> f64 {
    let mut sum = 0.0;
    for i in 0..n * n {
        let u = [(i / n) as f32 + 0.5, (i % n) as f32 + 0.5].map(|x| x / n as f32);
        let sample = table.sample_one(Wrapping(0), Vec3::<f32>::zero(), u);
        sum += f64::from(sample.weight().r * sample.wi.z.max(0.0));
    }
    sum / f64::from(n * n)
}

#[test]
fn a_sphere_gives_the_irradiance_of_its_cone() {
    // E = π·L·sin²θ for a sphere at the zenith, with sin θ = r/distance.
    for (distance, radius) in [(4.0, 1.0), (1000.0, 1.0), (1.001, 1.0)] {
        let sphere = Sphere::new(DVec3::Z * distance, radius);
        let expected = std::f64::consts::PI * 2.0 * (radius / distance).powi(2);
        let got = irradiance(&table(sphere, false, 2.0), 200);
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
        // From outside, a sphere that emits inwards is black.
        assert_eq!(irradiance(&table(sphere, true, 2.0), 20), 0.0);
    }
}

#[test]
fn a_surrounding_sphere_illuminates_like_a_sky() {
    // From inside, radiance is L in all directions: E = π·L at any position.
    for z in [0.0, 0.7, -0.5] {
        let sphere = Sphere::new(DVec3::Z * z, 1.0);
        let got = irradiance(&table(sphere, true, 1.0), 400);
        assert!((got / std::f64::consts::PI - 1.0).abs() < 3e-3, "{got} is not π");
        assert_eq!(irradiance(&table(sphere, false, 1.0), 20), 0.0);
    }
}

#[test]
fn a_quad_gives_the_irradiance_of_its_form_factor() {
    // The form factor of a unit square at a height of 1 above the point below its centre is 4 times that of a corner
    // patch of ½ × ½ (Howell, configuration C-13).
    let quad = Quad::new(DVec3::new(-0.5, -0.5, 1.0), DVec3::Y, DVec3::X);
    let s = 1.25_f64.sqrt();
    let expected = 4.0 * (0.5 / s * (0.5 / s).atan());
    let got = irradiance(&table(quad, false, 1.0), 200);
    assert!((got / expected - 1.0).abs() < 1e-4, "{got} is not {expected}");
    assert_eq!(irradiance(&table(quad, true, 1.0), 10), 0.0);
}

#[test]
fn a_disk_gives_the_irradiance_of_its_form_factor() {
    // A disk at the zenith covers a cone: E = π·L·r²/(r² + distance²).
    for (distance, radius) in [(1.0, 1.0), (0.5, 1.0), (50.0, 1.0)] {
        let disk = Disk::new(DVec3::Z * distance, DVec3::NEG_Z, radius);
        let expected = std::f64::consts::PI * radius * radius / (radius * radius + distance * distance);
        let got = irradiance(&table(disk, false, 1.0), 300);
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
        assert_eq!(irradiance(&table(disk, true, 1.0), 10), 0.0);
    }
}

#[test]
fn a_cylinder_gives_the_irradiance_of_its_solid_angle() {
    // A cylinder across the zenith covers a strip of directions (α, β) about its axis, with cos θ = cos α·cos β. It
    // reaches an angle β to either side, and its half width is the angle whose sine is s. From the height of its axis
    // it is a whole strip from end to end, whose ends depend on α only by the distance.
    let integral = |height: f64, radius: f64, half: f64| {
        let (n, widest) = (2000, (radius / height).asin());
        let sum: f64 = (0..n)
            .map(|i| {
                let alpha = widest * ((f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0);
                let chord = (radius * radius - (height * alpha.sin()).powi(2)).sqrt();
                let rise = (half / (height * alpha.cos() - chord)).atan();
                // ∫ cos β · cos β dβ from −rise to rise.
                alpha.cos() * (rise + 0.5 * (2.0 * rise).sin())
            })
            .sum();
        sum * 2.0 * widest / f64::from(n)
    };
    for (height, radius, half) in [(2.0, 1.0, 1.5), (1.05, 1.0, 20.0), (300.0, 1.0, 4.0), (2.0, 0.01, 0.01)] {
        let ends = [-half, half].map(|y| DVec3::new(0.0, y, height));
        let cylinder = Cylinder::new(ends[0], ends[1], radius);
        let expected = integral(height, radius, half);
        let got = irradiance(&table(cylinder, false, 1.0), 200);
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
    }
}

#[test]
fn a_long_surrounding_cylinder_illuminates_like_a_sky() {
    let tube = Cylinder::new(DVec3::new(0.2, -300.0, 0.1), DVec3::new(0.2, 300.0, 0.1), 1.0);
    let table = table(tube, true, 1.0);
    // By area most samples are distant, so that many are needed.
    let got = irradiance(&table, 2000);
    assert!((got / std::f64::consts::PI - 1.0).abs() < 1e-2, "{got} is not π");
}

#[test]
fn two_triangles_give_the_irradiance_of_their_square() {
    let (s, expected) = (1.25_f64.sqrt(), |s: f64| 4.0 * (0.5 / s * (0.5 / s).atan()));
    let corner = |x: f32, y: f32| [x - 0.5, y - 0.5, 1.0];
    let halves = [
        [corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 0.0)],
        [corner(1.0, 1.0), corner(1.0, 0.0), corner(0.0, 1.0)],
    ];
    let sum: f64 = halves.map(|half| irradiance(&table(Triangle(half), false, 1.0), 200)).iter().sum();
    assert!((sum / expected(s) - 1.0).abs() < 1e-4, "{sum} is not {}", expected(s));
    assert_eq!(irradiance(&table(Triangle(halves[0]), true, 1.0), 10), 0.0);
    // A triangle without area is never chosen and has no effect.
    let mut with_none = LightTable::default();
    with_none.push(AreaLight { shape: Triangle([[0.0, 0.0, 2.0]; 3]), flipped: false, emission: [1.0; 3] });
    with_none.push(AreaLight { shape: Triangle(halves[0]), flipped: false, emission: [1.0; 3] });
    with_none.build_tree();
    let up = Vec3::<f32>::splat([0.0, 0.0, 1.0]);
    for u in [0.0, 0.3, 0.999] {
        let (light, pmf) = with_none.choose_one(Vec3::zero(), up, u);
        assert_eq!((light.0, pmf), (1, 1.0));
    }
}

/// Compares the density by which a light is sampled with that of the ray that hits it. Checks the position of the hit
/// and the outward normal there.
fn densities_agree<S>(shape: S, flipped: bool, meet: impl Fn(&Ray<f32>) -> (f32, Vec3<f32>))
where
    AreaLight<S>: ListedLight,
{
    let table = table(shape, flipped, 1.0);
    for u in [[0.1, 0.2], [0.5, 0.5], [0.9, 0.8]] {
        let p = Vec3::<f32>::zero();
        let sample = table.sample_one(Wrapping(0), p, u);
        let (t, normal) = meet(&Ray::new(p, sample.wi));
        let normal = if flipped { -normal } else { normal };
        let on = p + sample.wi * t;
        let pdf = table.pdf_one(Wrapping(0), p, on, t, -sample.wi.dot(normal));
        assert!((pdf / sample.pdf - 1.0).abs() < 1e-4, "{pdf} is not {}", sample.pdf);
    }
}

#[test]
fn the_density_of_a_hit_is_that_of_the_sample() {
    let sphere = Sphere::new(DVec3::new(1.0, 2.0, 5.0), 1.5);
    let around = Sphere::new(DVec3::new(0.3, -0.2, 0.1), 3.0);
    for (sphere, flipped) in [(sphere, false), (around, true)] {
        densities_agree(sphere, flipped, |ray| {
            let t = sphere.intersect(ray);
            (t, (ray.at(t) - Vec3::splat(sphere.centre)).normalized())
        });
    }
    let quad = Quad::new(DVec3::new(-1.0, -1.0, 3.0), DVec3::Y, DVec3::X * 2.0);
    densities_agree(quad, false, |ray| (quad.intersect(ray), Vec3::splat(quad.normal)));
    let corners = [[-1.0, -1.0, 3.0], [-1.0, 2.0, 3.5], [1.5, -1.0, 2.5]];
    densities_agree(Triangle(corners), false, |ray| {
        let [a, b, c] = corners.map(Vec3::splat);
        (ShearedRays::new(ray).intersect([a, b, c], true).t, (b - a).cross(c - a).normalized())
    });
    let disk = Disk::new(DVec3::new(1.0, 0.5, 3.0), DVec3::new(0.0, -0.6, -0.8), 1.5);
    densities_agree(disk, false, |ray| (disk.intersect(ray), Vec3::splat(disk.normal)));
    let [from, to] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 2.5, 5.0)];
    let tube = Cylinder::new(from, to, 0.5);
    let shade = Cylinder::new(DVec3::NEG_Z, DVec3::new(0.1, 0.2, 2.0), 1.5);
    for (cylinder, flipped) in [(tube, false), (shade, true)] {
        densities_agree(cylinder, flipped, |ray| {
            let t = cylinder.intersect(ray);
            let (w, axis) = (ray.at(t) - Vec3::splat(cylinder.middle), Vec3::splat(cylinder.axis));
            (t, (w - axis * w.dot(axis)).normalized())
        });
    }
}

fn wide(v: Vec3<f32>) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

/// Rays that leave a light carry its power and start within its bounds. The means of the inverse densities are the
/// light's area and the solid angle of its directions.
#[test]
fn emitted_rays_carry_the_power_of_their_light() {
    fn check<L: ListedLight + Copy>(name: &str, light: L, power: Option<f64>) {
        let mut table = LightTable::default();
        table.push(light);
        let bounds = light.bounds().unwrap();
        let power = power.unwrap_or(bounds.power);
        let stream = &mut Stream::new(48, 0, 0);
        let draws = 200_000;
        let row = light.row();
        let (mut flux, mut cos, mut mean, mut spread) = (0.0, 0.0, DVec3::ZERO, 0.0);
        // The solid angle of the directions, and the area of the origins.
        let (mut angle, mut area) = (0.0, 0.0);
        for _ in 0..draws {
            let u = [stream.random(), stream.random(), stream.random(), stream.random()];
            let emitted = table.emit_one(Wrapping(0), u);
            assert!((wide(emitted.ray.d).length() - 1.0).abs() < 1e-5);
            let at = wide(emitted.ray.o);
            flux += f64::from(emitted.flux().r);
            cos += f64::from(emitted.cos);
            (angle, area) = (
                angle + f64::from(1.0 / emitted.pdf_direction),
                area + f64::from(1.0 / emitted.pdf_position),
            );
            mean += at;
            spread += at.distance_squared(DVec3::from(bounds.mean));
        }
        let n = f64::from(draws);
        let extent = bounds.spread.sqrt();
        // The rays of a spot differ in flux.
        let room = if row.ramp_slope == 0.0 { 1e-4 } else { 5e-3 };
        assert!((flux / n / power - 1.0).abs() < room, "{name}: {} is not {power}", flux / n);
        assert!(
            (mean / n).distance(DVec3::from(bounds.mean)) <= 1e-2 * extent + 1e-5,
            "{name}: {}",
            mean / n
        );
        assert!((spread / n - bounds.spread).abs() <= 1e-2 * bounds.spread, "{name}: {}", spread / n);
        let on_surface = row.area > 0.0;
        let (mean_cos, whole) = if on_surface { (2.0 / 3.0, f64::from(row.area)) } else { (1.0, 1.0) };
        assert!((cos / n - mean_cos).abs() < 5e-3, "{name}: cosines of {} on average", cos / n);
        assert!((area / n / whole - 1.0).abs() < 1e-4, "{name}: {} is not the area", area / n);
        // 1/pdf has the solid angle as its mean, but its variance is infinite because of directions near the horizon.
        let half = 2.0 * std::f64::consts::PI;
        let cone = half * f64::from(row.radius);
        let filled = if on_surface {
            half
        } else if row.radius > 0.0 {
            cone
        } else {
            2.0 * half
        };
        assert!((angle / n / filled - 1.0).abs() < 0.05, "{name}: {} is not the solid angle", angle / n);
    }
    fn both<S: Copy>(name: &str, shape: S)
    where
        AreaLight<S>: ListedLight,
    {
        for flipped in [false, true] {
            check(name, AreaLight { shape, flipped, emission: [2.0; 3] }, None);
        }
    }
    check("point", PointLight { position: [1.0, 2.0, -3.0], intensity: [5.0; 3] }, None);
    for falloff in FALLOFFS {
        let light = spot(40.0, 25.0, falloff);
        check("spot", light, Some(light.power()));
    }
    both("sphere", Sphere::new(DVec3::new(1.0, 2.0, 5.0), 1.5));
    both("quad", Quad::new(DVec3::new(-1.0, -1.0, 3.0), DVec3::new(0.3, 1.0, 0.2), DVec3::X * 2.0));
    both("triangle", Triangle([[-1.0, -1.0, 3.0], [-1.0, 2.0, 3.5], [1.5, -1.0, 2.5]]));
    both("disk", Disk::new(DVec3::new(1.0, 0.5, 3.0), DVec3::new(0.0, -0.6, -0.8), 1.5));
    both("cylinder", Cylinder::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 2.5, 5.0), 0.5));
}

/// All rays that leave a surface leave its emitting side, from a point outside it.
#[test]
fn emitted_rays_leave_the_emitting_side() {
    let stream = &mut Stream::new(49, 0, 0);
    let sphere = Sphere::new(DVec3::new(0.0, 0.0, 2.0), 1.0);
    for flipped in [false, true] {
        let table = table(sphere, flipped, 1.0);
        for _ in 0..10_000 {
            let u = [stream.random(), stream.random(), stream.random(), stream.random()];
            let emitted = table.emit_one(Wrapping(0), u);
            let out = wide(emitted.ray.o) - DVec3::new(0.0, 0.0, 2.0);
            assert_eq!(out.length() > 1.0, !flipped);
            let cos = wide(emitted.ray.d).dot(out.normalize()) * if flipped { -1.0 } else { 1.0 };
            assert!((cos - f64::from(emitted.cos)).abs() < 1e-5);
        }
    }
}

/// The flux through a ball within the scene follows from the flux of each ray, and all rays start outside the scene.
#[test]
fn rays_from_infinity_cover_the_whole_scene() {
    let mut table = LightTable::default();
    table.push(Sky { radiance: [2.0; 3] });
    table.push(Distant { towards: [0.0, 0.6, 0.8], irradiance: [3.0; 3] });
    table.push(DistantDisk { towards: [0.0, 0.6, 0.8], versine: 0.2, radiance: [2.0; 3] });
    table.set_extent(Bounds { low: [1.0, -2.0, 3.0], high: [5.0, 4.0, 7.0] });
    let (middle, reach) = (DVec3::new(3.0, 1.0, 5.0), 17_f64.sqrt());
    let (centre, radius, pi) = (DVec3::new(1.5, -1.5, 6.5), 0.5, std::f64::consts::PI);
    let stream = &mut Stream::new(50, 0, 0);
    // Light from all directions within a disk hits a ball, whatever its direction.
    for (light, irradiance) in [(0, 4.0 * pi * 2.0), (1, 3.0), (2, 2.0 * pi * 0.2 * 2.0)] {
        let (mut flux, draws) = (0.0, 400_000);
        for _ in 0..draws {
            let u = [stream.random(), stream.random(), stream.random(), stream.random()];
            let emitted = table.emit_one(Wrapping(light), u);
            let (o, d) = (wide(emitted.ray.o), wide(emitted.ray.d));
            assert!((d.length() - 1.0).abs() < 1e-5);
            assert!((d.dot(o - middle) / -reach - 1.0).abs() < 1e-4, "{o} is within the scene");
            if d.cross(centre - o).length() < radius {
                flux += f64::from(emitted.flux().r);
            }
        }
        let (got, expected) = (flux / f64::from(draws), irradiance * pi * radius * radius);
        assert!((got / expected - 1.0).abs() < 0.06, "{got} is not {expected}");
    }
}

#[test]
fn without_an_extent_no_rays_start_at_infinity() {
    let mut table = LightTable::default();
    table.push(Distant { towards: [0.0, 0.6, 0.8], irradiance: [3.0; 3] });
    for around in [Bounds::NOTHING, Bounds::EVERYTHING] {
        table.set_extent(around);
        let emitted = table.emit_one(Wrapping(0), [0.3, 0.6, 0.0, 0.0]);
        assert_eq!((emitted.flux().r, emitted.ray.o.lane(0)), (0.0, [0.0; 3]));
    }
}

#[test]
fn lights_at_infinity_are_chosen_beside_the_tree() {
    let point = |x: f32| PointLight { position: [x, 0.0, 1.0], intensity: [1.0; 3] };
    let sky = Sky { radiance: [1.0; 3] };
    let sun = Distant { towards: [0.0, 0.6, 0.8], irradiance: [3.0; 3] };
    let (p, n) = (Vec3::<f32>::zero(), Vec3::splat([0.0_f32, 0.0, 1.0]));
    for (points, infinite) in [(0, 1), (0, 2), (1, 1), (3, 2), (20, 1)] {
        let mut table = LightTable::default();
        // Between the others, so that the lights of the tree are not the first ones.
        for i in 0..points {
            table.push(point(i as f32));
            if i == 0 {
                table.push(sky);
            }
        }
        if points == 0 {
            table.push(sky);
        }
        if infinite == 2 {
            table.push(sun);
        }
        table.build_tree();
        assert_eq!(table.infinite_lights().len(), infinite);
        let pmf = |light: u32| f64::from(table.pmf_one(p, n, Wrapping(light)));
        let all = table.len() as u32;
        let sum: f64 = (0..all).map(pmf).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{points} points: {sum}");
        let share = 1.0 / (infinite + usize::from(points > 0)) as f64;
        for &light in table.infinite_lights() {
            assert!((pmf(light) - share).abs() < 1e-6);
        }
        let (mut seen, draws) = (vec![0.0; all as usize], 10_000);
        for i in 0..draws {
            let (light, pmf) = table.choose_one(p, n, (i as f32 + 0.5) / draws as f32);
            let again = table.pmf_one(p, n, light);
            assert!((pmf - again).abs() <= 1e-5 * pmf, "{pmf} is not {again}");
            seen[light.0 as usize] += 1.0;
        }
        for (light, seen) in seen.iter().enumerate() {
            let expected = pmf(light as u32) * f64::from(draws);
            assert!((seen - expected).abs() < 2.5, "light {light}: {seen} of {expected}");
        }
    }
}

/// Where no light of the tree can contribute, lights at infinity have its share; everywhere the pmf is that of the
/// choice, and no light that contributes is left out.
#[test]
fn lights_that_cannot_reach_a_point_leave_their_share_to_those_at_infinity() {
    let facing = |x: f64| AreaLight {
        shape: Quad::new(DVec3::new(x, 0.0, 2.0), DVec3::Y, DVec3::X),
        flipped: false,
        emission: [1.0; 3],
    };
    let stream = &mut Stream::new(56, 0, 0);
    for (spots, quads, infinite) in [(1, 0, 1), (1, 0, 2), (3, 0, 1), (0, 1, 2), (2, 2, 1), (20, 0, 2)] {
        let mut table = LightTable::default();
        for i in 0..spots {
            let position = [i as f32, 0.5, 0.0];
            table.push(SpotLight { position, ..spot(20.0, 5.0, Falloff::Smoothstep) });
        }
        table.push(Sky { radiance: [1.0; 3] });
        for i in 0..quads {
            table.push(facing(f64::from(i)));
        }
        if infinite == 2 {
            table.push(Distant { towards: [0.0, 0.6, 0.8], irradiance: [3.0; 3] });
        }
        table.build_tree();
        let all = table.len() as u32;
        let (mut lit, mut dark, mut planted) = (0, 0, 0.0_f64);
        for _ in 0..400 {
            let [d, n] = [(); 2].map(|()| warp::uniform_sphere([stream.random::<f32>(), stream.random()]));
            let p = Vec3::splat([0.5, 0.5, 1.0]) + d * stream.random_range(0.2..6.0_f32);
            let pmf = |light: u32| table.pmf_one(p, n, Wrapping(light));
            let (mut seen, draws) = (vec![0_u32; all as usize], 512);
            for i in 0..draws {
                let (light, own) = table.choose_one(p, n, (i as f32 + 0.5) / draws as f32);
                assert!((own - pmf(light.0)).abs() <= 1e-5 * own, "{own} is not {}", pmf(light.0));
                seen[light.0 as usize] += 1;
            }
            let mut is_lit = false;
            for (light, &times) in (0..all).zip(&seen) {
                let own = pmf(light);
                let gives = table.sample_one(Wrapping(light), p, [0.3, 0.6]).weight().r > 0.0;
                assert!(own > 0.0 || !gives, "light {light} is never chosen from {p:?}");
                let expected = f64::from(own) * f64::from(draws);
                assert!((f64::from(times) - expected).abs() < 2.5, "light {light}: {times} of {expected}");
                is_lit = is_lit || own > 0.0 && !table.infinite_lights().contains(&light);
            }
            let groups = infinite + u32::from(is_lit);
            let share = table.pmf_of_infinite(p);
            assert!((share * groups as f32 - 1.0).abs() < 1e-6, "{share} of {groups} groups");
            for &light in table.infinite_lights() {
                assert_eq!(pmf(light), share);
                // The share that does not depend on the point.
                let constant = f64::from(draws) / f64::from(infinite + 1);
                planted = planted.max((f64::from(seen[light as usize]) - constant).abs());
            }
            lit += u32::from(is_lit);
            dark += u32::from(!is_lit);
        }
        assert!(lit > 3 && dark > 20, "{spots} spots, {quads} quads: {lit} lit, {dark} dark");
        assert!(planted > 50.0, "a share that is always the same would pass");
    }
}

#[test]
fn lights_at_infinity_are_infinitely_far_away() {
    let mut table = LightTable::default();
    table.push(PointLight { position: [0.0, 0.0, 2.0], intensity: [8.0; 3] });
    table.push(Sky { radiance: [1.0; 3] });
    table.push(Distant { towards: [0.0, 0.6, 0.8], irradiance: [3.0; 3] });
    table.build_tree();
    let o = Vec3::splat([1.0_f32, -2.0, 0.5]);
    let samples = [0, 1, 2].map(|light| table.sample_one(Wrapping(light), o, [0.3, 0.6]));
    assert_eq!(samples.map(|sample| sample.infinite), [false, true, true]);
    assert_eq!(samples.map(|sample| sample.delta), [true, false, true]);
    for sample in samples {
        let (ray, distance) = sample.shadow_ray(o);
        assert_eq!(distance.is_infinite(), sample.infinite);
        assert!(wide(ray.d).distance(wide(sample.wi)) < 1e-6);
    }
    // The delta lights alone, chosen uniformly, give the same irradiance.
    assert_eq!(table.delta_lights(), [0, 2]);
    let [near, far] = [0.25, 0.75].map(|choice| table.sample_delta(Vec3::<f32>::zero(), choice));
    assert_eq!((near.wi.lane(0), near.weight().r), ([0.0, 0.0, 1.0], 4.0));
    assert_eq!((far.wi.lane(0), far.weight().r), ([0.0, 0.6, 0.8], 6.0));
}

#[test]
fn escaped_radiance_is_weighted_by_the_density_of_its_light() {
    let d = Vec3::splat([0.0_f32, 0.0, 1.0]);
    let mut table = LightTable::default();
    table.set_environment(Environment { radiance: [1.0, 2.0, 3.0] });
    table.push(Distant { towards: [0.0, 0.0, 1.0], irradiance: [3.0; 3] });
    // The environment is never sampled, and the sun has no size.
    assert_eq!(table.escaped(d, |_| 0.0).lane(0), [1.0, 2.0, 3.0]);
    table.push(Sky { radiance: [8.0; 3] });
    let given = std::cell::Cell::new(0.0);
    let seen = table.escaped(d, |pdf| {
        given.set(pdf);
        0.25
    });
    assert_eq!(seen.lane(0), [3.0, 4.0, 5.0]);
    assert_eq!(given.get(), 1.0 / (4.0 * std::f32::consts::PI));
    // The reported densities are those of sampling and, together with the pmf, of choosing.
    let (light, pmf) = table.choose_one(Vec3::zero(), d, 0.75);
    let sample = table.sample_one(light, Vec3::zero(), [0.1, 0.2]);
    assert_eq!((light.0, sample.pdf), (1, given.get()));
    assert_eq!((pmf, table.pmf_of_infinite(Vec3::zero())), (0.5, 0.5));
}
