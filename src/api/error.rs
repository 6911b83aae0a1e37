//! Errors of the interface.

use crate::output::{FilmError, OutputError};
use crate::scene::{SceneErrors, SceneProblem};
use crate::session::{MOST_THREADS, Report, SessionError};
use std::ops::Range;
use std::path::PathBuf;

/// Why a scene can't be had, or a render. Names in backquotes are settings: methods of [`Render`](super::Render).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene file can't be read, or has mistakes.
    #[error(transparent)]
    SceneFile(#[from] SceneErrors),
    /// A scene breaks its promises.
    #[error("{}", lines(.0))]
    Scene(Vec<SceneProblem>),
    /// Settings are impossible, or impossible together.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The render can't begin, or it failed before the first sample.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The render failed on the way, or a file could not be written: this is what there is. Files have been written as
    /// far as possible.
    #[error("{reason}")]
    Incomplete {
        /// What failed.
        reason: SessionError,
        /// The picture of the samples that there are.
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

/// What is wrong with settings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// A filter and a mode, or an integrator and a depth, do not go together.
    #[error("{0}")]
    Scene(&'static str),
    /// The film has more pixels than can be numbered.
    #[error(
        "a film of {width}×{height} pixels is more than stride can number (2³¹); it would need {gigabytes:.0} GB of memory"
    )]
    TooManyPixels {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// The memory that it would take, in 10⁹ bytes.
        gigabytes: f64,
    },
    /// A part of the film is none.
    #[error("`crop` {},{},{},{} is not a part of the film, which has {}×{} pixels", .crop[0], .crop[1], .crop[2], .crop[3], .film[0], .film[1])]
    Crop {
        /// Column and row of its first pixel, its width and its height.
        crop: [u32; 4],
        /// Width and height of the film.
        film: [u32; 2],
    },
    /// A number is out of its range.
    #[error("`{setting}` must be {range}, not {value}")]
    OutOfRange {
        /// The setting.
        setting: &'static str,
        /// What it may be, in words.
        range: &'static str,
        /// What it is.
        value: String,
    },
    /// There are no threads, or too many.
    #[error("`threads` must be from 1 to {most}, not {0}", most = MOST_THREADS)]
    Threads(usize),
    /// Both are given, and may contradict each other.
    #[error("`range` and `samples` can't be had together: both say which samples there are")]
    RangeAndSamples,
    /// There is no sample in a range.
    #[error("there is no sample in `range` {}..{}", .0.start, .0.end)]
    EmptyRange(Range<u32>),
    /// The samples that are asked for end before those of the film that is gone on with.
    #[error(
        "`samples` {samples} asks for the samples 0 to {}, and this film begins with sample {first}; to go on with it, ask for more",
        .samples - 1
    )]
    BeforeFilm {
        /// Samples that are asked for.
        samples: u32,
        /// The film's first one.
        first: u32,
    },
    /// A variance is asked for of light that may come from any sample.
    #[error(
        "`layers` variance can't be had with an integrator that contributes light to other pixels, too: their variance is not known"
    )]
    VarianceOfContributions,
    /// An error is asked for of samples that do not begin with the first.
    #[error(
        "`noise` tells the error of renders from sample 0 on, and these samples begin later (`range`, or the film)"
    )]
    NoiseOfLaterSamples,
    /// Adaptive sampling of samples that do not begin with the first, or of some only.
    #[error(
        "adaptive sampling decides where samples go by all from sample 0 on: it can't render a range of them (`range`), nor go on with a film that begins later"
    )]
    AdaptiveRange,
    /// Adaptive sampling with pictures of numbers of samples on the way.
    #[error(
        "adaptive sampling gives pixels different numbers of samples: there are no pictures of one number on the way (`dump_at`)"
    )]
    AdaptiveDump,
    /// Adaptive sampling on a GPU.
    #[error(
        "adaptive sampling is the CPU's: a GPU renders the same samples for all pixels of an order; use `device` cpu"
    )]
    AdaptiveDevice,
    /// Adaptive sampling of pixels that share their samples.
    #[error(
        "adaptive sampling needs pixels whose samples are their own: with mode \"continuous\" they share them; use mode \"importance\" (`film_mode` importance)"
    )]
    AdaptiveMode,
    /// A numbered picture of more samples than there will be.
    #[error("`dump_at` {at} lies past the end of the render at {samples} samples a pixel")]
    DumpPastEnd {
        /// Samples of the picture.
        at: u32,
        /// Samples of the render.
        samples: u32,
    },
    /// The overlay in a format that has no colours of its own.
    #[error("`overlay` colours .png files; {} would hold the picture", .0.display())]
    Overlay(PathBuf),
    /// How often is said, and not what.
    #[error("`checkpoint` says how often a film file is written, and none is; add `film` FILE.film")]
    CheckpointOfNoFilm,
    /// Two files in one place.
    #[error("{} would be written twice, or over the scene; give each file a name of its own", .0.display())]
    Twice(PathBuf),
    /// The samples of a run that is gone on with would be lost.
    #[error("{} may hold the samples of the run that this one goes on with; give the rest a file of its own", .0.display())]
    SamplesOfEarlierRun(PathBuf),
    /// A window of a render that does not run on the caller's thread.
    #[error("a window needs the program's main thread: run the render there")]
    WindowElsewhere,
}
