//! Functions of recorded programs.

use super::lane::LaneFloat;
use super::number::Float;
use super::value::Value;

/// A function of recorded programs, as [`function!`](crate::math::function) declares it. Two functions of one name are
/// the same one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// The names of its parameters.
    pub parameters: &'static [&'static str],
    /// The module that it stands in, as `module_path!` writes it.
    pub module: &'static str,
}

/// A function that recorded programs have written by hand, because it needs more than one lane, or memory of its own,
/// on the CPU.
pub trait Device {
    /// The name of the function that is written by hand.
    const NAME: &'static str;
    /// The arguments.
    type Arguments<F: Float>: Value<F>;
    /// The result.
    type Output<F: Float>: Value<F>;
    /// What lanes compute.
    fn run<F: LaneFloat>(&self, arguments: Self::Arguments<F>) -> Self::Output<F>;
}

/// The body of a function that is a function of recorded programs, too: `function!(F, disk(u), { … })` is the block's
/// value, in which `u` is what it was before. What the block uses besides are the scene's tables and settings, not
/// other numbers of lanes. The name may be a string, where it is put together from others.
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
