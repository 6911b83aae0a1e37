//! Reconstruction filters.

use super::choice::Choice;
use crate::parameter::Number;
use std::fmt;
use std::str::FromStr;

/// A reconstruction filter with its radius in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Every sample through the pixel's centre.
    None,
    /// Equal weight within the radius (½: the pixel itself).
    Box {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// A triangle that falls to zero at the radius (1 by default).
    Tent {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// exp(−x²/2σ²), lowered so that it ends at zero.
    Gaussian {
        /// Half the filter's width in pixels.
        radius: f64,
        /// σ in pixels.
        sigma: f64,
    },
    /// Two cubic pieces (Mitchell and Netravali 1988), stretched to the radius.
    Mitchell {
        /// Half the filter's width in pixels.
        radius: f64,
        /// B: 1 blurs.
        b: f64,
        /// C: 1 rings.
        c: f64,
    },
    /// The window of four cosines (Harris 1978).
    BlackmanHarris {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// sinc x · sinc(x/radius).
    Lanczos {
        /// Half the filter's width in pixels, and how many lobes there are on each side.
        radius: f64,
    },
}

impl Filter {
    /// What the radius may be.
    pub const RADII: Number = Number::positive(1e-6, 16.0);

    /// What the standard deviation of [`Filter::Gaussian`] may be.
    pub const SIGMAS: Number = Number::between(0.05, 16.0);

    /// What B and C of [`Filter::Mitchell`] may be.
    pub const SHARES: Number = Number::between(0.0, 1.0);

    /// Half the filter's width in pixels.
    pub fn radius(self) -> f64 {
        match self {
            Filter::None => 0.0,
            Filter::Box { radius }
            | Filter::Tent { radius }
            | Filter::Gaussian { radius, .. }
            | Filter::Mitchell { radius, .. }
            | Filter::BlackmanHarris { radius }
            | Filter::Lanczos { radius } => radius,
        }
    }

    /// The same, stretched or cut off at another radius.
    pub fn with_radius(mut self, to: f64) -> Filter {
        match &mut self {
            Filter::None => {}
            Filter::Box { radius }
            | Filter::Tent { radius }
            | Filter::Gaussian { radius, .. }
            | Filter::Mitchell { radius, .. }
            | Filter::BlackmanHarris { radius }
            | Filter::Lanczos { radius } => *radius = to,
        }
        self
    }

    /// Whether some of its weights may be below zero.
    pub fn has_negative_lobes(self) -> bool {
        matches!(self, Filter::Mitchell { .. } | Filter::Lanczos { .. })
    }
}

/// A tent of radius 1.
impl Default for Filter {
    fn default() -> Self {
        Filter::Tent { radius: 1.0 }
    }
}

/// Each with its usual radius.
impl Choice for Filter {
    const WHAT: &'static str = "filter type";
    const NAMED: &'static [(&'static str, Self)] = &[
        ("none", Filter::None),
        ("box", Filter::Box { radius: 0.5 }),
        ("tent", Filter::Tent { radius: 1.0 }),
        ("gaussian", Filter::Gaussian { radius: 1.5, sigma: 0.5 }),
        ("mitchell", Filter::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 }),
        ("blackman-harris", Filter::BlackmanHarris { radius: 1.5 }),
        ("lanczos", Filter::Lanczos { radius: 3.0 }),
    ];
}

impl FromStr for Filter {
    type Err = String;

    /// The filter of this name with its usual radius, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        Filter::of_name(name)
    }
}

/// "tent 1", "gaussian 1.5, sigma 0.5": the name, the radius, and what else there is to it.
impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Filter::None => Ok(()),
            Filter::Gaussian { radius, sigma } => write!(f, " {radius}, sigma {sigma}"),
            Filter::Mitchell { radius, b, c } => write!(f, " {radius}, b {b}, c {c}"),
            filter => write!(f, " {}", filter.radius()),
        }
    }
}
