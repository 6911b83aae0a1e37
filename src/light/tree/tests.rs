use super::*;
use crate::light::{Light, PointLight, flat};
use crate::math::lanes::{Level, dispatch};
use crate::sampling::Stream;
use rand::RngExt;

fn point(position: [f32; 3], intensity: [f32; 3]) -> LightBounds {
    PointLight { position, intensity }.bounds().unwrap()
}

fn scattered(count: u32) -> Vec<LightBounds> {
    let unit = |i: u32, k: u32| crate::math::Uint::to_unit(Wrapping((i * 3 + k).wrapping_mul(2_654_435_769)));
    (0..count).map(|i| point([0, 1, 2].map(|k| 10.0 * unit(i, k)), [1.0 + unit(i, 7); 3])).collect()
}

#[test]
fn the_pmf_sums_to_one_and_matches_the_choice() {
    for count in [1, 2, 3, 17, 500] {
        let tree = LightTree::new(&scattered(count));
        let p = Vec3::splat([4.0_f32, 5.0, 3.0]);
        let n = Vec3::splat([0.0_f32, 0.6, 0.8]);
        let sum: f64 = (0..count).map(|l| f64::from(tree.pmf(p, n, Wrapping(l), true))).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{count} lights: {sum}");
        let mut seen = vec![0_u32; count as usize];
        let draws = 20_000;
        for i in 0..draws {
            let (light, pmf) = tree.choose(p, n, (i as f32 + 0.5) / draws as f32, true);
            let again = tree.pmf(p, n, light, true);
            assert!((pmf - again).abs() <= 1e-5 * pmf, "{pmf} is not {again}");
            seen[light.0 as usize] += 1;
        }
        for (light, &times) in seen.iter().enumerate() {
            let expected = f64::from(tree.pmf(p, n, Wrapping(light as u32), true)) * f64::from(draws);
            assert!(
                (f64::from(times) - expected).abs() <= 2.0 + 1e-3 * expected,
                "light {light}: {times} of {expected}"
            );
        }
    }
}

#[test]
fn near_and_strong_lights_are_preferred() {
    let far = point([100.0, 0.0, 0.0], [1.0; 3]);
    let near = point([1.0, 0.0, 0.0], [1.0; 3]);
    let tree = LightTree::new(&[far, near]);
    let (p, n) = (Vec3::<f32>::zero(), Vec3::splat([1.0_f32, 0.0, 0.0]));
    assert!(tree.pmf(p, n, Wrapping(1), true) > 0.99);
}

#[test]
fn distant_meshes_are_sampled_by_power_and_near_ones_are_not() {
    // A strip of squares that emit towards +z, each with twice the power of the one before it.
    let square = |i: u32, mesh: Option<u32>| {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| [x + i as f32, y, 0.0]);
        let own = flat::bounds(&corners, [0.0, 0.0, 1.0], 1.0, [(1 << i) as f32; 3]);
        LightBounds { mesh, ..own }
    };
    let strip = |mesh: Option<u32>| LightTree::new(&(0..8).map(|i| square(i, mesh)).collect::<Vec<_>>());
    let off = |tree: &LightTree, z: f32| {
        let (p, n) = (Vec3::<f32>::splat([0.0, 0.0, z]), Vec3::<f32>::splat([0.0, 0.0, -1.0]));
        let pmf = |i: u32| f64::from(tree.pmf(p, n, Wrapping(i), true));
        (0..8).map(|i| (pmf(i) * 255.0 / f64::from(1 << i) - 1.0).abs()).fold(0.0, f64::max)
    };
    let mesh = strip(Some(0));
    assert!(off(&mesh, 30.0) < 1e-4, "{}", off(&mesh, 30.0));
    assert!(off(&mesh, 1.0) > 0.5);
    // This does not hold for separate lights that happen to be side by side.
    assert!(off(&strip(None), 30.0) > 0.02);
}

/// Choices from some points, by lanes that are active together and one at a time.
struct Choices<'a> {
    tree: &'a LightTree,
    /// p, n and u of each.
    places: &'a [[f32; 7]],
    alone: bool,
}

impl Kernel for Choices<'_> {
    type Output = Vec<[u32; 3]>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Self::Output {
        let mut all = Vec::new();
        for from in (0..512).step_by(F::LANES) {
            let column = |k: usize| {
                let mut column = [0.0; MAX_LANES];
                (0..F::LANES).for_each(|lane| column[lane] = self.places[from + lane][k]);
                F::load(&column)
            };
            let p = Vec3::new(column(0), column(1), column(2));
            let n = Vec3::new(column(3), column(4), column(5)).normalized();
            let u = column(6);
            let runs = if self.alone { 0..F::LANES } else { 0..1 };
            for lane in runs {
                let lanes = if self.alone { lane..lane + 1 } else { 0..F::LANES };
                let active = F::Mask::from_bits(lanes.clone().map(|lane| 1 << lane).sum());
                let (light, pmf) = self.tree.choose(p, n, u, active);
                let again = self.tree.pmf(p, n, light, active);
                let [light, pmf, again] = [light, pmf.to_bits(), again.to_bits()].map(words);
                all.extend(lanes.map(|lane| [light[lane], pmf[lane], again[lane]]));
            }
        }
        all
    }
}

#[test]
fn lanes_choose_the_same_alone_and_together_at_every_level() {
    let stream = &mut Stream::new(45, 0, 0);
    let places: Vec<[f32; 7]> = (0..512)
        .map(|_| {
            let mut unit = || stream.random::<f32>();
            [2.7 + 6.6 * unit(), 2.7 + 6.6 * unit(), 1.0 + 2.0 * unit(), unit(), unit(), unit(), unit()]
        })
        .collect();
    let places = &places[..];
    // A ring of triangles, near some points and distant from others.
    let ring: Vec<_> = (0..60)
        .map(|i| {
            let at = |turn: f32, r: f32| [6.0 + r * turn.cos(), 6.0 + r * turn.sin(), 2.0 + 0.01 * turn];
            let turn = i as f32 / 10.0;
            let corners = [at(turn, 1.0), at(turn, 1.3), at(turn + 0.1, 1.2)];
            let own = flat::bounds(&corners, [0.0, 0.0, -1.0], 0.1 + 0.01 * i as f32, [1.0; 3]);
            LightBounds { mesh: Some(3), ..own }
        })
        .collect();
    for bounds in [scattered(2), scattered(8), scattered(500), ring.clone(), [ring, scattered(70)].concat()] {
        let tree = LightTree::new(&bounds);
        let tree = &tree;
        if bounds.len() == 60 {
            // In most packets the lights are distant in some lanes and near in most.
            let is_near = |place: &&[f32; 7]| {
                let [p, n] = [0, 3].map(|i| Vec3::<f32>::splat([place[i], place[i + 1], place[i + 2]]));
                !Importance::of(&tree.top, 0, tree.kinds, p, n).is_far
            };
            let near = places.iter().filter(is_near).count();
            assert!((260..420).contains(&near), "{near} near places");
        }
        let truth = dispatch(Level::SCALAR, Choices { tree, places, alone: false });
        let lights = truth.iter().map(|choice| choice[0]).collect::<std::collections::HashSet<_>>();
        assert!(lights.len() > bounds.len() / 5);
        for level in Level::available() {
            for alone in [false, true] {
                assert!(dispatch(level, Choices { tree, places, alone }) == truth, "{level}, {alone}");
            }
        }
    }
}

#[test]
fn ten_thousand_lights_at_one_point_make_a_tree() {
    let tree = LightTree::new(&vec![point([1.0; 3], [1.0; 3]); 10_000]);
    let p = Vec3::<f32>::zero();
    let sum: f64 = (0..10_000).map(|l| f64::from(tree.pmf(p, p, Wrapping(l), true))).sum();
    assert!((sum - 1.0).abs() < 1e-3, "{sum}");
}
