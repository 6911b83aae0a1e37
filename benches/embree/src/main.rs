//! Compares stride's tree with Embree's: rays per second on one thread, seconds to build, and bytes per triangle. Both
//! trace the same rays in the same run.
//!
//! ```sh
//! apt-get install libembree-dev
//! cargo run --release -p embree -- [--rays N] [--rounds N] [mesh] [build] [instances] [watertight]
//! ```
//!
//! Embree is in robust mode, like stride, and traces one ray per call without coherence, as a path tracer would call it.
//! stride traces as many rays per call as it has lanes, as its own paths do. Figures are medians over rounds, in each of
//! which every tree traces all rays once; ratios are medians of the ratios of rounds.

mod blob;
mod embree;
mod rays;

use blob::{Icosphere, direction};
use embree::{Embree, Quality};
use glam::{DAffine3, DQuat, DVec3};
use rand::RngExt;
use rays::{Answers, Rays};
use std::sync::Arc;
use std::time::Instant;
use stride::math::lanes::Level;
use stride::sampling::Stream;
use stride::shape::Mesh;
use stride::world::{Instances, Simple, TreeScope, Triangles, World};

fn main() {
    let mut rays = 4_000_000;
    let mut rounds = 5;
    let mut what = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut number = || words.next().and_then(|n| n.parse().ok()).expect("a number");
        match word.as_str() {
            "--rays" => rays = number(),
            "--rounds" => rounds = number(),
            _ => what.push(word),
        }
    }
    let wants = |name: &str| what.is_empty() || what.iter().any(|word| word == name);
    let level = Level::from_environment().expect("a level");
    println!("stride with {level}");
    if wants("mesh") {
        mesh(level, rays, rounds);
    }
    if wants("build") {
        build(rounds);
    }
    if wants("instances") {
        instances(level, rays, rounds);
    }
    if what.iter().any(|word| word == "watertight") {
        watertight(level, 100_000_000);
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

fn stride_of(mesh: &Mesh, threads: usize) -> World {
    let mut triangles = Triangles::default();
    triangles.push(mesh, &DAffine3::IDENTITY, 0);
    tree_of(triangles, threads)
}

fn tree_of(triangles: Triangles, threads: usize) -> World {
    let surfaces = Simple { triangles: Arc::new(triangles), ..Simple::default() };
    World::with_build_threads(&surfaces, TreeScope::Everything, threads)
}

/// The size of a world's tree in memory.
fn tree_bytes(world: &World) -> usize {
    world.tree.as_ref().map_or(0, |tree| tree.bytes())
}

/// Camera rays from outside, in rows of a picture.
fn primary(count: usize) -> Rays {
    let side = (count as f64).sqrt().ceil() as usize;
    let eye = DVec3::new(0.7, -2.4, 0.9);
    let forward = -eye.normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    let at = |i: usize| (i as f64 + 0.5) / side as f64 - 0.5;
    Rays::new((0..count).map(|i| (eye, (forward + right * at(i % side) - up * at(i / side)).normalize())))
}

/// Rays from hits of other rays, with a cosine distribution around the normal.
fn bounce(count: usize, rays: &Rays, hits: &Answers, mesh: &Mesh) -> Rays {
    let stream = &mut Stream::new(1, 0, 0);
    let met: Vec<usize> = (0..rays.len()).filter(|&i| hits.t[i] < f32::INFINITY).collect();
    Rays::new((0..count).map(|i| {
        // Hits are in the order of the picture, as in a path tracer.
        let i = met[i * met.len() / count];
        let (o, d) = rays.get(i);
        let p = o + d * f64::from(hits.t[i]);
        let [a, b, c] = mesh.triangles[hits.primitive[i] as usize]
            .map(|vertex| DVec3::from(mesh.positions[vertex as usize].map(f64::from)));
        let n = (b - a).cross(c - a).normalize();
        let n = if n.dot(d) < 0.0 { n } else { -n };
        (p + n * 1e-5, (n + direction(stream)).normalize())
    }))
}

/// Rays from random points in and around the mesh in random directions.
fn random(count: usize) -> Rays {
    let stream = &mut Stream::new(2, 0, 0);
    Rays::new((0..count).map(|_| {
        let o = DVec3::from([(); 3].map(|()| stream.random_range(-1.2..1.2_f64)));
        (o, direction(stream))
    }))
}

fn mesh(level: Level, count: usize, rounds: usize) {
    let mesh = Icosphere::new(8).blob(7);
    println!("{} triangles", mesh.triangles.len());
    let ours = stride_of(&mesh, 1);
    let medium = Embree::new(std::slice::from_ref(&mesh), &[], Quality::Medium, 1);
    let high = Embree::new(std::slice::from_ref(&mesh), &[], Quality::High, 1);
    let primary = primary(count);
    let mut hits = primary.answers();
    medium.closest(&primary, &mut hits);
    let sets = [
        ("primary", bounce(0, &primary, &hits, &mesh)),
        ("bounce", bounce(count, &primary, &hits, &mesh)),
        ("random", random(count)),
    ];
    let [_, bounce, random] = sets;
    compare(level, &ours, [&medium, &high], &[("primary", primary), bounce, random], rounds);
}

/// Measures all trees in rounds, and prints millions of rays per second and ratios.
fn compare(level: Level, ours: &World, embree: [&Embree; 2], sets: &[(&str, Rays)], rounds: usize) {
    println!("rays             stride     Embree medium, high  (Mrays/s)    stride over medium, high");
    for (name, rays) in sets {
        let mut answers = [rays.answers(), rays.answers(), rays.answers()];
        for closest in [true, false] {
            let mut times = [const { Vec::new() }; 3];
            for _ in 0..rounds {
                let [a, b, c] = &mut answers;
                times[0].push(
                    seconds(|| if closest { rays.closest(level, ours, a) } else { rays.any(level, ours, a) })
                        .0,
                );
                for (i, answers) in [b, c].into_iter().enumerate() {
                    let work = || {
                        if closest { embree[i].closest(rays, answers) } else { embree[i].any(rays, answers) }
                    };
                    times[i + 1].push(seconds(work).0);
                }
            }
            let speed = |i: usize| median(times[i].clone()).recip() * rays.len() as f64 / 1e6;
            let ratio = |i: usize| median((0..rounds).map(|k| times[i][k] / times[0][k]).collect());
            let kind = if closest { "closest" } else { "any" };
            println!(
                "{name:8} {kind:8} {:6.3}     {:6.3} {:6.3}                        {:5.2} {:5.2}",
                speed(0),
                speed(1),
                speed(2),
                ratio(1),
                ratio(2)
            );
            if closest {
                let off =
                    |a: f32, b: f32| a != b && ((a - b).abs() > 1e-4 * a.max(b) || a.is_nan() || b.is_nan());
                let differ = (0..rays.len()).filter(|&i| off(answers[0].t[i], answers[1].t[i])).count();
                let met = answers[0].t.iter().filter(|t| t.is_finite()).count();
                println!(
                    "    {met} of {} rays meet something; {differ} distances differ by a ten-thousandth",
                    rays.len()
                );
            }
        }
    }
}

/// A thousand instances of eight meshes of 1.3 million triangles each.
fn instances(level: Level, count: usize, rounds: usize) {
    let sphere = Icosphere::new(8);
    let meshes: Vec<Mesh> = (0..8).map(|seed| sphere.blob(seed)).collect();
    let stream = &mut Stream::new(3, 0, 0);
    let places: Vec<(usize, DAffine3)> = (0..1000)
        .map(|i| {
            let at = DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) - 4.5;
            let at = at + DVec3::from([(); 3].map(|()| stream.random_range(-0.3..0.3_f64)));
            let turn = DQuat::from_axis_angle(direction(stream), stream.random_range(0.0..6.0));
            let scale = DVec3::splat(stream.random_range(0.2..0.5));
            let place = DAffine3::from_scale_rotation_translation(scale, turn, at);
            (i as usize % meshes.len(), DAffine3::from_scale(DVec3::splat(0.25)) * place)
        })
        .collect();
    let triangles: usize = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    println!("{triangles} triangles in {} meshes, {} instances", meshes.len(), places.len());
    let (ours_seconds, ours) = seconds(|| {
        let mut triangles = Triangles::default();
        let mut instances = Instances::default();
        instances.meshes = meshes.iter().map(|mesh| triangles.push_shared(mesh)).collect();
        for (row, (mesh, place)) in places.iter().enumerate() {
            instances.push(*mesh, place, row as u32);
        }
        let (triangles, instances) = (Arc::new(triangles), Arc::new(instances));
        let surfaces = Simple { triangles, instances, ..Simple::default() };
        World::with_build_threads(&surfaces, TreeScope::Everything, 2)
    });
    let columns = |place: &DAffine3| place.to_cols_array().map(|x| x as f32);
    let placed: Vec<_> = places.iter().map(|(mesh, place)| (*mesh, columns(place))).collect();
    let of = |quality| seconds(|| Embree::new(&meshes, &placed, quality, 2));
    let ((medium_seconds, medium), (high_seconds, high)) = (of(Quality::Medium), of(Quality::High));
    let bytes = |bytes: f64| bytes / triangles as f64;
    println!("                 stride     Embree medium, high");
    println!("build, 2 threads {ours_seconds:6.3}     {medium_seconds:6.3} {high_seconds:6.3}");
    println!(
        "bytes a triangle {:6.1}     {:6.1} {:6.1}",
        bytes(tree_bytes(&ours) as f64),
        bytes(medium.bytes as f64),
        bytes(high.bytes as f64)
    );
    compare(
        level,
        &ours,
        [&medium, &high],
        &[("primary", primary(count)), ("random", random(count))],
        rounds,
    );
}

/// The number of rays from inside a closed mesh of more than a million triangles that leave it without a hit.
fn watertight(level: Level, count: usize) {
    let mesh = Icosphere::new(8).blob(7);
    let tree = stride_of(&mesh, 1);
    let stream = &mut Stream::new(4, 0, 0);
    let (mut left, mut asked) = (0, 0);
    while asked < count {
        let rays = Rays::new((0..1 << 20).map(|i| {
            let o = direction(stream) * 0.3 * stream.random::<f64>();
            let any = |stream: &mut Stream| {
                let [a, b, c] = mesh.triangles[stream.random_range(0..mesh.triangles.len())]
                    .map(|vertex| DVec3::from(mesh.positions[vertex as usize].map(f64::from)));
                // A vertex, or a point of an edge.
                if i % 4 == 0 { a } else { b.lerp(c, stream.random()) }
            };
            (o, if i % 2 == 0 { (any(stream) - o).normalize() } else { direction(stream) })
        }));
        let mut answers = rays.answers();
        rays.closest(level, &tree, &mut answers);
        left += answers.t.iter().filter(|t| !t.is_finite()).count();
        asked += rays.len();
    }
    println!("{left} of {asked} rays leave a closed mesh of {} triangles", mesh.triangles.len());
}

fn build(rounds: usize) {
    let mesh = Icosphere::new(8).blob(7);
    let count = mesh.triangles.len() as f64;
    println!("build            stride     Embree medium, high  (seconds)");
    for threads in [1, 2] {
        let mut times = [const { Vec::new() }; 3];
        let mut bytes = [0.0; 3];
        for _ in 0..rounds {
            // The time does not include copying the vertices, as for Embree.
            let mut triangles = Triangles::default();
            triangles.push(&mesh, &DAffine3::IDENTITY, 0);
            let (time, tree) = seconds(|| tree_of(triangles, threads));
            times[0].push(time);
            bytes[0] = tree_bytes(&tree) as f64 / count;
            for (i, quality) in [Quality::Medium, Quality::High].into_iter().enumerate() {
                let (time, tree) =
                    seconds(|| Embree::new(std::slice::from_ref(&mesh), &[], quality, threads));
                times[i + 1].push(time);
                bytes[i + 1] = tree.bytes as f64 / count;
            }
        }
        let [ours, medium, high] = times.map(median);
        println!("{threads} threads        {ours:6.3}     {medium:6.3} {high:6.3}");
        if threads == 1 {
            let [ours, medium, high] = bytes;
            println!(
                "bytes a triangle {ours:6.1}     {medium:6.1} {high:6.1}    (Embree's with vertices and indices)"
            );
        }
    }
}
