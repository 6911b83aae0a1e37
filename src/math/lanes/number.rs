//! The numbers of programs, computed by lanes or recorded; structures and functions of them; and the operations that
//! only lanes have.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// One boolean per lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// The same value in every lane.
    fn splat(value: bool) -> Self;
    /// The value of the first lane, for observers.
    ///
    /// # Panics
    /// Panics while a program is recorded, which has no lanes.
    fn first(self) -> bool;
}

/// One `u32` per lane, with wrapping arithmetic.
pub trait Uint:
    Copy
    + Add<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
{
    /// The float type with the same number of lanes.
    type Float: Float<Uint = Self, Mask = Self::Mask>;
    /// The result type of comparisons.
    type Mask: Mask;

    /// The same value in every lane, a constant of the program.
    fn splat(value: u32) -> Self;
    /// A number of the scene or of the settings in every lane. The argument must be the number itself and not a copy,
    /// because recorded programs identify it by its address. They read it from a buffer, so that they do not depend on
    /// its value.
    ///
    /// # Panics
    /// Panics while a program is recorded, if the address is not registered.
    fn given(number: &u32) -> Self;
    /// `table[index]` for each lane; an index past the end reads the last entry on lanes, and anything in recorded
    /// programs. The table is not empty and has at most `i32::MAX` entries. Tables no longer than a register are the
    /// quickest.
    fn gather(table: &[u32], index: Self) -> Self;
    /// Shifts every lane left by `K` bits.
    fn shl<const K: u32>(self) -> Self;
    /// Shifts every lane right by `K` bits, filling with zeros.
    fn shr<const K: u32>(self) -> Self;
    /// Every lane's bits in the opposite order.
    fn reverse_bits(self) -> Self;
    /// Equality, lane by lane.
    fn eq(self, other: Self) -> Self::Mask;
    /// Unsigned "less than", lane by lane.
    fn lt(self, other: Self) -> Self::Mask;
    /// `a` where the mask holds, `b` elsewhere.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The nearest float of values below 2³¹; larger ones are unspecified.
    fn to_float(self) -> Self::Float;
    /// A float in [0, 1), uniform if the bits are: the upper 24 bits over 2²⁴.
    #[inline(always)]
    fn to_unit(self) -> Self::Float {
        self.shr::<8>().to_float() * (1.0 / 16_777_216.0)
    }
    /// The number of the first lane, for observers.
    ///
    /// # Panics
    /// Panics while a program is recorded, which has no lanes.
    fn first(self) -> u32;
}

/// One `f32` per lane.
///
/// A comparison with NaN is false, but compilers for GPUs may assume that there is no NaN. Code whose result
/// depends on such a comparison must examine bits instead.
pub trait Float:
    Copy
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f32, Output = Self>
    + Sub<f32, Output = Self>
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
    + Value<Self>
{
    /// The integer type with the same number of lanes.
    type Uint: Uint<Float = Self, Mask = Self::Mask> + Value<Self>;
    /// The result type of comparisons.
    type Mask: Mask + Value<Self>;
    /// The number of lanes, 1 to 16; zero in a recorded program.
    const LANES: usize;

    /// The same value in every lane, a constant of the program.
    fn splat(value: f32) -> Self;
    /// A number of the scene or of the settings in every lane. The argument must be the number itself and not a copy,
    /// because recorded programs identify it by its address. They read it from a buffer, so that they do not depend on
    /// its value.
    ///
    /// # Panics
    /// Panics while a program is recorded, if the address is not registered.
    fn given(number: &f32) -> Self;
    /// `table[index]` for each lane; an index past the end reads the last entry on lanes, and anything in recorded
    /// programs. The table is not empty and has at most `i32::MAX` entries.
    fn gather(table: &[f32], index: Self::Uint) -> Self;
    /// [`Self::gather`] from several tables of equal length at the same index.
    fn gather_all<const T: usize>(tables: [&[f32]; T], index: Self::Uint) -> [Self; T] {
        tables.map(|table| Self::gather(table, index))
    }
    /// The correctly rounded square root.
    fn sqrt(self) -> Self;
    /// The magnitude: clears the sign bit.
    fn abs(self) -> Self;
    /// The largest integer that is not above the value.
    fn floor(self) -> Self;
    /// `self` if it is less than `other`, else `other` (also when either is NaN, and for two zeros).
    fn min(self, other: Self) -> Self;
    /// `self` if it is greater than `other`, else `other` (also when either is NaN, and for two zeros).
    fn max(self, other: Self) -> Self;
    /// Less than; false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// Less than or equal; false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Greater than; false for NaN.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// Greater than or equal; false for NaN.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `a` where the mask holds, `b` elsewhere.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The bit pattern.
    fn to_bits(self) -> Self::Uint;
    /// The float of a bit pattern.
    fn from_bits(bits: Self::Uint) -> Self;
    /// Rounds towards zero, for values in [0, 2³¹); others are unspecified but never undefined.
    fn to_uint(self) -> Self::Uint;
    /// The number of the first lane, for observers.
    ///
    /// # Panics
    /// Panics while a program is recorded, which has no lanes.
    fn first(self) -> f32;

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// The value where the mask holds, zero elsewhere.
    #[inline(always)]
    fn only(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }
    /// `self` with the sign of `sign`.
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = Self::Uint::splat(0x8000_0000);
        Self::from_bits(self.abs().to_bits() | (sign.to_bits() & bit))
    }

    // Three-dimensional vectors. Lanes compute each coordinate separately; a recorded program has vector types.

    /// The sum of two vectors.
    #[inline(always)]
    fn add3([ax, ay, az]: [Self; 3], [bx, by, bz]: [Self; 3]) -> [Self; 3] {
        [ax + bx, ay + by, az + bz]
    }
    /// The difference of two vectors.
    #[inline(always)]
    fn sub3([ax, ay, az]: [Self; 3], [bx, by, bz]: [Self; 3]) -> [Self; 3] {
        [ax - bx, ay - by, az - bz]
    }
    /// The products of the coordinates of two vectors.
    #[inline(always)]
    fn mul3([ax, ay, az]: [Self; 3], [bx, by, bz]: [Self; 3]) -> [Self; 3] {
        [ax * bx, ay * by, az * bz]
    }
    /// A vector times a number.
    #[inline(always)]
    fn scale3([x, y, z]: [Self; 3], k: Self) -> [Self; 3] {
        [x * k, y * k, z * k]
    }
    /// A vector in the opposite direction.
    #[inline(always)]
    fn neg3([x, y, z]: [Self; 3]) -> [Self; 3] {
        [-x, -y, -z]
    }
    /// The scalar product of two vectors.
    #[inline(always)]
    fn dot3([ax, ay, az]: [Self; 3], [bx, by, bz]: [Self; 3]) -> Self {
        ax * bx + ay * by + az * bz
    }
    /// The vector product of two vectors.
    #[inline(always)]
    fn cross3([ax, ay, az]: [Self; 3], [bx, by, bz]: [Self; 3]) -> [Self; 3] {
        [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
    }
    /// `a` where the mask holds, `b` elsewhere.
    #[inline(always)]
    fn select3(mask: Self::Mask, [ax, ay, az]: [Self; 3], [bx, by, bz]: [Self; 3]) -> [Self; 3] {
        [Self::select(mask, ax, bx), Self::select(mask, ay, by), Self::select(mask, az, bz)]
    }

    // Control flow. Mark closures `#[inline(always)]`: only code that is inlined is compiled with the level's
    // instructions.

    /// `then()` where the mask holds, `otherwise` elsewhere. Lanes skip `then` if the mask holds nowhere.
    fn branch<T: Value<Self>>(mask: Self::Mask, otherwise: T, then: impl FnOnce() -> T) -> T;
    /// `then()` if the mask holds anywhere, else `otherwise`: lanes in which it does not hold are unspecified.
    fn guard<T: Value<Self>>(mask: Self::Mask, otherwise: T, then: impl FnOnce() -> T) -> T;
    /// `then()` where the mask holds, `otherwise()` elsewhere. Lanes skip `then` if the mask holds nowhere, and compute
    /// `otherwise` in any case; a recorded program computes one of the two.
    fn fork<T: Value<Self>>(mask: Self::Mask, then: impl FnOnce() -> T, otherwise: impl FnOnce() -> T) -> T;
    /// Calls `body` while any lane is live. It returns the next state, and which of the lanes stay live. The state of
    /// lanes that are not live does not change.
    fn repeat<T: Value<Self>>(live: Self::Mask, state: T, body: impl FnMut(T) -> (T, Self::Mask)) -> T;
    /// `body(arguments)`. In a recorded program it is a separate function, which depends only on its arguments and on the
    /// scene. See `function!` (in `macros.rs`).
    fn call<A: Value<Self>, R: Value<Self>>(
        function: &'static Function,
        arguments: A,
        body: impl FnOnce(A) -> R,
    ) -> R;
    /// `body()` in a separate function that is compiled for the level's instructions, for code that most scenes do not run:
    /// inlined, it would cost those scenes registers and every kernel compile time. It has no effect in recorded programs.
    fn out_of_line<T>(body: impl FnOnce() -> T) -> T;
    /// A function that is written by hand for recorded programs.
    fn device<D: Device>(device: &D, arguments: D::Arguments<Self>) -> D::Output<Self>;
}

/// A number of a structure.
#[derive(Clone, Copy)]
pub enum Part<F: Float> {
    /// A float.
    Float(F),
    /// An integer.
    Uint(F::Uint),
    /// A boolean.
    Mask(F::Mask),
}

/// The layout of a structure: its numbers, in the order of [`Value::parts`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Layout {
    /// A float.
    Float,
    /// An integer.
    Uint,
    /// A boolean.
    Mask,
    /// Three floats: a vector or a colour.
    Vector,
    /// A structure of named fields.
    Record {
        /// The name of its type.
        name: &'static str,
        /// Its fields.
        fields: Vec<(&'static str, Layout)>,
    },
    /// A tuple or an array.
    List(Vec<Layout>),
}

/// A number per lane, or a structure of such numbers. Implemented by `value!` (in `macros.rs`).
pub trait Value<F: Float>: Copy {
    /// `a` where the mask holds, `b` elsewhere.
    fn blend(mask: F::Mask, a: Self, b: Self) -> Self;
    /// The layout.
    fn layout() -> Layout;
    /// Appends the numbers.
    fn parts(&self, parts: &mut Vec<Part<F>>);
    /// Makes the structure from the next numbers.
    ///
    /// # Panics
    /// Panics if there are too few of them, or if their types differ from [`Value::layout`].
    fn of_parts(parts: &mut impl Iterator<Item = Part<F>>) -> Self;
}

/// The layout of a field, given by a function that reads it.
pub fn layout_of<F: Float, T, V: Value<F>>(_field: impl Fn(&T) -> V) -> Layout {
    V::layout()
}

/// A function of recorded programs, as declared by `function!` (in `macros.rs`). Functions of one name are identical.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// The names of its parameters.
    pub parameters: &'static [&'static str],
    /// The module that contains it, as `module_path!` writes it.
    pub module: &'static str,
}

/// A function that is written by hand for recorded programs, because on the CPU it needs more than one lane, or memory
/// of its own.
pub trait Device {
    /// The name of the function written by hand.
    const NAME: &'static str;
    /// The arguments.
    type Arguments<F: Float>: Value<F>;
    /// The result.
    type Output<F: Float>: Value<F>;
    /// The computation on lanes.
    fn run<F: LaneFloat>(&self, arguments: Self::Arguments<F>) -> Self::Output<F>;
    /// The computation in recorded programs, if only lanes need a special one; `None` if the function is written by
    /// hand.
    fn recorded<F: Float>(&self, _arguments: Self::Arguments<F>) -> Option<Self::Output<F>> {
        None
    }
}

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
    /// The first values of a slice, one per lane. The slice has at least as many values as there are lanes.
    fn load(from: &[u32]) -> Self;
    /// Writes the lanes to the front of a slice, which has room for all of them.
    fn store(self, into: &mut [u32]);
    /// For each true lane the number of true lanes before it; unspecified values below 16 in other lanes.
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
    /// Eight floats, as fast as this level allows: for testing one ray against eight primitives.
    type Octet: LaneFloat;

    /// The first values of a slice, one per lane. The slice has at least as many values as there are lanes.
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
    /// Runs a program with these lanes in a separate function, for code that is too large to be inlined at every call.
    /// The function is compiled for the level's instructions, as those of [`dispatch`](super::dispatch) are.
    fn outlined<K: Kernel>(kernel: K) -> K::Output;
    /// Like [`Self::outlined`], for a program that uses [`Self::Octet`] alone, such as one that treats one lane after the other: it is
    /// compiled once for the levels that have the same octets.
    #[inline(always)]
    fn with_octets<K: Kernel>(kernel: K) -> K::Output {
        <Self::Octet as LaneFloat>::outlined(kernel)
    }
    /// Like [`Self::outlined`], for code that most scenes do not run: the code around the call is laid out for paths without it.
    fn seldom<K: Kernel>(kernel: K) -> K::Output;
}

/// A closure as a program.
pub(super) struct Closure<C>(pub C);

impl<T, C: FnOnce() -> T> Kernel for Closure<C> {
    type Output = T;
    #[inline(always)]
    fn run<F: LaneFloat>(self) -> T {
        (self.0)()
    }
}

/// The maximum number of lanes of any level.
pub const MAX_LANES: usize = 16;

/// A program that is compiled once for each level.
pub trait Kernel {
    /// The result of the program.
    type Output;
    /// The program. Mark it, and everything that it calls for each lane, `#[inline(always)]`: only code that is
    /// inlined into the level's entry point is compiled with the level's instructions.
    fn run<F: LaneFloat>(self) -> Self::Output;
}
