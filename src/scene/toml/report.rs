//! Errors and warnings with positions in a text.

use std::path::Path;
use std::sync::Arc;

use ::toml::de::Error as SyntaxError;

use crate::parameter::ImageIndex;
use crate::scene::description::ImageFile;
use crate::scene::diagnostic::{Cursor, Diagnostic, Position, SceneErrors};
use crate::scene::fingerprint::Sources;
use crate::scene::images::{self, ImageCache};
use crate::scene::mesh::cache::{Found, MeshCache, Unreadable};
use crate::scene::mesh::{self, MeshFile, Split};
use crate::scene::spelling::{self, quote, shorten};
use crate::texture;

/// The maximum number of errors that are described; an invalid file may have millions.
const MAX_ERRORS: usize = 100;

/// Proof that an error has been reported: only [`Diagnostics`] makes one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reported(());

/// A result, or proof that an error has been reported.
pub(super) type Read<T> = Result<T, Reported>;

/// A value with its byte offset in the file.
#[derive(Clone, Debug)]
pub(super) struct Placed<T> {
    pub(super) at: usize,
    pub(super) value: T,
}

/// A message about byte `at` of the text.
struct Message {
    at: Option<usize>,
    message: String,
    help: Option<String>,
}

/// Finds the places where a key belongs that was given for an item, such as "a mesh".
pub(super) type PlacesOf = fn(what: &str, key: &str) -> Vec<&'static str>;

/// All errors and warnings about a text so far.
pub(super) struct Diagnostics<'t> {
    text: &'t str,
    errors: Vec<Message>,
    unlisted: usize,
    warnings: Vec<Message>,
    unlisted_warnings: usize,
    /// The mesh files that the text refers to.
    meshes: MeshCache<'t>,
    /// The image files that the text refers to.
    images: ImageCache,
    /// Finds the places for a misplaced key.
    places_of: PlacesOf,
}

impl<'t> Diagnostics<'t> {
    /// No messages yet, for a text with its mesh and image files.
    pub(super) fn new(text: &'t str, meshes: MeshCache<'t>, images: ImageCache, places_of: PlacesOf) -> Self {
        let (errors, warnings) = (Vec::new(), Vec::new());
        Self { text, errors, unlisted: 0, warnings, unlisted_warnings: 0, meshes, images, places_of }
    }

    /// No messages yet, for a text without files.
    #[cfg(test)]
    pub(super) fn alone(text: &'t str) -> Self {
        let folder = Path::new("");
        Self::new(text, MeshCache::new(folder, None), ImageCache::new(folder), |_, _| Vec::new())
    }

    /// The contents of a mesh file; messages about it have the position of the reference.
    pub(super) fn mesh(&mut self, file: &Placed<String>, split: Split) -> Result<Arc<MeshFile>, Reported> {
        match self.meshes.get(&file.value, split) {
            Ok(Found { file: mesh, notes }) => {
                for note in notes {
                    self.warn(Some(file.at), note, "the rest is rendered");
                }
                Ok(mesh)
            }
            Err(Unreadable::First(error)) => {
                let help = |this: &Self| this.similar(file, &mesh::EXTENSIONS);
                Err(self.error_with(file.at, error.to_string(), help))
            }
            // It has been reported.
            Err(Unreadable::Again) => Err(Reported(())),
        }
    }

    /// The index of an image file; messages about it have the position of the reference.
    pub(super) fn image(&mut self, file: &Placed<String>) -> Result<usize, Reported> {
        self.images.get(&file.value).map_err(|error| match error {
            images::Unreadable::First(error) => {
                self.error_with(file.at, error.to_string(), |this| this.similar(file, &texture::EXTENSIONS))
            }
            images::Unreadable::Again => Reported(()),
        })
    }

    /// A suggestion for a file that does not exist: one with a similar name beside it.
    fn similar(&self, file: &Placed<String>, extensions: &[&str]) -> Option<String> {
        let path = self.images.folder().join(&file.value);
        // The tiles of a picture of several have numbers, which are no misspellings.
        if path.exists() || file.value.contains('<') {
            return None;
        }
        let is_candidate = |name: &str| {
            let extension = Path::new(name).extension().map(|extension| extension.to_ascii_lowercase());
            extension.is_some_and(|extension| extensions.iter().any(|known| extension == *known))
        };
        let name = spelling::file_beside(&path, is_candidate)?;
        let path = Path::new(&file.value).with_file_name(name);
        Some(format!("did you mean {}?", quote(&path.to_string_lossy())))
    }

    /// A message about the values of an image that are no valid radiance, if there are any.
    pub(super) fn odd_numbers(&self, image: ImageIndex, name: &str) -> Option<String> {
        let (negative, not_finite) = self.images.odd_numbers(image.0);
        let some = |count: u64, what: &str| match count {
            0 => None,
            1 => Some(format!("1 number that is {what}")),
            n => Some(format!("{n} numbers that are {what}")),
        };
        let all: Vec<_> =
            [some(negative, "negative"), some(not_finite, "not finite")].into_iter().flatten().collect();
        (!all.is_empty()).then(|| format!("{name} has {}", all.join(" and ")))
    }

    /// The image files that were read, in the order of their indices.
    pub(super) fn take_images(&mut self) -> Vec<ImageFile> {
        self.images.take()
    }

    /// The meshes that were read, with their sources.
    pub(super) fn sources(&self) -> Sources {
        self.meshes.sources()
    }

    /// The places for a misplaced key of the item `what`.
    pub(super) fn places_of(&self, what: &str, key: &str) -> Vec<&'static str> {
        (self.places_of)(what, key)
    }

    pub(super) fn has_errors(&self) -> bool {
        !self.errors.is_empty()
    }

    /// Reports an error at byte `at`.
    pub(super) fn error(&mut self, at: usize, message: impl Into<String>) -> Reported {
        self.error_with(at, message, |_| None)
    }

    /// Reports an error at byte `at`, with help that is computed only if it is shown.
    pub(super) fn error_with(
        &mut self,
        at: usize,
        message: impl Into<String>,
        help: impl FnOnce(&Self) -> Option<String>,
    ) -> Reported {
        if self.errors.len() < MAX_ERRORS {
            let help = help(self);
            self.errors.push(Message { at: Some(at), message: message.into(), help });
        } else {
            self.unlisted += 1;
        }
        Reported(())
    }

    /// Warns about byte `at`, or about the entire file.
    pub(super) fn warn(&mut self, at: Option<usize>, message: impl Into<String>, help: &str) {
        if self.warnings.len() < MAX_ERRORS {
            self.warnings.push(Message { at, message: message.into(), help: Some(help.into()) });
        } else {
            self.unlisted_warnings += 1;
        }
    }

    /// Reports the errors of the TOML parser. If the text is not TOML, its tables are a guess, and so are all errors
    /// after the first: only that one is reported. Duplicate keys leave the tables intact, and are all reported.
    pub(super) fn syntax_errors(&mut self, errors: &[SyntaxError]) -> Result<(), Reported> {
        let (twice, broken): (Vec<_>, Vec<_>) =
            errors.iter().partition(|error| error.message() == "duplicate key");
        let place = |error: &&SyntaxError| error.span().map_or(self.text.len(), |span| span.start);
        if let Some(first) = broken.into_iter().min_by_key(place) {
            let at = place(&first);
            return Err(self.error(at, self.explain(at, first.message())));
        }
        for error in twice {
            let span = error.span().unwrap_or_default();
            let key = self.source(span.clone());
            self.error(span.start, format!("{key} is given twice"));
        }
        Ok(())
    }

    /// The parser's message about byte `at`, reworded where it is hard to understand.
    fn explain(&self, at: usize, message: &str) -> String {
        let rest = self.text.get(at..).unwrap_or_default();
        if message.contains("recurs") {
            "arrays and tables are nested too deep".into()
        } else if message.starts_with("string values must be quoted")
            && rest.trim_start_matches('\r').starts_with('\n')
        {
            "this is not TOML: the value is missing".into()
        } else if message.contains("between key-value pairs")
            && let Some(brace) = self.open_brace(at)
        {
            let Position { line, column } = Cursor::new(self.text).advance(brace);
            format!("this is not TOML: {message}, or `}}` for the `{{` in line {line}, column {column}")
        } else {
            format!("this is not TOML: {message}")
        }
    }

    /// The innermost open brace at byte `at`. Braces in strings count as well, as this is only a hint.
    fn open_brace(&self, at: usize) -> Option<usize> {
        let mut closed = 0;
        self.text.get(..at)?.bytes().enumerate().rev().find_map(|(i, byte)| {
            match byte {
                b'}' => closed += 1,
                b'{' if closed == 0 => return Some(i),
                b'{' => closed -= 1,
                _ => {}
            }
            None
        })
    }

    /// The text at `span`, shortened and made safe to print.
    pub(super) fn source(&self, span: std::ops::Range<usize>) -> String {
        shorten(self.text.get(span).unwrap_or_default())
    }

    pub(super) fn into_errors(self, file: &Path) -> SceneErrors {
        SceneErrors::new(locate(self.text, self.errors, file), self.unlisted)
    }

    pub(super) fn into_warnings(self, file: &Path) -> Vec<Diagnostic> {
        let mut warnings = locate(self.text, self.warnings, file);
        if self.unlisted_warnings > 0 {
            let message = format!("there are {} more warnings", self.unlisted_warnings);
            warnings.push(Diagnostic { file: file.into(), position: None, message, help: None });
        }
        warnings
    }
}

/// Sorts messages by position; those about the entire file come first.
fn locate(text: &str, mut diagnostics: Vec<Message>, file: &Path) -> Vec<Diagnostic> {
    let file: Arc<Path> = file.into();
    diagnostics.sort_by_key(|report| report.at);
    let mut cursor = Cursor::new(text);
    diagnostics
        .into_iter()
        .map(|Message { at, message, help }| Diagnostic {
            file: file.clone(),
            position: at.map(|at| cursor.advance(at)),
            message,
            help,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_beyond_the_limit_are_counted() {
        let mut diagnostics = Diagnostics::alone("");
        for _ in 0..MAX_ERRORS + 2 {
            diagnostics.error(0, "wrong");
        }
        let errors = diagnostics.into_errors("a.toml".as_ref());
        assert_eq!((errors.diagnostics().len(), errors.unlisted()), (MAX_ERRORS, 2));
        assert!(errors.to_string().ends_with("a.toml:1:1: wrong\nand 2 more errors"));
    }

    #[test]
    fn warnings_beyond_the_limit_are_counted() {
        let mut diagnostics = Diagnostics::alone("");
        (0..MAX_ERRORS + 2).for_each(|_| diagnostics.warn(None, "odd", "look"));
        let warnings = diagnostics.into_warnings("a.toml".as_ref());
        assert_eq!(warnings.len(), MAX_ERRORS + 1);
        assert_eq!(warnings[MAX_ERRORS].to_string(), "a.toml: there are 2 more warnings");
    }
}
