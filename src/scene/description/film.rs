//! The size of the image and its reconstruction from samples.

use super::choice::Choice;
use super::filter::Filter;
use crate::parameter::Number;
use std::fmt;
use std::str::FromStr;

/// The maximum width and height of a film in pixels.
pub const LONGEST_SIDE: u32 = 65_536;

/// The range of the exposure, in stops.
pub const EXPOSURES: Number = Number::between(-64.0, 64.0);

/// The size of the image and its reconstruction from samples.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// Width in pixels, 1 to [`LONGEST_SIDE`].
    pub width: u32,
    /// Height in pixels, 1 to [`LONGEST_SIDE`].
    pub height: u32,
    /// Exposure of PNG files and the window in stops: display values are radiance × 2^exposure.
    pub exposure: f64,
    /// The tone curve of PNG files and the window.
    pub tone: Tone,
    /// The reconstruction filter.
    pub filter: Filter,
    /// How samples are filtered; `None` stands for [`FilmMode::usual`].
    pub mode: Option<FilmMode>,
}

impl FilmSettings {
    /// The effective mode.
    pub fn mode(&self) -> FilmMode {
        self.mode.unwrap_or(FilmMode::usual(self.filter))
    }

    /// The problem with the filter in this mode, if any.
    pub fn problem(&self) -> Option<&'static str> {
        match (self.mode(), self.filter) {
            (FilmMode::Importance, filter) if filter.has_negative_lobes() => Some(
                "this filter has negative lobes, from which samples cannot be drawn: it needs mode \"continuous\"",
            ),
            (FilmMode::Continuous, Filter::None) => Some(
                "filter \"none\" samples only pixel centres: mode \"continuous\" needs a filter with a radius",
            ),
            (FilmMode::Continuous, filter) if filter.radius() < 0.5 => Some(
                "with mode \"continuous\" a filter's radius must be at least 0.5, or some samples would reach no pixel",
            ),
            _ => None,
        }
    }
}

/// The settings of an empty scene file.
impl Default for FilmSettings {
    fn default() -> Self {
        let (tone, filter) = (Tone::default(), Filter::default());
        FilmSettings { width: 640, height: 480, exposure: 0.0, tone, filter, mode: None }
    }
}

/// How samples are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmMode {
    /// Each pixel draws its own samples from the filter, with equal weights (report §5.2.5).
    Importance,
    /// Samples are distributed evenly over the film, and each contributes to every pixel within the filter's radius.
    Continuous,
}

impl FilmMode {
    /// The default mode for a filter, which measurements favour (see `docs/measurements.md`).
    pub fn usual(filter: Filter) -> FilmMode {
        match filter {
            Filter::None | Filter::Box { .. } | Filter::Tent { .. } => FilmMode::Importance,
            _ => FilmMode::Continuous,
        }
    }
}

impl Choice for FilmMode {
    const WHAT: &'static str = "mode";
    const NAMED: &'static [(&'static str, Self)] =
        &[("importance", FilmMode::Importance), ("continuous", FilmMode::Continuous)];
}

impl FromStr for FilmMode {
    type Err = String;

    /// The mode with this name in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        FilmMode::of_name(name)
    }
}

/// The name in a scene file.
impl fmt::Display for FilmMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The mapping from linear values to codes of 8-bit images and screens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// The transfer function of IEC 61966-2-1, clipped at one.
    #[default]
    Srgb,
    /// The ACES film curve as fitted by Narkowicz (<https://knarkowicz.wordpress.com>, "ACES Filmic Tone Mapping
    /// Curve", 2016), before the transfer function: dark tones gain contrast, and highlights roll off to white at ten.
    Filmic,
    /// Codes in proportion to the values, for inspecting numbers in a window.
    Linear,
}

impl Tone {
    /// All curves, in the order of a viewer.
    pub const ALL: [Tone; 3] = [Tone::Srgb, Tone::Filmic, Tone::Linear];

    /// The name.
    pub fn name(self) -> &'static str {
        match self {
            Tone::Linear => "linear",
            chosen => Choice::name(chosen),
        }
    }
}

/// The curves for scenes; [`Tone::Linear`] is only for windows.
impl Choice for Tone {
    const WHAT: &'static str = "tone curve";
    const NAMED: &'static [(&'static str, Self)] = &[("srgb", Tone::Srgb), ("filmic", Tone::Filmic)];
}

impl FromStr for Tone {
    type Err = String;

    /// The tone curve with this name in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        Tone::of_name(name)
    }
}
