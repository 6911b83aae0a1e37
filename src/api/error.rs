//! Errors of this interface.

use crate::output::{FilmError, OutputError};
use crate::scene::{SceneErrors, SceneProblem};
use crate::session::{MOST_THREADS, Report, SessionError};
use std::ops::Range;
use std::path::PathBuf;

/// The reason why a scene cannot be loaded, or a render fails. Names in backquotes are methods of
/// [`Render`](super::Render).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene file cannot be read, or is invalid.
    #[error(transparent)]
    SceneFile(#[from] SceneErrors),
    /// A scene built in code is invalid.
    #[error("{}", lines(.0))]
    Scene(Vec<SceneProblem>),
    /// Settings are invalid, alone or in combination.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The render cannot start, or failed before the first sample.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The render failed after the first sample, or a file could not be written. The other files have been written if
    /// possible.
    #[error("{reason}")]
    Incomplete {
        /// The failure.
        reason: SessionError,
        /// The picture of the samples made by then.
        report: Box<Report>,
    },
}

impl From<OutputError> for Error {
    fn from(error: OutputError) -> Error {
        Error::Session(error.into())
    }
}

impl From<FilmError> for Error {
    fn from(error: FilmError) -> Error {
        Error::Session(error.into())
    }
}

fn lines(problems: &[SceneProblem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// An error in the settings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// A filter and a mode, or an integrator and a depth, cannot be combined.
    #[error("{0}")]
    Scene(&'static str),
    /// The film has too many pixels.
    #[error(
        "a film of {width}×{height} pixels exceeds the maximum of 2³¹ pixels; it would need {gigabytes:.0} GB of memory"
    )]
    TooManyPixels {
        /// The width of the image in pixels.
        width: u32,
        /// Rows.
        height: u32,
        /// The memory that it would need, in 10⁹ bytes.
        gigabytes: f64,
    },
    /// The crop is not a part of the film.
    #[error("`crop` {},{},{},{} is not a part of the film, which has {}×{} pixels", .crop[0], .crop[1], .crop[2], .crop[3], .film[0], .film[1])]
    Crop {
        /// Column and row of its first pixel, its width and its height.
        crop: [u32; 4],
        /// Width and height of the film.
        film: [u32; 2],
    },
    /// A number is out of range.
    #[error("`{setting}` must be {range}, not {value}")]
    OutOfRange {
        /// The setting.
        setting: &'static str,
        /// The valid range, in words.
        range: &'static str,
        /// The invalid value.
        value: String,
    },
    /// The number of threads is out of range.
    #[error("`threads` must be from 1 to {most}, not {0}", most = MOST_THREADS)]
    Threads(usize),
    /// Both settings determine the samples.
    #[error("`range` and `samples` cannot be combined: both determine the samples")]
    RangeAndSamples,
    /// The range of samples is empty.
    #[error("`range` {}..{} is empty", .0.start, .0.end)]
    EmptyRange(Range<u32>),
    /// The requested samples end before those of the resumed film.
    #[error(
        "`samples` {samples} requests the samples 0 to {}, but this film begins with sample {first}; to resume it, request more",
        .samples - 1
    )]
    BeforeFilm {
        /// The requested samples.
        samples: u32,
        /// The film's first sample index.
        first: u32,
    },
    /// The variance layer is requested for a light image.
    #[error(
        "`layers` variance is not available for an integrator that contributes light to other pixels: their variance is unknown"
    )]
    VarianceOfContributions,
    /// An error is requested for samples that do not begin with index 0.
    #[error("`noise` needs a render from sample 0 on, and these samples begin later (`range`, or the film)")]
    NoiseOfLaterSamples,
    /// Adaptive sampling is requested for samples that do not begin with index 0.
    #[error(
        "adaptive sampling needs all samples from sample 0 on: it cannot render a range (`range`) or resume a film that begins later"
    )]
    AdaptiveRange,
    /// Adaptive sampling is combined with numbered pictures.
    #[error(
        "adaptive sampling gives pixels different numbers of samples: it cannot write pictures at a given number (`dump_at`)"
    )]
    AdaptiveDump,
    /// Adaptive sampling is requested on a GPU.
    #[error(
        "adaptive sampling is not available on a GPU, which renders the same samples for all pixels of an order; use `device` cpu"
    )]
    AdaptiveDevice,
    /// Adaptive sampling is requested for weighted samples.
    #[error(
        "adaptive sampling needs separate samples for each pixel, but pixels share them in mode \"continuous\"; use mode \"importance\" (`film_mode` importance)"
    )]
    AdaptiveMode,
    /// A numbered picture is beyond the end of the render.
    #[error("`dump_at` {at} is beyond the end of the render at {samples} samples per pixel")]
    DumpPastEnd {
        /// Samples per pixel of the picture.
        at: u32,
        /// Samples per pixel of the render.
        samples: u32,
    },
    /// The overlay is requested for a format other than PNG.
    #[error("`overlay` needs .png files, and {} is not one", .0.display())]
    Overlay(PathBuf),
    /// A checkpoint interval is given without a film file.
    #[error("`checkpoint` is the interval of writing the film file, and there is none; add `film` FILE.film")]
    CheckpointOfNoFilm,
    /// Two files have the same path.
    #[error("{} would be written twice, or would replace the scene; choose another name for one of the files", .0.display())]
    Twice(PathBuf),
    /// The sample dump of the resumed run would be lost.
    #[error("{} may contain the samples of the resumed run; choose another file for the new ones", .0.display())]
    SamplesOfEarlierRun(PathBuf),
    /// A window is requested for a render in the background.
    #[error("a window requires the program's main thread: run the render there")]
    WindowElsewhere,
}
