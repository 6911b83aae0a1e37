//! Reconstruction filters.

use super::choice::Choice;
use crate::parameter::Number;
use std::fmt;
use std::str::FromStr;

/// A reconstruction filter with its radius in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Every sample is at the pixel's centre.
    None,
    /// Constant within the radius (½: the pixel itself).
    Box {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// A triangle that falls to zero at the radius (default 1).
    Tent {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// exp(−x²/2σ²), shifted so that it ends at zero.
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
        /// B; larger values blur.
        b: f64,
        /// C; larger values ring.
        c: f64,
    },
    /// The four-term cosine window (Harris 1978).
    BlackmanHarris {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// sinc x · sinc(x/radius).
    Lanczos {
        /// Half the filter's width in pixels, which is the number of lobes on each side.
        radius: f64,
    },
}

impl Filter {
    /// The range of radii.
    pub const RADII: Number = Number::positive(1e-6, 16.0);

    /// The range of the standard deviation of [`Filter::Gaussian`].
    pub const SIGMAS: Number = Number::between(0.05, 16.0);

    /// The range of B and C of [`Filter::Mitchell`].
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

    /// The same filter with another radius, stretched or truncated.
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

/// All filters with their default radii.
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

    /// The filter with this name in a scene file, with its default radius.
    fn from_str(name: &str) -> Result<Self, String> {
        Filter::of_name(name)
    }
}

/// "tent 1", "gaussian 1.5, sigma 0.5": the name, the radius, and any other parameters.
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
