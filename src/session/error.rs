//! Errors of a render.

use crate::film::MemoryError;
use crate::gpu;
use crate::output::{FilmError, OutputError, TevError, window};
use crate::render::accumulator::WorkerFailure;
use crate::world::TooLarge;
use std::path::PathBuf;

/// The result of writing files.
pub(super) type Written = Result<(), OutputError>;

/// The reason why a render failed. The samples made by then have been written if possible.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The film is too large.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The scene is too large.
    #[error(transparent)]
    Scene(#[from] TooLarge),
    /// The window cannot be opened.
    #[error(transparent)]
    Window(#[from] window::WindowError),
    /// The viewer tev cannot be reached.
    #[error(transparent)]
    Tev(#[from] TevError),
    /// The GPU cannot be used.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A film cannot be read.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A film does not belong to this render.
    #[error("cannot resume {path:?}: {reason}")]
    Resume {
        /// The film.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The device that a render was begun on is not available.
    #[error("the render was begun on {begun}, but the device is now {found}: it cannot be resumed here")]
    OtherDevice {
        /// The device that it was begun on.
        begun: String,
        /// The present device.
        found: String,
    },
    /// The camera was moved to an impossible position.
    #[error(
        "the camera was moved to an impossible position; this is a bug in stride: please report it with the scene"
    )]
    MovedCamera,
    /// A worker failed.
    #[error("{0}; {1}")]
    Worker(WorkerFailure, String),
    /// A worker did not stop on request.
    #[error("{0}; {1}")]
    Unanswered(String, String),
    /// An internal process failed.
    #[error("the {0} failed; this is a bug in stride: please report it with the scene and the command")]
    Process(&'static str),
}
