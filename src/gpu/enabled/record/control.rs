//! Control flow and calls in the recording in progress, with their values as plain lists of numbers.
//!
//! The methods of `Float` are compiled for every structure and every closure that programs pass to them, which is many
//! hundred times. They call these functions, which are compiled once: in place, these were a large part of the
//! compiler's work on this crate.

use super::graph::{Block, ControlForm};
use super::kind::Kind;
use super::state::{Handle, Value, with};
use crate::math::lanes::{Function, Layout};

/// The numbers of a structure.
type Numbers<'a> = &'a [(Handle, Kind)];

/// Begins a function, unless it need not be recorded. Returns the numbers of its parameters.
#[inline(never)]
pub(super) fn enter(function: &'static Function, arguments: Layout) -> Option<Vec<Handle>> {
    with(|state| state.enter(function, arguments))
}

/// Ends a function with its result.
#[inline(never)]
pub(super) fn leave(layout: Layout, result: Numbers<'_>) {
    with(|state| state.leave(layout, result));
}

/// Records the call of a recorded function. Returns the numbers of its result.
#[inline(never)]
pub(super) fn called(
    function: &'static Function,
    layouts: (Layout, Layout),
    arguments: Numbers<'_>,
) -> Vec<Handle> {
    with(|state| state.called(function, layouts, arguments))
}

/// Records the call of a function written by hand. Returns the numbers of its result.
#[inline(never)]
pub(super) fn device(name: &str, layouts: (Layout, Layout), arguments: Numbers<'_>) -> Vec<Handle> {
    with(|state| state.device(name, layouts, arguments))
}

/// The value of a mask, if it is a constant.
#[inline(never)]
pub(super) fn constant(mask: Handle) -> Option<bool> {
    with(|state| state.constant_mask(mask))
}

/// The values of a structure, recorded in the current block.
#[inline(never)]
pub(super) fn values(layout: &Layout, numbers: Numbers<'_>) -> Vec<Value> {
    with(|state| state.values(layout, numbers))
}

/// A branch or a fork whose first block has begun.
pub(super) struct Begun {
    mask: Handle,
    layout: Layout,
    block: Block,
}

impl Begun {
    /// Begins the block in which the mask holds.
    #[inline(never)]
    pub(super) fn new(mask: Handle, layout: Layout) -> Begun {
        Begun { mask, layout, block: with(|state| state.open(mask, true)) }
    }

    /// Ends a branch with the result of its block. Returns the numbers of its own result.
    #[inline(never)]
    pub(super) fn end(self, result: Numbers<'_>, otherwise: Vec<Value>) -> Vec<Handle> {
        let Begun { mask, layout, block } = self;
        with(|state| {
            let result = state.close(&layout, result);
            let blocks = vec![block, state.empty(mask)];
            state.end_branch(ControlForm::Branch, mask, blocks, result, otherwise)
        })
    }

    /// Begins the second block of a fork with the result of the first one.
    #[inline(never)]
    pub(super) fn turn(&self, first: Numbers<'_>) -> (Vec<Value>, Block) {
        with(|state| (state.close(&self.layout, first), state.open(self.mask, false)))
    }

    /// Ends a fork with the result of its second block. Returns the numbers of its own result.
    #[inline(never)]
    pub(super) fn end_fork(self, turned: (Vec<Value>, Block), second: Numbers<'_>) -> Vec<Handle> {
        let (Begun { mask, layout, block }, (first, second_block)) = (self, turned);
        with(|state| {
            let second = state.close(&layout, second);
            state.end_branch(ControlForm::Fork, mask, vec![block, second_block], first, second)
        })
    }
}

/// A loop that has begun.
pub(super) struct Loop {
    layout: Layout,
    before: Vec<Value>,
    control: usize,
}

impl Loop {
    /// Begins a loop. Also returns the numbers of its state within.
    #[inline(never)]
    pub(super) fn new(live: Handle, layout: Layout, state: Numbers<'_>) -> (Loop, Vec<Handle>) {
        with(|recording| {
            let before = recording.values(&layout, state);
            let (control, within) = recording.begin_loop(live, &before);
            (Loop { layout, before, control }, within)
        })
    }

    /// Ends a loop, and returns the numbers of its final state.
    #[inline(never)]
    pub(super) fn end(self, next: Numbers<'_>, stays: Handle) -> Vec<Handle> {
        let Loop { layout, before, control } = self;
        with(|recording| recording.end_loop(control, &before, &layout, next, stays))
    }
}
