//! Programs for a device, recorded from the code that computes the same on lanes.
//!
//! [`RecordedFloat`] is a [`Float`](crate::math::Float) that computes nothing: operations on it are written down, and
//! become WGSL, one function for each [`function!`](crate::math::function).
//!
//! | file | what is in it |
//! |---|---|
//! | `number` | the numbers that are recorded, with all that the traits ask of them |
//! | `state` | the recording in progress: values, branches and loops |
//! | `state::functions` | functions and calls of the recording in progress |
//! | `graph` | one function: its operations, blocks and controls |
//! | `fold` | operations whose result is known |
//! | `kind` | the types of WGSL, and how values are made of them |
//! | `registry` | the numbers and the tables of the scene |
//! | `schedule` | what is needed, and where it is computed |
//! | `text`, `expression`, `operators`, `names` | WGSL |

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
    /// Structures that are declared whether or not a function uses them.
    declared: HashSet<usize>,
    borrowed: PhantomData<&'a ()>,
}

/// What is wrong with a program: each line tells one mistake.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.join("\n"))]
pub(crate) struct RecordingError(pub(crate) Vec<String>);

/// A function of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Signature {
    /// Its name in WGSL.
    pub(crate) name: String,
    /// The module that it stands in.
    pub(crate) module: &'static str,
    /// The names and the forms of its parameters, as Rust has them.
    pub(crate) parameters: Vec<(&'static str, Layout)>,
    /// The form of its result.
    pub(crate) result: Layout,
    /// Its WGSL.
    pub(crate) text: String,
}

/// A program that was recorded.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    structures: Vec<String>,
    functions: Vec<Signature>,
}

impl<'a> Recording<'a> {
    /// An empty program over some numbers and tables. WGSL that is written by hand declares the structures of these
    /// names, with the same fields.
    pub(crate) fn new(registry: Registry<'a>, by_hand: &[&str]) -> Self {
        let state = State::new(registry.sources, Structures::new(by_hand));
        Recording { state, declared: HashSet::new(), borrowed: PhantomData }
    }
    /// Compares every call of a function with the first, as functions of one name must be the same. That takes as much
    /// longer as functions are called more than once.
    pub(crate) fn checked(mut self) -> Self {
        self.state.checks = true;
        self
    }

    /// Records a function, and those that it calls. It is part of the program even if no other calls it.
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

    /// Declares the structure of a type, for code that is written by hand.
    pub(crate) fn structure<V: Value<RecordedFloat>>(&mut self) {
        if let Some(shape) = self.state.structures.shape(&V::layout(), "Structure") {
            self.state.structures.needs(shape.kind(), &mut self.declared);
        }
    }

    /// Records the functions that `body` calls, for code that is written by hand. What `body` makes of their results is not
    /// part of the program, and `function` only names the arguments.
    pub(crate) fn callees<A: Value<RecordedFloat>, R: Value<RecordedFloat>>(
        &mut self,
        function: &'static Function,
        body: impl FnOnce(A) -> R,
    ) {
        let state = std::mem::take(&mut self.state);
        (self.state, ()) = state::record_in(state, || number::callees(function, body));
    }

    /// The program. Fails if two functions or structures of one name differ, or a function uses a number of another one
    /// that is no argument.
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
    /// All of it in WGSL: structures, then functions.
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
