//! Structures of numbers: tuples and arrays.

use super::number::{Float, Layout, Mask, Part, Value};

/// `a` where the mask holds, `b` elsewhere.
#[inline(always)]
pub(crate) fn blend_masks<M: Mask>(mask: M, a: M, b: M) -> M {
    (mask & a) | (!mask & b)
}

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
    (A 0, B 1, C 2, D 3, E 4, G 5, H 6)
}

/// The empty structure.
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
