//! What keys ask for, and the list of them.

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Leave.
    Close,
    /// Write the outputs now.
    Save,
    /// Half a stop brighter.
    Brighter,
    /// Half a stop darker.
    Darker,
    /// Show the owner overlay, or the picture again.
    Overlay,
    /// Show the list of keys, or take it away.
    Help,
    /// Tell about the pixel under the pointer, or stop doing so.
    Probe,
    /// The next tone curve.
    Tone,
    /// The next layer; the picture follows the last.
    Layer,
    /// Show the whole picture again.
    Fit,
    /// Let the mouse move the camera, or the picture again.
    Camera,
    /// Print the camera.
    Print,
    /// Back to the scene's own camera.
    Home,
}

impl Action {
    /// What a typed character asks for; keys that type none are the window's business.
    pub fn of(typed: char) -> Option<Self> {
        match typed {
            // The key of + types = without shift, on many keyboards.
            '+' | '=' => Some(Self::Brighter),
            '-' | '_' => Some(Self::Darker),
            _ => None,
        }
    }
}

/// The list of keys.
pub const HELP: &[&str] = &[
    "Esc close    S save the outputs now",
    "+ - exposure    T tone curve",
    "L  error, samples, layers in turn",
    "O  which worker owns a pixel",
    "P  tell about the pixel pointed at",
    "wheel enlarge    drag move    F fit",
    "C  let the mouse move the camera:",
    "   drag  turn about the middle",
    "   right drag, Shift  move along",
    "   wheel  come nearer",
    "K  print the camera, as TOML",
    "R  back to the scene's own camera",
    "H  this list",
];
