//! What lights give, against irradiance by formula; densities against what is met.

use super::*;
use crate::math::lanes::scalar::Wrapping;
use crate::shape::Shears;
use glam::DVec3;

fn table(light: AreaLight, flipped: bool, emission: f32) -> LightTable {
    let mut table = LightTable::default();
    table.push_area(light, flipped, [emission; 3]);
    table.build_tree();
    table
}

/// The mean of `n²` stratified samples of the irradiance on a surface at the origin facing +z.
fn irradiance(table: &LightTable, n: u32) -> f64 {
    let mut sum = 0.0;
    for i in 0..n * n {
        let u = [(i / n) as f32 + 0.5, (i % n) as f32 + 0.5].map(|x| x / n as f32);
        let sample = table.sample(Wrapping(0), Vec3::<f32>::zero(), u);
        sum += f64::from(sample.weight().r * sample.wi.z.max(0.0));
    }
    sum / f64::from(n * n)
}

#[test]
fn a_sphere_gives_the_irradiance_of_its_cone() {
    // E = π·L·sin²θ for a sphere straight above, sin θ = r/distance.
    for (distance, radius) in [(4.0, 1.0), (1000.0, 1.0), (1.001, 1.0)] {
        let sphere = Sphere::new(DVec3::Z * distance, radius);
        let expected = std::f64::consts::PI * 2.0 * (radius / distance).powi(2);
        let got = irradiance(&table(AreaLight::Sphere(sphere), false, 2.0), 200);
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
        // Seen from outside, a sphere that emits inwards is dark.
        assert_eq!(irradiance(&table(AreaLight::Sphere(sphere), true, 2.0), 20), 0.0);
    }
}

#[test]
fn a_sphere_around_us_lights_us_as_a_sky() {
    // From inside, radiance is L everywhere: E = π·L, wherever we stand.
    for z in [0.0, 0.7, -0.5] {
        let sphere = Sphere::new(DVec3::Z * z, 1.0);
        let got = irradiance(&table(AreaLight::Sphere(sphere), true, 1.0), 400);
        assert!((got / std::f64::consts::PI - 1.0).abs() < 3e-3, "{got} is not π");
        assert_eq!(irradiance(&table(AreaLight::Sphere(sphere), false, 1.0), 20), 0.0);
    }
}

#[test]
fn a_quad_gives_the_irradiance_of_its_form_factor() {
    // The form factor of a unit square 1 above the middle is 4 times that of a corner patch of ½ × ½
    // (Howell, configuration C-13).
    let quad = Quad::new(DVec3::new(-0.5, -0.5, 1.0), DVec3::Y, DVec3::X);
    let s = 1.25_f64.sqrt();
    let expected = 4.0 * (0.5 / s * (0.5 / s).atan());
    let got = irradiance(&table(AreaLight::Quad(quad), false, 1.0), 200);
    assert!((got / expected - 1.0).abs() < 1e-4, "{got} is not {expected}");
    assert_eq!(irradiance(&table(AreaLight::Quad(quad), true, 1.0), 10), 0.0);
}

#[test]
fn a_disk_gives_the_irradiance_of_its_form_factor() {
    // A disk straight above fills a cone: E = π·L·r²/(r² + distance²).
    for (distance, radius) in [(1.0, 1.0), (0.5, 1.0), (50.0, 1.0)] {
        let disk = Disk::new(DVec3::Z * distance, DVec3::NEG_Z, radius);
        let expected = std::f64::consts::PI * radius * radius / (radius * radius + distance * distance);
        let got = irradiance(&table(AreaLight::Disk(disk), false, 1.0), 300);
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
        assert_eq!(irradiance(&table(AreaLight::Disk(disk), true, 1.0), 10), 0.0);
    }
}

#[test]
fn a_cylinder_gives_the_irradiance_of_its_solid_angle() {
    // One that lies across the zenith, at an angle β to it on either side and as wide as a sine s: of the strip of
    // directions (α, β) about its axis, cos θ = cos α·cos β. Seen from its axis's height it is a whole strip, from
    // end to end, whose ends depend on α only by the distance to it.
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
        let got = irradiance(&table(AreaLight::Cylinder(cylinder), false, 1.0), 200);
        assert!((got / expected - 1.0).abs() < 1e-3, "{got} is not {expected}");
    }
}

#[test]
fn a_long_tube_around_us_lights_us_as_a_sky() {
    let tube = Cylinder::new(DVec3::new(0.2, -300.0, 0.1), DVec3::new(0.2, 300.0, 0.1), 1.0);
    let table = table(AreaLight::Cylinder(tube), true, 1.0);
    // By area, most samples are far away: many are needed.
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
    let sum: f64 =
        halves.map(|half| irradiance(&table(AreaLight::Triangle(half), false, 1.0), 200)).iter().sum();
    assert!((sum / expected(s) - 1.0).abs() < 1e-4, "{sum} is not {}", expected(s));
    assert_eq!(irradiance(&table(AreaLight::Triangle(halves[0]), true, 1.0), 10), 0.0);
    // A triangle without area is never chosen, and spoils nothing.
    let mut with_none = LightTable::default();
    with_none.push_area(AreaLight::Triangle([[0.0, 0.0, 2.0]; 3]), false, [1.0; 3]);
    with_none.push_area(AreaLight::Triangle(halves[0]), false, [1.0; 3]);
    with_none.build_tree();
    let up = Vec3::<f32>::splat([0.0, 0.0, 1.0]);
    for u in [0.0, 0.3, 0.999] {
        let (light, chance) = with_none.choose(Vec3::zero(), up, u, true);
        assert_eq!((light.0, chance), (1, 1.0));
    }
}

#[test]
fn the_density_of_a_met_light_is_that_of_the_sample() {
    let sphere = AreaLight::Sphere(Sphere::new(DVec3::new(1.0, 2.0, 5.0), 1.5));
    let around = AreaLight::Sphere(Sphere::new(DVec3::new(0.3, -0.2, 0.1), 3.0));
    let quad = AreaLight::Quad(Quad::new(DVec3::new(-1.0, -1.0, 3.0), DVec3::Y, DVec3::X * 2.0));
    let triangle = AreaLight::Triangle([[-1.0, -1.0, 3.0], [-1.0, 2.0, 3.5], [1.5, -1.0, 2.5]]);
    let disk = AreaLight::Disk(Disk::new(DVec3::new(1.0, 0.5, 3.0), DVec3::new(0.0, -0.6, -0.8), 1.5));
    let [from, to] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 2.5, 5.0)];
    let tube = AreaLight::Cylinder(Cylinder::new(from, to, 0.5));
    let shade = AreaLight::Cylinder(Cylinder::new(DVec3::NEG_Z, DVec3::new(0.1, 0.2, 2.0), 1.5));
    for (light, flipped) in [
        (sphere, false),
        (around, true),
        (quad, false),
        (triangle, false),
        (disk, false),
        (tube, false),
        (shade, true),
    ] {
        let table = table(light, flipped, 1.0);
        for u in [[0.1, 0.2], [0.5, 0.5], [0.9, 0.8]] {
            let p = Vec3::<f32>::zero();
            let sample = table.sample(Wrapping(0), p, u);
            let ray = crate::math::Ray::new(p, sample.wi);
            let (t, normal) = match light {
                AreaLight::Sphere(s) => {
                    let t = s.intersect(&ray);
                    let out = (ray.at(t) - Vec3::splat(s.centre)).normalized();
                    (t, if flipped { -out } else { out })
                }
                AreaLight::Quad(q) => (q.intersect(&ray), Vec3::splat(q.normal)),
                AreaLight::Disk(d) => (d.intersect(&ray), Vec3::splat(d.normal)),
                AreaLight::Cylinder(c) => {
                    let t = c.intersect(&ray);
                    let w = ray.at(t) - Vec3::splat(c.middle);
                    let axis = Vec3::splat(c.axis);
                    let out = (w - axis * w.dot(axis)).normalized();
                    (t, if flipped { -out } else { out })
                }
                AreaLight::Triangle(corners) => {
                    let [a, b, c] = corners.map(Vec3::splat);
                    (Shears::new(&ray).meet([a, b, c], true).t, (b - a).cross(c - a).normalized())
                }
            };
            let pdf = table.pdf(Wrapping(0), p, t, -sample.wi.dot(normal));
            assert!((pdf / sample.pdf - 1.0).abs() < 1e-4, "{pdf} is not {}", sample.pdf);
        }
    }
}
