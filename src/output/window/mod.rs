//! The live window: draws snapshots, listens to keys and mouse. It runs on the main thread, as some systems demand.
//!
//! | file | what is in it |
//! |---|---|
//! | `enabled`, `disabled` | the system's window, or why there is none |
//! | [`viewer`] | what is shown, and how keys and mouse change it |
//! | [`keys`] | what keys ask for |
//! | [`view`] | pictures scaled into windows |
//! | [`layers`] | numbers of any range as pictures |
//! | [`orbit`] | a camera that moves about a point |
//! | [`text`] | lines over a picture |
//!
//! [`open`] fails cleanly where there is no display or the feature `window` was left out; the caller then
//! shows [progress](super::progress) instead. [`Window::run`] takes snapshots from a channel and sends
//! [`Request`]s, until one of: the user closes it, or moves the camera; the `stop` channel closes; or the
//! snapshots' channel closes without a finished snapshot, which is how a failed run looks from here. It says which
//! ([`Left`]), and can be run again, with the channels of another render.
//!
//! It takes 30 snapshots a second at most, so that a bounded channel of one tells the accumulator how often
//! to make them.

pub mod keys;
pub mod layers;
pub mod orbit;
pub mod text;
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

use crate::film::{Channel, Snapshot, ViewTransform};
use crate::scene::Viewpoint;
use crossbeam_channel::{Receiver, Sender};
use std::convert::Infallible;
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
    /// Rows of the whole film, of which the picture may be a part: what a camera's field of view spans.
    pub film_height: u32,
    /// The film's pixel that is the picture's left upper one.
    pub corner: (u32, u32),
    /// How the picture is shown to begin with.
    pub view: ViewTransform,
    /// Begin with the owner overlay.
    pub overlay: bool,
    /// Seconds after which the run ends, where it has such an end; for the time left.
    pub time_limit: Option<f64>,
    /// The camera, if it may be moved; otherwise why not.
    pub camera: Result<orbit::Orbit, String>,
}

/// What the window hears of a render.
#[derive(Clone, Debug)]
pub struct Feed {
    /// The picture so far.
    pub snapshots: Receiver<Arc<Snapshot>>,
    /// Layers of what its camera sees, once.
    pub layers: Receiver<Vec<Channel>>,
    /// Closes when the run is to end.
    pub stop: Receiver<Infallible>,
}

/// What the user asks for.
#[derive(Clone, Debug)]
pub enum Request {
    /// Write the outputs now.
    Save {
        /// What is on the screen.
        snapshot: Arc<Snapshot>,
        /// How it is shown.
        view: ViewTransform,
        /// Where to send a line for the title bar: what was written, or why not.
        reply: Sender<String>,
    },
    /// Tell where the camera is, outside the window.
    Tell(Viewpoint),
}

/// Why the window left a render.
#[derive(Clone, Debug, PartialEq)]
pub enum Left {
    /// The user closed it, by Esc or the window's own button.
    Closed,
    /// The run is over: it is to stop, or has failed.
    Over,
    /// The user moved the camera here.
    Moved(Viewpoint),
    /// The user wants the scene's own camera back.
    Home,
}

/// Why there is no window.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum WindowError {
    /// The program was built without it.
    #[error(
        "this stride was built without the feature `window`; build it with `--features window`, or open none (`view`)"
    )]
    NotBuilt,
    /// There is nothing to open a window on.
    #[error("there is no display to open a window on (DISPLAY is not set); open none (`view`)")]
    NoDisplay,
    /// The display, or a library it needs, does not answer.
    #[error("the window cannot be opened: {0}; check the display, or open none (`view`)")]
    Failed(String),
}
