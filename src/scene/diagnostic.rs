//! Errors and warnings of readers: position, problem and remedy.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// A position in a text file, as shown by editors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// The line, from 1.
    pub line: usize,
    /// The column in characters, from 1. A byte order mark is not counted.
    pub column: usize,
}

/// An error or warning. It displays as `box.toml:12:8: no material "rad"; did you mean "red"?`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file, by the name given to the reader.
    pub file: Arc<Path>,
    /// The position; `None` if the message concerns the entire file.
    pub position: Option<Position>,
    /// The problem.
    pub message: String,
    /// The remedy, if the reader can suggest one.
    pub help: Option<String>,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(Position { line, column }) = self.position {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, "; {help}")?;
        }
        Ok(())
    }
}

/// All errors in a scene file, in the order of the file; never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneErrors {
    diagnostics: Vec<Diagnostic>,
    unlisted: usize,
}

impl SceneErrors {
    /// `unlisted` is the number of further errors without description.
    pub(super) fn new(diagnostics: Vec<Diagnostic>, unlisted: usize) -> Self {
        Self { diagnostics, unlisted }
    }

    /// A single error, about the entire file or a position in it.
    pub(super) fn one(
        file: &Path,
        position: Option<Position>,
        message: String,
        help: Option<String>,
    ) -> Self {
        Self::new(vec![Diagnostic { file: file.into(), position, message, help }], 0)
    }

    /// The errors, in the order of the file.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// The number of errors beyond [`Self::diagnostics`]: invalid files may have millions.
    pub fn unlisted(&self) -> usize {
        self.unlisted
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.diagnostics.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{diagnostic}")?;
        }
        match self.unlisted {
            0 => Ok(()),
            1 => write!(f, "\nand 1 more error"),
            n => write!(f, "\nand {n} more errors"),
        }
    }
}

impl std::error::Error for SceneErrors {}

/// Converts byte offsets, in increasing order, to positions in one pass over the text.
///
/// Counting from the start for each would be quadratic, and a hostile file may be one long line of errors.
pub(super) struct Cursor<'t> {
    text: &'t str,
    offset: usize,
    position: Position,
}

impl<'t> Cursor<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        // Editors hide the byte order mark, so it is not counted.
        let offset = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        Self { text, offset, position: Position { line: 1, column: 1 } }
    }

    /// The position of the character that contains byte `offset`, or of the text's end.
    pub(super) fn advance(&mut self, offset: usize) -> Position {
        let mut end = offset.min(self.text.len());
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        for c in self.text.get(self.offset..end).unwrap_or_default().chars() {
            if c == '\n' {
                self.position = Position { line: self.position.line + 1, column: 1 };
            } else {
                self.position.column += 1;
            }
        }
        self.offset = self.offset.max(end);
        self.position
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagnostic_shows_its_position_and_remedy() {
        let position = Some(Position { line: 12, column: 8 });
        let message = "no material \"rad\"".to_string();
        let help = Some("did you mean \"red\"?".to_string());
        let diagnostic = Diagnostic { file: Path::new("box.toml").into(), position, message, help };
        assert_eq!(diagnostic.to_string(), "box.toml:12:8: no material \"rad\"; did you mean \"red\"?");
        let whole = Diagnostic { position: None, help: None, ..diagnostic };
        assert_eq!(whole.to_string(), "box.toml: no material \"rad\"");
    }

    #[test]
    fn a_cursor_counts_characters_and_survives_any_offset() {
        let text = "\u{feff}aé☃b\r\nc";
        let mut cursor = Cursor::new(text);
        let at = |cursor: &mut Cursor<'_>, offset| {
            let Position { line, column } = cursor.advance(offset);
            (line, column)
        };
        assert_eq!(at(&mut cursor, 0), (1, 1));
        assert_eq!(at(&mut cursor, 3), (1, 1));
        assert_eq!(at(&mut cursor, text.find('☃').unwrap_or(0)), (1, 3));
        // Inside a character, and before the cursor's current position.
        assert_eq!(at(&mut cursor, text.find('☃').unwrap_or(0) + 1), (1, 3));
        assert_eq!(at(&mut cursor, 1), (1, 3));
        assert_eq!(at(&mut cursor, text.find('c').unwrap_or(0)), (2, 1));
        assert_eq!(at(&mut cursor, 1 << 40), (2, 2));
    }
}
