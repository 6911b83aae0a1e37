//! A heap of sixteen-byte words for all tables, in as many pages as the adapter's limits require.
//!
//! Adapters limit the size of a buffer binding, the least capable to 128 MiB. A larger heap is split into pages, each a
//! buffer of its own, and the WGSL selects a word's page. On nearly all adapters one page holds everything, and there
//! is no selection.

use super::device::Device;
use super::layout::{Field, structures};
use crate::gpu::GpuError;
use bytemuck::Pod;
use std::fmt::Write;
use std::ops::Range;

/// Bytes per word: the size of one hardware load.
pub(super) const WORD: usize = 16;

/// The binding of the first page.
pub(super) const FIRST_PAGE: u32 = 2;

/// The maximum number of pages. Each has its own case in the program.
const MOST_PAGES: u32 = 64;

/// The division of a heap into pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Paging {
    pub(super) pages: u32,
    /// Binary logarithm of the number of words per page. Unused with a single page.
    bits: u32,
}

impl Paging {
    /// A single page.
    pub(super) const ONE: Paging = Paging { pages: 1, bits: 0 };

    /// Divides a heap of `words` words for shaders with limits on a binding's bytes and on the number of buffers. Fails
    /// with the number of bytes that would fit.
    fn of(words: usize, max_binding: u64, most_pages: u32) -> Result<Paging, u64> {
        let (words, most_words) = (words as u64, max_binding / WORD as u64);
        if words <= most_words {
            return Ok(Paging::ONE);
        }
        let most_pages = u64::from(most_pages.min(MOST_PAGES));
        let bits = most_words.checked_ilog2().unwrap_or(0).min(31);
        // Words are indexed in 32 bits.
        let fits =
            if most_words == 0 { 0 } else { (most_pages << bits).min(u64::from(u32::MAX)).max(most_words) };
        if words > fits {
            return Err(fits * WORD as u64);
        }
        Ok(Paging { pages: words.div_ceil(1 << bits) as u32, bits })
    }

    /// Divides a heap for a device.
    pub(super) fn on(device: &Device, words: usize) -> Result<Paging, GpuError> {
        let info = device.description();
        Paging::of(words, info.max_binding, device.table_buffers()).map_err(|limit| GpuError::TooLarge {
            what: "the scene's tables",
            needed: (words * WORD) as u64,
            adapter: info.name.clone(),
            limit,
        })
    }

    /// The range of words on a page.
    fn range(&self, page: u32, words: usize) -> Range<usize> {
        if self.pages == 1 {
            return 0..words;
        }
        let first = (page as usize) << self.bits;
        first..words.min(first + (1 << self.bits))
    }

    /// The WGSL declarations of the pages, and of the function that reads a word.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for page in 0..self.pages {
            let binding = FIRST_PAGE + page;
            writeln!(text, "@group(0) @binding({binding}) var<storage, read> page_{page}: array<vec4u>;")
                .expect("a string takes all");
        }
        if self.pages == 1 {
            return text + "fn heap_word(at: u32) -> vec4u {\n    return page_0[at];\n}\n";
        }
        let (bits, mask) = (self.bits, (1_u32 << self.bits) - 1);
        write!(
            text,
            "fn heap_word(at: u32) -> vec4u {{\n    let place = at & {mask}u;\n    switch at >> {bits}u {{\n"
        )
        .expect("a string takes all");
        for page in 1..self.pages {
            writeln!(text, "        case {page}u: {{ return page_{page}[place]; }}")
                .expect("a string takes all");
        }
        text + "        default: { return page_0[place]; }\n    }\n}\n"
    }
}

/// A table, in the form in which it is written to the heap.
pub(super) struct Section<'a> {
    bytes: &'a [u8],
}

impl<'a> Section<'a> {
    pub(super) fn new<T: Pod>(rows: &'a [T]) -> Section<'a> {
        const { assert!(size_of::<T>().is_multiple_of(WORD)) };
        Section { bytes: bytemuck::cast_slice(rows) }
    }

    pub(super) fn words(&self) -> usize {
        self.bytes.len() / WORD
    }
}

/// The pages as buffers. Tables are written to them directly; the heap exists nowhere else.
pub(super) fn upload(device: &wgpu::Device, sections: &[Section<'_>], paging: Paging) -> Vec<wgpu::Buffer> {
    let words: usize = sections.iter().map(Section::words).sum();
    let page = |page| {
        let range = paging.range(page, words);
        // Buffers must not be empty.
        let bytes = (range.len() * WORD).max(WORD);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("page"),
            size: bytes as u64,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: true,
        });
        // Without memory there is no mapped range; the caller of the buffers' creation gets the error.
        if let Ok(mut view) = buffer.get_mapped_range_mut(..) {
            let (from, to) = (range.start * WORD, range.end * WORD);
            let mut start = 0;
            for section in sections {
                let end = start + section.bytes.len();
                let (first, last) = (from.max(start), to.min(end));
                if first < last {
                    view.slice(first - from..last - from)
                        .copy_from_slice(&section.bytes[first - start..last - start]);
                }
                start = end;
            }
        }
        buffer.unmap();
        buffer
    };
    (0..paging.pages).map(page).collect()
}

/// A field of a WGSL type in a row whose words are called `w0`, `w1` and so on: some components of a word.
pub(super) fn field(ty: &str, word: usize, numbers: Range<usize>) -> String {
    format!("bitcast<{ty}>(w{word}.{})", &"xyzw"[numbers])
}

/// A field in the host's layout.
fn read_field(host: &Field) -> String {
    let (word, first, count) = (host.offset / WORD, host.offset % WORD / 4, host.size / 4);
    field(host.wgsl_type(), word, first..first + count)
}

/// The WGSL of a function that reads a row of `words` words from the table that starts at the heap's word `scene.FROM`.
/// Fields are in the structure's order (see [`field`]).
pub(super) fn reader(
    name: &str,
    function: &str,
    from: &str,
    words: usize,
    fields: impl Iterator<Item = String>,
) -> String {
    let mut text =
        format!("fn {function}(row: u32) -> {name} {{\n    let at = scene.{from} + row * {words}u;\n");
    for word in 0..words {
        writeln!(text, "    let w{word} = heap_word(at + {word}u);").expect("a string takes all");
    }
    let fields: Vec<_> = fields.collect();
    writeln!(text, "    return {name}({});\n}}", fields.join(", ")).expect("a string takes all");
    text
}

/// The WGSL names of the tables that the host also stores by rows: `vertex_at(row)` reads a row of the table that
/// starts at the heap's word `scene.vertices_from`.
const TABLES: [(&str, &str, &str); 6] = [
    ("LightNode", "light_node_at", "light_nodes_from"),
    ("TreeNode", "tree_node_at", "tree_nodes_from"),
    ("Triangle", "triangle_at", "triangles_from"),
    // Instances are stored among triangles.
    ("Instance", "instance_at", "triangles_from"),
    ("MeshVertex", "vertex_at", "vertices_from"),
    ("PlaceRow", "place_row_at", "places_from"),
];

/// WGSL functions that read rows of these tables, from the host's layouts.
pub(super) fn readers() -> String {
    let structures = structures();
    let one = |(name, function, from): (&str, &str, &str)| {
        let Some(structure) = structures.iter().find(|structure| structure.name == name) else {
            unreachable!("there is no structure {name}");
        };
        reader(name, function, from, structure.size / WORD, structure.named().map(read_field))
    };
    TABLES.into_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heap_is_divided_only_if_necessary() {
        let of =
            |words, bytes, pages| Paging::of(words, bytes, pages).map(|paging| (paging.pages, paging.bits));
        assert_eq!(of(0, 1 << 27, 5), Ok((1, 0)));
        assert_eq!(of(1 << 23, 1 << 27, 5), Ok((1, 0)));
        assert_eq!(of((1 << 23) + 1, 1 << 27, 5), Ok((2, 23)));
        // A limit that is not a power of two is rounded down to one, unless one page holds everything.
        assert_eq!(of(100, 1600, 5), Ok((1, 0)));
        assert_eq!(of(101, 1600, 5), Ok((2, 6)));
        assert_eq!(of(320, 1600, 5), Ok((5, 6)));
        assert_eq!(of(321, 1600, 5), Err(320 * 16));
        assert_eq!(of(101, 1600, 1), Err(1600));
        assert_eq!(of(1, 15, 5), Err(0));
    }

    #[test]
    fn pages_hold_every_word_once() {
        let paging = Paging { pages: 3, bits: 2 };
        let ranges: Vec<_> = (0..3).map(|page| paging.range(page, 11)).collect();
        assert_eq!(ranges, [0..4, 4..8, 8..11]);
        assert_eq!(Paging::ONE.range(0, 11), 0..11);
    }
}
