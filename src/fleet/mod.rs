//! Renders on many machines, over a NATS server with JetStream.
//!
//! A *job* is a scene with its settings. It is divided into *units*: ranges of samples of every pixel. A *worker* renders a
//! unit into a film file, and the *collector* adds these films, each once. Sums are exact, so that the result has the bits
//! of one machine. `docs/fleet.md` describes the messages and what is kept at each failure.
//!
//! Without the feature `fleet` this room is empty.
//!
//! | file | what is in it |
//! |---|---|
//! | `settings` | servers, logins, jobs and workers as the caller states them |
//! | `error` | errors |
//! | `enabled` | the room |

#[cfg(feature = "fleet")]
mod enabled;
#[cfg(feature = "fleet")]
mod error;
#[cfg(feature = "fleet")]
mod settings;

#[cfg(feature = "fleet")]
pub use enabled::{cancel, collect, extend, keep, list, local, prioritise, remove, submit, watch, work};
#[cfg(feature = "fleet")]
pub use error::FleetError;
#[cfg(feature = "fleet")]
pub use settings::{
    Collecting, JobSettings, JobState, JobSummary, LocalFleet, Login, Notice, Server, Submission,
    WorkerSettings,
};
