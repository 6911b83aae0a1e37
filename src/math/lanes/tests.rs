//! Compares every level with one lane, bit by bit. Code built on lanes is compared in `tests/transport/lanes.rs`.

use super::scalar::Wrapping;
use super::*;

/// A program over three words per lane, each the bits of a float or an integer.
trait Program {
    fn run<F: LaneFloat>(x: [F; 3]) -> Vec<F>;
}

/// Runs a program over rows of words, one row per lane at a time.
struct Rows<'a, P> {
    rows: &'a [[u32; 3]],
    program: std::marker::PhantomData<P>,
}

impl<P: Program> Kernel for Rows<'_, P> {
    type Output = Vec<Vec<u32>>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Vec<Vec<u32>> {
        let mut all = Vec::new();
        for chunk in self.rows.chunks(F::LANES) {
            let column = |i: usize| {
                let mut words = [0; MAX_LANES];
                for (word, row) in words.iter_mut().zip(chunk) {
                    *word = row[i];
                }
                F::from_bits(F::Uint::load(&words))
            };
            let results: Vec<[u32; MAX_LANES]> = P::run([column(0), column(1), column(2)])
                .into_iter()
                .map(|result| {
                    let mut words = [0; MAX_LANES];
                    result.to_bits().store(&mut words);
                    words
                })
                .collect();
            all.extend((0..chunk.len()).map(|lane| results.iter().map(|words| words[lane]).collect()));
        }
        all
    }
}

/// Runs a program with a level's eight lanes, in a separate function.
struct Octets<K>(K);

impl<K: Kernel> Kernel for Octets<K> {
    type Output = K::Output;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> K::Output {
        struct Inner<K>(K);
        impl<K: Kernel> Kernel for Inner<K> {
            type Output = K::Output;
            #[inline(always)]
            fn run<F: LaneFloat>(self) -> K::Output {
                assert_eq!(F::Octet::LANES, 8);
                self.0.run::<F::Octet>()
            }
        }
        F::outlined(Inner(self.0))
    }
}

/// The results of a program at every level, with every level's octets, and with plain arrays, which are for other
/// processors.
fn everywhere<K: Kernel>(kernel: impl Fn() -> K) -> Vec<(String, K::Output)> {
    let mut all = vec![
        ("arrays of four".to_owned(), kernel().run::<portable::Four>()),
        ("arrays of eight".to_owned(), kernel().run::<portable::Eight>()),
    ];
    for level in Level::available() {
        all.push((level.to_string(), dispatch(level, kernel())));
        all.push((format!("{level}'s octet"), dispatch(level, Octets(kernel()))));
    }
    all
}

/// Whether the sign and payload of a NaN are compared. IEEE 754 leaves them open for arithmetic, and no result may
/// depend on them; operations that only move bits keep them.
#[derive(Clone, Copy, PartialEq)]
enum NaNs {
    Kept,
    Alike,
}

fn first_difference<P: Program>(rows: &[[u32; 3]], nans: NaNs) -> Option<String> {
    let canonical = |words: &[u32]| -> Vec<u32> {
        let alike = |&w: &u32| match f32::from_bits(w).is_nan() && nans == NaNs::Alike {
            true => f32::NAN.to_bits(),
            false => w,
        };
        words.iter().map(alike).collect()
    };
    let program = || Rows { rows, program: std::marker::PhantomData::<P> };
    let one_lane = dispatch(Level::SCALAR, program());
    for (lanes, wide) in everywhere(program) {
        assert_eq!(wide.len(), one_lane.len());
        for ((row, a), b) in rows.iter().zip(&wide).zip(&one_lane) {
            if canonical(a) != canonical(b) {
                return Some(format!("{lanes} of {row:08x?} is {a:08x?}, one lane says {b:08x?}"));
            }
        }
    }
    None
}

fn all_levels_agree<P: Program>(rows: &[[u32; 3]], nans: NaNs) {
    if let Some(difference) = first_difference::<P>(rows, nans) {
        panic!("{}: {difference}", std::any::type_name::<P>());
    }
}

macro_rules! program {
    ($name:ident, $f:ident, [$a:pat, $b:pat, $c:pat], $outputs:expr) => {
        struct $name;
        impl Program for $name {
            #[inline(always)]
            fn run<$f: LaneFloat>([$a, $b, $c]: [$f; 3]) -> Vec<$f> {
                $outputs.to_vec()
            }
        }
    };
}

/// Floats at critical values: signs of zero, the ends of every range, NaNs, halves, the integers above which floats
/// have no fractions.
fn edges() -> Vec<u32> {
    let mut edges: Vec<u32> = vec![0x7fc0_0000, 0xffc0_0001, 0x7f80_0001, 0x0000_0001, 0x007f_ffff, u32::MAX];
    edges.extend([1, 2, 7, 255, 256, 0x7fff_ffff, 0x8000_0001, 0xffff_fffe, 0x0101_0101]);
    for x in [
        0.0,
        1.0,
        0.5,
        1.5,
        2.5,
        0.499_999_97,
        0.999_999_94,
        1.000_000_1,
        1.0 / 3.0,
        std::f32::consts::PI,
        8_388_607.5,
        8_388_608.0,
        16_777_215.0,
        16_777_216.0,
        2_147_483_648.0,
        4_294_967_296.0,
        1e-20,
        1e20,
        f32::MIN_POSITIVE,
        f32::EPSILON,
        f32::MAX,
        f32::INFINITY,
    ] {
        edges.extend([x, -x].map(f32::to_bits));
    }
    edges
}

/// Every pair of critical values, with a third word that varies, and as many pseudorandom words.
fn rows() -> Vec<[u32; 3]> {
    let edges = edges();
    let mut rows = Vec::new();
    for (i, &a) in edges.iter().enumerate() {
        rows.extend(edges.iter().enumerate().map(|(j, &b)| [a, b, edges[(i * 7 + j * 3) % edges.len()]]));
    }
    let mut word = 1_u32;
    let mut next = || {
        // Xorshift (Marsaglia 2003).
        word ^= word << 13;
        word ^= word >> 17;
        word ^= word << 5;
        word
    };
    for i in 0..4000 {
        // Every other row with exponents near 2⁰, where arithmetic neither over- nor underflows.
        let moderate = |w: u32| if i % 2 == 0 { w } else { (w & 0x83ff_ffff) | 0x3c00_0000 };
        rows.push([moderate(next()), moderate(next()), moderate(next())]);
    }
    // A last group that does not fill the lanes.
    rows.truncate(rows.len() / MAX_LANES * MAX_LANES + 3);
    rows
}

#[inline(always)]
fn truth<F: LaneFloat>(mask: F::Mask) -> F {
    F::splat(1.0).only(mask)
}

program!(Arithmetic, F, [a, b, c], [a + b, a - b, a * b, a / b, a * b + c, a - b * c]);
program!(WithConstant, F, [a, _, _], [a + 0.1, a - 0.1, a * 3.3, a / 3.3, a * 0.0, a + f32::MAX]);
program!(Roots, F, [a, b, _], [a.sqrt(), a.abs().sqrt(), a.floor(), b.floor() - b]);
program!(Signs, F, [a, b, _], [-a, a.abs(), a.copysign(b), b.copysign(a)]);
program!(Extremes, F, [a, b, c], [a.min(b), a.max(b), b.min(a), b.max(a), a.min(b).max(c), a.max(a)]);
program!(
    Comparisons,
    F,
    [a, b, _],
    [truth::<F>(a.lt(b)), truth::<F>(a.le(b)), truth::<F>(a.gt(b)), truth::<F>(a.ge(b)), truth::<F>(a.le(a))]
);
program!(
    Selection,
    F,
    [a, b, c],
    [F::select(a.lt(b), a, c), F::select(!a.lt(b), a, c), b.only(a.le(c)), F::splat(-0.0), F::zero()]
);
program!(
    Logic,
    F,
    [a, b, c],
    [
        truth::<F>(a.lt(b) & b.lt(c)),
        truth::<F>(a.lt(b) | b.lt(c)),
        truth::<F>(!(a.lt(b) | b.lt(c)) & !c.le(a)),
        truth::<F>(<F::Mask as Mask>::splat(true) & a.lt(b)),
        truth::<F>(<F::Mask as Mask>::splat(false) | a.lt(b)),
    ]
);
program!(Integers, F, [a, b, c], {
    let (a, b, c) = (a.to_bits(), b.to_bits(), c.to_bits());
    let all = [a + b, a * b, a & b, a | b, a ^ b, a * b + c, F::Uint::splat(0xdead_beef) + a];
    all.map(F::from_bits)
});
program!(Shifts, F, [a, _, _], {
    let a = a.to_bits();
    let left = [a.shl::<0>(), a.shl::<1>(), a.shl::<8>(), a.shl::<30>(), a.shl::<31>()];
    let right = [a.shr::<0>(), a.shr::<1>(), a.shr::<8>(), a.shr::<16>(), a.shr::<31>()];
    [left, right].concat().into_iter().map(F::from_bits).collect::<Vec<_>>()
});
program!(Reversal, F, [a, b, _], {
    let (a, b) = (a.to_bits(), b.to_bits());
    [a.reverse_bits(), b.reverse_bits().reverse_bits(), (a ^ b).reverse_bits()].map(F::from_bits)
});
program!(IntegerComparisons, F, [a, b, c], {
    let (a, b, c) = (a.to_bits(), b.to_bits(), c.to_bits());
    let chosen = [F::Uint::select(a.lt(b), a, c), F::Uint::select(a.eq(b), b, c)].map(F::from_bits);
    [
        vec![truth::<F>(a.eq(b)), truth::<F>(a.lt(b)), truth::<F>(b.lt(a)), truth::<F>(a.eq(a))],
        chosen.to_vec(),
    ]
    .concat()
});
program!(Conversions, F, [a, b, _], {
    // Only specified inputs: integers below 2³¹, floats in [0, 2³¹).
    let small = a.to_bits() & F::Uint::splat(0x7fff_ffff);
    let positive = b.abs();
    let in_range = positive.lt(F::splat(2_147_483_648.0));
    let whole = positive.only(in_range).to_uint();
    [small.to_float(), a.to_bits().to_unit(), F::from_bits(whole), whole.to_float()]
});

#[test]
fn arithmetic_rounds_alike_at_every_level() {
    all_levels_agree::<Arithmetic>(&rows(), NaNs::Alike);
    all_levels_agree::<WithConstant>(&rows(), NaNs::Alike);
    all_levels_agree::<Roots>(&rows(), NaNs::Alike);
}

#[test]
fn bit_moves_are_exact_at_every_level() {
    all_levels_agree::<Signs>(&rows(), NaNs::Kept);
    all_levels_agree::<Extremes>(&rows(), NaNs::Kept);
    all_levels_agree::<Selection>(&rows(), NaNs::Kept);
    all_levels_agree::<Conversions>(&rows(), NaNs::Kept);
}

#[test]
fn comparisons_and_logic_agree_at_every_level() {
    all_levels_agree::<Comparisons>(&rows(), NaNs::Kept);
    all_levels_agree::<Logic>(&rows(), NaNs::Kept);
}

#[test]
fn integers_wrap_shift_and_compare_alike_at_every_level() {
    all_levels_agree::<Integers>(&rows(), NaNs::Kept);
    all_levels_agree::<Shifts>(&rows(), NaNs::Kept);
    all_levels_agree::<Reversal>(&rows(), NaNs::Kept);
    all_levels_agree::<IntegerComparisons>(&rows(), NaNs::Kept);
}

#[test]
fn a_level_that_differs_in_one_lane_is_noticed() {
    struct Broken;
    impl Program for Broken {
        #[inline(always)]
        fn run<F: LaneFloat>([a, ..]: [F; 3]) -> Vec<F> {
            // An estimate in place of the division, as with fast-math.
            let scale = if F::LANES > 1 { F::splat(0.333_333_3) } else { F::splat(1.0) / 3.0 };
            vec![a * scale]
        }
    }
    assert!(first_difference::<Broken>(&rows(), NaNs::Alike).is_some());
}

/// Tables of several lengths, looked up at indices inside, at the end and far beyond it.
struct Gathers;

impl Kernel for Gathers {
    type Output = Vec<[u32; 2]>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Vec<[u32; 2]> {
        let mut all = Vec::new();
        // Around the lengths that fit into one and two registers, and far beyond.
        for len in [1_u32, 2, 5, 7, 8, 9, 15, 16, 17, 1000] {
            let words: Vec<u32> = (0..len).map(|i| i.wrapping_mul(0x9e37_79b9) ^ 0x7fc0_0001).collect();
            let floats: Vec<f32> = words.iter().map(|&w| f32::from_bits(w)).collect();
            let negated: Vec<f32> = words.iter().map(|&w| f32::from_bits(w ^ 0x8000_0000)).collect();
            let mut indices: Vec<u32> = (0..len).rev().collect();
            indices.extend([len, len + 1, 0x7fff_ffff, 0x8000_0000, u32::MAX - 1, u32::MAX]);
            for chunk in indices.chunks(F::LANES) {
                let mut index = [0; MAX_LANES];
                index[..chunk.len()].copy_from_slice(chunk);
                let index = F::Uint::load(&index);
                let (mut a, mut b) = ([0; MAX_LANES], [0; MAX_LANES]);
                F::Uint::gather(&words, index).store(&mut a);
                F::gather(&floats, index).to_bits().store(&mut b);
                // Several tables at once: one that differs, and the same one.
                let [negated, same] = F::gather_all([&negated, &floats], index);
                let (mut c, mut d) = ([0; MAX_LANES], [0; MAX_LANES]);
                negated.to_bits().store(&mut c);
                same.to_bits().store(&mut d);
                for lane in 0..F::LANES {
                    assert_eq!([c[lane], d[lane]], [b[lane] ^ 0x8000_0000, b[lane]], "{} lanes", F::LANES);
                }
                all.extend((0..chunk.len()).map(|lane| [a[lane], b[lane]]));
            }
        }
        all
    }
}

#[test]
fn gathers_past_the_end_read_the_last_entry_at_every_level() {
    let one_lane = dispatch(Level::SCALAR, Gathers);
    // The first table has one entry: everything reads it.
    assert!(one_lane[..7].iter().all(|&[a, b]| a == 0x7fc0_0001 && a == b));
    for (lanes, found) in everywhere(|| Gathers) {
        assert_eq!(found, one_lane, "{lanes}");
    }
}

/// The properties of masks of all patterns.
struct Masks;

impl Kernel for Masks {
    type Output = ();

    #[inline(always)]
    fn run<F: LaneFloat>(self) {
        let all = ((1_u64 << F::LANES) - 1) as u32;
        assert_eq!(F::Mask::splat(true).bits(), all);
        assert_eq!(F::Mask::splat(false).bits(), 0);
        for i in 0..70_000_u32 {
            let (w, other) = (i ^ 0xffff_0000, i.wrapping_mul(0x9e37_79b9) >> 7);
            let (a, b) = (F::Mask::from_bits(w), F::Mask::from_bits(other));
            assert_eq!(a.bits(), w & all, "bits past the last lane are ignored");
            assert_eq!((a & b).bits(), w & other & all);
            let mut ranks = [0; MAX_LANES];
            F::Uint::rank(a).store(&mut ranks);
            for (lane, &rank) in ranks[..F::LANES].iter().enumerate() {
                let before = w & ((1 << lane) - 1);
                assert!(rank < MAX_LANES as u32 && (w >> lane & 1 == 0 || rank == before.count_ones()));
            }
            assert_eq!((a | b).bits(), (w | other) & all);
            assert_eq!((!a).bits(), !w & all);
            assert_eq!(a.any(), w & all != 0);
            let chosen = F::select(a, F::splat(2.0), F::splat(3.0));
            let lane = i as usize % F::LANES;
            assert_eq!(chosen.lane(lane), if w >> lane & 1 != 0 { 2.0 } else { 3.0 });
        }
    }
}

#[test]
fn masks_match_their_bits_at_every_level() {
    everywhere(|| Masks);
}

/// Loads and stores at every alignment access only their own lanes.
struct Memory;

impl Kernel for Memory {
    type Output = ();

    #[inline(always)]
    fn run<F: LaneFloat>(self) {
        let words: Vec<u32> = (0..64).map(|i| 0x3f80_0000 + i).collect();
        let floats: Vec<f32> = words.iter().map(|&w| f32::from_bits(w)).collect();
        for at in 0..=64 - F::LANES {
            let mut into = vec![0; 64];
            F::Uint::load(&words[at..]).store(&mut into[at..]);
            let mut float_into = vec![0.0; 64];
            F::load(&floats[at..at + F::LANES]).store(&mut float_into[at..at + F::LANES]);
            for i in 0..64 {
                let expected = if (at..at + F::LANES).contains(&i) { words[i] } else { 0 };
                assert_eq!([into[i], float_into[i].to_bits()], [expected; 2]);
            }
        }
    }
}

#[test]
fn loads_and_stores_touch_exactly_their_lanes() {
    everywhere(|| Memory);
}

/// Kernels that must not read or write past a slice.
struct ShortSlices(u32);

impl Kernel for ShortSlices {
    type Output = ();

    #[inline(always)]
    fn run<F: LaneFloat>(self) {
        let (mut words, mut floats) = (vec![0; F::LANES - 1], vec![0.0; F::LANES - 1]);
        match self.0 {
            0 => drop(F::load(&floats)),
            1 => F::zero().store(&mut floats),
            2 => drop(F::Uint::load(&words)),
            3 => F::Uint::splat(1).store(&mut words),
            4 => drop(F::gather(&[], F::Uint::splat(0))),
            _ => drop(F::Uint::gather(&[], F::Uint::splat(0))),
        }
    }
}

/// The short slices that are overrun.
struct Overruns;

impl Kernel for Overruns {
    type Output = Vec<u32>;

    fn run<F: LaneFloat>(self) -> Vec<u32> {
        let ends = |&case: &u32| std::panic::catch_unwind(|| F::outlined(ShortSlices(case))).is_ok();
        (0..6).filter(ends).collect()
    }
}

#[test]
fn a_slice_that_is_too_short_panics_and_is_not_overrun() {
    for (lanes, overruns) in everywhere(|| Overruns) {
        assert!(overruns.is_empty(), "{lanes}, cases {overruns:?}");
    }
}

#[test]
fn minimum_and_maximum_return_the_second_if_neither_is_less() {
    let bits = |x: f32| x.to_bits();
    assert_eq!(bits(Float::min(0.0, -0.0)), bits(-0.0));
    assert_eq!(bits(Float::min(-0.0, 0.0)), bits(0.0));
    assert_eq!(bits(Float::max(0.0, -0.0)), bits(-0.0));
    assert_eq!(Float::min(f32::NAN, 1.0), 1.0);
    assert_eq!(Float::max(f32::NAN, 1.0), 1.0);
    assert!(Float::min(1.0, f32::NAN).is_nan());
    assert!(Float::max(1.0, f32::NAN).is_nan());
}

#[test]
fn unit_floats_are_below_one_and_keep_24_bits() {
    assert_eq!(Wrapping(u32::MAX).to_unit(), 1.0 - f32::EPSILON / 2.0);
    assert_eq!(Wrapping(0xff).to_unit(), 0.0);
    assert_eq!(Wrapping(0x100).to_unit(), f32::EPSILON / 2.0);
    assert_eq!(Wrapping(0x8000_0000).to_unit(), 0.5);
}

#[test]
fn levels_have_only_their_names() {
    for level in Level::available() {
        assert_eq!(level.to_string().parse::<Level>().unwrap(), level);
    }
    let error = "sse9".parse::<Level>().unwrap_err().to_string();
    assert!(error.contains("sse9") && error.contains("portable, scalar"), "{error}");
}
