//! Memory limits for the contents of a glTF document.

use crate::scene::mesh::source::Source;
use crate::shape::MOST_TRIANGLES;
use std::io::BufRead;

/// The remaining memory for the contents of a file: nodes and copies may repeat a mesh, but not without limit.
///
/// Vertices, triangles and everything else may take [`FLOOR`] bytes plus [`MOST_REPEATS`] bytes for each byte of the
/// file and of the files that it refers to.
pub(super) struct Room {
    vertices: usize,
    triangles: usize,
    repeats: u64,
}

/// Bytes for each byte of a file.
const MOST_REPEATS: u64 = 64;

/// Bytes available to any file: a small file may well have a thousand copies of a mesh of thousands of triangles.
const FLOOR: u64 = 256 << 20;

impl Room {
    pub(super) fn new<R: BufRead>(source: &Source<'_, R>) -> Room {
        let bytes = source.len().saturating_mul(MOST_REPEATS).saturating_add(FLOOR);
        Room { vertices: MOST_TRIANGLES, triangles: MOST_TRIANGLES, repeats: bytes }
    }

    /// Adds the allowance for another file.
    pub(super) fn add_file(&mut self, len: u64) {
        self.repeats = self.repeats.saturating_add(len.saturating_mul(MOST_REPEATS));
    }

    /// The cost in bytes of sparse vectors, each of which replaces another.
    pub(super) fn replacing(vectors: usize) -> u64 {
        16 * vectors as u64
    }

    /// Takes memory for vertices, triangles, and a number of further bytes.
    pub(super) fn take(&mut self, vertices: usize, triangles: usize, more: u64) -> Result<(), String> {
        let bytes = 32 * vertices as u64 + 12 * triangles as u64 + more;
        match (
            self.vertices.checked_sub(vertices),
            self.triangles.checked_sub(triangles),
            self.repeats.checked_sub(bytes),
        ) {
            (Some(vertices), Some(triangles), Some(repeats)) => {
                *self = Room { vertices, triangles, repeats };
                Ok(())
            }
            _ => Err(format!(
                "with it, the file's nodes and copies repeat its meshes to more than {MOST_REPEATS} times its size \
                 and {} MiB; place them as entities of the scene",
                FLOOR >> 20
            )),
        }
    }
}
