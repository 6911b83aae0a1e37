//! Errors of a render.

use crate::film::MemoryError;
use crate::gpu;
use crate::output::{FilmError, OutputError, TevError, window};
use crate::render::accumulator::WorkerFailure;
use crate::world::TooLarge;
use std::path::PathBuf;

/// What became of files.
pub(super) type Written = Result<(), OutputError>;

/// Why a render failed. Whatever was rendered has been written all the same.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The film is too large.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The scene is too large.
    #[error(transparent)]
    Scene(#[from] TooLarge),
    /// There is no window.
    #[error(transparent)]
    Window(#[from] window::WindowError),
    /// There is no tev.
    #[error(transparent)]
    Tev(#[from] TevError),
    /// The GPU can't do it.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// A file can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A film can't be read.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A film is not one of this render.
    #[error("cannot go on with {path:?}: {reason}")]
    Resume {
        /// The film.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// The device that a render was begun on is gone, and there is another.
    #[error("the render was begun on {begun}, and now there is {found}: it can't be gone on with here")]
    OtherDevice {
        /// What it was begun on.
        begun: String,
        /// What is there.
        found: String,
    },
    /// The camera was moved to where no camera can be.
    #[error(
        "the camera was moved to where no camera can be; this is a bug in stride: please report it with the scene"
    )]
    MovedCamera,
    /// A worker failed.
    #[error("{0}; {1}")]
    Worker(WorkerFailure, String),
    /// A worker did not stop when it was asked to.
    #[error("{0}; {1}")]
    Unanswered(String, String),
    /// A process failed that should not.
    #[error("the {0} failed; this is a bug in stride: please report it with the scene and the command")]
    Process(&'static str),
}
