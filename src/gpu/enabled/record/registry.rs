//! Inputs of programs besides their arguments: the numbers and tables of a scene, identified by their addresses in
//! memory.

use super::kind::Kind;
use std::collections::HashMap;
use std::fmt::Debug;
use std::marker::PhantomData;
use std::rc::Rc;

/// The location of a number of the scene in WGSL.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Number {
    /// The expression.
    pub(super) text: Rc<str>,
    pub(super) kind: Kind,
    /// Its component, if the expression is a vector.
    pub(super) member: Option<u32>,
}

/// The location of a table in WGSL: a function of the index reads it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Table {
    /// The function.
    pub(super) reader: Rc<str>,
    /// The field of the function's result, if it is not the entire result.
    pub(super) field: Option<Rc<str>>,
    /// The kind of the field, or of the result.
    pub(super) kind: Kind,
    /// Its component, if the field is a vector.
    pub(super) member: Option<u32>,
}

/// The numbers and tables that a program may read. They are borrowed, so that no address is reused during the
/// registry's lifetime.
#[derive(Debug, Default)]
pub(crate) struct Registry<'a> {
    pub(super) sources: Sources,
    borrowed: PhantomData<&'a ()>,
}

/// See [`Registry`].
#[derive(Debug, Default)]
pub(super) struct Sources {
    pub(super) numbers: HashMap<usize, Number>,
    pub(super) tables: HashMap<usize, Table>,
}

/// Registers an address.
///
/// # Panics
/// Panics if it is registered as something else.
fn insert<T: Debug + PartialEq>(map: &mut HashMap<usize, T>, address: usize, source: T) {
    if let Some(other) = map.get(&address) {
        assert!(*other == source, "the same memory is registered as {other:?} and as {source:?}");
    }
    map.insert(address, source);
}

impl<'a> Registry<'a> {
    /// An empty registry.
    pub(crate) fn new() -> Self {
        Registry::default()
    }

    fn insert_number<T>(&mut self, at: &'a T, text: &str, kind: Kind, member: Option<u32>) {
        let number = Number { text: text.into(), kind, member };
        insert(&mut self.sources.numbers, std::ptr::from_ref(at).addr(), number);
    }
    // An empty table has no memory of its own, and is never read.
    fn insert_table<T>(
        &mut self,
        table: &'a [T],
        reader: &str,
        field: Option<&str>,
        kind: Kind,
        member: Option<u32>,
    ) {
        if !table.is_empty() {
            let source = Table { reader: reader.into(), field: field.map(Rc::from), kind, member };
            insert(&mut self.sources.tables, table.as_ptr().addr(), source);
        }
    }

    /// A float, written `text` in WGSL.
    ///
    /// # Panics
    /// Panics, as all functions here do, if the same memory is registered as something else.
    pub(crate) fn number(&mut self, number: &'a f32, text: &str) -> &mut Self {
        self.insert_number(number, text, Kind::Float, None);
        self
    }
    /// An integer.
    pub(crate) fn word(&mut self, word: &'a u32, text: &str) -> &mut Self {
        self.insert_number(word, text, Kind::Uint, None);
        self
    }
    /// Two to four floats, written `text` in WGSL: a vector.
    pub(crate) fn vector<const N: usize>(&mut self, vector: &'a [f32; N], text: &str) -> &mut Self {
        const { assert!(2 <= N && N <= 4, "WGSL's vectors have two to four numbers") };
        for (member, number) in (0..).zip(vector) {
            self.insert_number(number, text, Kind::Floats(N as u32), Some(member));
        }
        self
    }
    /// A column of floats: `reader(index).field` in WGSL.
    pub(crate) fn column(&mut self, column: &'a [f32], reader: &str, field: &str) -> &mut Self {
        self.insert_table(column, reader, Some(field), Kind::Float, None);
        self
    }
    /// A column of integers.
    pub(crate) fn words(&mut self, column: &'a [u32], reader: &str, field: &str) -> &mut Self {
        self.insert_table(column, reader, Some(field), Kind::Uint, None);
        self
    }
    /// Two to four columns of floats, which are one vector field in WGSL.
    pub(crate) fn columns<const N: usize>(
        &mut self,
        columns: &'a [Vec<f32>; N],
        reader: &str,
        field: &str,
    ) -> &mut Self {
        const { assert!(2 <= N && N <= 4, "WGSL's vectors have two to four numbers") };
        for (member, column) in (0..).zip(columns) {
            self.insert_table(column, reader, Some(field), Kind::Floats(N as u32), Some(member));
        }
        self
    }
    /// A table of floats: `reader(index)` in WGSL.
    pub(crate) fn array(&mut self, array: &'a [f32], reader: &str) -> &mut Self {
        self.insert_table(array, reader, None, Kind::Float, None);
        self
    }
}
