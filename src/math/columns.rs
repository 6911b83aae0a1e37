//! Tables in columns: conversion from descriptions, and access to whole columns.

/// Numbers of a description in the precision of tables.
pub fn narrow<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(|x| x as f32)
}

/// Appends a row to three columns, one for each coordinate or channel. [`Vec3::gather`](super::Vec3::gather) looks it
/// up.
pub fn push3(columns: &mut [Vec<f32>; 3], values: [f32; 3]) {
    for (column, value) in columns.iter_mut().zip(values) {
        column.push(value);
    }
}

/// Visits the columns of a table, each with its field's name.
///
/// All instances of a table have the same names and types, in the same order, and columns of equal length. The slices
/// are those in which lanes look rows up, not copies, so that a visitor may identify a column by its address.
pub trait ColumnReader<'a> {
    /// A column of numbers.
    fn floats(&mut self, name: &'static str, column: &'a [f32]);

    /// A column of whole numbers: indices, counts and kinds.
    fn words(&mut self, name: &'static str, column: &'a [u32]);

    /// Three columns: the coordinates of vectors, or the channels of colours.
    fn vectors(&mut self, name: &'static str, columns: &'a [Vec<f32>; 3]);
}
