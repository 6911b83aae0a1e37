// The buffers. `layout.rs` declares their structures.

// Sums of samples that count in all pixels around them.
struct Splats {
    // How many samples were too bright for that.
    bright: atomic<u32>,
    // Of all pixels of the band the low words of red, then those of green, of blue and of the weight, so that neighbours
    // add side by side; then the high words.
    words: array<atomic<u32>>,
}

// `scene` and `dispatch` are declared by `variant.rs`.
// Of every invocation as many as may wait, those at one height side by side.
@group(0) @binding(1) var<storage, read_write> branches: array<WaitingBranch>;
// The tables follow, in one heap: see `heap.rs`.
@group(1) @binding(1) var<storage, read_write> sums: array<SlotSums>;
@group(1) @binding(2) var<storage, read_write> samples: array<SampleWords>;
@group(1) @binding(3) var<storage, read_write> splats: Splats;
