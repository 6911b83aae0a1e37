//! The live window: draws snapshots, listens to keys. It runs on the main thread, as some systems demand.
//!
//! [`open`] fails cleanly where there is no display or the feature `window` was left out; the caller then
//! shows [progress](super::progress) instead. [`Window::run`] takes snapshots from a channel and sends
//! [`Request`]s, until one of: the user closes it; the `stop` channel closes; or the snapshots' channel
//! closes without a finished snapshot, which is how a failed run looks from here. In all cases its ends of
//! the channels are closed when it returns.
//!
//! It takes 30 snapshots a second at most, so that a bounded channel of one tells the accumulator how often
//! to make them.

pub mod view;
pub mod viewer;

#[cfg(feature = "window")]
mod enabled;
#[cfg(feature = "window")]
pub use enabled::{Window, open};
#[cfg(all(feature = "window", unix, not(target_os = "macos")))]
mod x11;

#[cfg(not(feature = "window"))]
mod disabled;
#[cfg(not(feature = "window"))]
pub use disabled::{Window, open};

use crate::film::Snapshot;
use crossbeam_channel::Sender;
use std::sync::Arc;
use thiserror::Error;

/// What a window is opened with.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowOptions {
    /// What is rendered; the title bar begins with it.
    pub name: String,
    /// Pixels in a row of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Exposure to begin with, in stops.
    pub exposure: f64,
    /// Begin with the owner overlay.
    pub overlay: bool,
    /// Seconds after which the run ends, where it has such an end; for the time left.
    pub time_limit: Option<f64>,
}

/// What the user asks for.
#[derive(Clone, Debug)]
pub enum Request {
    /// Write the outputs now.
    Save {
        /// What is on the screen.
        snapshot: Arc<Snapshot>,
        /// The exposure on the screen, in stops.
        exposure: f64,
        /// Where to send a line for the title bar: what was written, or why not.
        reply: Sender<String>,
    },
}

/// How a window was left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closed {
    /// The exposure on the screen at the end, in stops.
    pub exposure: f64,
    /// The user closed it, by Esc or the window's own button.
    pub by_user: bool,
}

/// Why there is no window.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum WindowError {
    /// The program was built without it.
    #[error(
        "this stride was built without the feature `window`; build it with `--features window`, or use --headless"
    )]
    NotBuilt,
    /// There is nothing to open a window on.
    #[error("there is no display to open a window on (DISPLAY is not set); use --headless")]
    NoDisplay,
    /// The display, or a library it needs, does not answer.
    #[error("the window cannot be opened: {0}; check the display, or use --headless")]
    Failed(String),
}
