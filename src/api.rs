//! The interface for programs: load a scene or build one, render it, get the picture.
//!
//! | file | what is in it |
//! |---|---|
//! | `builder` | [`Render`]: what a render is asked for |
//! | `rules` | settings that are impossible, or impossible together; which samples there are |
//! | `places` | files that would replace each other, or that can't be written |
//! | `running` | renders that the caller waits for |
//! | `handle` | [`RenderHandle`]: a render that runs beside the caller |
//! | `error` | [`Error`] |
//!
//! Nothing is printed, no process is ended, no environment variable is read, and no signal is caught. Two renders in one
//! process are independent. The program `stride` is a caller like others: it takes the [`Settings`](crate::session::Settings)
//! that [`Render::settings`] has checked, and runs them with a window and Ctrl-C of its own.

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
