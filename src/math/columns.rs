//! From the numbers of descriptions to those of tables.

/// Numbers of a description, as tables have them.
pub fn narrow<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(|x| x as f32)
}

/// Adds a row to three columns, one for each coordinate or channel. [`Vec3::gather`](super::Vec3::gather) looks it up.
pub fn push3(columns: &mut [Vec<f32>; 3], values: [f32; 3]) {
    for (column, value) in columns.iter_mut().zip(values) {
        column.push(value);
    }
}
