//! Structures of numbers, as branches give them and functions take them.

use super::number::{Float, Mask};

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

/// The form of a structure: which numbers it has, in the order of [`Value::parts`].
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

/// A number of each lane, or a structure of such numbers. [`value!`](crate::math::value) implements it.
pub trait Value<F: Float>: Copy {
    /// `a` where the mask holds, `b` elsewhere.
    fn blend(mask: F::Mask, a: Self, b: Self) -> Self;
    /// The form.
    fn layout() -> Layout;
    /// Appends the numbers.
    fn parts(&self, parts: &mut Vec<Part<F>>);
    /// The structure of the next numbers.
    ///
    /// # Panics
    /// Panics if there are too few of them, or others than [`Value::layout`] says.
    fn of_parts(parts: &mut impl Iterator<Item = Part<F>>) -> Self;
}

/// The layout of a field, given by a function that reads it.
pub fn layout_of<F: Float, T, V: Value<F>>(_field: impl Fn(&T) -> V) -> Layout {
    V::layout()
}

/// Makes a structure generic over lanes a [`Value`]: `value!(Frame { s, t, n });` names all its fields.
macro_rules! value {
    ($Type:ident { $($field:ident),+ $(,)? }) => {
        impl<F: $crate::math::Float> $crate::math::lanes::Value<F> for $Type<F> {
            #[inline(always)]
            fn blend(mask: F::Mask, a: Self, b: Self) -> Self {
                $Type { $($field: $crate::math::lanes::Value::<F>::blend(mask, a.$field, b.$field)),+ }
            }
            fn layout() -> $crate::math::lanes::Layout {
                $crate::math::lanes::Layout::Record {
                    name: stringify!($Type),
                    fields: vec![$((
                        stringify!($field),
                        $crate::math::lanes::layout_of::<F, Self, _>(|value| value.$field),
                    )),+],
                }
            }
            fn parts(&self, parts: &mut Vec<$crate::math::lanes::Part<F>>) {
                $($crate::math::lanes::Value::<F>::parts(&self.$field, parts);)+
            }
            fn of_parts(parts: &mut impl Iterator<Item = $crate::math::lanes::Part<F>>) -> Self {
                $Type { $($field: $crate::math::lanes::Value::<F>::of_parts(parts)),+ }
            }
        }
    };
}
pub(crate) use value;

/// Makes the numbers of some lanes values: their float, integer and mask. The types may be generic.
macro_rules! numbers {
    (generic [$($generics:tt)*] $Float:ty, $Uint:ty, $Mask:ty) => {
        $crate::math::lanes::value::number!([$($generics)*], $Float, $Float, Float, Float::select);
        $crate::math::lanes::value::number!([$($generics)*], $Float, $Uint, Uint, Uint::select);
        $crate::math::lanes::value::number!([$($generics)*], $Float, $Mask, Mask, $crate::math::lanes::value::blend_masks);
    };
    ($Float:ty, $Uint:ty, $Mask:ty) => {
        $crate::math::lanes::value::numbers!(generic [] $Float, $Uint, $Mask);
    };
}
pub(crate) use numbers;

/// `a` where the mask holds, `b` elsewhere.
#[inline(always)]
pub(crate) fn blend_masks<M: Mask>(mask: M, a: M, b: M) -> M {
    (mask & a) | (!mask & b)
}

/// See [`numbers`].
macro_rules! number {
    ([$($generics:tt)*], $Float:ty, $Type:ty, $kind:ident, $select:path) => {
        impl<$($generics)*> $crate::math::lanes::Value<$Float> for $Type {
            #[inline(always)]
            fn blend(mask: <$Float as $crate::math::Float>::Mask, a: Self, b: Self) -> Self {
                $select(mask, a, b)
            }
            fn layout() -> $crate::math::lanes::Layout {
                $crate::math::lanes::Layout::$kind
            }
            fn parts(&self, parts: &mut Vec<$crate::math::lanes::Part<$Float>>) {
                parts.push($crate::math::lanes::Part::$kind(*self));
            }
            fn of_parts(parts: &mut impl Iterator<Item = $crate::math::lanes::Part<$Float>>) -> Self {
                match parts.next() {
                    Some($crate::math::lanes::Part::$kind(number)) => number,
                    _ => panic!("a structure has other numbers than its layout"),
                }
            }
        }
    };
}
pub(crate) use number;

macro_rules! tuples {
    ($(($($T:ident $i:tt),+))+) => {
        $(
            impl<F: Float, $($T: Value<F>),+> Value<F> for ($($T,)+) {
                #[inline(always)]
                fn blend(mask: F::Mask, a: Self, b: Self) -> Self {
                    ($($T::blend(mask, a.$i, b.$i),)+)
                }
                fn layout() -> Layout {
                    Layout::List(vec![$($T::layout()),+])
                }
                fn parts(&self, parts: &mut Vec<Part<F>>) {
                    $(self.$i.parts(parts);)+
                }
                fn of_parts(parts: &mut impl Iterator<Item = Part<F>>) -> Self {
                    ($($T::of_parts(parts),)+)
                }
            }
        )+
    };
}
tuples! {
    (A 0)
    (A 0, B 1)
    (A 0, B 1, C 2)
    (A 0, B 1, C 2, D 3)
    (A 0, B 1, C 2, D 3, E 4)
    (A 0, B 1, C 2, D 3, E 4, G 5)
}

/// Nothing.
impl<F: Float> Value<F> for () {
    #[inline(always)]
    fn blend(_mask: F::Mask, _a: Self, _b: Self) -> Self {}
    fn layout() -> Layout {
        Layout::List(Vec::new())
    }
    fn parts(&self, _parts: &mut Vec<Part<F>>) {}
    fn of_parts(_parts: &mut impl Iterator<Item = Part<F>>) -> Self {}
}

impl<F: Float, T: Value<F>, const N: usize> Value<F> for [T; N] {
    #[inline(always)]
    fn blend(mask: F::Mask, mut a: Self, b: Self) -> Self {
        // A closure of `from_fn` would not be inlined into the level.
        let mut i = 0;
        while i < N {
            a[i] = T::blend(mask, a[i], b[i]);
            i += 1;
        }
        a
    }
    fn layout() -> Layout {
        Layout::List(vec![T::layout(); N])
    }
    fn parts(&self, parts: &mut Vec<Part<F>>) {
        self.iter().for_each(|number| number.parts(parts));
    }
    fn of_parts(parts: &mut impl Iterator<Item = Part<F>>) -> Self {
        std::array::from_fn(|_| T::of_parts(parts))
    }
}
