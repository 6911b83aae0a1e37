//! Elements of a PLY file, in text and in binary.
//!
//! In text, numbers are separated by blanks, and usually each element has a line. Where elements are split or joined
//! across lines, they are read number by number. Where each has a line ([`lines::correspond`]), surplus numbers at its
//! end are ignored, as in other readers. The first line with surplus numbers decides for the rest of the file, which is
//! scanned once for this. Both cases add a note.

use super::header::{Element, Encoding, Property};
use super::lines;
use crate::scene::mesh::parts::Parts;
use crate::scene::mesh::source::{FilePosition, Read_, Source, number_or_nan, shown};
use std::io::BufRead;

/// The number of bytes of a list that are read at once; a multiple of every number's size.
const PIECE: usize = 1 << 16;

/// The correspondence of elements and lines.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// So far, each element has a line.
    Unknown,
    /// Each element has a line, some with surplus numbers.
    Lines,
    /// Some elements have no line of their own.
    Free,
}

/// Reads elements one by one: their scalars, and one of their lists.
pub(super) struct Rows<'e> {
    pub(super) encoding: Encoding,
    /// The elements of the header, all of which are read in this order.
    elements: &'e [Element],
    /// In text, the number of elements with properties that have been started.
    begun: u64,
    layout: Layout,
    /// A line, or an element's bytes.
    buffer: Vec<u8>,
    /// The number of bytes of the line that were read.
    read: usize,
    /// The number of text elements without a line of their own, and the location of the first.
    astray: u64,
    first_astray: Option<FilePosition>,
    /// The number of lines with surplus numbers, and the location of the first.
    surplus: u64,
    first_surplus: Option<FilePosition>,
    /// One number for each property; for a list, its length.
    pub(super) scalars: Vec<f64>,
    /// The elements of the requested list.
    pub(super) list: Vec<f64>,
}

impl<'e> Rows<'e> {
    pub(super) fn new(encoding: Encoding, elements: &'e [Element]) -> Self {
        Rows {
            encoding,
            elements,
            begun: 0,
            layout: Layout::Unknown,
            buffer: Vec::new(),
            read: 0,
            astray: 0,
            first_astray: None,
            surplus: 0,
            first_surplus: None,
            scalars: Vec::new(),
            list: Vec::new(),
        }
    }

    pub(super) fn next<R: BufRead>(
        &mut self,
        source: &mut Source<'_, R>,
        element: &Element,
        wanted: Option<usize>,
    ) -> Read_<()> {
        self.scalars.clear();
        self.list.clear();
        match self.encoding {
            Encoding::Text => self.next_text(source, element, wanted),
            _ => self.next_binary(source, element, wanted),
        }
    }

    fn next_text<R: BufRead>(
        &mut self,
        source: &mut Source<'_, R>,
        element: &Element,
        wanted: Option<usize>,
    ) -> Read_<()> {
        if element.properties.is_empty() {
            return Ok(());
        }
        // The line begins with another element.
        let mut follows = self.skip_blanks();
        if follows && self.layout == Layout::Unknown {
            let is_of_lines = lines::correspond(source.look_ahead()?, self.elements, self.begun);
            self.layout = if is_of_lines { Layout::Lines } else { Layout::Free };
        }
        if follows && self.layout == Layout::Lines {
            self.skip_line(source);
            follows = false;
        }
        self.begun += 1;
        let mut line = None;
        for (i, property) in element.properties.iter().enumerate() {
            let value = self.number(source)?;
            line = line.or(source.line());
            self.scalars.push(value);
            if property.length.is_some() {
                // Bounded by the file: with a wrong length, the words run out.
                let Some(length) = length(value) else {
                    let is_astray = follows || line != source.line();
                    let first = self.first_astray.take().or(line.filter(|_| is_astray));
                    return Err(source.on_line(no_length(property, value, first)));
                };
                for _ in 0..length {
                    let value = self.number(source)?;
                    if wanted == Some(i) {
                        self.list.push(value);
                    }
                }
            }
        }
        if follows || line != source.line() {
            self.layout = Layout::Free;
            self.astray += 1;
            self.first_astray = self.first_astray.take().or(line);
        }
        Ok(())
    }

    /// Notes irregularities of the elements, and data after the last one.
    pub(super) fn finish<R: BufRead>(
        &mut self,
        source: &mut Source<'_, R>,
        parts: &mut Parts<'_>,
    ) -> Read_<()> {
        let message = "elements not on lines of their own are read number by number";
        parts.note_several(message, self.astray, self.first_astray.take());
        if self.layout == Layout::Lines && self.skip_blanks() {
            self.skip_line(source);
        }
        let message = "surplus numbers at the end of an element's line are ignored";
        parts.note_several(message, self.surplus, self.first_surplus.take());
        let left_over = "data after the last element is ignored";
        if self.encoding != Encoding::Text {
            parts.note_several(left_over, u64::from(source.left() > 0), source.byte());
            return Ok(());
        }
        while !self.skip_blanks() {
            self.read = 0;
            if !source.next_line(&mut self.buffer)? {
                return Ok(());
            }
        }
        if self.astray > 0 {
            return Err(source.on_line("there are more numbers than the header declares"));
        }
        parts.note(left_over, source.line());
        Ok(())
    }

    /// Skips blanks in a line of text, and returns whether anything follows them.
    fn skip_blanks(&mut self) -> bool {
        let blanks = self.buffer[self.read..].iter().take_while(|byte| byte.is_ascii_whitespace());
        self.read += blanks.count();
        self.read < self.buffer.len()
    }

    /// Skips the rest of a line of text with surplus numbers.
    fn skip_line<R: BufRead>(&mut self, source: &Source<'_, R>) {
        self.read = self.buffer.len();
        self.surplus += 1;
        self.first_surplus = self.first_surplus.take().or(source.line());
    }

    /// The next number in text.
    fn number<R: BufRead>(&mut self, source: &mut Source<'_, R>) -> Read_<f64> {
        while !self.skip_blanks() {
            self.read = 0;
            if !source.next_line(&mut self.buffer)? {
                return Err(source.whole("the file ends before its last element: it is truncated"));
            }
        }
        let rest = &self.buffer[self.read..];
        let word = rest.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        self.read += word.len();
        number_or_nan(word).ok_or_else(|| source.on_line(format!("{} is not a number", shown(word))))
    }

    fn next_binary<R: BufRead>(
        &mut self,
        source: &mut Source<'_, R>,
        element: &Element,
        wanted: Option<usize>,
    ) -> Read_<()> {
        for (i, property) in element.properties.iter().enumerate() {
            let mut raw = [0; 8];
            let scalar = property.length.unwrap_or(property.scalar);
            source.exact(&mut raw[..scalar.size()])?;
            let value = scalar.decode(&raw, self.encoding);
            self.scalars.push(value);
            if property.length.is_some() {
                let Some(count) = length(value) else {
                    return Err(source.at_byte(no_length(property, value, None)));
                };
                let size = property.scalar.size();
                if count * size as u64 > source.left() {
                    return Err(source.at_byte(format!(
                        "a list of {count} numbers, but only {} bytes are left",
                        source.left()
                    )));
                }
                // In pieces, as a list may be as long as the file.
                let mut left = count as usize * size;
                while left > 0 {
                    self.buffer.resize(left.min(PIECE), 0);
                    source.exact(&mut self.buffer)?;
                    left -= self.buffer.len();
                    if wanted == Some(i) {
                        let decode = |bytes| property.scalar.decode(bytes, self.encoding);
                        self.list.extend(self.buffer.chunks_exact(size).map(decode));
                    }
                }
            }
        }
        Ok(())
    }
}

/// The length of a list, from a number.
fn length(value: f64) -> Option<u64> {
    (value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0).then_some(value as u64)
}

/// The message about an invalid length of a list; `astray` is the location of the first text element without a line of
/// its own.
fn no_length(list: &Property, value: f64, astray: Option<FilePosition>) -> String {
    let message = format!("{value} is not a length of the list {}", shown(&list.name));
    match astray {
        None => message,
        Some(first) => format!(
            "{message}: from {first} on, lines have more or fewer numbers than the header gives their elements properties"
        ),
    }
}
