//! The room with the feature.
//!
//! | file | what is in it |
//! |---|---|
//! | `job`, `unit` | jobs, units and results as the messages describe them |
//! | `broker` | the server: streams, messages, acknowledgements; the only file with asynchronous code |
//! | `login` | connections, TLS and their errors |
//! | `mail` | what the collector needs of a server |
//! | `notes` | texts from the network |
//! | `pack` | compression of films for the network |
//! | `scene_files` | the files of a scene: their list, and the cache of a worker |
//! | `uploads` | the files of scenes on the server: each once, by its content |
//! | `renderer` | renders a unit into a film file |
//! | `posting` | sends the film of a unit |
//! | `worker` | takes units, renders them, sends the results |
//! | `gathering` | the film of a job, its checkpoint and its outputs |
//! | `plan` | the units of a job: their sizes, and which are missing |
//! | `checks` | units that two workers render |
//! | `relief` | workers that wait for room on the server |
//! | `spool` | films of results on the collector's disk, before they are added |
//! | `collector` | takes results and adds each once |
//! | `submit`, `collect`, `jobs`, `local` | the commands |
//! | `hooks` | faults on request, for tests |

mod broker;
mod checks;
mod collect;
mod collector;
mod gathering;
mod hooks;
mod job;
mod jobs;
mod local;
mod login;
mod mail;
mod notes;
mod pack;
mod plan;
mod posting;
mod relief;
mod renderer;
mod scene_files;
#[cfg(test)]
mod simulation;
mod spool;
mod submit;
mod unit;
mod uploads;
mod worker;

pub use collect::collect;
pub use jobs::{cancel, extend, list, prioritise, remove, watch};
pub use local::{keep, local};
pub use submit::submit;
pub use worker::work;

use crossbeam_channel::{Receiver, TryRecvError};
use std::convert::Infallible;

/// The channel that closes on a request to stop.
type Stop = Receiver<Infallible>;

fn is_asked_to_stop(stop: &Stop) -> bool {
    !matches!(stop.try_recv(), Err(TryRecvError::Empty))
}

/// Receives what happens meanwhile.
type Tell<'a> = &'a mut dyn FnMut(super::Notice);
