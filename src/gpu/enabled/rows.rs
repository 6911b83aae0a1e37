//! Rows of the heap, made of the host's columns.
//!
//! Lanes look tables up by columns, an invocation reads all that it needs of a row at once. Which fields a row has
//! follows from the columns' names and types, and so does the WGSL that reads it: a new column needs no line here.

use super::heap::{self, WORD};
use crate::math::ColumnReader;
use std::fmt::Write;

/// Numbers in a word of the heap.
const NUMBERS: usize = WORD / 4;

/// A word of the heap.
pub(super) type HeapWord = [u32; NUMBERS];

/// What a column holds.
#[derive(Clone, Copy)]
enum Values<'a> {
    Floats(&'a [f32]),
    Words(&'a [u32]),
    Vectors(&'a [Vec<f32>; 3]),
}

impl Values<'_> {
    /// How many numbers a row has of it.
    fn width(&self) -> usize {
        match self {
            Values::Floats(_) | Values::Words(_) => 1,
            Values::Vectors(columns) => columns.len(),
        }
    }

    /// How many rows there are. The columns of a vector are of one length.
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

    /// The bits of a row's number.
    fn bits(&self, row: usize, i: usize) -> u32 {
        match self {
            Values::Floats(column) => column[row].to_bits(),
            Values::Words(column) => column[row],
            Values::Vectors(columns) => columns[i][row].to_bits(),
        }
    }

    /// Its type in WGSL.
    fn wgsl_type(&self) -> &'static str {
        match self {
            Values::Floats(_) => "f32",
            Values::Words(_) => "u32",
            Values::Vectors(_) => "vec3f",
        }
    }
}

/// Where in a row a field begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// The word of the row.
    pub(super) word: usize,
    /// The first number in that word.
    pub(super) first: usize,
}

/// Places for fields of so many numbers, one or three each, in their order, and the words that a row of them takes.
///
/// The words are as few as can be: each vector begins a word, and single numbers take the first room that is left,
/// behind vectors at first.
fn pack(widths: &[usize]) -> (Vec<Place>, usize) {
    let mut places = vec![Place::default(); widths.len()];
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
        places[i] = Place { word, first: filled[word] };
        filled[word] += 1;
    }
    (places, filled.len())
}

/// A table's columns, to be laid out by rows. The layout and the WGSL depend on their names and types alone.
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
    /// Where in a row each column's field begins, and the words of a row.
    fn layout(&self) -> (Vec<Place>, usize) {
        let widths: Vec<_> = self.columns.iter().map(|(_, values)| values.width()).collect();
        pack(&widths)
    }

    /// The rows, one after the other. All columns must be of one length.
    pub(super) fn packed(&self) -> Vec<HeapWord> {
        let all: Vec<_> = (0..self.len() as u32).collect();
        self.packed_as(&all)
    }

    /// How many rows there are.
    fn len(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| values.len())
    }

    /// The same for some of the rows, in another order.
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

    /// WGSL that declares a structure of this name with a field for each column, and a function that reads a row of
    /// the table that begins with the heap's word `scene.FROM`.
    pub(super) fn text(&self, name: &str, function: &str, from: &str) -> String {
        let (places, words) = self.layout();
        let mut text = format!("struct {name} {{\n");
        for (field, values) in &self.columns {
            writeln!(text, "    {field}: {},", values.wgsl_type()).expect("a string takes all");
        }
        let fields = self.columns.iter().zip(places).map(|((_, values), Place { word, first })| {
            heap::field(values.wgsl_type(), word, first..first + values.width())
        });
        text + "}\n" + &heap::reader(name, function, from, words, fields)
    }

    /// Where in a row a column's field begins, and the words of a row.
    #[cfg(test)]
    pub(super) fn place(&self, name: &str) -> Option<(Place, usize)> {
        let (places, words) = self.layout();
        let column = self.columns.iter().position(|(field, _)| *field == name)?;
        Some((places[column], words))
    }
}

#[cfg(test)]
mod tests;
