//! The instructions of texture programs.

/// The next instruction of the last one.
pub(super) const END: u32 = 0x7fff_ffff;

/// The number of further numbers of an instruction, besides its colour.
pub(super) const NUMBERS: usize = 6;

/// The operation of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Op {
    /// Pushes its colour on the stack.
    Constant,
    /// Looks up a picture at uv.
    Image,
    /// Continues with one of two instructions by uv, with the uv within the check.
    Check,
    /// Mixes the lower two of three colours by the first channel of the top one.
    Mix,
    /// Multiplies two colours.
    Scale,
    /// Mixes two colours by noise at the point.
    Noise,
    /// Pushes uv on the stack.
    Save,
    /// Restores uv from below the top colour.
    Restore,
}

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instruction {
    pub(super) op: Op,
    /// The next instruction, or [`END`].
    pub(super) next: u32,
    /// A row of another table, or a count.
    pub(super) link: u32,
    /// Another instruction, or a count.
    pub(super) other: u32,
    /// Flags.
    pub(super) flags: u32,
    pub(super) colour: [f32; 3],
    pub(super) numbers: [f32; NUMBERS],
}

impl Instruction {
    /// An instruction without operands.
    pub(super) fn new(op: Op, next: u32) -> Instruction {
        Instruction { op, next, link: 0, other: 0, flags: 0, colour: [0.0; 3], numbers: [0.0; NUMBERS] }
    }
}
