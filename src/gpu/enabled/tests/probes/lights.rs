//! The choice of lights.

use super::*;
use crate::shape::{Cylinder, Disk, Quad, Sphere};

/// Two points, three spheres of which one emits inwards, a rectangle, a flipped quad that is no rectangle, a triangle,
/// a disk, and two cylinders of which one emits inwards.
fn lights() -> LightTable {
    let mut lights = LightTable::default();
    lights.push(PointLight { position: [3.0, 1.0, 2.0], intensity: [4.0, 5.0, 6.0] });
    lights.push(PointLight { position: [-2.0, -2.5, 0.5], intensity: [1.0, 0.5, 0.25] });
    let sphere = |x: f64, y: f64, z: f64, r| Sphere::new(DVec3::new(x, y, z), r);
    lights.push(AreaLight { shape: sphere(1.0, -3.0, 2.0, 0.5), flipped: false, emission: [3.0, 2.0, 1.0] });
    lights.push(AreaLight { shape: sphere(-40.0, 30.0, 10.0, 2.0), flipped: false, emission: [100.0; 3] });
    lights.push(AreaLight { shape: sphere(0.0, 0.0, 0.0, 12.0), flipped: true, emission: [0.5, 0.4, 0.3] });
    let quad = |z, v| Quad::new(DVec3::new(-1.0, -1.0, z), DVec3::Y * 2.0, v);
    lights.push(AreaLight {
        shape: quad(3.0, DVec3::new(1.5, 0.0, 0.5)),
        flipped: false,
        emission: [2.0; 3],
    });
    lights.push(AreaLight {
        shape: quad(-3.0, DVec3::new(1.5, 0.7, 0.5)),
        flipped: true,
        emission: [7.0, 0.0, 0.0],
    });
    let corners = [[-2.0, 1.0, 2.5], [0.5, 2.0, 2.0], [-1.0, 3.5, 3.0]];
    lights.push(AreaLight { shape: Triangle(corners), flipped: true, emission: [1.0, 2.0, 3.0] });
    let disk = Disk::new(DVec3::new(1.5, -1.0, -2.0), DVec3::new(0.0, 0.6, 0.8), 0.7);
    lights.push(AreaLight { shape: disk, flipped: false, emission: [2.0, 1.0, 4.0] });
    let tube =
        |from: [f64; 3], to: [f64; 3], radius| Cylinder::new(DVec3::from(from), DVec3::from(to), radius);
    lights.push(AreaLight {
        shape: tube([-3.0, 2.0, -1.0], [-1.0, 3.0, 0.5], 0.4),
        flipped: false,
        emission: [1.0, 3.0, 2.0],
    });
    lights.push(AreaLight {
        shape: tube([0.0, -1.0, -5.0], [0.5, 1.0, 5.0], 5.0),
        flipped: true,
        emission: [0.5, 0.6, 0.2],
    });
    lights.build_tree();
    lights
}

/// A nearly flat fan of triangles: from most points one light, from others several.
fn fan() -> LightTable {
    let rim = |i: u8| {
        let phi = f32::from(i).powi(2) * 0.1;
        [2.0 + 0.8 * phi.cos(), -2.0 + 0.8 * phi.sin(), 1.0 + 0.01 * f32::from(i)]
    };
    let mut lights = LightTable::default();
    lights.push_mesh((0..7).map(|i| [[2.0, -2.0, 1.05], rim(i), rim(i + 1)]), false, [1.0; 3]);
    lights.build_tree();
    lights
}

/// Spots that diverge from one point, with parts of the space between them.
fn spots() -> LightTable {
    let mut lights = LightTable::default();
    for axis in [[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, -0.8]] {
        let ramp = Ramp { outer: 0.6, inner: 0.4, falloff: Falloff::Smoothstep };
        lights.push(SpotLight { position: [0.1, -0.2, 0.3], axis, intensity: [1.0; 3], ramp });
    }
    lights.build_tree();
    lights
}

#[test]
fn light_trees_agree_on_the_points_that_no_light_reaches() {
    let Some(device) = device() else { return };
    let inputs = places();
    for (table, least) in [(spots(), 1000), (fan(), 100)] {
        let tables = tables_of(&table);
        let lines = "put(0u, u32(lights_reach(float3(0u))));";
        let (mut unlike, mut dark) = (0, 0);
        for (input, [out]) in inputs.iter().zip(probe::<9, 1>(&device, lines, &bits(&inputs), &tables)) {
            let reaches = table.tree().reaches(vec3([input[0], input[1], input[2]]));
            unlike += usize::from(reaches != (out == 1));
            dark += usize::from(!reaches);
        }
        // Points at the limit may differ.
        assert!(unlike <= 20, "{unlike} unlike");
        assert!((least..inputs.len() - least).contains(&dark), "{dark} dark points");
    }
}

fn tables_of(lights: &LightTable) -> Tables {
    let (lights, light_nodes) = light_tables(lights);
    Tables { lights, light_nodes, ..nothing() }
}

/// Comparison of the GPU's and the CPU's choices among seven lights.
#[derive(Default)]
struct Choices {
    /// Points at which the probability of some light differs.
    unlike: usize,
    /// Points at which another light is chosen.
    others: usize,
    /// Points at which the choice depends on power alone.
    by_power: usize,
}

fn choices(device: &Device, table: &LightTable, tables: &Tables, inputs: &[[f32; 9]]) -> Choices {
    let lines = "let choice = choose_light(float3(0u), float3(3u), float(8u), true);
        put(0u, choice.light); put_float(1u, choice.pmf);
        for (var i = 0u; i < 7u; i++) { put_float(2u + i, light_pmf(float3(0u), float3(3u), i, true)); }";
    let total: u32 = tables.light_nodes[0].units;
    let by_power = [0, 1, 2, 3, 4, 5, 6].map(|light| table.tree().units(light) as f32 / total as f32);
    let is_close = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-5;
    let mut seen = Choices::default();
    for (input, out) in inputs.iter().zip(probe::<9, 9>(device, lines, &bits(inputs), tables)) {
        let [x, y, z, nx, ny, nz, .., u] = *input;
        let (p, n) = (vec3([x, y, z]), vec3([nx, ny, nz]));
        let pmfs = [0, 1, 2, 3, 4, 5, 6].map(|light| table.pmf(p, n, Wrapping(light), true));
        let given = [2, 3, 4, 5, 6, 7, 8].map(|i| f32::from_bits(out[i]));
        let (light, pmf) = table.choose(p, n, u, true);
        let is_same = out[0] == light.0;
        // Cosines and sines of sums of angles cancel, so that a rounding error may become a large relative error.
        let is_like = given.iter().zip(&pmfs).all(is_close);
        let pmf_is_like = !is_same || is_close((&f32::from_bits(out[1]), &pmf));
        seen.unlike += usize::from(!is_like || !pmf_is_like);
        seen.others += usize::from(!is_same);
        seen.by_power += usize::from(pmfs.iter().zip(&by_power).all(is_close));
    }
    seen
}

#[test]
fn light_trees_agree_in_probabilities() {
    let Some(device) = device() else { return };
    let inputs = places();
    let table = lights();
    let seen = choices(&device, &table, &tables_of(&table), &inputs);
    assert!(seen.unlike == 0 && seen.others <= 20, "{} unlike, {} others", seen.unlike, seen.others);

    // A point at the limit of being far may be far on one side only.
    let table = fan();
    let mut tables = tables_of(&table);
    let seen = choices(&device, &table, &tables, &inputs);
    assert!(seen.unlike <= 20 && seen.others <= 20, "{} unlike, {} others", seen.unlike, seen.others);
    assert!((1000..inputs.len() - 1000).contains(&seen.by_power), "{} far places", seen.by_power);

    // One light has too many units of power.
    let own = LightColumns::default();
    let (units, words) = light_rows(&LightTable::default(), &own).place("units").unwrap();
    tables.lights[3 * words + units.word][units.first] += tables.light_nodes[0].units / 100;
    assert!(choices(&device, &table, &tables, &inputs).unlike > 1000);
}
