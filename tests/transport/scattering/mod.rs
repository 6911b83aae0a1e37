//! BxDFs: directions follow their densities, energy is not created, and scattering is reciprocal.
//!
//! Directions are tested at the significance level stated in `common::chi_square`, frequencies at [`LEVEL`] together.

mod rough;

use crate::common::chi_square::{Outcome, Polar, compare_some, draw, narrow, wide};
use crate::common::statistics::{check_against_tables, normal_tails, sidak};
use glam::DVec3;
use rand::RngExt;
use std::f64::consts::{PI, TAU};
use stride::material::{
    Branch, Bsdf, Bxdf, BxdfSample, Ggx, GlassParameters, Lambertian, MaterialParameters, MaterialTable,
    MatteParameters, Metal, MirrorParameters, RoughMetal, Row, Site, SmoothDielectric, SpecularReflection,
    TransportMode,
};
use stride::math::lanes::scalar::Wrapping;
use stride::math::{Rgb, Vec3};
use stride::sampling::{Stream, warp};
use stride::scene::{ConductorParameters, DielectricParameters};

/// The probability that any of the frequencies in a test is rejected although it is correct.
const LEVEL: f64 = 0.01;

fn rgb(c: [f32; 3]) -> Rgb<f32> {
    Rgb::splat(c)
}

/// A direction by its cosine to the normal, and its angle around it.
fn direction(cos: f64, phi: f64) -> Vec3<f32> {
    let sin = (1.0 - cos * cos).sqrt();
    narrow(DVec3::new(sin * phi.cos(), sin * phi.sin(), cos))
}

/// Directions on both sides, from the normal to grazing.
fn directions() -> [Vec3<f32>; 8] {
    [1.0, 0.8, 0.3, 0.01, -0.02, -0.4, -0.9, -1.0].map(|cos| direction(cos, 1.0 + 2.0 * cos))
}

fn uniform(u: [f32; 4]) -> Vec3<f32> {
    warp::uniform_sphere([u[0], u[1]])
}

/// The mode of paths from the camera.
const MODE: TransportMode = TransportMode::Radiance;

/// The index of a metal between copper and gold.
fn conductor(roughness: [f64; 2]) -> Row {
    let (eta, k) = (Some([0.2, 0.9, 1.1]), Some([3.9, 2.4, 2.2]));
    ConductorParameters { metal: None, eta, k, roughness }.row()
}

fn dielectric(ior: f64, roughness: [f64; 2], thin_walled: bool) -> Row {
    let (reflectance, transmittance) = ([1.0; 3], [1.0; 3]);
    let (absorption, priority) = ([0.0; 3], 0.0);
    DielectricParameters { ior, roughness, absorption, priority, thin_walled, reflectance, transmittance }
        .row()
}

/// A rough surface, and the index of refraction below it over that above it.
struct Rough {
    name: &'static str,
    row: Row,
    ior: f64,
}

fn rough() -> Vec<Rough> {
    let same = |name, row| Rough { name, row, ior: 1.0 };
    vec![
        same("a conductor", conductor([0.5; 2])),
        same("a very rough conductor", conductor([1.0; 2])),
        same("a brushed conductor", conductor([0.35, 0.8])),
        same("a rough matte", MatteParameters { reflectance: [0.9, 0.5, 0.2], roughness: 0.8 }.row()),
        same("a thin dielectric", dielectric(1.5, [0.5; 2], true)),
        same("a brushed thin dielectric", dielectric(2.0, [0.8, 0.4], true)),
        Rough { name: "a dielectric", row: dielectric(1.5, [0.75; 2], false), ior: 1.5 },
        Rough { name: "a brushed dielectric", row: dielectric(2.0, [0.9, 0.65], false), ior: 2.0 },
        Rough { name: "a bubble", row: dielectric(0.7, [0.75; 2], false), ior: 0.7 },
    ]
}

impl Rough {
    fn bsdf(&self) -> Bsdf<f32> {
        of(self.row)
    }

    /// The square of the index of refraction on the side of a direction.
    fn n2(&self, w: Vec3<f32>) -> f64 {
        if w.z > 0.0 { 1.0 } else { self.ior * self.ior }
    }
}

fn materials() -> MaterialTable {
    let reflectance = [0.7, 0.4, 0.2];
    let smooth = vec![
        MatteParameters { reflectance, roughness: 0.0 }.row(),
        MirrorParameters { reflectance }.row(),
        GlassParameters { ior: 1.5, reflectance: [1.0; 3], transmittance: [1.0; 3] }.row(),
        GlassParameters { ior: 0.75, reflectance: [0.8; 3], transmittance: [0.9; 3] }.row(),
        conductor([0.0; 2]),
        dielectric(1.5, [0.0; 2], false),
        dielectric(1.5, [0.0; 2], true),
    ];
    let same_medium = rough().into_iter().filter(|rough| rough.ior == 1.0).map(|rough| rough.row);
    MaterialTable::new(smooth.into_iter().chain(same_medium).collect())
}

/// The BSDFs of all materials.
fn bsdfs() -> Vec<Bsdf<f32>> {
    (0..materials().rows().len() as u32).map(bsdf).collect()
}

fn of(row: Row) -> Bsdf<f32> {
    MaterialTable::new(vec![row]).bsdf(Wrapping(0), Site::new(Vec3::zero(), [0.0; 2], 0.0))
}

fn bsdf(index: u32) -> Bsdf<f32> {
    materials().bsdf(Wrapping(index), Site::new(Vec3::zero(), [0.0; 2], 0.0))
}

fn follows(bxdf: &impl Bxdf<f32>, wo: Vec3<f32>, seed: u32) -> Outcome {
    let normal = DVec3::Z * f64::from(wo.z.signum());
    let sample = |u: [f32; 4]| {
        let sample = bxdf.sample(wo, [u[0], u[1]], u[2], MODE);
        // Rough surfaces may lose energy by multiple scattering between microfacets.
        (sample.pdf > 0.0).then_some(sample.wi)
    };
    compare_some(Polar::new(normal, DVec3::X), seed, sample, |wi| bxdf.pdf(wo, wi))
}

#[test]
fn statistics_match_published_tables() {
    check_against_tables();
}

#[test]
fn lambertian_directions_follow_their_density() {
    let wos = directions();
    let lambertian = Lambertian { reflectance: rgb([0.5; 3]) };
    for (i, &wo) in wos.iter().enumerate() {
        // Separately, and as the matte material of a table.
        for outcome in [follows(&lambertian, wo, 10 + i as u32), follows(&bsdf(0), wo, 50 + i as u32)] {
            assert!(outcome.agrees(2 * wos.len()), "{wo:?}: {outcome:?}");
        }
    }
}

#[test]
fn a_sample_has_the_density_and_the_weight_of_its_direction() {
    let matte = bsdf(0);
    for wo in directions() {
        for i in 0..20_000 {
            let [u, v, lobe, _] = draw(3, i);
            let sample = matte.sample(wo, [u, v], lobe, MODE);
            let (f, pdf) = (matte.eval(wo, sample.wi, MODE), matte.pdf(wo, sample.wi));
            assert!(!sample.delta && (sample.pdf / pdf - 1.0).abs() < 1e-5, "{sample:?}: {pdf}");
            for (weight, f) in sample.weight.lane(0).into_iter().zip(f.lane(0)) {
                let expected = f * sample.wi.z.abs() / pdf;
                assert!((weight - expected).abs() < 1e-5, "{sample:?}: {expected}");
            }
        }
    }
}

/// A Lambertian lobe with an error in its sampling.
#[derive(Clone, Copy)]
enum Fault {
    /// The density is 2% too high everywhere.
    Scaled,
    /// The density is 2% too high on one half and too low on the other.
    Tilted,
    /// Directions are uniform over the hemisphere, without the cosine.
    Uniform,
    /// All light goes to one side, wherever it comes from.
    OneSided,
}

impl Bxdf<f32> for Fault {
    fn albedo(&self) -> Rgb<f32> {
        rgb([0.5; 3])
    }
    fn eval(&self, wo: Vec3<f32>, wi: Vec3<f32>, _mode: TransportMode) -> Rgb<f32> {
        Lambertian { reflectance: rgb([0.5; 3]) }.eval(wo, wi, MODE)
    }
    fn sample(&self, wo: Vec3<f32>, u: [f32; 2], lobe: f32, _mode: TransportMode) -> BxdfSample<f32> {
        let mut sample = Lambertian { reflectance: rgb([0.5; 3]) }.sample(wo, u, lobe, MODE);
        match self {
            Fault::Uniform => {
                let w = warp::uniform_sphere(u);
                sample.wi = Vec3::new(w.x, w.y, w.z.copysign(wo.z));
            }
            Fault::OneSided => sample.wi.z = sample.wi.z.abs(),
            Fault::Scaled | Fault::Tilted => {}
        }
        sample
    }
    fn pdf(&self, wo: Vec3<f32>, wi: Vec3<f32>) -> f32 {
        let pdf = Lambertian { reflectance: rgb([0.5; 3]) }.pdf(wo, wi);
        match self {
            Fault::Scaled => pdf * 1.02,
            Fault::Tilted => pdf * (1.0 + 0.02_f32.copysign(wi.x)),
            Fault::Uniform | Fault::OneSided => pdf,
        }
    }
}

#[test]
fn wrong_densities_and_missing_cosines_are_detected() {
    for fault in [Fault::Scaled, Fault::Tilted, Fault::Uniform, Fault::OneSided] {
        // From below the surface, where all four are wrong.
        let outcome = follows(&fault, direction(-0.4, 0.3), 90);
        // At a much stricter level than that of the other tests.
        assert!(!outcome.agrees(1_000_000), "fault {}: {outcome:?}", fault as u32);
    }
}

/// The Fresnel reflectance of unpolarised light, from sines and tangents.
fn fresnel(cos_i: f64, eta: f64) -> f64 {
    let i = cos_i.acos();
    let sin_t = i.sin() / eta;
    if sin_t >= 1.0 {
        return 1.0;
    }
    if i < 1e-6 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let t = sin_t.asin();
    let s = ((i - t).sin() / (i + t).sin()).powi(2);
    let p = ((i - t).tan() / (i + t).tan()).powi(2);
    (s + p) / 2.0
}

/// Snell's law with vectors: −wo/η, plus a component along the normal that makes the length one.
fn snell(wo: DVec3, eta: f64) -> DVec3 {
    let across = DVec3::new(wo.x, wo.y, 0.0) * (-1.0 / eta);
    across - DVec3::Z * wo.z.signum() * (1.0 - across.length_squared()).max(0.0).sqrt()
}

#[test]
fn a_mirror_reflects_about_the_normal() {
    let mirror = SpecularReflection { reflectance: rgb([0.7, 0.4, 0.2]) };
    for wo in directions() {
        let expected = DVec3::Z * (2.0 * wide(wo).z) - wide(wo);
        for i in 0..1000 {
            let [u, v, lobe, _] = draw(4, i);
            for sample in [mirror.sample(wo, [u, v], lobe, MODE), bsdf(1).sample(wo, [u, v], lobe, MODE)] {
                assert!((wide(sample.wi) - expected).length() < 1e-6 && sample.delta, "{sample:?}");
                assert_eq!((sample.pdf, sample.weight), (1.0, mirror.reflectance));
            }
            // No other direction, and no density.
            let wi = uniform([u, v, 0.0, 0.0]);
            assert_eq!((mirror.eval(wo, wi, MODE), mirror.pdf(wo, wi)), (Rgb::black(), 0.0));
            assert_eq!((bsdf(1).eval(wo, wi, MODE), bsdf(1).pdf(wo, wi)), (Rgb::black(), 0.0));
        }
    }
}

/// The frequency of reflection by glass, as z for a given reflectance; each direction and weight is checked.
fn z_of_reflections(
    glass: &impl Bxdf<f32>,
    [r, t]: [f64; 2],
    ior: f64,
    wo: Vec3<f32>,
    probability: f64,
) -> f64 {
    const DRAWS: u32 = 1_000_000;
    let eta = if wo.z > 0.0 { ior } else { 1.0 / ior };
    let w = wide(wo);
    let (reflected, refracted) = (DVec3::new(-w.x, -w.y, w.z), snell(w, eta));
    let mut reflections = 0_u32;
    for i in 0..DRAWS {
        let [u, v, lobe, _] = draw(5, i);
        let sample = glass.sample(wo, [u, v], lobe, MODE);
        let reflects = sample.wi.z * wo.z > 0.0;
        reflections += u32::from(reflects);
        let (wi, weight) = if reflects { (reflected, r) } else { (refracted, t / (eta * eta)) };
        assert!(sample.delta && (wide(sample.wi) - wi).length() < 1e-5, "{wo:?}: {sample:?}, not {wi}");
        let off = (f64::from(sample.weight.r) / weight - 1.0).abs();
        assert!(off < 1e-4, "{wo:?}: {sample:?}, not {weight}");
    }
    let n = f64::from(DRAWS);
    let noise = (n * probability * (1.0 - probability)).sqrt();
    let off = f64::from(reflections) - n * probability;
    if noise < 1e-3 { if off == 0.0 { 0.0 } else { f64::INFINITY } } else { off / noise }
}

#[test]
fn glass_reflects_and_refracts_in_the_proportion_of_fresnel() {
    let glasses = [(2, 1.5, [1.0, 1.0]), (3, 0.75, [0.8, 0.9])];
    let wos = directions();
    let level = sidak(LEVEL, glasses.len() * wos.len());
    for (index, ior, tints) in glasses {
        for wo in wos {
            let eta = if wo.z > 0.0 { ior } else { 1.0 / ior };
            let probability = fresnel(f64::from(wo.z.abs()).min(1.0), eta);
            let z = z_of_reflections(&bsdf(index), tints, ior, wo, probability);
            assert!(normal_tails(z) > level, "ior {ior}, {wo:?}: off by {z} σ");
            // Negative control: the smaller of reflectance and transmittance is off by 2%.
            if probability > 0.01 && probability < 0.99 {
                let wrong =
                    if probability < 0.5 { 1.02 * probability } else { 1.0 - 1.02 * (1.0 - probability) };
                let z = z_of_reflections(&bsdf(index), tints, ior, wo, wrong);
                let enough = (1e6 * probability.min(1.0 - probability)).sqrt() * 0.02 > 8.0;
                assert!(
                    !enough || normal_tails(z) < level,
                    "ior {ior}, {wo:?}: an error of 2% is not detected, {z} σ"
                );
            }
        }
    }
}

/// The light towards `wo` in a white environment, with its standard error, by BxDF samples. Refraction into glass
/// concentrates radiance; `scale`, a function of the relative index of refraction, compensates for that.
fn albedo<B: Bxdf<f32>>(
    bxdf: &B,
    wo: Vec3<f32>,
    mode: TransportMode,
    scale: impl Fn(f32) -> f32,
) -> (f64, f64) {
    const DRAWS: u32 = 100_000;
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..DRAWS {
        let [u, v, lobe, _] = draw(6, i);
        let sample = bxdf.sample(wo, [u, v], lobe, mode);
        let x = f64::from(sample.weight.max_channel() * scale(sample.eta));
        sum += x;
        squares += x * x;
    }
    let n = f64::from(DRAWS);
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
}

/// ∫ f·|cos| over all directions by the midpoint rule, whose error for a smooth f and this number of points is below
/// 10⁻⁴.
fn integral<B: Bxdf<f32>>(bxdf: &B, wo: Vec3<f32>) -> f64 {
    scaled_integral(bxdf, wo, |_| 1.0)
}

/// The same with f multiplied by a factor of its direction.
fn scaled_integral<B: Bxdf<f32>>(bxdf: &B, wo: Vec3<f32>, scale: impl Fn(Vec3<f32>) -> f64) -> f64 {
    const N: u32 = 256;
    let mut sum = 0.0;
    for i in 0..N {
        // By angles, because lobes may be narrow around the normal.
        let theta = (f64::from(i) + 0.5) / f64::from(N) * PI;
        let (cos, sin) = (theta.cos(), theta.sin());
        for k in 0..N {
            let wi = direction(cos, (f64::from(k) + 0.5) / f64::from(N) * TAU);
            sum += f64::from(bxdf.eval(wo, wi, MODE).max_channel()) * cos.abs() * sin * scale(wi);
        }
    }
    sum * PI * TAU / f64::from(N * N)
}

/// Checks that no more light leaves than arrives: exactly, and by BxDF samples at five standard errors, which fails by
/// chance once in three million times. 10⁻⁴ are for rounding and quadrature.
fn conserves<B: Bxdf<f32>>(bxdf: &B, mode: TransportMode, scale: impl Fn(f32) -> f32) -> bool {
    directions().into_iter().all(|wo| {
        let (mean, error) = albedo(bxdf, wo, mode, &scale);
        mean <= 1.0 + 5.0 * error + 1e-4 && integral(bxdf, wo) <= 1.0 + 1e-4
    })
}

/// Whether f is symmetric.
fn reciprocal<B: Bxdf<f32>>(bxdf: &B) -> bool {
    (0..20_000).all(|i| {
        let [a, b, c, d] = draw(7, i);
        let (wo, wi) = (uniform([a, b, 0.0, 0.0]), uniform([c, d, 0.0, 0.0]));
        let (there, back) = (bxdf.eval(wo, wi, MODE).lane(0), bxdf.eval(wi, wo, MODE).lane(0));
        there.iter().zip(back).all(|(a, b)| (a - b).abs() <= 1e-6 * a.abs())
    })
}

#[test]
fn no_bxdf_creates_energy() {
    let none = |_: f32| 1.0;
    assert!(conserves(&Lambertian { reflectance: rgb([1.0; 3]) }, MODE, none));
    assert!(conserves(&SpecularReflection { reflectance: rgb([1.0; 3]) }, MODE, none));
    for (index, bsdf) in bsdfs().into_iter().enumerate() {
        assert!(conserves(&bsdf, MODE, |eta| eta * eta), "material {index}");
        // Power is not concentrated by refraction.
        assert!(conserves(&bsdf, TransportMode::Importance, none), "material {index}");
    }
}

#[test]
fn a_matte_surface_scatters_its_reflectance() {
    for wo in directions() {
        let (mean, error) = albedo(&bsdf(0), wo, MODE, |_| 1.0);
        assert!((mean - 0.7).abs() <= 5.0 * error + 1e-6 && (integral(&bsdf(0), wo) - 0.7).abs() < 1e-4);
    }
}

#[test]
fn every_bxdf_is_reciprocal() {
    for (index, bsdf) in bsdfs().iter().enumerate() {
        assert!(reciprocal(bsdf), "material {index}");
    }
    assert!(reciprocal(&Lambertian { reflectance: rgb([0.7, 0.4, 0.2]) }));
}

/// The deviation from reciprocity of refraction from `wo` and back: |1 − there/back| of f·|cos|·η², which is symmetric
/// for flux, unlike radiance (Veach 1997, §5.2). Also the direction after the way back.
fn passage(glass: &SmoothDielectric<f32>, wo: Vec3<f32>, scale: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let ior = f64::from(glass.ior);
    let eta = |w: Vec3<f32>| if w.z > 0.0 { ior } else { 1.0 / ior };
    let [_, Branch { wi, weight: there, probability }] = glass.branches(wo, MODE);
    if probability <= 0.0 {
        return None;
    }
    let [_, Branch { wi: home, weight: back, .. }] = glass.branches(wi, MODE);
    let flux = |w: Vec3<f32>, weight: Rgb<f32>| f64::from(weight.r) * scale(eta(w));
    Some(((1.0 - flux(wo, there) / flux(wi, back)).abs(), (wide(home) - wide(wo)).length()))
}

#[test]
fn glass_is_reciprocal_up_to_the_scaling_of_radiance() {
    let (mut passages, mut caught) = (0, 0);
    for ior in [1.5, 0.75, 2.4] {
        let glass = SmoothDielectric { ior, reflectance: rgb([1.0; 3]), transmittance: rgb([0.9; 3]) };
        for i in 0..20_000 {
            let wo = uniform(draw(8, i));
            // Reflection returns along the same path with the same weight.
            let [Branch { wi: mirrored, weight: there, .. }, _] = glass.branches(wo, MODE);
            let [Branch { wi: home, weight: back, .. }, _] = glass.branches(mirrored, MODE);
            assert_eq!((home, there), (wo, back));
            // At nearly grazing directions, f32 has few digits of the cosine left on the denser side.
            if wo.z.abs() < 0.02 || glass.branches(wo, MODE)[1].wi.z.abs() < 0.02 {
                continue;
            }
            let Some((off, astray)) = passage(&glass, wo, |eta| eta * eta) else { continue };
            passages += 1;
            // Rounding gives a cosine c a relative error of about 2⁻²⁴/c², here at most 1.5·10⁻⁴, a few times over.
            assert!(off < 1e-3 && astray < 1e-4, "ior {ior}, {wo:?}: {off:e}, {astray:e}");
            // Negative control: without η², or with η, it would not be symmetric.
            let without = passage(&glass, wo, |_| 1.0).is_some_and(|(off, _)| off > 0.1);
            let half = passage(&glass, wo, |eta| eta).is_some_and(|(off, _)| off > 0.1);
            caught += u32::from(without && half);
        }
    }
    assert!(passages > 30_000 && passages == caught, "{passages} refractions, {caught} detected without η²");
}

/// A BxDF that violates a law.
#[derive(Clone, Copy)]
enum Outlaw {
    /// Returns 2% more light than it receives.
    Bright,
    /// Scatters by the cosine of one direction only.
    Lopsided,
}

impl Bxdf<f32> for Outlaw {
    fn albedo(&self) -> Rgb<f32> {
        rgb([0.5; 3])
    }
    fn eval(&self, wo: Vec3<f32>, wi: Vec3<f32>, _mode: TransportMode) -> Rgb<f32> {
        let reflectance = match self {
            Outlaw::Bright => 1.02,
            // At most 2%.
            Outlaw::Lopsided => 0.5 * (1.0 + 0.02 * wo.z.abs()),
        };
        Lambertian { reflectance: rgb([reflectance; 3]) }.eval(wo, wi, MODE)
    }
    fn sample(&self, wo: Vec3<f32>, u: [f32; 2], lobe: f32, _mode: TransportMode) -> BxdfSample<f32> {
        let reflectance = if matches!(self, Outlaw::Bright) { 1.02 } else { 0.5 };
        Lambertian { reflectance: rgb([reflectance; 3]) }.sample(wo, u, lobe, MODE)
    }
    fn pdf(&self, wo: Vec3<f32>, wi: Vec3<f32>) -> f32 {
        Lambertian { reflectance: rgb([1.0; 3]) }.pdf(wo, wi)
    }
}

#[test]
fn created_energy_and_asymmetric_scattering_are_detected() {
    let none = |_: f32| 1.0;
    assert!(!conserves(&Outlaw::Bright, MODE, none) && reciprocal(&Outlaw::Bright));
    assert!(conserves(&Outlaw::Lopsided, MODE, none) && !reciprocal(&Outlaw::Lopsided));
    // Only sampling reveals the first.
    let (mean, error) = albedo(&Outlaw::Bright, direction(0.5, 0.0), MODE, |_| 1.0);
    assert!(mean > 1.0 + 5.0 * error + 1e-4);
    // Glass without the factor for radiance: from outside it transmits η² of the correct value.
    assert!(!conserves(&bsdf(2), MODE, |eta| eta.powi(4)));
    // And power with the factor for radiance.
    assert!(!conserves(&bsdf(2), TransportMode::Importance, |eta| eta * eta));
}
