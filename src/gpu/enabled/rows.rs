//! Rows of the heap, built from the host's columns.
//!
//! Lanes look tables up by columns; an invocation reads all that it needs of a row at once. The fields of a row, and
//! the WGSL that reads it, follow from the columns' names and types: a new column needs no line here.

use super::heap::{self, WORD};
use crate::math::ColumnReader;
use std::fmt::Write;

/// Numbers per word of the heap.
const NUMBERS: usize = WORD / 4;

/// A word of the heap.
pub(super) type HeapWord = [u32; NUMBERS];

/// The values of a column.
#[derive(Clone, Copy)]
enum Values<'a> {
    Floats(&'a [f32]),
    Words(&'a [u32]),
    Vectors(&'a [Vec<f32>; 3]),
}

impl Values<'_> {
    /// The number of numbers per row.
    fn width(&self) -> usize {
        match self {
            Values::Floats(_) | Values::Words(_) => 1,
            Values::Vectors(columns) => columns.len(),
        }
    }

    /// The number of rows. The columns of a vector have equal length.
    fn len(&self) -> usize {
        match self {
            Values::Floats(column) => column.len(),
            Values::Words(column) => column.len(),
            Values::Vectors([x, y, z]) => {
                assert!(x.len() == y.len() && y.len() == z.len(), "a vector's columns are of one length");
                x.len()
            }
        }
    }

    /// The bits of a number in a row.
    fn bits(&self, row: usize, i: usize) -> u32 {
        match self {
            Values::Floats(column) => column[row].to_bits(),
            Values::Words(column) => column[row],
            Values::Vectors(columns) => columns[i][row].to_bits(),
        }
    }

    /// The type in WGSL.
    fn wgsl_type(&self) -> &'static str {
        match self {
            Values::Floats(_) => "f32",
            Values::Words(_) => "u32",
            Values::Vectors(_) => "vec3f",
        }
    }
}

/// The position of a field in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FieldOffset {
    /// The index of the word in the row.
    pub(super) word: usize,
    /// The index of the first number in that word.
    pub(super) first: usize,
}

/// The offsets of fields of one or three numbers, in their order, and the number of words per row.
///
/// The number of words is minimal: each vector begins a word, and single numbers fill the gaps after vectors first.
fn pack(widths: &[usize]) -> (Vec<FieldOffset>, usize) {
    let mut places = vec![FieldOffset::default(); widths.len()];
    let mut filled: Vec<usize> = Vec::new();
    let (wide, single): (Vec<_>, Vec<_>) = (0..widths.len()).partition(|&i| widths[i] > 1);
    for i in wide {
        places[i].word = filled.len();
        filled.push(widths[i]);
    }
    for i in single {
        let word = filled.iter().position(|&numbers| numbers < NUMBERS).unwrap_or(filled.len());
        if word == filled.len() {
            filled.push(0);
        }
        places[i] = FieldOffset { word, first: filled[word] };
        filled[word] += 1;
    }
    (places, filled.len())
}

/// A table's columns, to be laid out by rows. The layout and the WGSL depend only on their names and types.
#[derive(Default)]
pub(super) struct Rows<'a> {
    columns: Vec<(&'static str, Values<'a>)>,
}

impl<'a> ColumnReader<'a> for Rows<'a> {
    fn floats(&mut self, name: &'static str, column: &'a [f32]) {
        self.columns.push((name, Values::Floats(column)));
    }

    fn words(&mut self, name: &'static str, column: &'a [u32]) {
        self.columns.push((name, Values::Words(column)));
    }

    fn vectors(&mut self, name: &'static str, columns: &'a [Vec<f32>; 3]) {
        self.columns.push((name, Values::Vectors(columns)));
    }
}

impl Rows<'_> {
    /// The offset of each column's field, and the number of words per row.
    fn layout(&self) -> (Vec<FieldOffset>, usize) {
        let widths: Vec<_> = self.columns.iter().map(|(_, values)| values.width()).collect();
        pack(&widths)
    }

    /// All rows in order. All columns must have equal length.
    pub(super) fn packed(&self) -> Vec<HeapWord> {
        let all: Vec<_> = (0..self.len() as u32).collect();
        self.packed_as(&all)
    }

    /// The number of rows.
    fn len(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| values.len())
    }

    /// Some of the rows, in a given order.
    pub(super) fn packed_as(&self, order: &[u32]) -> Vec<HeapWord> {
        let (places, words) = self.layout();
        let mut packed = vec![HeapWord::default(); order.len() * words];
        for ((name, values), place) in self.columns.iter().zip(places) {
            assert_eq!(values.len(), self.len(), "the column {name} is as long as the others");
            for (&row, words) in order.iter().zip(packed.chunks_exact_mut(words)) {
                for i in 0..values.width() {
                    words[place.word][place.first + i] = values.bits(row as usize, i);
                }
            }
        }
        packed
    }

    /// WGSL that declares a structure with a field for each column, and a function that reads a row of the table that
    /// starts at the heap's word `scene.FROM`.
    pub(super) fn text(&self, name: &str, function: &str, from: &str) -> String {
        let (places, words) = self.layout();
        let mut text = format!("struct {name} {{\n");
        for (field, values) in &self.columns {
            writeln!(text, "    {field}: {},", values.wgsl_type()).expect("a string takes all");
        }
        let fields = self.columns.iter().zip(places).map(|((_, values), FieldOffset { word, first })| {
            heap::field(values.wgsl_type(), word, first..first + values.width())
        });
        text + "}\n" + &heap::reader(name, function, from, words, fields)
    }

    /// The offset of a column's field, and the number of words per row.
    #[cfg(test)]
    pub(super) fn place(&self, name: &str) -> Option<(FieldOffset, usize)> {
        let (places, words) = self.layout();
        let column = self.columns.iter().position(|(field, _)| *field == name)?;
        Some((places[column], words))
    }
}

#[cfg(test)]
mod tests;
