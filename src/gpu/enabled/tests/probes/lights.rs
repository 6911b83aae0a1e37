//! The choice among lights, and their samples.

use super::*;

/// Two points, three spheres of which one shines inwards, a rectangle, a quad that is none and turned round, a
/// triangle, a disk, and two cylinders of which one shines inwards.
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

/// A fan of triangles that is nearly flat: from most places one light, from others several.
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

fn tables_of(lights: &LightTable) -> Tables {
    let (lights, light_nodes) = light_tables(lights);
    Tables { lights, light_nodes, ..nothing() }
}

/// How the GPU's choices among seven lights compare with the CPU's.
#[derive(Default)]
struct Choices {
    /// Places at which some light has another chance.
    unlike: usize,
    /// Places at which another light is chosen.
    others: usize,
    /// Places at which power alone says what is chosen.
    by_power: usize,
}

fn choices(device: &Device, table: &LightTable, tables: &Tables, inputs: &[[f32; 9]]) -> Choices {
    let lines = "let choice = choose_light(float3(0u), float3(3u), float(8u));
        put(0u, choice.light); put_float(1u, choice.chance);
        for (var i = 0u; i < 7u; i++) { put_float(2u + i, light_chance(float3(0u), float3(3u), i)); }";
    let total: u32 = tables.light_nodes[0].units;
    let by_power = [0, 1, 2, 3, 4, 5, 6].map(|light| table.tree().units(light) as f32 / total as f32);
    let is_close = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-5;
    let mut seen = Choices::default();
    for (input, out) in inputs.iter().zip(probe::<9, 9>(device, lines, &bits(inputs), tables)) {
        let [x, y, z, nx, ny, nz, .., u] = *input;
        let (p, n) = (vec3([x, y, z]), vec3([nx, ny, nz]));
        let chances = [0, 1, 2, 3, 4, 5, 6].map(|light| table.chance(p, n, Wrapping(light), true));
        let given = [2, 3, 4, 5, 6, 7, 8].map(|i| f32::from_bits(out[i]));
        let (light, chance) = table.choose(p, n, u, true);
        let is_same = out[0] == light.0;
        // Cosines and sines of sums of angles cancel: a rounding of each may show as a part of the whole.
        let is_like = given.iter().zip(&chances).all(is_close);
        let chance_is_like = !is_same || is_close((&f32::from_bits(out[1]), &chance));
        seen.unlike += usize::from(!is_like || !chance_is_like);
        seen.others += usize::from(!is_same);
        seen.by_power += usize::from(chances.iter().zip(&by_power).all(is_close));
    }
    seen
}

#[test]
fn the_light_tree_gives_the_same_chances() {
    let Some(device) = device() else { return };
    let inputs = places();
    let table = lights();
    let seen = choices(&device, &table, &tables_of(&table), &inputs);
    assert!(seen.unlike == 0 && seen.others <= 20, "{} unlike, {} others", seen.unlike, seen.others);

    // A place that is just far enough for one is not for the other.
    let table = fan();
    let mut tables = tables_of(&table);
    let seen = choices(&device, &table, &tables, &inputs);
    assert!(seen.unlike <= 20 && seen.others <= 20, "{} unlike, {} others", seen.unlike, seen.others);
    assert!((1000..inputs.len() - 1000).contains(&seen.by_power), "{} far places", seen.by_power);

    // One light's units more than they are.
    let own = LightColumns::default();
    let (units, words) = light_rows(&LightTable::default(), &own).place("units").unwrap();
    tables.lights[3 * words + units.word][units.first] += tables.light_nodes[0].units / 100;
    assert!(choices(&device, &table, &tables, &inputs).unlike > 1000);
}

#[test]
fn lights_are_sampled_as_on_the_cpu() {
    let Some(device) = device() else { return };
    let table = lights();
    let lines = "for (var i = 0u; i < 11u; i++) {
            let s = sample_light(light_at(i), float3(0u), vec2f(float(6u), float(7u)));
            put_float3(10u * i, s.wi); put_float3(10u * i + 3u, s.target_point);
            put_float3(10u * i + 6u, s.radiance); put_float(10u * i + 9u, s.pdf);
            put_float(110u + i, light_pdf(light_at(i), float3(0u), 2.5, 0.5 + 0.5 * float(6u)));
        }";
    let inputs = places();
    let outputs = probe::<9, 121>(&device, lines, &bits(&inputs), &tables_of(&table));
    let (mut lit, mut doubtful) = ([0; 11], 0);
    for (input, out) in inputs.iter().zip(outputs) {
        let [x, y, z, _, _, _, u, v, _] = *input;
        let p = vec3([x, y, z]);
        for light in 0..11 {
            let expected = table.sample(Wrapping(light as u32), p, [u, v]);
            let out = &out[10 * light..];
            let pdf = f32::from_bits(out[9]);
            if (pdf > 0.0) != (expected.pdf > 0.0) {
                doubtful += 1;
                continue;
            }
            if expected.pdf == 0.0 {
                assert_eq!(out[6..9], [0; 3], "the dark has no radiance");
                continue;
            }
            lit[light] += 1;
            // Towards the rim of a sphere the cosine is a root of what is left after cancellation; seen from
            // the rim of a quad its cosine is.
            let length = (expected.target - p).length();
            let grazing = 1.0 + expected.pdf.max(1.0);
            let (w, t, l) = (expected.wi, expected.target, expected.radiance);
            [w.x, w.y, w.z].iter().zip(out).for_each(|(e, o)| close(*o, *e, 2e-5 / length.min(1.0), input));
            [t.x, t.y, t.z].iter().zip(&out[3..]).for_each(|(e, o)| close(*o, *e, 2e-3 * length, input));
            [l.r, l.g, l.b]
                .iter()
                .zip(&out[6..])
                .for_each(|(e, o)| close(*o, *e, 1e-5 * l.r.max(l.b).max(1.0), input));
            close(out[9], expected.pdf, 2e-5 * expected.pdf * grazing, input);
        }
        for light in 2..11 {
            let expected = table.pdf(Wrapping(light), p, 2.5, 0.5 + 0.5 * u);
            // By solid angle within a cone whose rim may be near, else by area.
            close(out[110 + light as usize], expected, 1e-3 * expected, input);
        }
    }
    assert!(lit.iter().all(|&n| n > 5000), "too few points see them: {lit:?}");
    assert!(doubtful <= 5, "{doubtful} lights are seen by one side only");
}
