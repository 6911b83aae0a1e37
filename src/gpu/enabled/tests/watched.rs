//! A lane that stores the arguments and results of the functions that it calls.

use crate::math::lanes::scalar::Wrapping;
use crate::math::lanes::{Device, Function, Layout, Part, Value};
use crate::math::{Float, Mask, Uint};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
use std::vec;

/// A float with recorded calls.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watched(pub(super) f32);
/// An integer with recorded calls.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedUint(pub(super) Wrapping);
/// A boolean with recorded calls.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedMask(pub(super) bool);

/// A call of a function: the words of its arguments and of its result.
pub(super) struct Call {
    pub(super) arguments: Vec<u32>,
    pub(super) result: Vec<u32>,
}

/// The maximum number of stored calls of a function.
const KEPT: usize = 2000;

/// The calls of a function.
#[derive(Default)]
pub(super) struct Calls {
    seen: u32,
    /// Some of them, evenly distributed.
    pub(super) kept: Vec<Call>,
}

impl Calls {
    /// The slot for the next call, if it is stored; each call has the same probability.
    fn place(&mut self) -> Option<usize> {
        let stirred = self.seen.wrapping_mul(0x9e37_79b1).rotate_left(13).wrapping_mul(0x85eb_ca6b);
        self.seen += 1;
        let place = if self.kept.len() < KEPT { self.kept.len() } else { (stirred % self.seen) as usize };
        (place < KEPT).then_some(place)
    }
}

thread_local! {
    static CALLS: RefCell<BTreeMap<&'static str, Calls>> = const { RefCell::new(BTreeMap::new()) };
}

/// The calls of each function during `work`, by the functions' names.
pub(super) fn watch(work: impl FnOnce()) -> BTreeMap<&'static str, Calls> {
    CALLS.take();
    work();
    CALLS.take()
}

/// The place for the next call of a function, if it is stored.
fn place_of(function: &'static str) -> Option<usize> {
    CALLS.with_borrow_mut(|all| all.entry(function).or_default().place())
}

/// Stores a call at its place.
fn keep(function: &'static str, place: usize, call: Call) {
    CALLS.with_borrow_mut(|all| {
        let kept = &mut all.entry(function).or_default().kept;
        if place == kept.len() {
            kept.push(call);
        } else {
            kept[place] = call;
        }
    });
}

// What is generic does the least possible, as it is compiled for every structure.

/// The bits of all numbers of a value.
fn words(value: &impl Value<Watched>) -> Vec<u32> {
    let mut parts = Vec::new();
    value.parts(&mut parts);
    words_of(&parts)
}

fn words_of(parts: &[Part<Watched>]) -> Vec<u32> {
    let word = |part: &Part<Watched>| match part {
        Part::Float(number) => number.0.to_bits(),
        Part::Uint(number) => number.0.0,
        Part::Mask(number) => u32::from(number.0),
    };
    parts.iter().map(word).collect()
}

/// Converts plain numbers to watched ones.
fn watched<V: Value<Watched>>(value: &impl Value<f32>) -> V {
    let mut parts = Vec::new();
    value.parts(&mut parts);
    V::of_parts(&mut watched_parts(parts))
}

fn watched_parts(parts: Vec<Part<f32>>) -> vec::IntoIter<Part<Watched>> {
    let watched = |part| match part {
        Part::Float(number) => Part::Float(Watched(number)),
        Part::Uint(number) => Part::Uint(WatchedUint(number)),
        Part::Mask(number) => Part::Mask(WatchedMask(number)),
    };
    parts.into_iter().map(watched).collect::<Vec<_>>().into_iter()
}

/// The inverse conversion.
fn plain<V: Value<f32>>(value: &impl Value<Watched>) -> V {
    let mut parts = Vec::new();
    value.parts(&mut parts);
    V::of_parts(&mut plain_parts(parts))
}

fn plain_parts(parts: Vec<Part<Watched>>) -> vec::IntoIter<Part<f32>> {
    let plain = |part| match part {
        Part::Float(Watched(number)) => Part::Float(number),
        Part::Uint(WatchedUint(number)) => Part::Uint(number),
        Part::Mask(WatchedMask(number)) => Part::Mask(number),
    };
    parts.into_iter().map(plain).collect::<Vec<_>>().into_iter()
}

macro_rules! number {
    ($Type:ident, $kind:ident) => {
        impl Value<Watched> for $Type {
            fn blend(mask: WatchedMask, a: Self, b: Self) -> Self {
                if mask.0 { a } else { b }
            }
            fn layout() -> Layout {
                Layout::$kind
            }
            fn parts(&self, parts: &mut Vec<Part<Watched>>) {
                parts.push(Part::$kind(*self));
            }
            fn of_parts(parts: &mut impl Iterator<Item = Part<Watched>>) -> Self {
                match parts.next() {
                    Some(Part::$kind(number)) => number,
                    _ => panic!("a structure has other numbers than its layout"),
                }
            }
        }
    };
}
number!(Watched, Float);
number!(WatchedUint, Uint);
number!(WatchedMask, Mask);

macro_rules! operator {
    ($Type:ident, $($Trait:ident::$method:ident),+) => {
        $(
            impl $Trait for $Type {
                type Output = Self;
                fn $method(self, other: Self) -> Self {
                    $Type($Trait::$method(self.0, other.0))
                }
            }
        )+
    };
}
operator!(Watched, Add::add, Sub::sub, Mul::mul, Div::div);
operator!(WatchedUint, Add::add, Mul::mul, BitAnd::bitand, BitOr::bitor, BitXor::bitxor);
operator!(WatchedMask, BitAnd::bitand, BitOr::bitor);

macro_rules! with_constant {
    ($($Trait:ident::$method:ident),+) => {
        $(
            impl $Trait<f32> for Watched {
                type Output = Self;
                fn $method(self, other: f32) -> Self {
                    Watched($Trait::$method(self.0, other))
                }
            }
        )+
    };
}
with_constant!(Add::add, Sub::sub, Mul::mul, Div::div);

impl Neg for Watched {
    type Output = Self;
    fn neg(self) -> Self {
        Watched(-self.0)
    }
}

impl Not for WatchedMask {
    type Output = Self;
    fn not(self) -> Self {
        WatchedMask(!self.0)
    }
}

impl Mask for WatchedMask {
    fn splat(value: bool) -> Self {
        WatchedMask(value)
    }
    fn first(self) -> bool {
        self.0
    }
}

impl Uint for WatchedUint {
    type Float = Watched;
    type Mask = WatchedMask;

    fn splat(value: u32) -> Self {
        WatchedUint(Wrapping(value))
    }
    fn given(number: &u32) -> Self {
        WatchedUint(Wrapping(*number))
    }
    fn gather(table: &[u32], index: Self) -> Self {
        WatchedUint(Uint::gather(table, index.0))
    }
    fn shl<const K: u32>(self) -> Self {
        WatchedUint(self.0.shl::<K>())
    }
    fn shr<const K: u32>(self) -> Self {
        WatchedUint(self.0.shr::<K>())
    }
    fn reverse_bits(self) -> Self {
        WatchedUint(self.0.reverse_bits())
    }
    fn eq(self, other: Self) -> WatchedMask {
        WatchedMask(Uint::eq(self.0, other.0))
    }
    fn lt(self, other: Self) -> WatchedMask {
        WatchedMask(Uint::lt(self.0, other.0))
    }
    fn select(mask: WatchedMask, a: Self, b: Self) -> Self {
        if mask.0 { a } else { b }
    }
    fn to_float(self) -> Watched {
        Watched(self.0.to_float())
    }
    fn first(self) -> u32 {
        self.0.0
    }
}

impl Float for Watched {
    type Uint = WatchedUint;
    type Mask = WatchedMask;
    const LANES: usize = 1;

    fn splat(value: f32) -> Self {
        Watched(value)
    }
    fn given(number: &f32) -> Self {
        Watched(*number)
    }
    fn gather(table: &[f32], index: WatchedUint) -> Self {
        Watched(Float::gather(table, index.0))
    }
    fn sqrt(self) -> Self {
        Watched(Float::sqrt(self.0))
    }
    fn abs(self) -> Self {
        Watched(Float::abs(self.0))
    }
    fn floor(self) -> Self {
        Watched(Float::floor(self.0))
    }
    fn min(self, other: Self) -> Self {
        Watched(Float::min(self.0, other.0))
    }
    fn max(self, other: Self) -> Self {
        Watched(Float::max(self.0, other.0))
    }
    fn lt(self, other: Self) -> WatchedMask {
        WatchedMask(self.0 < other.0)
    }
    fn le(self, other: Self) -> WatchedMask {
        WatchedMask(self.0 <= other.0)
    }
    fn select(mask: WatchedMask, a: Self, b: Self) -> Self {
        if mask.0 { a } else { b }
    }
    fn to_bits(self) -> WatchedUint {
        WatchedUint(Float::to_bits(self.0))
    }
    fn from_bits(bits: WatchedUint) -> Self {
        Watched(Float::from_bits(bits.0))
    }
    fn to_uint(self) -> WatchedUint {
        WatchedUint(Float::to_uint(self.0))
    }
    fn first(self) -> f32 {
        self.0
    }

    // As on a device, unused branches are not evaluated, so that no call is stored that a device would not make.
    fn branch<T: Value<Self>>(mask: WatchedMask, otherwise: T, then: impl FnOnce() -> T) -> T {
        if mask.0 { then() } else { otherwise }
    }
    fn guard<T: Value<Self>>(mask: WatchedMask, otherwise: T, then: impl FnOnce() -> T) -> T {
        if mask.0 { then() } else { otherwise }
    }
    fn fork<T: Value<Self>>(mask: WatchedMask, then: impl FnOnce() -> T, otherwise: impl FnOnce() -> T) -> T {
        if mask.0 { then() } else { otherwise() }
    }
    fn repeat<T: Value<Self>>(
        mut live: WatchedMask,
        mut state: T,
        mut body: impl FnMut(T) -> (T, WatchedMask),
    ) -> T {
        while live.0 {
            (state, live) = body(state);
        }
        state
    }
    fn call<A: Value<Self>, R: Value<Self>>(
        function: &'static Function,
        arguments: A,
        body: impl FnOnce(A) -> R,
    ) -> R {
        let result = body(arguments);
        if let Some(place) = place_of(function.name) {
            keep(function.name, place, Call { arguments: words(&arguments), result: words(&result) });
        }
        result
    }
    // Hand-written functions are not stored, and not compiled a second time.
    fn out_of_line<T>(body: impl FnOnce() -> T) -> T {
        body()
    }
    fn device<D: Device>(device: &D, arguments: D::Arguments<Self>) -> D::Output<Self> {
        match device.recorded(arguments) {
            Some(output) => output,
            None => watched(&device.run::<f32>(plain(&arguments))),
        }
    }
}
