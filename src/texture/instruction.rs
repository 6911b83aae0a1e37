//! The instructions of textures' programs.

/// The next instruction of one that is the last.
pub(super) const END: u32 = 0x7fff_ffff;

/// Numbers of an instruction beside its colour.
pub(super) const NUMBERS: usize = 6;

/// What an instruction does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Op {
    /// Puts its colour on the stack.
    Constant,
    /// Looks a picture up at uv.
    Image,
    /// Goes on with one of two instructions by uv, with the uv within the check.
    Check,
    /// Mixes the lower two of three colours by the first channel of the uppermost.
    Mix,
    /// Multiplies two colours.
    Scale,
    /// Mixes two colours by noise at the point.
    Noise,
    /// Puts uv on the stack.
    Save,
    /// Takes uv from below the uppermost colour.
    Restore,
}

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instruction {
    pub(super) op: Op,
    /// The instruction that follows, or [`END`].
    pub(super) next: u32,
    /// A row of another table, or a count.
    pub(super) link: u32,
    /// Another instruction, or a count.
    pub(super) other: u32,
    /// Bits.
    pub(super) flags: u32,
    pub(super) colour: [f32; 3],
    pub(super) numbers: [f32; NUMBERS],
}

impl Instruction {
    /// One that has no operands.
    pub(super) fn new(op: Op, next: u32) -> Instruction {
        Instruction { op, next, link: 0, other: 0, flags: 0, colour: [0.0; 3], numbers: [0.0; NUMBERS] }
    }
}
