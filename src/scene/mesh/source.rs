//! The bytes of a mesh file, and the place in it.

use super::Watch;
use std::fmt;
use std::io::{BufRead, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// What is wrong with a mesh file. It displays as `dragon.ply: line 12: "1.0x" is not a number`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshFileError {
    /// The file.
    pub file: PathBuf,
    /// Where in it.
    pub place: Option<Place>,
    /// What is wrong.
    pub message: String,
}

/// A place in a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of text, from 1.
    Line(u64),
    /// A byte of a binary file, from 0.
    Byte(u64),
    /// An item of a structured file by its path, such as `meshes[0].primitives[2]`.
    Item(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(f, "line {line}"),
            Place::Byte(byte) => write!(f, "byte {byte}"),
            Place::Item(path) => f.write_str(path),
        }
    }
}

impl Place {
    /// The place with its preposition: `in line 12`, `at byte 80`.
    pub(super) fn within(&self) -> String {
        match self {
            Place::Byte(_) => format!("at {self}"),
            Place::Line(_) | Place::Item(_) => format!("in {self}"),
        }
    }
}

impl fmt::Display for MeshFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.file.display())?;
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for MeshFileError {}

/// The longest line of text, the longest word of which is no longer. A polygon of a thousand corners fits.
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// A file that is read from front to back.
pub(super) struct Source<'a, R> {
    name: &'a Path,
    input: R,
    len: u64,
    /// Bytes read so far.
    offset: u64,
    /// Lines read so far.
    line: u64,
    watch: Watch<'a>,
    /// The offset from which on it is told again.
    tell_at: u64,
}

/// How many bytes are read before a progress display hears of them.
const TELL_EVERY: u64 = 1 << 20;

pub(super) type Read_<T> = Result<T, MeshFileError>;

impl<'a, R: BufRead> Source<'a, R> {
    pub(super) fn new(name: &'a Path, input: R, len: u64, watch: Watch<'a>) -> Self {
        Source { name, input, len, offset: 0, line: 0, watch, tell_at: 0 }
    }

    /// The length of the file.
    pub(super) fn len(&self) -> u64 {
        self.len
    }

    /// The file.
    pub(super) fn name(&self) -> &'a Path {
        self.name
    }

    fn passed(&mut self, bytes: usize) {
        self.offset += bytes as u64;
        if self.offset >= self.tell_at {
            (self.watch)(self.offset, self.len);
            self.tell_at = self.offset + TELL_EVERY;
        }
    }

    /// An error about the file as a whole.
    pub(super) fn whole(&self, message: impl ToString) -> MeshFileError {
        MeshFileError { file: self.name.into(), place: None, message: message.to_string() }
    }

    /// An error on the line that was read last.
    pub(super) fn on_line(&self, message: impl ToString) -> MeshFileError {
        MeshFileError { place: Some(Place::Line(self.line)), ..self.whole(message) }
    }

    /// An error at the byte that comes next.
    pub(super) fn at_byte(&self, message: impl ToString) -> MeshFileError {
        MeshFileError { place: Some(Place::Byte(self.offset)), ..self.whole(message) }
    }

    /// The line that was read last, for a note.
    pub(super) fn line(&self) -> Option<Place> {
        Some(Place::Line(self.line))
    }

    /// Bytes that are left, if the file is as long as it was.
    pub(super) fn left(&self) -> u64 {
        self.len.saturating_sub(self.offset)
    }

    fn failed(&self, error: &std::io::Error) -> MeshFileError {
        self.at_byte(format!("cannot be read: {error}"))
    }

    /// Reads the next line, without its end, into `line`; false at the end of the file.
    pub(super) fn next_line(&mut self, line: &mut Vec<u8>) -> Read_<bool> {
        line.clear();
        let read = match self.input.by_ref().take(LONGEST_LINE as u64 + 1).read_until(b'\n', line) {
            Ok(read) => read,
            Err(error) => return Err(self.failed(&error)),
        };
        self.passed(read);
        self.line += 1;
        if read > LONGEST_LINE {
            return Err(self.too_long());
        }
        if line.last() == Some(&b'\n') {
            line.pop();
        }
        if line.last() == Some(&b'\r') {
            line.pop();
        }
        Ok(read > 0)
    }

    /// The line that was read last, by itself or with those that it goes on, is longer than any may be.
    pub(super) fn too_long(&self) -> MeshFileError {
        self.on_line("this line is longer than 1 MiB: is this a mesh file?")
    }

    /// Fills `bytes` with the next ones.
    pub(super) fn exact(&mut self, bytes: &mut [u8]) -> Read_<()> {
        match self.input.read_exact(bytes) {
            Ok(()) => {
                self.passed(bytes.len());
                Ok(())
            }
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                Err(self.at_byte("the file ends in the middle of an element: it is cut off"))
            }
            Err(error) => Err(self.failed(&error)),
        }
    }
}

impl<R: BufRead> Source<'_, R> {
    /// The next bytes, as many as there are up to a limit that the caller has checked against the file's length.
    pub(super) fn bytes(&mut self, len: u64) -> Read_<Vec<u8>> {
        let mut bytes = Vec::new();
        match self.input.by_ref().take(len).read_to_end(&mut bytes) {
            Ok(read) => self.passed(read),
            Err(error) => return Err(self.failed(&error)),
        }
        Ok(bytes)
    }

    /// An error on a line, from 1.
    pub(super) fn at_line(&self, line: usize, message: impl ToString) -> MeshFileError {
        MeshFileError { place: Some(Place::Line(line as u64)), ..self.whole(message) }
    }
}

/// A word as messages show it.
pub(super) fn shown(word: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(&word[..word.len().min(40)]).escape_debug().collect();
    if word.len() > 40 { format!("\"{text}…\"") } else { format!("\"{text}\"") }
}

/// Words between blanks.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A number in decimal.
pub(super) fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}
