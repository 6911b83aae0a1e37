//! Options of readers of scene files.

/// Options of readers of scene files. By default, a file is read without changes, and may name files in its own folder
/// only.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Values of variables of the file, by name. They replace the file's own values.
    pub defines: Vec<(String, String)>,
    /// The name of the camera. The default is the first one.
    pub camera: Option<String>,
    /// Whether parts without a counterpart are errors instead of warnings.
    pub strict: bool,
    /// Whether a scene may refer to files outside its folder.
    pub allow_outside: bool,
}
