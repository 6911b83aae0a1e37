//! Code on lanes gives the same bits at every level, up to entire paths.

use crate::common;
use crate::common::scenes::*;
use glam::DVec3;
use std::marker::PhantomData;
use stride::integrator::blocks::path::SCATTER;
use stride::integrator::{Finished, Paths};
use stride::material::{
    Bxdf, CheckerboardParameters, GlassParameters, MaterialParameters, MaterialTable, MatteParameters,
    MirrorParameters, Site, TransportMode, fresnel_dielectric,
};
use stride::math::lanes::{Kernel, Level, MAX_LANES, dispatch};
use stride::math::{Frame, LaneFloat, LaneUint, Ray, Rgb, Uint, Vec3, trig};
use stride::sampling::{Independent, PathId, Region, Sampler, Sobol, independent, warp};
use stride::scene::{Integrator, Scene};
use stride::shape::{Plane, Quad, Shape, Sphere, offset_origin};
use stride::world::AcceleratorChoice;

/// A program with eight words per lane.
trait Program {
    fn run<F: LaneFloat>(x: [F::Uint; 8]) -> Vec<F>;
}

struct Rows<'a, P>(&'a [[u32; 8]], PhantomData<P>);

impl<P: Program> Kernel for Rows<'_, P> {
    type Output = Vec<Vec<u32>>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Vec<Vec<u32>> {
        let mut all = Vec::new();
        for chunk in self.0.chunks(F::LANES) {
            let mut columns = [F::Uint::splat(0); 8];
            for (i, column) in columns.iter_mut().enumerate() {
                let mut words = [0; MAX_LANES];
                words.iter_mut().zip(chunk).for_each(|(word, row)| *word = row[i]);
                *column = F::Uint::load(&words);
            }
            let mut results = vec![Vec::new(); chunk.len()];
            for result in P::run::<F>(columns) {
                let mut words = [0; MAX_LANES];
                result.to_bits().store(&mut words);
                for (lane, result) in results.iter_mut().enumerate() {
                    // The payload of a NaN does not matter.
                    let nan = f32::from_bits(words[lane]).is_nan();
                    result.push(if nan { f32::NAN.to_bits() } else { words[lane] });
                }
            }
            all.extend(results);
        }
        all
    }
}

fn all_levels_agree<P: Program>() {
    // Hashed words, and the ends of the unit interval.
    let mut rows: Vec<[u32; 8]> = (0..4001_u32)
        .map(|i| {
            std::array::from_fn(|j| (i * 8 + j as u32 + 1).wrapping_mul(0x9e37_79b9).rotate_left(i % 31))
        })
        .collect();
    for (i, edge) in [0, u32::MAX, 0x8000_0000, 0x7fff_ffff, 0x4000_0000, 0xff, 0x100].into_iter().enumerate()
    {
        rows.push([edge; 8]);
        rows[i * 13][i] = edge;
    }
    let run = |level| dispatch(level, Rows(&rows, PhantomData::<P>));
    let one_lane = run(Level::SCALAR);
    for level in Level::available() {
        for ((row, a), b) in rows.iter().zip(run(level)).zip(&one_lane) {
            assert_eq!(&a, b, "{level} of {row:08x?}");
        }
    }
}

#[inline(always)]
fn unit<F: LaneFloat>(x: [F::Uint; 8]) -> [F; 8] {
    x.map(
        #[inline(always)]
        |x| x.to_unit(),
    )
}

#[inline(always)]
fn parts<F: LaneFloat>(v: Vec3<F>) -> [F; 3] {
    [v.x, v.y, v.z]
}

#[inline(always)]
fn colour<F: LaneFloat>(c: Rgb<F>) -> [F; 3] {
    [c.r, c.g, c.b]
}

/// Two directions: random ones, some of them close to the poles and the equator.
#[inline(always)]
fn directions<F: LaneFloat>(x: [F::Uint; 8]) -> [Vec3<F>; 2] {
    let [a, b, c, d, e, ..] = unit::<F>(x);
    let squeeze = F::select(e.lt(F::splat(0.3)), a * a * a * 1e-3, a);
    [warp::uniform_sphere([squeeze, b]), warp::uniform_sphere([c, d])]
}

macro_rules! law {
    ($test:ident, $f:ident, $x:ident, $outputs:expr) => {
        #[test]
        fn $test() {
            struct Here;
            impl Program for Here {
                #[inline(always)]
                fn run<$f: LaneFloat>($x: [$f::Uint; 8]) -> Vec<$f> {
                    $outputs.concat()
                }
            }
            all_levels_agree::<Here>();
        }
    };
}

law!(trigonometry_is_the_same_at_every_level, F, x, {
    let [a, b, c, ..] = unit::<F>(x);
    let (sin, cos) = trig::sin_cos_turns(a);
    let far = trig::angle_turns(b * 1e20 - 5e19, c * 1e20 - 5e19);
    [vec![sin, cos], vec![trig::angle_turns(sin, cos), trig::angle_turns(b - 0.5, c - 0.5), far]]
});

law!(frames_are_the_same_at_every_level, F, x, {
    let [n, w] = directions::<F>(x);
    let frame = Frame::around(n);
    [parts(frame.s), parts(frame.t), parts(frame.to_local(w)), parts(frame.to_world(w)), parts(n.cross(w))]
});

law!(random_numbers_are_the_same_at_every_level, F, x, {
    let hash = independent::pcg4d::<F>([x[0], x[1], x[2], x[3]]).map(F::from_bits);
    let id = PathId::<F> { pixel: x[4], sample: x[5] };
    let block = SCATTER.at::<F>(x[6] & F::Uint::splat(63));
    [hash, Independent { seed: 7 }.draw(id, block), Sobol { seed: 7 }.draw(id, block)]
});

// Each lane draws until a number falls below its own bound, as Markov chains do.
law!(endless_streams_are_the_same_at_every_level, F, x, {
    let id = PathId::<F> { pixel: x[4], sample: x[5] };
    let stream = Sampler::from(Sobol { seed: 7 }).endless(id, x[6]);
    let bound = (x[7] & F::Uint::splat(0x3fff_ffff) | F::Uint::splat(0x0200_0000)).to_unit();
    let (all, zero) = (F::zero().le(F::zero()), F::Uint::splat(0));
    let (mut stream, draws, last) = F::repeat(
        all,
        (stream, zero, F::zero()),
        #[inline(always)]
        |(mut stream, draws, _)| {
            let [_, u, _, v] = stream.draw(all);
            ((stream, draws + F::Uint::splat(1), v), u.gt(bound))
        },
    );
    let after = stream.draw(last.lt(F::splat(0.5)));
    [vec![F::from_bits(draws), last], after.to_vec(), stream.draw(all).to_vec()]
});

law!(warps_are_the_same_at_every_level, F, x, {
    let [a, b, ..] = unit::<F>(x);
    let (dx, dy) = warp::disk([a, b]);
    let tent = warp::tent(a);
    let hemisphere = warp::cosine_hemisphere([a, b]);
    [
        vec![dx, dy, tent, warp::tent_pdf(tent), warp::cosine_hemisphere_pdf(hemisphere.z)],
        parts(hemisphere).to_vec(),
        parts(warp::uniform_sphere([a, b])).to_vec(),
    ]
});

law!(hits_are_the_same_at_every_level, F, x, {
    let [d, side] = directions::<F>(x);
    let [.., a, b, c] = unit::<F>(x);
    let o = Vec3::new(a * 8.0 - 4.0, b * 8.0 - 4.0, c * 8.0 - 4.0);
    let ray = Ray::new(o, d);
    let plane = Plane { normal: [0.6, 0.0, 0.8], distance: -1.0 };
    let near = Sphere::new(DVec3::new(1.0, 0.5, -0.25), 2.5);
    let wall = Sphere::new(DVec3::new(1e5 + 3.0, 40.0, -20.0), 1e5);
    let quad = Quad::new(DVec3::new(-2.0, -2.0, 1.0), DVec3::new(5.0, 0.5, 0.0), DVec3::new(0.0, 4.0, 1.0));
    [
        vec![plane.intersect(&ray), near.intersect(&ray), wall.intersect(&ray), quad.intersect(&ray)],
        parts(offset_origin(o, d, a, side)).to_vec(),
    ]
});

law!(scattering_is_the_same_at_every_level, F, x, {
    let [wo, wi] = directions::<F>(x);
    let [a, b, c, ..] = unit::<F>(x);
    let table = MaterialTable::new(vec![
        MatteParameters { reflectance: [0.75, 0.5, 0.25], roughness: 0.0 }.row(),
        MirrorParameters { reflectance: [0.6, 0.4, 0.2] }.row(),
        GlassParameters { ior: 1.5, reflectance: [0.5; 3], transmittance: [0.9, 0.8, 0.7] }.row(),
        CheckerboardParameters { even: 0, odd: 1, checks_per_unit: [3.0, 7.0] }.row(),
    ]);
    // Each lane has another material.
    let (material, uv) = table.resolve(x[7] & F::Uint::splat(3), [a * 50.0 - 25.0, b * 50.0 - 25.0]);
    let bsdf = table.bsdf::<F>(material, Site::new(Vec3::zero(), uv, F::zero()));
    let sample = bsdf.sample(wo, [a, b], c, TransportMode::Radiance);
    let (fresnel, cos_t) = fresnel_dielectric(wo.z.abs(), b * 2.0 + 0.5);
    [
        parts(sample.wi).to_vec(),
        colour(sample.weight).to_vec(),
        colour(bsdf.eval(wo, wi, TransportMode::Radiance)).to_vec(),
        vec![sample.pdf, sample.eta, bsdf.pdf(wo, wi), fresnel, cos_t, F::splat(1.0).only(sample.delta)],
    ]
});

/// All samples of some paths as bits, sorted, as their order is not defined.
fn samples(scene: &Scene, level: Level) -> Vec<[u32; 7]> {
    samples_in(scene, AcceleratorChoice::Fastest, level)
}

fn samples_in(scene: &Scene, accelerator: AcceleratorChoice, level: Level) -> Vec<[u32; 7]> {
    let integrator = common::integrator_in(scene, accelerator);
    let region = Region::whole(scene.film.width, scene.film.height);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let mut out: Vec<Finished> = Vec::new();
    integrator.trace(level, &Paths { pixels: &pixels, first_sample: 3, samples: 5 }, &mut out);
    let mut words: Vec<[u32; 7]> = out
        .iter()
        .map(|f| {
            assert_eq!(pixels[f.slot as usize].index, f.sample.pixel);
            let [r, g, b] = f.sample.radiance.map(f32::to_bits);
            [f.sample.pixel, f.sample.sample, f.sample.x.to_bits(), f.sample.y.to_bits(), r, g, b]
        })
        .collect();
    words.sort_unstable();
    words
}

#[test]
fn whole_paths_are_the_same_at_every_level() {
    let mut lit = cover(40, 30);
    lit.lights = vec![point_light(v(3.0, 1.0, 2.0), 4.0), point_light(v(5.0, -3.0, 0.0), 2.0)];
    lit.camera.aperture_radius = 0.1;
    lit.camera.focus_distance = 7.0;
    let mut glazed = smallpt(40, 30);
    glazed.render.max_depth = 20;
    let mut whitted = smallpt(40, 30);
    whitted.render.integrator = Integrator::Whitted;
    for scene in [cover(40, 30), lit, glazed, whitted] {
        let one_lane = samples(&scene, Level::SCALAR);
        assert_eq!(one_lane.len(), 40 * 30 * 5);
        assert!(one_lane.iter().any(|s| s[4] != 0), "all black");
        for level in Level::available() {
            assert_eq!(samples(&scene, level), one_lane, "{level}");
        }
    }
}

#[test]
fn whole_paths_are_the_same_in_every_world() {
    let mut whitted = bazaar(40, 30);
    whitted.render.integrator = Integrator::Whitted;
    let mut naive = bazaar(40, 30);
    naive.render.integrator = Integrator::PathNaive;
    naive.lights = vec![point_light(v(3.0, 1.0, 2.0), 4.0)];
    for scene in [cover(40, 30), smallpt(40, 30), bazaar(40, 30), naive, whitted] {
        let one_by_one = samples_in(&scene, AcceleratorChoice::Simple, Level::SCALAR);
        assert!(one_by_one.iter().any(|s| s[4] != 0), "all black");
        for level in Level::available() {
            assert!(samples_in(&scene, AcceleratorChoice::Bvh, level) == one_by_one, "{level}");
        }
        assert!(samples(&scene, Level::available()[0]) == one_by_one);
    }
    // Negative control: a world that lacks one of three hundred small lamps differs.
    let mut dimmed = bazaar(40, 30);
    dimmed.entities.pop();
    let level = Level::available()[0];
    assert!(
        samples_in(&dimmed, AcceleratorChoice::Bvh, level)
            != samples_in(&bazaar(40, 30), AcceleratorChoice::Bvh, level)
    );
}

#[test]
fn an_empty_block_of_paths_returns_at_once() {
    let integrator = common::integrator(&cover(40, 30));
    let pixel = Region::whole(40, 30).pixel(7);
    let mut out = Vec::new();
    for (pixels, samples) in [(&[pixel][..], 0), (&[][..], 3), (&[][..], 0)] {
        let paths = Paths { pixels, first_sample: 0, samples };
        assert_eq!(integrator.trace(Level::available()[0], &paths, &mut out), 0);
    }
    assert!(out.is_empty());
}

#[test]
fn an_explained_path_equals_the_traced_path() {
    let mut whitted = smallpt(40, 30);
    whitted.render.integrator = Integrator::Whitted;
    for scene in [cover(40, 30), smallpt(40, 30), whitted] {
        let integrator = common::integrator(&scene);
        let region = Region::whole(40, 30);
        for traced in samples(&scene, Level::available()[0]) {
            let (seen, events) = integrator.explain(region.pixel(traced[0]), traced[1]);
            let [r, g, b] = seen.radiance.map(f32::to_bits);
            assert_eq!([seen.pixel, seen.sample, seen.x.to_bits(), seen.y.to_bits(), r, g, b], traced);
            assert!(events.len() >= 2);
        }
    }
}
