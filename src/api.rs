//! The interface for programs: load a scene or build one, render it, get the picture.
//!
//! | file | what is in it |
//! |---|---|
//! | `builder` | [`Render`]: the settings of a render |
//! | `rules` | the validation of settings, and the range of samples |
//! | `places` | checks of output files: collisions and permissions |
//! | `running` | blocking renders |
//! | `handle` | [`RenderHandle`]: a render in the background |
//! | `error` | [`Error`] |
//!
//! This module prints nothing, ends no process, reads no environment variables and catches no signals. Two renders in
//! one process are independent. The program `stride` uses the same interface: it takes the
//! [`RenderSettings`](crate::session::Settings) from [`Render::settings`], and runs them with a window and its own handler of
//! Ctrl-C.

mod builder;
mod error;
mod handle;
mod places;
mod rules;
mod running;

pub use builder::Render;
pub use error::{Error, SettingsError};
pub use handle::{Events, RenderHandle};

pub(crate) use rules::{check_film, part};
