// The buffers. `layout.rs` declares their structures.

// Sums of samples that count in all pixels within the filter's radius.
struct Splats {
    // The number of samples that were too bright for these sums.
    bright: atomic<u32>,
    // The low words of red of all pixels of the band, then those of green, of blue and of the weight, then the high
    // words in the same order. Neighbouring invocations thus add to adjacent words.
    words: array<atomic<u32>>,
}

// `scene` and `dispatch` are declared by `variant.rs`.
// MOST_BRANCHES of each invocation; those at the same height of the stack are adjacent.
@group(0) @binding(1) var<storage, read_write> branches: array<WaitingBranch>;
// The tables follow, in one heap: see `heap.rs`.
@group(1) @binding(1) var<storage, read_write> sums: array<SlotSums>;
@group(1) @binding(2) var<storage, read_write> samples: array<SampleWords>;
@group(1) @binding(3) var<storage, read_write> splats: Splats;
