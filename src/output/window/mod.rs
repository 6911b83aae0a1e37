//! The live window: draws snapshots and handles keys and mouse. It runs on the main thread, which some systems require.
//!
//! | file | contents |
//! |---|---|
//! | `enabled`, `disabled` | the system's window, or the reason why there is none |
//! | [`viewer`] | the displayed state, and its changes by keys and mouse |
//! | [`keys`] | the actions of keys |
//! | [`view`] | scaling of pictures to windows |
//! | [`layers`] | layers as pictures |
//! | [`orbit`] | a camera that orbits a point |
//! | [`text`] | text over a picture |
//!
//! [`open`] fails if there is no display or the feature `window` is disabled; the caller then
//! shows [progress](super::progress) instead. [`Window::run`] receives snapshots from a channel and sends
//! [`Request`]s, until one of: the user closes it, or moves the camera; the `stop` channel closes; or the
//! snapshots' channel closes without a finished snapshot, which happens if the run fails. It returns the reason
//! ([`ExitReason`]), and can run again with the channels of another render.
//!
//! It receives at most 30 snapshots a second, so that a bounded channel of one tells the accumulator how often
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

/// The options for opening a window.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowOptions {
    /// The name of the render, at the start of the title.
    pub name: String,
    /// Pixels in a row of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Rows of the whole film, which the camera's field of view spans. The picture may be a part of it.
    pub film_height: u32,
    /// The film's pixel at the picture's top left.
    pub corner: (u32, u32),
    /// The initial view transform.
    pub view: ViewTransform,
    /// Whether to start with the owner overlay.
    pub overlay: bool,
    /// The time limit of the run in seconds, if there is one; for the remaining time.
    pub time_limit: Option<f64>,
    /// The camera, if the user may move it; otherwise the reason why not.
    pub camera: Result<orbit::Orbit, String>,
}

/// The channels from a render to the window.
#[derive(Clone, Debug)]
pub struct Feed {
    /// The picture so far.
    pub snapshots: Receiver<Arc<Snapshot>>,
    /// The layers of the camera's view, sent once.
    pub layers: Receiver<Vec<Channel>>,
    /// Closes when the run is to end.
    pub stop: Receiver<Infallible>,
}

/// A request of the user.
#[derive(Clone, Debug)]
pub enum Request {
    /// Write the outputs now.
    Save {
        /// The displayed snapshot.
        snapshot: Arc<Snapshot>,
        /// Its view transform.
        view: ViewTransform,
        /// The channel for a message in the title bar: the written files, or an error.
        reply: Sender<String>,
    },
    /// Print the camera outside the window.
    PrintCamera(Viewpoint),
}

/// The reason why the window left a render.
#[derive(Clone, Debug, PartialEq)]
pub enum ExitReason {
    /// The user closed the window, by Esc or the window's button.
    Closed,
    /// The run has ended: on request or by a failure.
    Ended,
    /// The user moved the camera.
    Moved(Viewpoint),
    /// The user returned to the scene's own camera.
    SceneCamera,
}

/// The reason why there is no window.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum WindowError {
    /// The feature is disabled in this build.
    #[error(
        "this stride was built without the feature `window`; build it with `--features window`, or render without a window (`view`)"
    )]
    NotBuilt,
    /// There is no display.
    #[error("there is no display for a window (DISPLAY is not set); render without a window (`view`)")]
    NoDisplay,
    /// The display, or a library that it needs, does not respond.
    #[error("the window cannot be opened: {0}; check the display, or render without a window (`view`)")]
    Failed(String),
}
