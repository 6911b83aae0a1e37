//! The recording in progress, one per thread, which operators access implicitly.

mod functions;

use super::graph::{Binary, Block, ControlForm, Graph, Node, Op};
use super::kind::{Kind, Structures, ValueType};
use super::registry::{Sources, Table};
use super::text::Written;
use crate::math::lanes::{Function, Layout};
use std::cell::RefCell;
use std::collections::HashMap;

/// A value of the function that is being recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Handle {
    /// Identifies the recording of a function to which it belongs.
    function: u32,
    node: u32,
}

/// A function that is being recorded.
#[derive(Debug)]
struct Frame {
    number: u32,
    function: &'static Function,
    parameters: Vec<(String, ValueType)>,
    layouts: Vec<Layout>,
    graph: Graph,
    /// Whether the function itself is not part of the program, but its callees are.
    stands_for_other: bool,
}

/// A recorded function.
#[derive(Clone, Debug)]
pub(super) struct Done {
    pub(super) function: &'static Function,
    pub(super) name: String,
    pub(super) parameters: Vec<(&'static str, Layout)>,
    pub(super) result: Layout,
    pub(super) written: Written,
    is_root: bool,
    parameter_names: Vec<String>,
}

/// See the module's documentation.
#[derive(Debug, Default)]
pub(super) struct State {
    pub(super) sources: Sources,
    pub(super) structures: Structures,
    /// Whether further calls of a function are compared with the first.
    pub(super) checks: bool,
    pub(super) errors: Vec<String>,
    pub(super) done: Vec<Done>,
    places: HashMap<&'static str, usize>,
    stack: Vec<Frame>,
    frames: u32,
}

thread_local! {
    static STATE: RefCell<Option<State>> = const { RefCell::new(None) };
}

/// Passes the recording in progress to `f`.
///
/// # Panics
/// Panics if there is none on this thread.
pub(super) fn with<R>(f: impl FnOnce(&mut State) -> R) -> R {
    STATE.with_borrow_mut(|state| {
        f(state.as_mut().expect("numbers of programs exist only while one is recorded"))
    })
}

/// Runs `f` with a recording in progress, and returns the recording. If `f` panics, there is none any more.
pub(super) fn record_in<R>(state: State, f: impl FnOnce() -> R) -> (State, R) {
    struct Ends;
    impl Drop for Ends {
        fn drop(&mut self) {
            STATE.set(None);
        }
    }
    let before = STATE.replace(Some(state));
    assert!(before.is_none(), "a program is being recorded on this thread");
    let ends = Ends;
    let result = f();
    let state = STATE.take().expect("the recording was installed above");
    drop(ends);
    (state, result)
}

impl State {
    pub(super) fn new(sources: Sources, structures: Structures) -> State {
        State { sources, structures, ..State::default() }
    }
    fn frame(&mut self) -> &mut Frame {
        self.stack.last_mut().expect("numbers of programs exist only while a function is recorded")
    }
    pub(super) fn graph(&mut self) -> &mut Graph {
        &mut self.frame().graph
    }
    /// The functions that are being recorded, for messages.
    fn trace(&self) -> String {
        let names: Vec<_> = self.stack.iter().map(|frame| frame.function.name).collect();
        if names.is_empty() { "no function".to_owned() } else { names.join(" > ") }
    }

    pub(super) fn handle(&mut self, node: Node) -> Handle {
        Handle { function: self.frame().number, node: node as u32 }
    }
    fn handles(&mut self, nodes: &[Node]) -> Vec<Handle> {
        nodes.iter().map(|&node| self.handle(node)).collect()
    }

    /// The node of a value in the current block: a constant if the block is where a mask is known.
    pub(super) fn node(&mut self, handle: Handle, kind: Kind) -> Node {
        let node = self.node_of(handle, kind);
        match (kind, self.graph().assumed(node)) {
            (Kind::Mask, Some(holds)) => self.graph().mask(holds),
            _ => node,
        }
    }

    /// The node of a value in the current function. A constant or a number of the scene may come from another function.
    fn node_of(&mut self, handle: Handle, kind: Kind) -> Node {
        let node = handle.node as Node;
        let place = self.stack.iter().rposition(|frame| frame.number == handle.function);
        let is_own = place.is_some_and(|place| place + 1 == self.stack.len());
        if is_own && self.stack[place.unwrap_or(0)].graph.is_visible(node) {
            return node;
        }
        if !is_own && let Some(copied) = place.and_then(|place| self.copied(place, node)) {
            return copied;
        }
        let error = if is_own {
            format!("{}: a number leaves a branch or a loop other than in its result", self.trace())
        } else {
            format!("{}: a number of another function is used that is no argument", self.trace())
        };
        self.errors.push(error);
        let graph = self.graph();
        match kind {
            Kind::Mask => graph.mask(false),
            Kind::Uint => graph.uint(0),
            _ => graph.float(0.0),
        }
    }
    fn nodes(&mut self, handles: &[(Handle, Kind)]) -> Vec<Node> {
        handles.iter().map(|&(handle, kind)| self.node(handle, kind)).collect()
    }

    /// A node of an outer function, copied to the current one if it depends on no number of the outer function.
    fn copied(&mut self, place: usize, node: Node) -> Option<Node> {
        let from = &self.stack[place].graph;
        let (op, kind) = (from.op(node).clone(), from.kind(node));
        let op = match op {
            Op::Float(_) | Op::Uint(_) | Op::Mask(_) | Op::Given(_) => op,
            Op::Extract(of, member) => Op::Extract(self.copied(place, of)?, member),
            Op::Unary(op, of) => Op::Unary(op, self.copied(place, of)?),
            Op::Binary(op, [a, b]) => Op::Binary(op, [self.copied(place, a)?, self.copied(place, b)?]),
            Op::Compose(members) => {
                let members = members.into_iter().map(|member| self.copied(place, member));
                Op::Compose(members.collect::<Option<_>>()?)
            }
            _ => return None,
        };
        Some(self.graph().record(op, kind))
    }

    /// Records one operation on values of the current function.
    pub(super) fn apply<const N: usize>(
        &mut self,
        operands: [(Handle, Kind); N],
        f: impl FnOnce(&mut Graph, [Node; N]) -> Node,
    ) -> Handle {
        let nodes = operands.map(|(handle, kind)| self.node(handle, kind));
        let node = f(self.graph(), nodes);
        self.handle(node)
    }

    /// A vector of three floats.
    pub(super) fn vector(&mut self, [x, y, z]: [Handle; 3]) -> Node {
        let members = [x, y, z].map(|handle| self.node(handle, Kind::Float));
        self.graph().compose(Kind::Floats(3), members.to_vec())
    }
    /// The components of a vector.
    pub(super) fn coordinates(&mut self, vector: Node) -> [Handle; 3] {
        [0, 1, 2].map(|i| {
            let node = self.graph().extract(vector, i, Kind::Float);
            self.handle(node)
        })
    }

    /// A number of the scene.
    pub(super) fn given<T>(&mut self, number: &T, kind: Kind) -> Handle {
        let Some(source) = self.sources.numbers.get(&std::ptr::from_ref(number).addr()).cloned() else {
            panic!("a number of the scene that no one registered is used in {}", self.trace());
        };
        let graph = self.graph();
        let whole = graph.record(Op::Given(source.text), source.kind);
        let node = match source.member {
            Some(member) => graph.extract(whole, member as usize, kind),
            None => whole,
        };
        debug_assert_eq!(self.graph().kind(node), kind);
        self.handle(node)
    }

    /// A number of a table of the scene.
    pub(super) fn gather<T>(&mut self, table: &[T], index: Handle, kind: Kind) -> Handle {
        if table.is_empty() {
            // Code for rows that the scene does not have: no path reaches it.
            let graph = self.graph();
            let zero = if kind == Kind::Float { graph.float(0.0) } else { graph.uint(0) };
            return self.handle(zero);
        }
        let Some(source) = self.sources.tables.get(&table.as_ptr().addr()).cloned() else {
            panic!("a table of the scene that no one registered is read in {}", self.trace());
        };
        let index = self.node(index, Kind::Uint);
        let graph = self.graph();
        graph.suggest(index, "index");
        let Table { reader, field, member, .. } = source;
        let read = if field.is_some() { Kind::Row } else { source.kind };
        let mut node = graph.record(Op::Call(reader.clone(), vec![index]), read);
        if let Some(field) = field {
            graph.suggest(node, reader.trim_end_matches("_at"));
            node = graph.record(Op::Field(node, field), source.kind);
        }
        if let Some(member) = member {
            node = graph.extract(node, member as usize, kind);
        }
        debug_assert_eq!(self.graph().kind(node), kind);
        self.handle(node)
    }

    pub(super) fn constant_mask(&mut self, mask: Handle) -> Option<bool> {
        let node = self.node(mask, Kind::Mask);
        self.graph().mask_of(node)
    }

    /// Begins a block in which a mask is true or false.
    pub(super) fn open(&mut self, mask: Handle, holds: bool) -> Block {
        let mask = self.node(mask, Kind::Mask);
        let block = self.graph().open(false);
        self.graph().assume(mask, holds);
        block
    }
    /// An empty block of that kind.
    pub(super) fn empty(&mut self, mask: Handle) -> Block {
        let block = self.open(mask, false);
        self.graph().close();
        block
    }

    /// A value from the next numbers. A value that becomes a field is named after it.
    fn implode(&mut self, value_type: &ValueType, numbers: &mut impl Iterator<Item = Node>) -> Node {
        let (kind, members) = match value_type {
            ValueType::Number(_) => return numbers.next().expect("as many numbers as the shape has"),
            ValueType::Group(kind, members) => (*kind, members),
        };
        let members: Vec<_> = members.iter().map(|member| self.implode(member, numbers)).collect();
        if let Kind::Structure(structure) = kind {
            for (i, &member) in members.iter().enumerate() {
                let name = self.structures.get(structure).fields[i].0.clone();
                self.graph().suggest(member, &name);
            }
        }
        self.graph().compose(kind, members)
    }

    /// The values of a structure, recorded in the current block, each with its numbers.
    pub(super) fn values(&mut self, layout: &Layout, numbers: &[(Handle, Kind)]) -> Vec<Value> {
        // Not the constants of masks known in the block, because results of two blocks are compared.
        let numbers: Vec<_> = numbers.iter().map(|&(handle, kind)| self.node_of(handle, kind)).collect();
        let shapes = self.structures.members(layout);
        let mut numbers = numbers.into_iter();
        let value = |value_type: ValueType| {
            let numbers: Vec<_> = numbers.by_ref().take(value_type.len()).collect();
            let node = self.implode(&value_type, &mut numbers.iter().copied());
            Value { value_type, numbers, node }
        };
        shapes.into_iter().map(value).collect()
    }
    /// The values of a block, which ends here.
    pub(super) fn close(&mut self, layout: &Layout, numbers: &[(Handle, Kind)]) -> Vec<Value> {
        let values = self.values(layout, numbers);
        self.graph().close();
        values
    }

    /// Records a branch or fork, and returns the numbers of its result.
    pub(super) fn end_branch(
        &mut self,
        form: ControlForm,
        mask: Handle,
        blocks: Vec<Block>,
        first: Vec<Value>,
        second: Vec<Value>,
    ) -> Vec<Handle> {
        let condition = self.node(mask, Kind::Mask);
        let graph = self.graph();
        let items = first.iter().zip(&second).map(|(a, b)| (a.value_type.clone(), a.node, b.node)).collect();
        let results = graph.end_branch(form, condition, blocks, items);
        let mut numbers = Vec::new();
        for ((a, b), result) in first.iter().zip(&second).zip(results) {
            let mut own = Vec::new();
            graph.explode(&a.value_type, result, &mut own);
            // Values that are equal in both blocks need no result.
            let same = a.numbers.iter().zip(&b.numbers).map(|(&a, &b)| (a == b).then_some(a));
            graph.note_equal(&a.value_type, result, &mut same.clone());
            numbers.extend(same.zip(own).map(|(same, own)| same.unwrap_or(own)));
        }
        self.handles(&numbers)
    }

    /// Begins a loop, and returns the numbers of its state within.
    pub(super) fn begin_loop(&mut self, live: Handle, state: &[Value]) -> (usize, Vec<Handle>) {
        let condition = self.node(live, Kind::Mask);
        let graph = self.graph();
        let items = state.iter().map(|value| (value.value_type.clone(), value.node)).collect();
        let (control, nodes) = graph.begin_loop(condition, items);
        let mut numbers = Vec::new();
        state
            .iter()
            .zip(nodes)
            .for_each(|(value, node)| graph.explode(&value.value_type, node, &mut numbers));
        (control, self.handles(&numbers))
    }
    /// Ends a loop, and returns the numbers of its final state.
    pub(super) fn end_loop(
        &mut self,
        control: usize,
        state: &[Value],
        layout: &Layout,
        next: &[(Handle, Kind)],
        stays: Handle,
    ) -> Vec<Handle> {
        let next = self.values(layout, next);
        let stays = self.node(stays, Kind::Mask);
        let graph = self.graph();
        let nodes: Vec<_> = next.iter().map(|value| value.node).collect();
        let results = graph.end_loop(control, &nodes, stays);
        let mut numbers = Vec::new();
        for (i, ((before, next), result)) in state.iter().zip(&next).zip(results).enumerate() {
            if *graph.op(next.node) == Op::State(control, i) {
                numbers.extend(&before.numbers);
            } else {
                graph.explode(&before.value_type, result, &mut numbers);
            }
        }
        self.handles(&numbers)
    }
}

/// A value that a block returns.
#[derive(Debug)]
pub(super) struct Value {
    value_type: ValueType,
    numbers: Vec<Node>,
    node: Node,
}

/// Arithmetic, including that on vectors of three floats.
pub(super) fn on_vectors(op: Binary, a: [Handle; 3], b: [Handle; 3]) -> [Handle; 3] {
    with(|state| {
        let (a, b) = (state.vector(a), state.vector(b));
        let node = state.graph().arithmetic(op, a, b);
        state.coordinates(node)
    })
}
