//! The bytes of a mesh file, with the current position.

use crate::texture::access;
use std::fmt;
use std::fs::File;
use std::io::{BufRead, Cursor, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// An error in a mesh file. It displays as `dragon.ply: line 12: "1.0x" is not a number`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshFileError {
    /// The file.
    pub file: PathBuf,
    /// The position in it.
    pub place: Option<FilePosition>,
    /// The problem, and the remedy if there is one.
    pub message: String,
}

/// A position in a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FilePosition {
    /// A line of text, from 1.
    Line(u64),
    /// A byte offset in a binary file, from 0.
    Byte(u64),
    /// An item of a structured file by its path, such as `meshes[0].primitives[2]`.
    Item(String),
}

impl fmt::Display for FilePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FilePosition::Line(line) => write!(f, "line {line}"),
            FilePosition::Byte(byte) => write!(f, "byte {byte}"),
            FilePosition::Item(path) => f.write_str(path),
        }
    }
}

impl FilePosition {
    /// The position with its preposition: `in line 12`, `at byte 80`.
    pub(super) fn within(&self) -> String {
        match self {
            FilePosition::Byte(_) => format!("at {self}"),
            FilePosition::Line(_) | FilePosition::Item(_) => format!("in {self}"),
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

/// The maximum length of a line or word of text. A polygon of a thousand corners fits.
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// A progress callback: the bytes read so far, and the length of the file.
pub type Watch<'a> = &'a mut dyn FnMut(u64, u64);

/// A file that is read from front to back.
pub(super) struct Source<'a, R> {
    name: &'a Path,
    input: Input<R>,
    len: u64,
    /// Bytes read so far.
    offset: u64,
    /// Lines read so far.
    line: u64,
    /// Whether lines end in a carriage return alone, as the first one does.
    ends_in_cr: bool,
    watch: Watch<'a>,
    /// The offset of the next progress callback.
    tell_at: u64,
}

/// A reader that first returns what was read ahead.
struct Input<R> {
    ahead: Cursor<Vec<u8>>,
    rest: R,
}

impl<R> Input<R> {
    fn is_ahead(&self) -> bool {
        self.ahead.position() < self.ahead.get_ref().len() as u64
    }
}

impl<R: BufRead> Read for Input<R> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        if self.is_ahead() { self.ahead.read(bytes) } else { self.rest.read(bytes) }
    }
}

impl<R: BufRead> BufRead for Input<R> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.is_ahead() { self.ahead.fill_buf() } else { self.rest.fill_buf() }
    }

    fn consume(&mut self, bytes: usize) {
        if self.is_ahead() { self.ahead.consume(bytes) } else { self.rest.consume(bytes) }
    }
}

/// The mark that some editors put before text in UTF-8. It is skipped without a note in every format, as nothing is
/// lost.
pub(super) const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Whether a file's first line is text with two bytes per character, by its byte-order mark or by Latin letters.
fn is_utf_16(line: &[u8]) -> bool {
    let latin =
        |zeros: [u8; 2], letters: [u8; 2]| zeros == [0, 0] && letters.iter().all(|c| (1..128).contains(c));
    match *line {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        [a, b, c, d, ..] => latin([a, c], [b, d]) || latin([b, d], [a, c]),
        _ => false,
    }
}

/// The number of bytes between progress callbacks.
const TELL_EVERY: u64 = 1 << 20;

pub(super) type Read_<T> = Result<T, MeshFileError>;

impl<'a, R> Source<'a, R> {
    /// The file.
    pub(super) fn name(&self) -> &'a Path {
        self.name
    }
}

impl<'a, R: BufRead> Source<'a, R> {
    pub(super) fn new(name: &'a Path, input: R, len: u64, watch: Watch<'a>) -> Self {
        let input = Input { ahead: Cursor::default(), rest: input };
        Source { name, input, len, offset: 0, line: 0, ends_in_cr: false, watch, tell_at: 0 }
    }

    /// The length of the file.
    pub(super) fn len(&self) -> u64 {
        self.len
    }

    fn passed(&mut self, bytes: usize) {
        self.offset += bytes as u64;
        if self.offset >= self.tell_at {
            (self.watch)(self.offset, self.len);
            self.tell_at = self.offset + TELL_EVERY;
        }
    }

    /// An error about the entire file.
    pub(super) fn whole(&self, message: impl ToString) -> MeshFileError {
        MeshFileError { file: self.name.into(), place: None, message: message.to_string() }
    }

    /// An error on the line that was read last.
    pub(super) fn on_line(&self, message: impl ToString) -> MeshFileError {
        MeshFileError { place: Some(FilePosition::Line(self.line)), ..self.whole(message) }
    }

    /// An error at the byte that comes next.
    pub(super) fn at_byte(&self, message: impl ToString) -> MeshFileError {
        MeshFileError { place: Some(FilePosition::Byte(self.offset)), ..self.whole(message) }
    }

    /// The offset of the next byte, for a note.
    pub(super) fn byte(&self) -> Option<FilePosition> {
        Some(FilePosition::Byte(self.offset))
    }

    /// The number of lines that were read.
    pub(super) fn lines(&self) -> u64 {
        self.line
    }

    /// The line that was read last, for a note.
    pub(super) fn line(&self) -> Option<FilePosition> {
        Some(FilePosition::Line(self.line))
    }

    /// Remaining bytes, if the file's length has not changed.
    pub(super) fn left(&self) -> u64 {
        self.len.saturating_sub(self.offset)
    }

    fn failed(&self, error: &std::io::Error) -> MeshFileError {
        self.at_byte(format!("cannot be read: {error}"))
    }

    /// Reads the next line, without its end, into `line`; false at the end of the file.
    ///
    /// A line ends in a line feed, in a carriage return, or in both. If the first line ends in a carriage return alone,
    /// all do, and a line feed is no line end: it may be the first byte of binary data after a header.
    pub(super) fn next_line(&mut self, line: &mut Vec<u8>) -> Read_<bool> {
        line.clear();
        self.line += 1;
        let mut read = 0;
        loop {
            let buffer = match self.input.fill_buf() {
                Ok(buffer) => buffer,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(self.failed(&error)),
            };
            let most = buffer.len().min(LONGEST_LINE + 1 - line.len());
            let end = buffer[..most].iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            line.extend_from_slice(&buffer[..end.unwrap_or(most)]);
            let of_line = end.map_or(most, |end| end + 1);
            let ended_by = end.map(|end| buffer[end]);
            self.input.consume(of_line);
            read += of_line;
            match ended_by {
                _ if line.len() > LONGEST_LINE => {
                    self.passed(read);
                    return Err(self.too_long());
                }
                Some(b'\r') if !self.ends_in_cr => {
                    let followed = self.peek()? == Some(b'\n');
                    if followed {
                        self.input.consume(1);
                        read += 1;
                    }
                    self.ends_in_cr = !followed && self.line == 1;
                    break;
                }
                Some(_) => break,
                // Nothing is left.
                None if most == 0 => break,
                None => {}
            }
        }
        self.passed(read);
        if self.line == 1 {
            if is_utf_16(line) {
                return Err(self.whole(
                    "this file is UTF-16, and text is read as UTF-8: save it as UTF-8, for example with iconv",
                ));
            }
            if line.starts_with(BYTE_ORDER_MARK) {
                line.drain(..BYTE_ORDER_MARK.len());
            }
        }
        Ok(read > 0)
    }

    /// The rest of the file, which remains to be read and is in memory from now on.
    pub(super) fn look_ahead(&mut self) -> Read_<&[u8]> {
        let mut ahead = Vec::new();
        // A file that grows meanwhile is read only up to its initial length.
        let left = self.left();
        if let Err(error) = self.input.by_ref().take(left).read_to_end(&mut ahead) {
            return Err(self.failed(&error));
        }
        self.input.ahead = Cursor::new(ahead);
        Ok(self.input.ahead.get_ref())
    }

    /// The next byte, if there is one.
    fn peek(&mut self) -> Read_<Option<u8>> {
        loop {
            match self.input.fill_buf() {
                Ok(buffer) => return Ok(buffer.first().copied()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(self.failed(&error)),
            }
        }
    }

    /// The error that the last line, or a statement continued over several lines, is too long.
    pub(super) fn too_long(&self) -> MeshFileError {
        self.on_line("this line is longer than 1 MiB: is this a mesh file?")
    }

    /// Fills `bytes` with the next ones.
    pub(super) fn exact(&mut self, bytes: &mut [u8]) -> Read_<()> {
        let read = if self.input.is_ahead() {
            self.input.read_exact(bytes)
        } else {
            // Readers have a faster way to this than by parts.
            self.input.rest.read_exact(bytes)
        };
        match read {
            Ok(()) => {
                self.passed(bytes.len());
                Ok(())
            }
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                Err(self.at_byte("the file ends in the middle of an element: it is truncated"))
            }
            Err(error) => Err(self.failed(&error)),
        }
    }
}

impl<R: BufRead> Source<'_, R> {
    /// The next bytes, up to a limit that the caller has checked against the file's length.
    pub(super) fn bytes(&mut self, len: u64) -> Read_<Vec<u8>> {
        let mut bytes = Vec::new();
        match self.input.by_ref().take(len).read_to_end(&mut bytes) {
            Ok(read) => self.passed(read),
            Err(error) => return Err(self.failed(&error)),
        }
        Ok(bytes)
    }
}

/// Opens a file, and returns its length.
pub(super) fn open(path: &Path) -> Read_<(File, u64)> {
    let fail = |message: String| Err(MeshFileError { file: path.into(), place: None, message });
    let unreadable = |error: &std::io::Error| match error.kind() {
        ErrorKind::NotFound => fail("there is no such file".into()),
        ErrorKind::PermissionDenied => fail("permission to read this file is denied".into()),
        _ => fail(format!("cannot be read: {error}")),
    };
    if let Err(error) = access::opening(path) {
        return unreadable(&error);
    }
    match std::fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => fail("this is not a file".into()),
        Err(error) => unreadable(&error),
        Ok(metadata) => match File::open(path) {
            Ok(file) => Ok((file, metadata.len())),
            Err(error) => unreadable(&error),
        },
    }
}

/// The path of a file that another one refers to.
pub(super) fn beside(file: &Path, name: &str) -> PathBuf {
    access::named(file.parent().unwrap_or(Path::new("")), name)
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

/// A real number in decimal, or NaN for a word by which C libraries print NaN and infinity: `-nan(ind)`, `1.#QNAN`,
/// `-1.#IND00`, `1.#INF`.
pub(super) fn number_or_nan<T: std::str::FromStr + From<f32>>(word: &[u8]) -> Option<T> {
    number(word).or_else(|| {
        let word = word.strip_prefix(b"-").unwrap_or(word);
        let starts =
            |with: &&[u8]| word.get(..with.len()).is_some_and(|start| start.eq_ignore_ascii_case(with));
        let none: [&[u8]; 5] = [b"nan(", b"1.#QNAN", b"1.#SNAN", b"1.#IND", b"1.#INF"];
        none.iter().any(starts).then(|| T::from(f32::NAN))
    })
}
