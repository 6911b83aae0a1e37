//! The picture's shape and how samples become pixels.

use super::choice::Choice;
use super::filter::Filter;
use crate::parameter::Number;
use std::fmt;
use std::str::FromStr;

/// The most pixels in a row or in a column of a film.
pub const LONGEST_SIDE: u32 = 65_536;

/// What the exposure may be, in stops.
pub const EXPOSURES: Number = Number::between(-64.0, 64.0);

/// The picture's shape and how samples become pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// Pixels in a row, 1 to [`LONGEST_SIDE`].
    pub width: u32,
    /// Rows, 1 to [`LONGEST_SIDE`].
    pub height: u32,
    /// Exposure of PNG and window in stops: display values are radiance × 2^exposure.
    pub exposure: f64,
    /// The tone curve of PNG and window.
    pub tone: Tone,
    /// The reconstruction filter.
    pub filter: Filter,
    /// How samples are filtered; none leaves it to [`FilmMode::usual`].
    pub mode: Option<FilmMode>,
}

impl FilmSettings {
    /// How samples are filtered.
    pub fn mode(&self) -> FilmMode {
        self.mode.unwrap_or(FilmMode::usual(self.filter))
    }

    /// What is wrong with the filter in this mode.
    pub fn problem(&self) -> Option<&'static str> {
        match (self.mode(), self.filter) {
            (FilmMode::Importance, filter) if filter.has_negative_lobes() => Some(
                "this filter is negative in places, and no sample can be drawn with a negative chance: it needs mode \"continuous\"",
            ),
            (FilmMode::Continuous, Filter::None) => Some(
                "filter \"none\" takes samples in pixel centres only: mode \"continuous\" needs a filter with a width",
            ),
            (FilmMode::Continuous, filter) if filter.radius() < 0.5 => Some(
                "samples would fall between the pixels: with mode \"continuous\" a filter's radius is at least 0.5",
            ),
            _ => None,
        }
    }
}

/// What an empty scene file gives.
impl Default for FilmSettings {
    fn default() -> Self {
        let (tone, filter) = (Tone::default(), Filter::default());
        FilmSettings { width: 640, height: 480, exposure: 0.0, tone, filter, mode: None }
    }
}

/// How samples are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmMode {
    /// Each pixel draws samples of its own from the filter, and all count the same (report §5.2.5).
    Importance,
    /// Samples are spread evenly over the film, and each lands on every pixel within the filter's reach.
    Continuous,
}

impl FilmMode {
    /// The mode of a film that doesn't say: what was measured to serve each filter best (see `docs/measurements.md`).
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

    /// The mode of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        FilmMode::of_name(name)
    }
}

/// The name, as in a scene file.
impl fmt::Display for FilmMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How linear values become the codes of 8-bit pictures and screens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// As they are, by the transfer function of IEC 61966-2-1, clipped at one.
    #[default]
    Srgb,
    /// Through Narkowicz's fit of the ACES film curve first (<https://knarkowicz.wordpress.com>, "ACES Filmic Tone
    /// Mapping Curve", 2016): dark tones gain contrast, and highlights roll off, to white at ten.
    Filmic,
    /// Codes in proportion to the values, for looking at numbers in a window.
    Linear,
}

impl Tone {
    /// All of them, in the order in which a viewer goes through them.
    pub const ALL: [Tone; 3] = [Tone::Srgb, Tone::Filmic, Tone::Linear];

    /// The name.
    pub fn name(self) -> &'static str {
        match self {
            Tone::Linear => "linear",
            chosen => Choice::name(chosen),
        }
    }
}

/// Those that a scene may choose; [`Tone::Linear`] is for windows alone.
impl Choice for Tone {
    const WHAT: &'static str = "tone curve";
    const NAMED: &'static [(&'static str, Self)] = &[("srgb", Tone::Srgb), ("filmic", Tone::Filmic)];
}

impl FromStr for Tone {
    type Err = String;

    /// The tone curve of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        Tone::of_name(name)
    }
}
