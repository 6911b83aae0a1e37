//! Programs for a device, recorded from the code that lanes run.
//!
//! [`RecordedFloat`] is a [`Float`](crate::math::Float) that computes nothing: it records operations, which become WGSL
//! with one function for each [`function!`](crate::math::function).
//!
//! | file | contents |
//! |---|---|
//! | `number` | recorded numbers, and their implementation of the number traits |
//! | `control` | branches, loops and calls as they are recorded, for all structures |
//! | `state` | the recording in progress: values, branches and loops |
//! | `state::functions` | functions and calls of the recording in progress |
//! | `graph` | one function: its operations, blocks and controls |
//! | `fold` | constant folding |
//! | `kind` | the types of WGSL, and their composition into values |
//! | `registry` | the numbers and the tables of the scene |
//! | `schedule` | which operations are needed, and in which block |
//! | `text`, `expression`, `operators`, `names` | WGSL |

mod control;
mod expression;
mod fold;
mod graph;
mod kind;
mod names;
mod number;
mod operators;
mod registry;
mod schedule;
mod state;
#[cfg(test)]
mod tests;
mod text;

pub(crate) use number::{RecordedFloat, RecordedMask, RecordedUint};
pub(crate) use registry::Registry;

use crate::math::lanes::{Function, Layout, Value};
use kind::Structures;
use state::State;
use std::collections::HashSet;
use std::marker::PhantomData;

/// A program that is being recorded.
#[derive(Debug)]
pub(crate) struct Recording<'a> {
    state: State,
    /// Structures that are declared even if no function uses them.
    declared: HashSet<usize>,
    borrowed: PhantomData<&'a ()>,
}

/// The mistakes in a program, one per line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.join("\n"))]
pub(crate) struct RecordingError(pub(crate) Vec<String>);

/// A function of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Signature {
    /// Its name in WGSL.
    pub(crate) name: String,
    /// Its module in Rust.
    pub(crate) module: &'static str,
    /// The Rust names and the layouts of its parameters.
    pub(crate) parameters: Vec<(&'static str, Layout)>,
    /// The layout of its result.
    pub(crate) result: Layout,
    /// Its WGSL.
    pub(crate) text: String,
}

/// A recorded program.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    structures: Vec<String>,
    functions: Vec<Signature>,
}

impl<'a> Recording<'a> {
    /// An empty program over some numbers and tables. Hand-written WGSL declares the structures with these names, with
    /// the same fields.
    pub(crate) fn new(registry: Registry<'a>, by_hand: &[&str]) -> Self {
        let state = State::new(registry.sources, Structures::new(by_hand));
        Recording { state, declared: HashSet::new(), borrowed: PhantomData }
    }
    /// Compares every call of a function with the first, as functions with the same name must be identical. The
    /// recording time grows with the number of calls.
    pub(crate) fn checked(mut self) -> Self {
        self.state.checks = true;
        self
    }

    /// Records a function and those that it calls. It becomes part of the program even if no other function calls it.
    ///
    /// # Panics
    /// Panics if a number or a table is read that is not registered, or a function calls itself.
    pub(crate) fn function<A: Value<RecordedFloat>, R: Value<RecordedFloat>>(
        &mut self,
        function: &'static Function,
        body: impl FnOnce(A) -> R,
    ) {
        let state = std::mem::take(&mut self.state);
        (self.state, ()) = state::record_in(state, || number::root(function, body));
    }

    /// Declares the structure of a type, for hand-written code.
    pub(crate) fn structure<V: Value<RecordedFloat>>(&mut self) {
        if let Some(value_type) = self.state.structures.value_type(&V::layout(), "Structure") {
            self.state.structures.needs(value_type.kind(), &mut self.declared);
        }
    }

    /// Records the functions that `body` calls, for hand-written code. The rest of `body` is not part of the program;
    /// `function` only names the arguments.
    pub(crate) fn callees<A: Value<RecordedFloat>, R: Value<RecordedFloat>>(
        &mut self,
        function: &'static Function,
        body: impl FnOnce(A) -> R,
    ) {
        let state = std::mem::take(&mut self.state);
        (self.state, ()) = state::record_in(state, || number::callees(function, body));
    }

    /// Finishes the program. Fails if two functions or structures with the same name differ, or if a function uses a
    /// number of another one that is no argument.
    pub(crate) fn finish(self) -> Result<Program, RecordingError> {
        let structures = &self.state.structures;
        let mut errors = self.state.errors.clone();
        errors.extend(structures.errors.iter().cloned());
        if !errors.is_empty() {
            return Err(RecordingError(errors));
        }
        let done = self.state.wanted();
        let used = done.iter().flat_map(|done| &done.written.structures);
        let used: HashSet<_> = used.chain(&self.declared).copied().collect();
        let mut used: Vec<_> = used.into_iter().collect();
        used.sort_unstable();
        let declared = used.into_iter().filter(|&structure| !structures.get(structure).by_hand);
        let signature = |done: &&state::Done| Signature {
            name: done.name.clone(),
            module: done.function.module,
            parameters: done.parameters.clone(),
            result: done.result.clone(),
            text: done.written.text.clone(),
        };
        Ok(Program {
            structures: declared.map(|structure| structures.declaration(structure)).collect(),
            functions: done.iter().map(signature).collect(),
        })
    }
}

impl Program {
    /// The program in WGSL: structures, then functions.
    pub(crate) fn text(&self) -> String {
        let functions = self.functions.iter().map(|function| &function.text);
        self.structures.iter().chain(functions).map(String::as_str).collect::<Vec<_>>().join("\n")
    }
    /// The functions, callees before their callers.
    #[cfg(test)]
    pub(crate) fn functions(&self) -> &[Signature] {
        &self.functions
    }
}
