//! The SIMD levels of the processor, and the dispatch to them.

use super::Kernel;
use std::{env, fmt, str::FromStr};

/// A SIMD level. All levels give the same bits; wider ones are faster.
///
/// A value of this type is proof that the processor supports the level.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Level(Width);

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Width {
    Scalar,
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// The name of a level is unknown, or the processor does not support it.
#[derive(Debug, thiserror::Error)]
#[error("STRIDE_SIMD={0}: this processor has {available}", available = Level::available_names())]
pub struct UnknownLevel(String);

impl Level {
    /// One lane: for tracing a single path.
    pub const SCALAR: Level = Level(Width::Scalar);
    /// Four lanes, on any processor.
    pub const PORTABLE: Level = Level(Width::Portable);

    /// All levels that this processor supports, the widest first.
    pub fn available() -> Vec<Level> {
        let mut levels = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            let has_avx2 = is_x86_feature_detected!("avx2");
            let has_avx512 = has_avx2
                && is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            if has_avx512 {
                levels.push(Level(Width::Avx512));
            }
            if has_avx2 {
                levels.push(Level(Width::Avx2));
            }
        }
        levels.extend([Level::PORTABLE, Level::SCALAR]);
        levels
    }

    /// The widest level that this processor supports.
    pub fn widest() -> Level {
        Level::available()[0]
    }

    /// The level that `STRIDE_SIMD` selects, or the widest. For programs; the library itself does not call it.
    pub fn from_environment() -> Result<Level, UnknownLevel> {
        match env::var("STRIDE_SIMD") {
            Ok(word) if !word.is_empty() => word.parse(),
            _ => Ok(Level::widest()),
        }
    }

    fn available_names() -> String {
        Level::available().iter().map(Level::to_string).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Width::Scalar => "scalar",
            Width::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => "avx512",
        })
    }
}

impl FromStr for Level {
    type Err = UnknownLevel;
    fn from_str(word: &str) -> Result<Level, UnknownLevel> {
        let found = Level::available().into_iter().find(|level| level.to_string() == word);
        found.ok_or_else(|| UnknownLevel(word.to_owned()))
    }
}

/// Runs a program with the lanes of a level.
#[allow(unsafe_code, reason = "entering code compiled for more than the baseline processor")]
pub fn dispatch<K: Kernel>(level: Level, kernel: K) -> K::Output {
    match level.0 {
        Width::Scalar => kernel.run::<f32>(),
        Width::Portable => kernel.run::<super::Four>(),
        // SAFETY: `Level` has no public constructor that skips detection; a value with this width comes
        // from `available`, which found AVX2.
        #[cfg(target_arch = "x86_64")]
        Width::Avx2 => unsafe { run_avx2(kernel) },
        // SAFETY: likewise; `available` found all of its features.
        #[cfg(target_arch = "x86_64")]
        Width::Avx512 => unsafe { run_avx512(kernel) },
    }
}

/// Runs whole paths: [`dispatch`], but for unit tests, for which the longest programs are compiled at one level only.
/// Compiling them at all levels takes minutes, and integration tests compare the levels.
#[cfg_attr(test, allow(unused_variables, reason = "unit tests have one level"))]
pub(crate) fn dispatch_paths<K: Kernel>(level: Level, kernel: K) -> K::Output {
    #[cfg(not(test))]
    return dispatch(level, kernel);
    #[cfg(test)]
    return kernel.run::<f32>();
}

/// Runs a program that takes a small part of the time of a render. It is compiled for four and for eight lanes only, and
/// the other levels run the nearer of these: the bits are the same. For unit tests, see [`dispatch_paths`].
#[allow(unsafe_code, reason = "entering code compiled for more than the baseline processor")]
pub(crate) fn dispatch_minor<K: Kernel>(level: Level, kernel: K) -> K::Output {
    #[cfg(test)]
    return dispatch_paths(level, kernel);
    #[cfg(not(test))]
    match level.0 {
        Width::Scalar | Width::Portable => kernel.run::<super::Four>(),
        // SAFETY: both widths come from `available`, which found AVX2 for both.
        #[cfg(target_arch = "x86_64")]
        Width::Avx2 | Width::Avx512 => unsafe { run_avx2(kernel) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<super::avx2::Float8>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<super::avx512::Float16>()
}
