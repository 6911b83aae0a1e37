use super::*;
use crate::film::cryptomatte::id;
use crate::sampling::Stream;
use rand::RngExt;

const LAYERS: [Layer; 7] = [
    Layer::Albedo,
    Layer::Normal,
    Layer::Position,
    Layer::Depth,
    Layer::Uv,
    Layer::CryptoEntity,
    Layer::CryptoMaterial,
];

/// A hit at a distance of any magnitude, or a miss.
fn hit(stream: &mut Stream, things: u32) -> FirstHit {
    let mut at = |size: f32| [0; 3].map(|_| stream.random_range(-1.0..1.0_f32) * size);
    let (albedo, normal) = (at(1.0).map(f32::abs), at(1.0));
    let scale = stream.random_range(-60.0..50.0_f32).exp2();
    let mut far = || stream.random_range(-1.0..1.0_f32) * scale;
    let (position, uv, depth) = ([far(), far(), far()], [far(), far()], far());
    let (entity, material) = (stream.random_range(0..things), stream.random_range(0..5));
    match stream.random_range(0..5) {
        0 => FirstHit::default(),
        _ => FirstHit { slot: 0, met: true, albedo, normal, position, depth, uv, entity, material },
    }
}

fn sums_of(set: LayerSet, hits: &[(u32, FirstHit)]) -> LayerSums {
    let mut sums = LayerSums::new(set);
    sums.grow(1);
    hits.iter().for_each(|(sample, hit)| sums.add(0, *sample, &[*hit]));
    sums
}

#[test]
fn parts_add_up_to_the_whole_in_any_order() {
    let stream = &mut Stream::new(1, 0, 0);
    for things in [7, 300, 100_000] {
        let set = LayerSet::new(&LAYERS, things as usize, 5);
        let hits: Vec<_> = (0..LAYER_SAMPLES).map(|sample| (sample, hit(stream, things))).collect();
        let whole = sums_of(set, &hits);
        let mut shuffled = hits.clone();
        (1..shuffled.len()).rev().for_each(|i| shuffled.swap(i, stream.random_range(0..=i)));
        assert!(sums_of(set, &shuffled) == whole);
        let (mut at_once, all) = (LayerSums::new(set), hits.iter().map(|(_, hit)| *hit).collect::<Vec<_>>());
        at_once.grow(1);
        at_once.add(0, 0, &all[..9]);
        at_once.add(0, 9, &all[9..]);
        assert!(at_once == whole);
        let (a, b) = shuffled.split_at(11);
        let [a, b] = [a, b].map(|hits| sums_of(set, hits));
        let mut sum = b.clone();
        sum.merge(0, &a, 0);
        assert!(sum == whole);
        // Through a film file.
        let mut read = LayerSums::new(set);
        read.grow(1);
        for part in [&a, &b] {
            let bytes: Vec<u8> = part.pixel_bytes(0).collect();
            assert_eq!(bytes.len() as u64, set.pixel_bytes());
            let [traced, met] = read.add_bytes(0, &bytes);
            assert_eq!(u64::from(met) << 32 | u64::from(traced), part.words[0]);
        }
        assert!(read == whole && whole.words[0] as u32 == u32::MAX);
        // Negative controls: one sample fewer, and a sample with a tiny change.
        assert!(sums_of(set, &hits[1..]) != whole);
        let mut other = hits.clone();
        let met = other.iter_mut().find(|(_, hit)| hit.met).expect("most samples hit");
        met.1.normal[2] += 1e-6;
        assert!(sums_of(set, &other) != whole);
    }
}

#[test]
fn channels_are_the_means_of_the_hits() {
    let stream = &mut Stream::new(2, 0, 0);
    let names: Vec<String> = (0..400).map(|i| format!("thing {}", i % 390)).collect();
    let names = Names::new("CryptoEntity", names);
    let set = LayerSet::new(&LAYERS, 400, 400);
    let (mut compared, mut told_apart) = (0, 0);
    for _ in 0..50 {
        let hits: Vec<_> = (0..20).map(|sample| (sample, hit(stream, 400))).collect();
        let (sums, fewer) = (sums_of(set, &hits), sums_of(set, &hits[1..]));
        let met: Vec<&FirstHit> = hits.iter().map(|(_, hit)| hit).filter(|hit| hit.met).collect();
        let mean = |of: &dyn Fn(&FirstHit) -> f32, count: usize| {
            let sum: f64 = met.iter().map(|hit| f64::from(of(hit))).sum();
            let size: f64 = met.iter().map(|hit| f64::from(of(hit).abs())).sum();
            (sum / count as f64, size / count as f64)
        };
        let channel = |sums: &LayerSums, layer: Layer, component: usize| {
            let channels = sums.channels(layer, 0..1, Some(&names));
            assert_eq!(channels.len(), layer.channels().len());
            f64::from(channels[component].values[0])
        };
        for c in 0..3 {
            for (layer, (mean, size)) in [
                (Layer::Albedo, mean(&|hit| hit.albedo[c], 20)),
                (Layer::Normal, mean(&|hit| hit.normal[c], 20)),
                (Layer::Position, mean(&|hit| hit.position[c], met.len())),
                (Layer::Uv, mean(&|hit| hit.uv[c % 2], met.len())),
                (Layer::Depth, mean(&|hit| hit.depth, met.len())),
            ] {
                let c = if layer == Layer::Depth {
                    0
                } else if layer == Layer::Uv {
                    c % 2
                } else {
                    c
                };
                // Half a unit of single precision, and a rounding error of 2⁻³² or 2⁻⁶⁴.
                let bound =
                    mean.abs() * 6e-8 + size * 1e-15 + if set.words(layer) == 3 { 1.2e-10 } else { 2.8e-20 };
                let off = |sums| (channel(sums, layer, c) - mean).abs();
                assert!(off(&sums) <= bound, "{layer:?} {c}: off by {}, {mean}", off(&sums));
                (compared, told_apart) = (compared + 1, told_apart + u32::from(off(&fewer) > bound));
            }
        }
        let ids = met.iter().map(|hit| id(&format!("thing {}", hit.entity % 390)));
        let first = ids
            .clone()
            .max_by_key(|&one| (ids.clone().filter(|&other| other == one).count(), std::cmp::Reverse(one)));
        let coverage = ids.clone().filter(|&other| Some(other) == first).count() as f32 / 20.0;
        let ranks = sums.channels(Layer::CryptoEntity, 0..1, Some(&names));
        assert_eq!(Some(ranks[0].values[0].to_bits()), first);
        assert_eq!(ranks[1].values[0], coverage);
    }
    // Negative control: one sample fewer. If it met no surface, the means over hits do not change.
    assert!(told_apart > compared / 2, "{told_apart} of {compared}");
}

#[test]
fn a_uniform_surface_is_exact_and_a_miss_has_the_largest_depth() {
    let set = LayerSet::new(&LAYERS, 1, 1);
    let hit = FirstHit {
        met: true,
        albedo: [0.1, 0.7, 1.0],
        position: [1e-12, -3.3e-7, 7e12],
        depth: 1e10,
        ..FirstHit::default()
    };
    let sums = sums_of(set, &(0..LAYER_SAMPLES).map(|sample| (sample, hit)).collect::<Vec<_>>());
    let values = |layer| {
        let channels = sums.channels(layer, 0..1, None);
        channels.iter().map(|channel| channel.values[0]).collect::<Vec<_>>()
    };
    assert_eq!(values(Layer::Albedo), hit.albedo);
    assert_eq!(values(Layer::Position), hit.position);
    assert_eq!(values(Layer::Depth), [hit.depth]);
    let mut nothing = LayerSums::new(set);
    nothing.grow(2);
    nothing.add(1, 0, &[FirstHit::default()]);
    assert_eq!(nothing.channels(Layer::Depth, 0..2, None)[0].values, [NO_DEPTH; 2]);
    assert_eq!(nothing.channels(Layer::Albedo, 0..2, None)[0].values, [0.0; 2]);
    assert!(nothing.channels(Layer::Variance, 0..2, None).is_empty());
}

// The largest summands fit into the words 32 times.
#[test]
fn huge_numbers_and_nan_do_not_overflow() {
    let set = LayerSet::new(&LAYERS, 1, 1);
    for (value, albedo, position) in [
        (f32::INFINITY, MOST_UNIT as f32, 57.0_f32.exp2()),
        (f32::MAX, MOST_UNIT as f32, 57.0_f32.exp2()),
        (f32::NEG_INFINITY, -MOST_UNIT as f32, -57.0_f32.exp2()),
        (f32::NAN, 0.0, 0.0),
        (1e9, MOST_UNIT as f32, 1e9),
        (2000.5, 2000.5, 2000.5),
        (f32::MIN_POSITIVE, 0.0, 0.0),
    ] {
        let hit = FirstHit { met: true, albedo: [value; 3], position: [value; 3], ..FirstHit::default() };
        let sums = sums_of(set, &(0..LAYER_SAMPLES).map(|sample| (sample, hit)).collect::<Vec<_>>());
        assert_eq!(sums.channels(Layer::Albedo, 0..1, None)[1].values, [albedo], "{value}");
        assert_eq!(sums.channels(Layer::Position, 0..1, None)[2].values, [position], "{value}");
    }
    assert_eq!((wide(-1.5), wide(0.0), wide(-0.0)), (-3 << 63, 0, 0));
    assert_eq!(wide(libm::exp2f(-64.0)), 1);
    assert_eq!(wide(-libm::exp2f(-66.0)), 0);
    assert_eq!(wide(libm::exp2f(-41.0) * 1.999_999_9), ((1_i128 << 24) - 1));
    assert_eq!(unit(-0.25), -1 << 30);
}
