//! Records of the functions called along paths.

use super::super::super::recorded::Source;
use super::super::watched::{Calls, Watched, WatchedMask, WatchedUint, watch};
use crate::integrator::blocks::path::LIGHT;
use crate::integrator::{Around, Lit, State, TraceContext, Transport, absorbed, camera_ray, step_with};
use crate::material::{Bxdf, TransportMode};
use crate::math::lanes::Function;
use crate::math::lanes::scalar::Wrapping;
use crate::math::{Float, Uint};
use crate::sampling::{PathId, Region, Stream, independent};
use rand::RngExt;
use std::collections::BTreeMap;

type F = Watched;

/// Calls a function that nothing else calls, under the name by which it is recorded.
macro_rules! root {
    ($name:ident($($argument:ident),*) $body:block) => {
        <F as Float>::call(
            const {
                &Function {
                    name: stringify!($name),
                    parameters: &[$(stringify!($argument)),*],
                    module: module_path!(),
                }
            },
            ($($argument,)*),
            |($($argument,)*)| $body,
        )
    };
}

fn uint(value: u32) -> WatchedUint {
    WatchedUint(Wrapping(value))
}

/// The calls of all functions along two paths from each pixel of a region.
pub(super) fn of(source: &Source<'_>, region: &Region) -> BTreeMap<&'static str, Calls> {
    watch(|| {
        for i in 0..2 * region.len() {
            let pixel = region.pixel(i / 2);
            let path = PathId { pixel: uint(pixel.index), sample: uint(i % 2) };
            follow(source, path, [pixel.x, pixel.y].map(|x| Watched(x as f32 + 0.5)));
        }
        by_hand();
    })
}

fn follow(source: &Source<'_>, path: PathId<F>, centre: [F; 2]) {
    let (settings, camera) = (source.settings, &source.scene.camera);
    root!(film_position(path, centre) {
        let (x, y, _) = camera_ray(settings, camera, path, centre);
        [x, y]
    });
    let start = root!(start_path(path, centre) {
        let (_, _, ray) = camera_ray(settings, camera, path, centre);
        State::start(path, ray)
    });
    let scene = source.scene;
    let around = root!(start_around() { Around::at_camera(scene) });
    match Transport::of(source.integrator) {
        Some(transport) => follow_path(source, transport, start, around),
        None => follow_branch(source, start, around),
    }
}

fn follow_path(source: &Source<'_>, transport: Transport, mut state: State<F>, mut around: Around<F>) {
    let context = TraceContext { scene: source.scene, world: source.world, settings: source.settings };
    loop {
        let (stepped, next) = root!(step_path(state, around) {
            step_with(transport, &context, state, around, WatchedMask(true))
        });
        if !stepped.going.0 {
            return;
        }
        (state, around) = (stepped.state, next);
    }
}

/// Samples some lights at each point, and continues in one direction.
fn follow_branch(source: &Source<'_>, mut state: State<F>, mut around: Around<F>) {
    const MODE: TransportMode = TransportMode::Radiance;
    let scene = source.scene;
    let lights = &scene.lights;
    let context = TraceContext { scene, world: source.world, settings: source.settings };
    for depth in 0..6 {
        let ray = state.ray;
        state.depth = uint(depth);
        let hit = source.world.intersect(&ray, WatchedMask(true));
        let (beta, t) = (state.beta, hit.t);
        root!(absorbed_along(around, beta, t) { absorbed(scene, &around, beta, t) });
        if !hit.is_some().0 {
            let d = ray.d;
            root!(escaped_radiance(d) { lights.escaped(d, |_| F::splat(1.0)) });
            return;
        }
        let lit = root!(lit_point(state, around, hit) { Lit::new(&context, &state, around, &hit) });
        let beyond = root!(pass_on(lit, ray) { lit.pass_on(&ray) });
        if lit.is_none.0 | lit.is_hole.0 {
            (state.ray, around) = (beyond.ray, beyond.around);
            continue;
        }
        let Lit { local, wo, .. } = lit;
        let bsdf = scene.materials.bsdf_of(local);
        let [a, b, choice, _] = source.settings.sampler.draw(state.id, LIGHT.at::<F>(uint(depth)));
        let u = [a, b];
        bsdf.albedo();
        // The first lights are of all kinds; many triangles follow.
        let some = (0..lights.len() as u32).filter(|i| *i < 30 || i % 30 == state.id.pixel.first() % 30);
        for light in some {
            let (light, pmf) = (uint(light), Watched(0.5));
            let lamp_sample = root!(light_share(lit, light, pmf, u) { lit.share_of(scene, light, pmf, u) });
            root!(light_through(lamp_sample, state, around) { lamp_sample.through(&context, &state, &around) });
        }
        bsdf.branches(wo, MODE);
        let wi = bsdf.sample(wo, u, choice, MODE).wi;
        let branch = root!(spawn(lit, wi) { lit.spawn(scene, wi) });
        (state.ray, around) = (branch.ray, branch.around);
    }
}

/// What code that is written by hand calls, with arguments from everywhere.
fn by_hand() {
    let stream = &mut Stream::new(61, 0, 0);
    for _ in 0..1000 {
        independent::pcg4d::<F>([(); 4].map(|()| uint(stream.random::<u32>())));
    }
}
