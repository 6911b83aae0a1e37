//! A function that is being recorded: operations in blocks, nested as in WGSL.

use super::kind::{Kind, ValueType};
use std::collections::HashMap;
use std::rc::Rc;

/// An operation, by its index in its function.
pub(super) type Node = usize;
/// A block, by its index.
pub(super) type Block = usize;

/// An operation on one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Unary {
    Negate,
    Not,
}

/// An operation on two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    And,
    Or,
    Xor,
    ShiftLeft,
    ShiftRight,
    Equal,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

/// The operation that computes a value. Operations have no side effects.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Op {
    /// A float, by its bits.
    Float(u32),
    /// An integer.
    Uint(u32),
    /// A boolean.
    Mask(bool),
    /// A parameter of the function.
    Parameter(usize),
    /// A WGSL expression with the same value everywhere.
    Given(Rc<str>),
    /// A named part of the result of a function.
    Field(Node, Rc<str>),
    /// An operation on one value.
    Unary(Unary, Node),
    /// An operation on two values.
    Binary(Binary, [Node; 2]),
    /// A call of a WGSL built-in, of a hand-written function, or of a recorded one.
    Call(Rc<str>, Vec<Node>),
    /// A vector or structure, from its members.
    Compose(Vec<Node>),
    /// A member of a vector or structure.
    Extract(Node, usize),
    /// A branch or a loop; its values are its results.
    Control(usize),
    /// An item of a control: after a branch, or after a loop.
    Result(usize, usize),
    /// An item of a loop's state, within the loop.
    State(usize, usize),
}

impl Op {
    /// The operands; those of controls are in [`Control`].
    pub(super) fn operands(&self) -> &[Node] {
        match self {
            Op::Field(of, _) | Op::Unary(_, of) | Op::Extract(of, _) => std::slice::from_ref(of),
            Op::Binary(_, operands) => operands,
            Op::Call(_, operands) | Op::Compose(operands) => operands,
            _ => &[],
        }
    }
}

/// An operation with its attributes.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) op: Op,
    pub(super) kind: Kind,
    /// The block in which it was recorded.
    pub(super) block: Block,
    /// A suggested name for its value.
    pub(super) hint: Option<Rc<str>>,
}

/// A block of statements.
#[derive(Debug, Default)]
pub(super) struct Scope {
    /// The enclosing block.
    pub(super) parent: Option<Block>,
    /// Whether it is the body of a loop.
    pub(super) is_loop: bool,
    closed: bool,
    known: HashMap<(Op, Kind), Node>,
    /// Masks that are known to be true or false in the block.
    assumed: HashMap<Node, bool>,
}

/// The WGSL form of a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ControlForm {
    /// `var r = second; if condition { r = first; }`
    Branch,
    /// `if condition { r = first; } else { r = second; }`
    Fork,
    /// `var r = first; while condition { r = second; }`
    Loop,
}

/// One of the results of a control.
#[derive(Debug)]
pub(super) struct Item {
    pub(super) value_type: ValueType,
    /// The result of the first block; for a loop, the initial value.
    pub(super) first: Node,
    /// The result of the second block; for a loop, the value after an iteration.
    pub(super) second: Node,
    /// Its [`Op::Result`] or [`Op::State`] nodes, whose names it takes.
    pub(super) nodes: Vec<Node>,
}

/// A branch or a loop.
#[derive(Debug)]
pub(super) struct Control {
    pub(super) form: ControlForm,
    /// Its [`Op::Control`].
    pub(super) node: Node,
    pub(super) condition: Node,
    /// Whether a loop continues after an iteration.
    pub(super) stays: Option<Node>,
    pub(super) blocks: Vec<Block>,
    pub(super) items: Vec<Item>,
}

/// A function that is being recorded.
#[derive(Debug)]
pub(super) struct Graph {
    pub(super) nodes: Vec<Recorded>,
    pub(super) scopes: Vec<Scope>,
    pub(super) controls: Vec<Control>,
    /// Members of results that equal values outside.
    equal: HashMap<Node, Node>,
    current: Block,
}

impl Graph {
    pub(super) fn new() -> Graph {
        Graph {
            nodes: Vec::new(),
            scopes: vec![Scope::default()],
            controls: Vec::new(),
            equal: HashMap::new(),
            current: 0,
        }
    }

    pub(super) fn op(&self, node: Node) -> &Op {
        &self.nodes[node].op
    }
    pub(super) fn kind(&self, node: Node) -> Kind {
        self.nodes[node].kind
    }
    /// Names a value that has no name yet.
    pub(super) fn suggest(&mut self, node: Node, name: &str) {
        let recorded = &mut self.nodes[node];
        if !matches!(recorded.op, Op::Float(_) | Op::Uint(_) | Op::Mask(_) | Op::Parameter(_) | Op::Given(_))
        {
            recorded.hint.get_or_insert_with(|| name.into());
        }
    }
    /// Whether a value can be used in the current block.
    pub(super) fn is_visible(&self, node: Node) -> bool {
        !self.scopes[self.nodes[node].block].closed
    }

    fn blocks_from(&self, block: Block) -> impl Iterator<Item = Block> {
        std::iter::successors(Some(block), |&block| self.scopes[block].parent)
    }
    fn is_around(&self, outer: Block, inner: Block) -> bool {
        self.blocks_from(inner).any(|block| block == outer)
    }

    /// The innermost of the blocks in which some values were recorded.
    fn block_of(&self, operands: &[Node]) -> Block {
        operands
            .iter()
            .map(|&node| self.nodes[node].block)
            .fold(0, |innermost, block| if self.is_around(innermost, block) { block } else { innermost })
    }

    /// Records an operation, unless an enclosing block has already recorded it.
    pub(super) fn record(&mut self, op: Op, kind: Kind) -> Node {
        // Free operations are recorded in the outermost possible block, so that sibling blocks share them.
        let block = match &op {
            Op::Float(_) | Op::Uint(_) | Op::Mask(_) | Op::Given(_) | Op::Parameter(_) => 0,
            Op::Field(of, _) | Op::Extract(of, _) => self.nodes[*of].block,
            Op::Compose(members) => self.block_of(members),
            _ => self.current,
        };
        let key = (op, kind);
        let known = self.blocks_from(block).find_map(|block| self.scopes[block].known.get(&key));
        if let Some(&node) = known {
            return node;
        }
        let node = self.push(key.0.clone(), kind, block);
        self.scopes[block].known.insert(key, node);
        node
    }

    fn push(&mut self, op: Op, kind: Kind, block: Block) -> Node {
        self.nodes.push(Recorded { op, kind, block, hint: None });
        self.nodes.len() - 1
    }

    /// A member of a vector or structure.
    pub(super) fn extract(&mut self, of: Node, member: usize, kind: Kind) -> Node {
        if let Op::Compose(members) = self.op(of) {
            return members[member];
        }
        self.record(Op::Extract(of, member), kind)
    }

    /// A vector or structure from its members; if they are all the members of one value of this kind, that value.
    pub(super) fn compose(&mut self, kind: Kind, members: Vec<Node>) -> Node {
        let is_member = |whole: Node, i: usize, member: Node| {
            let own = (Op::Extract(whole, i), self.kind(member));
            let own = self.scopes[self.nodes[whole].block].known.get(&own);
            own.is_some_and(|own| *own == member || self.equal.get(own) == Some(&member))
        };
        let wholes = members.iter().filter_map(|&member| match *self.op(member) {
            Op::Extract(whole, _) if self.kind(whole) == kind => Some(whole),
            _ => None,
        });
        let mut wholes = wholes
            .filter(|&whole| members.iter().enumerate().all(|(i, &member)| is_member(whole, i, member)));
        if let Some(whole) = wholes.next() {
            return whole;
        }
        self.record(Op::Compose(members), kind)
    }

    /// Notes which members of a result equal values outside. `numbers` are its own, paired with the equal ones outside.
    /// Returns the outside value if all of it is equal.
    pub(super) fn note_equal(
        &mut self,
        value_type: &ValueType,
        result: Node,
        outside: &mut impl Iterator<Item = Option<Node>>,
    ) -> Option<Node> {
        let same = match value_type {
            ValueType::Number(_) => outside.next().flatten(),
            ValueType::Group(kind, members) => {
                let mut note = |(i, member): (usize, &ValueType)| {
                    let own = self.extract(result, i, member.kind());
                    self.note_equal(member, own, outside)
                };
                let same: Vec<_> = members.iter().enumerate().map(&mut note).collect();
                let same: Option<Vec<_>> = same.into_iter().collect();
                same.map(|same| self.compose(*kind, same))
            }
        };
        if let Some(same) = same {
            self.equal.insert(result, same);
        }
        same
    }

    /// The numbers that a value consists of.
    pub(super) fn explode(&mut self, value_type: &ValueType, node: Node, numbers: &mut Vec<Node>) {
        match value_type {
            ValueType::Number(_) => numbers.push(node),
            ValueType::Group(_, members) => {
                for (i, member) in members.iter().enumerate() {
                    let node = self.extract(node, i, member.kind());
                    self.explode(member, node, numbers);
                }
            }
        }
    }

    /// Begins a block within the current one.
    pub(super) fn open(&mut self, is_loop: bool) -> Block {
        self.scopes.push(Scope { parent: Some(self.current), is_loop, ..Scope::default() });
        self.current = self.scopes.len() - 1;
        self.current
    }
    /// Assumes in the current block that a mask is true or false, with all consequences.
    pub(super) fn assume(&mut self, mask: Node, holds: bool) {
        self.scopes[self.current].assumed.insert(mask, holds);
        match *self.op(mask) {
            Op::Unary(Unary::Not, of) => self.assume(of, !holds),
            Op::Binary(op @ (Binary::And | Binary::Or), operands) if holds == (op == Binary::And) => {
                operands.into_iter().for_each(|operand| self.assume(operand, holds));
            }
            _ => {}
        }
    }
    /// The value of a mask in the current block, if known.
    pub(super) fn assumed(&self, mask: Node) -> Option<bool> {
        self.blocks_from(self.current).find_map(|block| self.scopes[block].assumed.get(&mask).copied())
    }

    /// Ends the current block. Values recorded in it can no longer be used.
    pub(super) fn close(&mut self) {
        let scope = &mut self.scopes[self.current];
        scope.closed = true;
        self.current = scope.parent.expect("a function's own block is not closed");
    }

    /// Begins a loop and returns its state within.
    pub(super) fn begin_loop(
        &mut self,
        condition: Node,
        state: Vec<(ValueType, Node)>,
    ) -> (usize, Vec<Node>) {
        let control = self.controls.len();
        let items = state.into_iter();
        let items =
            items.map(|(value_type, first)| Item { value_type, first, second: first, nodes: Vec::new() });
        let (items, blocks) = (items.collect(), vec![self.open(true)]);
        // A loop is entered only if its condition holds.
        self.assume(condition, true);
        self.controls.push(Control {
            form: ControlForm::Loop,
            node: 0,
            condition,
            stays: None,
            blocks,
            items,
        });
        (control, self.item_nodes(control, Op::State))
    }

    /// Ends the loop.
    pub(super) fn end_loop(&mut self, control: usize, next: &[Node], stays: Node) -> Vec<Node> {
        self.close();
        let node = self.push(Op::Control(control), Kind::Row, self.current);
        let this = &mut self.controls[control];
        (this.node, this.stays) = (node, Some(stays));
        for (item, &next) in this.items.iter_mut().zip(next) {
            item.second = next;
        }
        self.item_nodes(control, Op::Result)
    }

    /// Records a branch or fork whose blocks have ended, and returns its results.
    pub(super) fn end_branch(
        &mut self,
        form: ControlForm,
        condition: Node,
        blocks: Vec<Block>,
        items: Vec<(ValueType, Node, Node)>,
    ) -> Vec<Node> {
        let items = items.into_iter();
        let items = items
            .map(|(value_type, first, second)| Item { value_type, first, second, nodes: Vec::new() })
            .collect();
        let control = self.controls.len();
        let node = self.push(Op::Control(control), Kind::Row, self.current);
        self.controls.push(Control { form, node, condition, stays: None, blocks, items });
        self.item_nodes(control, Op::Result)
    }

    fn item_nodes(&mut self, control: usize, op: fn(usize, usize) -> Op) -> Vec<Node> {
        let of_item = |graph: &mut Graph, i: usize| {
            let kind = graph.controls[control].items[i].value_type.kind();
            let node = graph.push(op(control, i), kind, graph.current);
            graph.controls[control].items[i].nodes.push(node);
            node
        };
        (0..self.controls[control].items.len()).map(|i| of_item(self, i)).collect()
    }
}
