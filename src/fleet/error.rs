//! Errors of the fleet.

use crate::api;
use crate::output::{FilmError, OutputError};
use crate::scene::SceneErrors;
use crate::session::SessionError;
use std::io;
use std::path::PathBuf;

/// The reason why a command of the fleet fails.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FleetError {
    /// The server cannot be used, and another attempt would fail as well.
    #[error("{0}")]
    Server(String),
    /// The server does not answer at present.
    #[error("the server does not answer: {0}")]
    Unreachable(String),
    /// The server has no room for a message.
    #[error(
        "the server has no room: {0}; it accepts messages again when results have been collected, or when its limit is raised"
    )]
    Full(String),
    /// There is no such job.
    #[error("there is no job {0} on this server; `stride jobs list` shows the jobs")]
    NoJob(String),
    /// A job cannot be submitted, rendered or collected.
    #[error("{0}")]
    Job(String),
    /// The server lacks a part of a result: its worker died before the last one, or it was removed to make room.
    #[error("{0}")]
    Incomplete(String),
    /// A message or a result is malformed, or belongs to another render.
    #[error("{0}")]
    Refused(String),
    /// A file that is not an output cannot be read or written.
    #[error("{path:?}: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// The error.
        reason: io::Error,
    },
    /// The scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// The settings are invalid, or the render fails.
    #[error(transparent)]
    Render(#[from] api::Error),
    /// The render fails.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A film cannot be read.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// An output cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl FleetError {
    /// Whether another attempt may succeed.
    pub fn is_temporary(&self) -> bool {
        matches!(self, FleetError::Unreachable(_) | FleetError::Full(_))
    }
}
