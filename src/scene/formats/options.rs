//! What a reader of scene files may be told.

/// What a reader of scene files may be told. The default is what a file says by itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Names and values of the variables of a file, instead of its own.
    pub defines: Vec<(String, String)>,
    /// The name of the camera, where a file has several; otherwise it is the first.
    pub camera: Option<String>,
    /// Whether something without a counterpart is an error, and not a warning.
    pub strict: bool,
    /// Whether a scene may name files outside of its folder.
    pub allow_outside: bool,
}
