//! Random programs: their numbers are small integers, so that every device computes the same results.

use super::device::Case;
use super::{Marked, Scene};
use crate::math::lanes::Function;
use crate::math::{Float, Mask, Uint, Vec3};

/// Random choices that depend on the seed alone.
#[derive(Clone, Copy)]
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((x ^ (x >> 29)) >> 33) as usize % n
    }
    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        // Mostly the newest, so that programs become deep.
        let back = self.below(from.len()).min(self.below(from.len()));
        from[from.len() - 1 - back]
    }
    fn other(&mut self) -> Dice {
        Dice(self.below(1 << 30) as u64)
    }
}

/// The numbers available in a program so far.
#[derive(Clone)]
struct Pool<F: Float> {
    floats: Vec<F>,
    words: Vec<F::Uint>,
    masks: Vec<F::Mask>,
    vectors: Vec<Vec3<F>>,
}

/// The results of blocks and functions.
type Bundle<F> = (F, <F as Float>::Uint, <F as Float>::Mask, (Vec3<F>, Marked<F>), [F; 2]);

/// An integer below 256 in magnitude, from one below 2²⁴.
fn small<F: Float>(x: F) -> F {
    let size = (x.abs().to_uint() & F::Uint::splat(255)).to_float();
    F::select(x.lt(F::zero()), -size, size)
}
fn small3<F: Float>(v: Vec3<F>) -> Vec3<F> {
    Vec3::new(small(v.x), small(v.y), small(v.z))
}

impl<F: Float> Pool<F> {
    fn of(x: [F; 4], w: [F::Uint; 4]) -> Self {
        let x = x.map(small);
        let masks = vec![x[0].lt(x[1]), w[0].lt(w[1])];
        Pool { floats: x.to_vec(), words: w.to_vec(), masks, vectors: vec![Vec3::new(x[1], x[2], x[3])] }
    }
    fn put(&mut self, (x, w, mask, (v, marked), [a, b]): Bundle<F>) {
        self.floats.extend([x, marked.weight, a, b]);
        self.words.push(w);
        self.masks.push(mask);
        self.vectors.extend([v, marked.at]);
    }
    fn bundle(&self, dice: &mut Dice) -> Bundle<F> {
        let marked = Marked { at: dice.pick(&self.vectors), weight: dice.pick(&self.floats) };
        let vectors = (dice.pick(&self.vectors), marked);
        let pair = [dice.pick(&self.floats), dice.pick(&self.floats)];
        (dice.pick(&self.floats), dice.pick(&self.words), dice.pick(&self.masks), vectors, pair)
    }
    fn result(&self, dice: &mut Dice) -> ([F; 4], [F::Uint; 4]) {
        let (x, w, mask, (v, marked), [a, b]) = self.bundle(dice);
        let sum = small(v.dot(marked.at) + a * b);
        let word = F::Uint::select(mask, w, dice.pick(&self.words));
        ([x, sum, v.y, marked.weight], [w, word, dice.pick(&self.words), dice.pick(&self.words)])
    }
}

/// A program generated from the seed.
pub(super) struct Random {
    pub(super) seed: u64,
    /// The functions that it may call; their bodies are generated from their names.
    pub(super) functions: [&'static Function; 2],
}

impl Random {
    fn statement<F: Float>(
        &self,
        scene: &Scene,
        pool: &mut Pool<F>,
        dice: &mut Dice,
        depth: usize,
        in_function: bool,
    ) {
        let (a, b) = (dice.pick(&pool.words), dice.pick(&pool.words));
        let (x, y) = (dice.pick(&pool.floats), dice.pick(&pool.floats));
        let (v, w) = (dice.pick(&pool.vectors), dice.pick(&pool.vectors));
        let (mask, other) = (dice.pick(&pool.masks), dice.pick(&pool.masks));
        let kinds = if depth == 0 { 16 } else { 22 };
        match dice.below(kinds) {
            0 => pool.words.push(a + b),
            1 => pool.words.push(a * b),
            2 => pool.words.push([a & b, a | b, a ^ b][dice.below(3)]),
            3 => pool.words.push([a.shl::<3>(), a.shr::<5>(), a.reverse_bits()][dice.below(3)]),
            4 => pool.floats.push(small(a.shr::<8>().to_float())),
            5 => pool.floats.push(small([x + y, x - y, x * y][dice.below(3)])),
            6 => pool.floats.push([x.min(y), x.max(y), -x, x.abs(), (x * 0.25).floor()][dice.below(5)]),
            7 => pool.masks.push([x.lt(y), x.le(y), x.gt(y), x.ge(y), a.eq(b), a.lt(b)][dice.below(6)]),
            8 => pool.masks.push([mask & other, mask | other, !mask][dice.below(3)]),
            9 => pool.floats.push(F::select(mask, x, y)),
            10 => pool.words.push(F::Uint::select(mask, a, b)),
            11 => pool.vectors.push(small3([v + w, v - w, v * x, -v, v.cross(w)][dice.below(5)])),
            12 => pool.vectors.push([Vec3::select(mask, v, w), Vec3::new(x, v.y, w.x)][dice.below(2)]),
            13 => pool.floats.push(small([v.dot(w), v.z, w.max_abs()][dice.below(3)])),
            14 => {
                let row = a & F::Uint::splat(1);
                pool.vectors.push(small3(Vec3::gather(&scene.origin, row) + Vec3::given(&scene.eye)));
                pool.words.push(F::Uint::gather(&scene.kind, row) + F::Uint::given(&scene.seed));
            }
            15 => {
                let marked =
                    F::device(&super::Doubled, (Marked { at: v, weight: x }, a & F::Uint::splat(15)));
                pool.vectors.push(small3(marked.at));
                pool.floats.push(small(marked.weight));
            }
            16 | 17 => {
                let [first, second] = [dice.other(), dice.other()];
                let (p, q) = (pool.clone(), pool.clone());
                pool.put(F::fork(
                    mask,
                    || self.block(scene, p, first, depth - 1, in_function),
                    || self.block(scene, q, second, depth - 1, in_function),
                ));
            }
            18 | 19 => {
                let (inner, otherwise, p) = (dice.other(), pool.bundle(dice), pool.clone());
                pool.put(F::branch(mask, otherwise, || self.block(scene, p, inner, depth - 1, in_function)));
            }
            20 => {
                let rounds = a & F::Uint::splat(3);
                let (inner, before, p) = (dice.other(), pool.bundle(dice), pool.clone());
                let always = dice.below(3) == 0;
                let live = if always { F::Mask::splat(true) } else { F::Uint::splat(0).lt(rounds) };
                let state = (F::Uint::splat(0), before);
                let (_, after) = F::repeat(live, state, |(i, state)| {
                    let mut p = p.clone();
                    p.put(state);
                    let next = i + F::Uint::splat(1);
                    let (mut after, mut dice) = (self.block(scene, p, inner, depth - 1, in_function), inner);
                    match dice.below(4) {
                        // Some of the state is unchanged or permuted.
                        0 => after.3 = state.3,
                        1 => (after.4, after.0) = ([state.4[1], state.0], state.4[0]),
                        _ => {}
                    }
                    ((next, after), next.lt(rounds))
                });
                pool.put(after);
            }
            _ if in_function => pool.floats.push(F::given(&scene.near) * 4.0),
            _ => {
                let function = dice.pick(&self.functions);
                let seed = function.name.bytes().fold(self.seed, |seed, byte| seed * 31 + u64::from(byte));
                let marked = Marked { at: v, weight: x };
                pool.put(F::call(
                    function,
                    (x, [a, b], marked, mask, (y, a)),
                    |(x, [a, b], marked, mask, (y, c))| {
                        let mut pool = Pool::of([x, y, marked.weight, marked.at.x], [a, b, c, a]);
                        pool.masks.push(mask);
                        pool.vectors.push(marked.at);
                        self.block(scene, pool, Dice(seed), 2, true)
                    },
                ));
            }
        }
    }
    fn block<F: Float>(
        &self,
        scene: &Scene,
        mut pool: Pool<F>,
        mut dice: Dice,
        depth: usize,
        in_function: bool,
    ) -> Bundle<F> {
        for _ in 0..dice.below(6) {
            self.statement(scene, &mut pool, &mut dice, depth, in_function);
        }
        pool.bundle(&mut dice)
    }
}

impl Case for Random {
    fn run<F: Float>(&self, scene: &Scene, x: [F; 4], w: [F::Uint; 4]) -> ([F; 4], [F::Uint; 4]) {
        let (mut pool, mut dice) = (Pool::of(x, w), Dice(self.seed));
        for _ in 0..16 {
            self.statement(scene, &mut pool, &mut dice, 3, false);
        }
        pool.result(&mut dice)
    }
}
