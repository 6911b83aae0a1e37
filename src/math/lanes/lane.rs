//! What only lanes have: memory, looking from lane to lane, and functions of their own.

use super::number::{Float, Mask, Uint};

/// A [`Mask`] of lanes.
pub trait LaneMask: Mask {
    /// Lane `i` is bit `i`; bits past the last lane are ignored.
    fn from_bits(bits: u32) -> Self;
    /// Bit `i` is lane `i`; bits past the last lane are zero.
    fn bits(self) -> u32;
    /// Whether any lane is true.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// A [`Uint`] of lanes.
pub trait LaneUint: Uint<Mask: LaneMask> {
    /// The first values of a slice, one a lane. The slice holds at least as many values as there are lanes.
    fn load(from: &[u32]) -> Self;
    /// Writes the lanes to the front of a slice, which has room for all of them.
    fn store(self, into: &mut [u32]);
    /// For each true lane how many true ones come before it; other lanes hold nothing of use, below 16.
    #[inline(always)]
    fn rank(mask: Self::Mask) -> Self {
        let mut ranks = [0; MAX_LANES];
        let mut lanes = mask.bits();
        let mut rank = 0;
        while lanes != 0 {
            ranks[lanes.trailing_zeros() as usize & (MAX_LANES - 1)] = rank;
            rank += 1;
            lanes &= lanes - 1;
        }
        Self::load(&ranks)
    }
}

/// A [`Float`] of lanes.
pub trait LaneFloat: Float<Uint: LaneUint, Mask: LaneMask> {
    /// Eight floats, as fast as this level has them: for looking at eight things with one ray.
    type Octet: LaneFloat;

    /// The first values of a slice, one a lane. The slice holds at least as many values as there are lanes.
    fn load(from: &[f32]) -> Self;
    /// Writes the lanes to the front of a slice, which has room for all of them.
    fn store(self, into: &mut [f32]);
    /// One lane's value.
    #[inline(always)]
    fn lane(self, i: usize) -> f32 {
        let mut all = [0.0; MAX_LANES];
        self.store(&mut all);
        all[i]
    }
    /// Runs a program with these lanes in a function of its own, for what is too large to be inlined wherever
    /// it is called. The function is compiled for the level's instructions, as [`dispatch`](super::dispatch)'s are.
    fn outlined<K: Kernel>(kernel: K) -> K::Output;
}

/// The most lanes that any level has.
pub const MAX_LANES: usize = 16;

/// A program that is compiled once for each level.
pub trait Kernel {
    /// What the program gives back.
    type Output;
    /// The program. Mark it, and all that it calls for each lane, `#[inline(always)]`: only code that is
    /// inlined into the level's entry point is compiled with the level's instructions.
    fn run<F: LaneFloat>(self) -> Self::Output;
}

/// The part of [`Mask`], [`Uint`] and [`Float`] that is the same for all lanes, for their `impl` blocks.
macro_rules! for_lanes {
    (mask) => {
        #[inline(always)]
        fn first(self) -> bool {
            $crate::math::lanes::LaneMask::bits(self) & 1 != 0
        }
    };
    (uint) => {
        #[inline(always)]
        fn given(number: &u32) -> Self {
            Self::splat(*number)
        }
        #[inline(always)]
        fn first(self) -> u32 {
            let mut all = [0; $crate::math::lanes::MAX_LANES];
            $crate::math::lanes::LaneUint::store(self, &mut all);
            all[0]
        }
    };
    (float) => {
        #[inline(always)]
        fn given(number: &f32) -> Self {
            Self::splat(*number)
        }
        #[inline(always)]
        fn first(self) -> f32 {
            $crate::math::lanes::LaneFloat::lane(self, 0)
        }
        #[inline(always)]
        fn branch<T: $crate::math::lanes::Value<Self>>(
            mask: Self::Mask,
            otherwise: T,
            then: impl FnOnce() -> T,
        ) -> T {
            if $crate::math::lanes::LaneMask::any(mask) {
                T::blend(mask, then(), otherwise)
            } else {
                otherwise
            }
        }
        #[inline(always)]
        fn guard<T: $crate::math::lanes::Value<Self>>(
            mask: Self::Mask,
            otherwise: T,
            then: impl FnOnce() -> T,
        ) -> T {
            if $crate::math::lanes::LaneMask::any(mask) { then() } else { otherwise }
        }
        #[inline(always)]
        fn fork<T: $crate::math::lanes::Value<Self>>(
            mask: Self::Mask,
            then: impl FnOnce() -> T,
            otherwise: impl FnOnce() -> T,
        ) -> T {
            let otherwise = otherwise();
            if $crate::math::lanes::LaneMask::any(mask) {
                T::blend(mask, then(), otherwise)
            } else {
                otherwise
            }
        }
        #[inline(always)]
        fn repeat<T: $crate::math::lanes::Value<Self>>(
            mut live: Self::Mask,
            mut state: T,
            mut body: impl FnMut(T) -> (T, Self::Mask),
        ) -> T {
            while $crate::math::lanes::LaneMask::any(live) {
                let (next, stays) = body(state);
                state = T::blend(live, next, state);
                live = live & stays;
            }
            state
        }
        #[inline(always)]
        fn call<A: $crate::math::lanes::Value<Self>, R: $crate::math::lanes::Value<Self>>(
            _function: &'static $crate::math::lanes::Function,
            arguments: A,
            body: impl FnOnce(A) -> R,
        ) -> R {
            body(arguments)
        }
        #[inline(always)]
        fn device<D: $crate::math::lanes::Device>(
            device: &D,
            arguments: D::Arguments<Self>,
        ) -> D::Output<Self> {
            device.run(arguments)
        }
    };
}
pub(super) use for_lanes;
