//! Rough surfaces: the properties of all BxDFs, for any parameters.

use super::*;

/// A selection of rough surfaces.
fn fewer_directions() -> [Vec3<f32>; 5] {
    [1.0, 0.7, 0.15, -0.02, -0.5].map(|cos| direction(cos, 1.0 + 2.0 * cos))
}

#[test]
fn directions_of_rough_surfaces_follow_their_density() {
    let (wos, rough) = (fewer_directions(), rough());
    let tests = rough.len() * wos.len();
    for (i, rough) in rough.iter().enumerate() {
        for (j, &wo) in wos.iter().enumerate() {
            let outcome = follows(&rough.bsdf(), wo, 300 + (10 * i + j) as u32);
            assert!(outcome.agrees(tests), "{}, {wo:?}: {outcome:?}", rough.name);
        }
    }
}

/// Faulty rough metals: one samples normals of one width and returns the density of another; one omits the masking of
/// the sampled normals.
#[derive(Clone, Copy)]
enum WrongMetal {
    Narrow,
    Unmasked,
}

impl WrongMetal {
    fn metal(width: f32) -> RoughMetal<f32> {
        let metal = Metal { eta: rgb([0.2; 3]), k: rgb([3.0; 3]) };
        RoughMetal { metal, normals: Ggx { alpha: [width, width] } }
    }
}

impl Bxdf<f32> for WrongMetal {
    fn albedo(&self) -> Rgb<f32> {
        rgb([0.9; 3])
    }
    fn eval(&self, wo: Vec3<f32>, wi: Vec3<f32>, mode: TransportMode) -> Rgb<f32> {
        WrongMetal::metal(0.5).eval(wo, wi, mode)
    }
    fn sample(&self, wo: Vec3<f32>, u: [f32; 2], lobe: f32, mode: TransportMode) -> BxdfSample<f32> {
        WrongMetal::metal(0.5).sample(wo, u, lobe, mode)
    }
    fn pdf(&self, wo: Vec3<f32>, wi: Vec3<f32>) -> f32 {
        match self {
            WrongMetal::Narrow => WrongMetal::metal(0.49).pdf(wo, wi),
            WrongMetal::Unmasked => {
                let h = (wo + wi).normalized();
                let pdf = Ggx { alpha: [0.5; 2] }.density(h) * h.z.abs() / (4.0 * wo.dot(h).abs());
                if wo.z * wi.z > 0.0 { pdf } else { 0.0 }
            }
        }
    }
}

#[test]
fn wrong_widths_and_missing_masking_are_detected() {
    for wrong in [WrongMetal::Narrow, WrongMetal::Unmasked] {
        let outcome = follows(&wrong, direction(0.4, 0.3), 95);
        assert!(!outcome.agrees(1_000_000), "{}: {outcome:?}", wrong as u32);
    }
}

/// The largest relative difference of f·|cos|/pdf and of the density from those of samples.
fn worst_sample(bsdf: &impl Bxdf<f32>, wo: Vec3<f32>, mode: TransportMode) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..20_000 {
        let [u, v, lobe, _] = draw(9, i);
        let sample = bsdf.sample(wo, [u, v], lobe, mode);
        if sample.pdf <= 0.0 {
            assert_eq!(sample.weight, Rgb::black(), "{sample:?}");
            continue;
        }
        let f = match mode {
            TransportMode::Radiance => bsdf.eval(wo, sample.wi, mode),
            TransportMode::Importance => bsdf.eval(sample.wi, wo, mode),
        };
        let pdf = bsdf.pdf(wo, sample.wi);
        worst = worst.max(f64::from((pdf / sample.pdf - 1.0).abs()));
        for (weight, f) in sample.weight.lane(0).into_iter().zip(f.lane(0)) {
            let expected = f * sample.wi.z.abs() / pdf;
            worst = worst.max(f64::from((weight - expected).abs() / expected.max(1e-3)));
        }
    }
    worst
}

#[test]
fn samples_of_rough_surfaces_have_their_density_and_weight() {
    for rough in rough() {
        for wo in directions() {
            for mode in [MODE, TransportMode::Importance] {
                let worst = worst_sample(&rough.bsdf(), wo, mode);
                assert!(worst < 5e-3, "{}, {wo:?}: {worst:e}", rough.name);
            }
        }
    }
    // Negative control: the density of normals 2% narrower.
    assert!(worst_sample(&WrongMetal::Narrow, direction(0.4, 0.3), MODE) > 5e-3);
}

/// The integral of scattered light is the same by sampling and by evaluation. It is no more than the incident light, if
/// radiance is divided by the square of the index of refraction.
#[test]
fn rough_surfaces_scatter_the_same_by_sampling_and_by_evaluation() {
    for rough in rough() {
        let bsdf = rough.bsdf();
        for wo in directions() {
            let (mean, error) = albedo(&bsdf, wo, MODE, |eta| eta * eta);
            let (power, error_of_power) = albedo(&bsdf, wo, TransportMode::Importance, |_| 1.0);
            assert!(mean <= 1.0 + 5.0 * error + 1e-4, "{}, {wo:?}: {mean}", rough.name);
            assert!((power - mean).abs() <= 5.0 * error_of_power + 1e-4, "{}, {wo:?}: {power}", rough.name);
            // At grazing directions, lobes are narrow for the midpoint rule.
            if wo.z.abs() < 0.1 {
                continue;
            }
            let integral = scaled_integral(&bsdf, wo, |wi| rough.n2(wi) / rough.n2(wo));
            let off = (mean - integral).abs();
            assert!(off < 5.0 * error + 2e-3, "{}, {wo:?}: {mean} and {integral}", rough.name);
            assert!(mean > 0.2, "{}, {wo:?}: {mean}", rough.name);
        }
    }
}

#[test]
fn rough_surfaces_are_reciprocal_up_to_the_scaling_of_radiance() {
    for rough in rough() {
        let bsdf = rough.bsdf();
        let (mut refracted, mut caught) = (0, 0);
        for i in 0..20_000 {
            let [a, b, c, d] = draw(10, i);
            let (wo, wi) = (uniform([a, b, 0.0, 0.0]), uniform([c, d, 0.0, 0.0]));
            let there = f64::from(bsdf.eval(wo, wi, MODE).r);
            let back = f64::from(bsdf.eval(wi, wo, MODE).r);
            let (scaled_there, scaled_back) = (there / rough.n2(wo), back / rough.n2(wi));
            let off = (scaled_there - scaled_back).abs();
            assert!(off <= 2e-3 * scaled_there.max(1e-4), "{}, {wo:?}, {wi:?}: {there} {back}", rough.name);
            if rough.ior != 1.0 && wo.z * wi.z < 0.0 && there > 1e-6 {
                refracted += 1;
                caught += u32::from((there / back - 1.0).abs() > 0.1);
            }
        }
        // Negative control: without n² it would not be symmetric.
        assert_eq!(refracted, caught);
        assert!(rough.ior == 1.0 || refracted > 1000, "{}: {refracted}", rough.name);
    }
}

/// Directions from the normal to grazing, with some at the very edge.
fn anywhere(stream: &mut Stream) -> Vec3<f32> {
    let w = uniform([stream.random(), stream.random(), 0.0, 0.0]);
    match stream.random_range(0..8) {
        0 => Vec3::new(w.x, w.y, w.z * 1e-6).normalized(),
        1 => Vec3::new(w.x * 1e-6, w.y * 1e-6, w.z).normalized(),
        2 => Vec3::new(0.0, 0.0, 1.0_f32.copysign(w.z)),
        _ => w,
    }
}

/// Numbers in [0, 1), with some at the ends.
fn anything(stream: &mut Stream) -> f32 {
    match stream.random_range(0..16) {
        0 => 0.0,
        1 => 0.999_999_94,
        _ => stream.random(),
    }
}

/// A row with random parameters from their whole ranges.
type Draw = fn(&mut Stream) -> Row;

/// A roughness in [0, 1], as often small as large.
fn any_roughness(stream: &mut Stream) -> f64 {
    if stream.random_bool(0.1) {
        f64::from(stream.random_bool(0.5))
    } else {
        10_f64.powf(stream.random_range(-3.0..0.0))
    }
}

fn any_matte(stream: &mut Stream) -> Row {
    let reflectance = [(); 3].map(|()| f64::from(anything(stream)));
    MatteParameters { reflectance, roughness: any_roughness(stream) }.row()
}

fn any_dielectric(stream: &mut Stream) -> Row {
    let ior = match stream.random_range(0..4) {
        0 => 1.0 + stream.random_range(-0.01..0.01_f64),
        1 => 10_f64.powf(stream.random_range(-1.0..1.0)),
        _ => stream.random_range(0.4..2.5),
    };
    let roughness = [(); 2].map(|()| any_roughness(stream));
    let [reflectance, transmittance] = [(); 2].map(|()| [(); 3].map(|()| f64::from(anything(stream))));
    let thin_walled = stream.random_bool(0.4);
    let (absorption, priority) = ([0.0; 3], 0.0);
    DielectricParameters { ior, roughness, absorption, priority, thin_walled, reflectance, transmittance }
        .row()
}

fn any_conductor(stream: &mut Stream) -> Row {
    let eta = [(); 3].map(|()| 10_f64.powf(stream.random_range(-3.0..3.0)));
    let k = [(); 3]
        .map(|()| if stream.random_bool(0.1) { 0.0 } else { 10_f64.powf(stream.random_range(-3.0..3.0)) });
    let roughness = [(); 2].map(|()| any_roughness(stream));
    ConductorParameters { metal: None, eta: Some(eta), k: Some(k), roughness }.row()
}

/// For any parameters, directions and numbers, samples are directions, weights are at most one, and nothing is infinite
/// or NaN.
#[test]
fn no_parameters_and_no_directions_give_nan() {
    // Rough matte surfaces are sampled by the cosine: single weights may be above one.
    let kinds: [(&str, Draw, f32); 3] =
        [("conductor", any_conductor, 1.0), ("matte", any_matte, 1e6), ("dielectric", any_dielectric, 1.0)];
    let stream = &mut Stream::new(12, 0, 0);
    for (name, draw, most) in kinds {
        for i in 0..1_000_000 {
            let row = draw(stream);
            let bsdf = of(row);
            let (wo, other) = (anywhere(stream), anywhere(stream));
            let u = [(); 3].map(|()| anything(stream));
            let sample = bsdf.sample(wo, [u[0], u[1]], u[2], MODE);
            let about = || format!("{name} {i}: {row:?}, {wo:?}, {u:?}: {sample:?}");
            assert!((sample.wi.length() - 1.0).abs() < 1e-5, "{}", about());
            assert!(sample.pdf >= 0.0 && sample.pdf.is_finite() && sample.eta > 0.0, "{}", about());
            let most = most / (sample.eta * sample.eta) * 1.0001;
            for weight in sample.weight.lane(0) {
                assert!((0.0..=most).contains(&weight), "{}", about());
            }
            for wi in [sample.wi, other, Vec3::new(-wo.x, -wo.y, wo.z), -wo] {
                let (f, pdf) = (bsdf.eval(wo, wi, MODE), bsdf.pdf(wo, wi));
                assert!(pdf >= 0.0 && pdf.is_finite(), "{}, {wi:?}: pdf {pdf}", about());
                for f in f.lane(0) {
                    assert!(f >= 0.0 && f.is_finite(), "{}, {wi:?}: {f}", about());
                }
            }
        }
    }
}
