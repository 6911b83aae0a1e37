//! Macros that implement the traits of numbers, and declare functions of recorded programs.

/// Makes a structure generic over lanes a `Value`: `value!(Frame { s, t, n });` names all its fields.
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
        $crate::math::lanes::macros::number!([$($generics)*], $Float, $Float, Float, Float::select);
        $crate::math::lanes::macros::number!([$($generics)*], $Float, $Uint, Uint, Uint::select);
        $crate::math::lanes::macros::number!([$($generics)*], $Float, $Mask, Mask, $crate::math::lanes::value::blend_masks);
    };
    ($Float:ty, $Uint:ty, $Mask:ty) => {
        $crate::math::lanes::macros::numbers!(generic [] $Float, $Uint, $Mask);
    };
}
pub(crate) use numbers;

/// See `numbers!`.
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

/// The common methods of `Mask`, `Uint` and `Float` for all lanes, for their `impl` blocks. `gathers` is for lanes that
/// look up tables one after the other.
macro_rules! for_lanes {
    (gathers) => {
        #[inline(always)]
        fn gather_all<const T: usize>(tables: [&[f32]; T], index: Self::Uint) -> [Self; T] {
            let mut all = [Self::zero(); T];
            let mut i = 0;
            while i < T {
                all[i] = Self::gather(tables[i], index);
                i += 1;
            }
            all
        }
    };
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
        #[allow(clippy::assign_op_pattern, reason = "masks of some levels have no `&=`")]
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
        fn out_of_line<T>(body: impl FnOnce() -> T) -> T {
            <Self as $crate::math::lanes::LaneFloat>::seldom($crate::math::lanes::number::Closure(body))
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

/// Makes a function body also a function of recorded programs: `function!(F, disk(u), { … })` has the value of the
/// block, in which `u` is unchanged. Apart from its arguments the block may use only the scene's tables and settings,
/// not other numbers of lanes. The name may also be a string expression.
macro_rules! function {
    ($F:ty, $name:ident($($argument:ident),* $(,)?), $body:block) => {
        $crate::math::function!($F, stringify!($name), ($($argument),*), $body)
    };
    ($F:ty, $name:expr, ($($argument:ident),* $(,)?), $body:block) => {
        <$F as $crate::math::Float>::call(
            const {
                &$crate::math::lanes::Function {
                    name: $name,
                    parameters: &[$(stringify!($argument)),*],
                    module: module_path!(),
                }
            },
            ($($argument,)*),
            #[inline(always)]
            |($($argument,)*)| $body,
        )
    };
}
pub(crate) use function;

/// The look-ups of a level whose module has a `look_up` of registers.
#[cfg(target_arch = "x86_64")]
macro_rules! gathers {
    ($Float:ident, $Uint:ident) => {
        #[inline(always)]
        fn gather(table: &[f32], index: $Uint) -> Self {
            let [found] = Self::gather_all([table], index);
            found
        }
        #[inline(always)]
        fn gather_all<const T: usize>(tables: [&[f32]; T], index: $Uint) -> [Self; T] {
            let (mut starts, mut len, mut i) = ([std::ptr::null(); T], usize::MAX, 0);
            while i < T {
                (starts[i], len) =
                    (tables[i].as_ptr(), if tables[i].len() < len { tables[i].len() } else { len });
                i += 1;
            }
            // SAFETY: `len` is the least length, so each slice holds at least that many values.
            let found = unsafe { look_up(starts, len, index.0) };
            let (mut all, mut i) = ([Self::zero(); T], 0);
            while i < T {
                all[i] = $Float(found[i]);
                i += 1;
            }
            all
        }
    };
}
#[cfg(target_arch = "x86_64")]
pub(crate) use gathers;
