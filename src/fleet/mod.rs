//! Renders on many machines, over a NATS server with JetStream.
//!
//! A *job* is a scene with its settings. It is divided into *units*: ranges of samples of every pixel. A *worker* renders a
//! unit into a film file, and the *collector* adds these films, each once. Sums are exact, so that the result has the bits
//! of one machine. `docs/fleet.md` describes the messages and what is kept at each failure.
//!
//! The feature `fleet` decides which half of this room is compiled. Without it every function says so.
//!
//! | file | what is in it |
//! |---|---|
//! | `settings` | what the caller asks for |
//! | `error` | errors |
//! | `enabled` | the room |
//! | `disabled` | the same functions, which fail |

mod error;
mod settings;

#[cfg(feature = "fleet")]
mod enabled;
#[cfg(feature = "fleet")]
pub use enabled::{cancel, collect, extend, keep, list, local, prioritise, submit, watch, work};

#[cfg(not(feature = "fleet"))]
mod disabled;
#[cfg(not(feature = "fleet"))]
pub use disabled::{cancel, collect, extend, keep, list, local, prioritise, submit, watch, work};

pub use error::FleetError;
pub use settings::{
    Collecting, JobSettings, JobState, JobSummary, LocalFleet, Login, Notice, Server, Submission,
    WorkerSettings,
};
