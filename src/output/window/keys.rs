//! The actions of keys, and the help text.

/// The action of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Close the window.
    Close,
    /// Write the outputs now.
    Save,
    /// Increase the exposure by half a stop.
    Brighter,
    /// Decrease the exposure by half a stop.
    Darker,
    /// Toggle the owner overlay.
    Overlay,
    /// Toggle the help text.
    Help,
    /// Toggle the values of the pixel under the pointer.
    Probe,
    /// Select the next tone curve.
    Tone,
    /// Select the next layer; the picture follows the last one.
    Layer,
    /// Fit the whole picture into the window.
    Fit,
    /// Toggle whether the mouse moves the camera or the picture.
    Camera,
    /// Print the camera.
    Print,
    /// Return to the scene's own camera.
    SceneCamera,
}

impl Action {
    /// The action of a typed character; the window handles keys without a character.
    pub fn of(typed: char) -> Option<Self> {
        match typed {
            // The character of the + key without shift, on many keyboards.
            '+' | '=' => Some(Self::Brighter),
            '-' | '_' => Some(Self::Darker),
            _ => None,
        }
    }
}

/// The help text.
pub const HELP: &[&str] = &[
    "Esc close    S save the outputs now",
    "+ - exposure    T tone curve",
    "L  next: error, samples, layers",
    "O  worker that owns each pixel",
    "P  values of the pixel pointed at",
    "wheel zoom    drag pan    F fit",
    "C  let the mouse move the camera:",
    "   drag  orbit around the centre",
    "   right drag, Shift drag  pan",
    "   wheel  move closer",
    "K  print the camera, as TOML",
    "R  return to the scene's camera",
    "H  this help",
];
