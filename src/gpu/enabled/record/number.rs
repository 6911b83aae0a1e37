//! Recorded numbers, and their implementation of the number traits.

use super::control::{self, Begun, Loop, constant};
use super::graph::Binary;
use super::kind::Kind;
use super::state::{Handle, on_vectors, with};
use crate::math::lanes::{Device, Function, Layout, Part, Value};
use crate::math::{Float, Mask, Uint};
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};
use std::vec;

/// A float of a program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordedFloat(Handle);
/// An integer of a program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordedUint(Handle);
/// A boolean of a program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordedMask(Handle);

type Float32 = RecordedFloat;

macro_rules! number {
    ($Type:ident, $kind:ident, $blend:expr) => {
        impl Value<RecordedFloat> for $Type {
            fn blend(mask: RecordedMask, a: Self, b: Self) -> Self {
                $blend(mask, a, b)
            }
            fn layout() -> Layout {
                Layout::$kind
            }
            fn parts(&self, parts: &mut Vec<Part<RecordedFloat>>) {
                parts.push(Part::$kind(*self));
            }
            fn of_parts(parts: &mut impl Iterator<Item = Part<RecordedFloat>>) -> Self {
                match parts.next() {
                    Some(Part::$kind(number)) => number,
                    _ => panic!("a structure has other numbers than its layout"),
                }
            }
        }
    };
}
number!(RecordedFloat, Float, Float::select);
number!(RecordedUint, Uint, Uint::select);
number!(RecordedMask, Mask, blend_masks);

fn blend_masks(mask: RecordedMask, a: RecordedMask, b: RecordedMask) -> RecordedMask {
    (mask & a) | (!mask & b)
}

// Operations are not inlined: recording need not be fast, and there are thousands of call sites.

macro_rules! operator {
    ($Type:ident, $kind:ident, $Trait:ident, $method:ident, $function:ident, $op:expr) => {
        impl $Trait for $Type {
            type Output = Self;
            #[inline(never)]
            fn $method(self, other: Self) -> Self {
                let operands = [(self.0, Kind::$kind), (other.0, Kind::$kind)];
                $Type(with(|state| state.apply(operands, |graph, [a, b]| graph.$function($op, a, b))))
            }
        }
    };
}
operator!(RecordedMask, Mask, BitAnd, bitand, masks, Binary::And);
operator!(RecordedMask, Mask, BitOr, bitor, masks, Binary::Or);
operator!(RecordedUint, Uint, Add, add, integers, Binary::Add);
operator!(RecordedUint, Uint, Mul, mul, integers, Binary::Multiply);
operator!(RecordedUint, Uint, BitAnd, bitand, integers, Binary::And);
operator!(RecordedUint, Uint, BitOr, bitor, integers, Binary::Or);
operator!(RecordedUint, Uint, BitXor, bitxor, integers, Binary::Xor);
operator!(RecordedFloat, Float, Add, add, arithmetic, Binary::Add);
operator!(RecordedFloat, Float, Sub, sub, arithmetic, Binary::Subtract);
operator!(RecordedFloat, Float, Mul, mul, arithmetic, Binary::Multiply);
operator!(RecordedFloat, Float, Div, div, arithmetic, Binary::Divide);

macro_rules! with_constant {
    ($Trait:ident, $method:ident) => {
        impl $Trait<f32> for RecordedFloat {
            type Output = Self;
            fn $method(self, other: f32) -> Self {
                $Trait::$method(self, RecordedFloat::splat(other))
            }
        }
    };
}
with_constant!(Add, add);
with_constant!(Sub, sub);
with_constant!(Mul, mul);
with_constant!(Div, div);

impl Not for RecordedMask {
    type Output = Self;
    #[inline(never)]
    fn not(self) -> Self {
        RecordedMask(with(|state| state.apply([(self.0, Kind::Mask)], |graph, [a]| graph.not(a))))
    }
}

impl Neg for RecordedFloat {
    type Output = Self;
    #[inline(never)]
    fn neg(self) -> Self {
        RecordedFloat(with(|state| state.apply([(self.0, Kind::Float)], |graph, [a]| graph.negate(a))))
    }
}

impl Mask for RecordedMask {
    #[inline(never)]
    fn splat(value: bool) -> Self {
        RecordedMask(with(|state| state.apply([], |graph, []| graph.mask(value))))
    }
    fn first(self) -> bool {
        panic!("a recorded program has no lanes");
    }
}

impl RecordedUint {
    #[inline(never)]
    fn with_constant(self, op: Binary, b: u32) -> Self {
        RecordedUint(with(|state| {
            state.apply([(self.0, Kind::Uint)], |graph, [a]| {
                let b = graph.uint(b);
                graph.integers(op, a, b)
            })
        }))
    }
    #[inline(never)]
    fn compare(self, op: Binary, other: Self) -> RecordedMask {
        let operands = [(self.0, Kind::Uint), (other.0, Kind::Uint)];
        RecordedMask(with(|state| state.apply(operands, |graph, [a, b]| graph.compare(op, a, b))))
    }
}

impl Uint for RecordedUint {
    type Float = RecordedFloat;
    type Mask = RecordedMask;

    #[inline(never)]
    fn splat(value: u32) -> Self {
        RecordedUint(with(|state| state.apply([], |graph, []| graph.uint(value))))
    }
    #[inline(never)]
    fn given(number: &u32) -> Self {
        RecordedUint(with(|state| state.given(number, Kind::Uint)))
    }
    #[inline(never)]
    fn gather(table: &[u32], index: Self) -> Self {
        RecordedUint(with(|state| state.gather(table, index.0, Kind::Uint)))
    }
    fn shl<const K: u32>(self) -> Self {
        self.with_constant(Binary::ShiftLeft, K)
    }
    fn shr<const K: u32>(self) -> Self {
        self.with_constant(Binary::ShiftRight, K)
    }
    #[inline(never)]
    fn reverse_bits(self) -> Self {
        RecordedUint(with(|state| state.apply([(self.0, Kind::Uint)], |graph, [a]| graph.reverse_bits(a))))
    }
    fn eq(self, other: Self) -> RecordedMask {
        self.compare(Binary::Equal, other)
    }
    fn lt(self, other: Self) -> RecordedMask {
        self.compare(Binary::Less, other)
    }
    #[inline(never)]
    fn select(mask: RecordedMask, a: Self, b: Self) -> Self {
        let operands = [(mask.0, Kind::Mask), (a.0, Kind::Uint), (b.0, Kind::Uint)];
        RecordedUint(with(|state| state.apply(operands, |graph, [mask, a, b]| graph.select(mask, a, b))))
    }
    #[inline(never)]
    fn to_float(self) -> RecordedFloat {
        RecordedFloat(with(|state| state.apply([(self.0, Kind::Uint)], |graph, [a]| graph.float_of_uint(a))))
    }
    fn first(self) -> u32 {
        panic!("a recorded program has no lanes");
    }
}

impl RecordedFloat {
    #[inline(never)]
    fn function(self, name: &str, exact: fn(f32) -> f32) -> Self {
        RecordedFloat(with(|state| {
            state.apply([(self.0, Kind::Float)], |graph, [a]| graph.function_of_float(name, a, exact))
        }))
    }
    #[inline(never)]
    fn function2(self, name: &str, other: Self, exact: fn(f32, f32) -> f32) -> Self {
        let operands = [(self.0, Kind::Float), (other.0, Kind::Float)];
        RecordedFloat(with(|state| {
            state.apply(operands, |graph, operands| graph.function_of_floats(name, operands, exact))
        }))
    }
    #[inline(never)]
    fn compare(self, op: Binary, other: Self) -> RecordedMask {
        let operands = [(self.0, Kind::Float), (other.0, Kind::Float)];
        RecordedMask(with(|state| state.apply(operands, |graph, [a, b]| graph.compare(op, a, b))))
    }
}

fn handles([x, y, z]: [RecordedFloat; 3]) -> [Handle; 3] {
    [x.0, y.0, z.0]
}

// What follows is compiled for every structure, and does the least possible itself: see `control.rs`.

/// The numbers of a structure.
#[inline(never)]
fn numbers<T: Value<RecordedFloat>>(value: &T) -> Vec<(Handle, Kind)> {
    let mut parts = Vec::new();
    value.parts(&mut parts);
    handles_of(&parts)
}

fn handles_of(parts: &[Part<RecordedFloat>]) -> Vec<(Handle, Kind)> {
    let number = |part: &Part<RecordedFloat>| match part {
        Part::Float(number) => (number.0, Kind::Float),
        Part::Uint(number) => (number.0, Kind::Uint),
        Part::Mask(number) => (number.0, Kind::Mask),
    };
    parts.iter().map(number).collect()
}

/// The structure with some numbers.
#[inline(never)]
fn structure<T: Value<RecordedFloat>>(handles: Vec<Handle>) -> T {
    T::of_parts(&mut parts_of(&T::layout(), handles))
}

fn parts_of(layout: &Layout, handles: Vec<Handle>) -> vec::IntoIter<Part<RecordedFloat>> {
    fn kinds(layout: &Layout, into: &mut Vec<Kind>) {
        match layout {
            Layout::Float => into.push(Kind::Float),
            Layout::Uint => into.push(Kind::Uint),
            Layout::Mask => into.push(Kind::Mask),
            Layout::Vector => into.extend([Kind::Float; 3]),
            Layout::Record { fields, .. } => fields.iter().for_each(|(_, layout)| kinds(layout, into)),
            Layout::List(list) => list.iter().for_each(|layout| kinds(layout, into)),
        }
    }
    let mut all = Vec::new();
    kinds(layout, &mut all);
    debug_assert_eq!(all.len(), handles.len());
    let part = |(handle, kind)| match kind {
        Kind::Uint => Part::Uint(RecordedUint(handle)),
        Kind::Mask => Part::Mask(RecordedMask(handle)),
        _ => Part::Float(RecordedFloat(handle)),
    };
    let parts: Vec<_> = handles.into_iter().zip(all).map(part).collect();
    parts.into_iter()
}

/// Records a root: a function that need not be called by another one.
pub(super) fn root<A: Value<Float32>, R: Value<Float32>>(
    function: &'static Function,
    body: impl FnOnce(A) -> R,
) {
    recorded(function, body);
    with(|state| state.want(function));
}

/// Records the functions that a function calls, but not the function itself.
pub(super) fn callees<A: Value<Float32>, R: Value<Float32>>(
    function: &'static Function,
    body: impl FnOnce(A) -> R,
) {
    recorded(function, |arguments| {
        with(|state| state.stand_for_others());
        body(arguments)
    });
}

fn recorded<A: Value<Float32>, R: Value<Float32>>(function: &'static Function, body: impl FnOnce(A) -> R) {
    if let Some(parameters) = control::enter(function, A::layout()) {
        let result = body(structure(parameters));
        control::leave(R::layout(), &numbers(&result));
    }
}

impl Float for RecordedFloat {
    type Uint = RecordedUint;
    type Mask = RecordedMask;
    const LANES: usize = 0;

    #[inline(never)]
    fn splat(value: f32) -> Self {
        RecordedFloat(with(|state| state.apply([], |graph, []| graph.float(value))))
    }
    #[inline(never)]
    fn given(number: &f32) -> Self {
        RecordedFloat(with(|state| state.given(number, Kind::Float)))
    }
    #[inline(never)]
    fn gather(table: &[f32], index: RecordedUint) -> Self {
        RecordedFloat(with(|state| state.gather(table, index.0, Kind::Float)))
    }
    fn sqrt(self) -> Self {
        self.function("sqrt", f32::sqrt)
    }
    fn abs(self) -> Self {
        self.function("abs", f32::abs)
    }
    fn floor(self) -> Self {
        self.function("floor", libm::floorf)
    }
    fn min(self, other: Self) -> Self {
        self.function2("float_min", other, <f32 as Float>::min)
    }
    fn max(self, other: Self) -> Self {
        self.function2("float_max", other, <f32 as Float>::max)
    }
    fn lt(self, other: Self) -> RecordedMask {
        self.compare(Binary::Less, other)
    }
    fn le(self, other: Self) -> RecordedMask {
        self.compare(Binary::LessOrEqual, other)
    }
    fn gt(self, other: Self) -> RecordedMask {
        self.compare(Binary::Greater, other)
    }
    fn ge(self, other: Self) -> RecordedMask {
        self.compare(Binary::GreaterOrEqual, other)
    }
    #[inline(never)]
    fn select(mask: RecordedMask, a: Self, b: Self) -> Self {
        let operands = [(mask.0, Kind::Mask), (a.0, Kind::Float), (b.0, Kind::Float)];
        RecordedFloat(with(|state| state.apply(operands, |graph, [mask, a, b]| graph.select(mask, a, b))))
    }
    #[inline(never)]
    fn to_bits(self) -> RecordedUint {
        RecordedUint(with(|state| state.apply([(self.0, Kind::Float)], |graph, [a]| graph.bits_of(a))))
    }
    #[inline(never)]
    fn from_bits(bits: RecordedUint) -> Self {
        RecordedFloat(with(|state| state.apply([(bits.0, Kind::Uint)], |graph, [a]| graph.float_of_bits(a))))
    }
    #[inline(never)]
    fn to_uint(self) -> RecordedUint {
        RecordedUint(with(|state| state.apply([(self.0, Kind::Float)], |graph, [a]| graph.uint_of_float(a))))
    }
    fn first(self) -> f32 {
        panic!("a recorded program has no lanes");
    }
    fn copysign(self, sign: Self) -> Self {
        self.function2("copysign", sign, f32::copysign)
    }

    #[inline(never)]
    fn add3(a: [Self; 3], b: [Self; 3]) -> [Self; 3] {
        on_vectors(Binary::Add, handles(a), handles(b)).map(RecordedFloat)
    }
    #[inline(never)]
    fn sub3(a: [Self; 3], b: [Self; 3]) -> [Self; 3] {
        on_vectors(Binary::Subtract, handles(a), handles(b)).map(RecordedFloat)
    }
    #[inline(never)]
    fn mul3(a: [Self; 3], b: [Self; 3]) -> [Self; 3] {
        on_vectors(Binary::Multiply, handles(a), handles(b)).map(RecordedFloat)
    }
    #[inline(never)]
    fn scale3(v: [Self; 3], k: Self) -> [Self; 3] {
        with(|state| {
            let (v, k) = (state.vector(handles(v)), state.node(k.0, Kind::Float));
            let node = state.graph().arithmetic(Binary::Multiply, v, k);
            state.coordinates(node).map(RecordedFloat)
        })
    }
    #[inline(never)]
    fn neg3(v: [Self; 3]) -> [Self; 3] {
        with(|state| {
            let v = state.vector(handles(v));
            let node = state.graph().negate(v);
            state.coordinates(node).map(RecordedFloat)
        })
    }
    #[inline(never)]
    fn dot3(a: [Self; 3], b: [Self; 3]) -> Self {
        with(|state| {
            let vectors = [a, b].map(|v| state.vector(handles(v)));
            let node = state.graph().call("dot", vectors.to_vec(), Kind::Float);
            RecordedFloat(state.handle(node))
        })
    }
    #[inline(never)]
    fn cross3(a: [Self; 3], b: [Self; 3]) -> [Self; 3] {
        with(|state| {
            let vectors = [a, b].map(|v| state.vector(handles(v)));
            let node = state.graph().call("cross", vectors.to_vec(), Kind::Floats(3));
            state.coordinates(node).map(RecordedFloat)
        })
    }
    #[inline(never)]
    fn select3(mask: RecordedMask, a: [Self; 3], b: [Self; 3]) -> [Self; 3] {
        with(|state| {
            let [a, b] = [a, b].map(|v| state.vector(handles(v)));
            let mask = state.node(mask.0, Kind::Mask);
            let node = state.graph().select(mask, a, b);
            state.coordinates(node).map(RecordedFloat)
        })
    }

    // Not inlined, as otherwise a program would be compiled as a few functions of immense length.
    #[inline(never)]
    fn branch<T: Value<Self>>(mask: RecordedMask, otherwise: T, then: impl FnOnce() -> T) -> T {
        let constant = constant(mask.0);
        if constant == Some(false) {
            return otherwise;
        }
        let mut begun = None;
        if constant.is_none() {
            let layout = T::layout();
            let otherwise = control::values(&layout, &numbers(&otherwise));
            begun = Some((otherwise, Begun::new(mask.0, layout)));
        }
        // Called once, as in `fork`: otherwise nested branches would double the code each time.
        let result = then();
        let Some((otherwise, begun)) = begun else { return result };
        structure(begun.end(&numbers(&result), otherwise))
    }
    fn guard<T: Value<Self>>(mask: RecordedMask, otherwise: T, then: impl FnOnce() -> T) -> T {
        Self::branch(mask, otherwise, then)
    }
    #[inline(never)]
    fn fork<T: Value<Self>>(
        mask: RecordedMask,
        then: impl FnOnce() -> T,
        otherwise: impl FnOnce() -> T,
    ) -> T {
        let constant = constant(mask.0);
        let mut begun = None;
        if constant != Some(false) {
            let first = constant.is_none().then(|| Begun::new(mask.0, T::layout()));
            let result = then();
            let Some(first) = first else { return result };
            let turned = first.turn(&numbers(&result));
            begun = Some((first, turned));
        }
        let result = otherwise();
        let Some((begun, turned)) = begun else { return result };
        structure(begun.end_fork(turned, &numbers(&result)))
    }
    #[inline(never)]
    fn repeat<T: Value<Self>>(
        live: RecordedMask,
        state: T,
        mut body: impl FnMut(T) -> (T, RecordedMask),
    ) -> T {
        if constant(live.0) == Some(false) {
            return state;
        }
        let (begun, within) = Loop::new(live.0, T::layout(), &numbers(&state));
        let (next, stays) = body(structure(within));
        structure(begun.end(&numbers(&next), stays.0))
    }
    #[inline(never)]
    fn call<A: Value<Self>, R: Value<Self>>(
        function: &'static Function,
        arguments: A,
        body: impl FnOnce(A) -> R,
    ) -> R {
        recorded(function, body);
        let layouts = (A::layout(), R::layout());
        structure(control::called(function, layouts, &numbers(&arguments)))
    }
    fn out_of_line<T>(body: impl FnOnce() -> T) -> T {
        body()
    }
    fn device<D: Device>(device: &D, arguments: D::Arguments<Self>) -> D::Output<Self> {
        if let Some(output) = device.recorded(arguments) {
            return output;
        }
        let layouts = (<D::Arguments<Self>>::layout(), <D::Output<Self>>::layout());
        structure(control::device(D::NAME, layouts, &numbers(&arguments)))
    }
}
