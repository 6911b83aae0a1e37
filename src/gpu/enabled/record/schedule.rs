//! Selects the operations of a function that are needed, and the block of each.
//!
//! An operation is computed in the innermost block that contains all its uses, but not in a loop that it was recorded
//! outside of. An operation that is used once becomes part of the expression that uses it; others get a name.
//! Operations that only one side of a branch uses are thus computed there, and so is the value of a branch for a false
//! condition.

use super::graph::{Block, ControlForm, Graph, Node, Op};

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct Schedule {
    /// The replacement of each node: itself, or an equal node.
    same: Vec<Node>,
    /// The number of uses of each node that is not free.
    uses: Vec<u32>,
    /// The block in which a node is computed.
    place: Vec<Option<Block>>,
    /// Whether a node gets a name.
    pub(super) is_named: Vec<bool>,
    /// The named nodes and the controls of each block, in the order in which they were recorded.
    pub(super) statements: Vec<Vec<Node>>,
    /// For each item of each control, the number of uses of its result; `None` if it is not needed.
    items: Vec<Vec<Option<u32>>>,
    /// Whether a control computes something for a false condition.
    is_fork: Vec<bool>,
    /// The enclosing block of each block, with controls moved to where they are needed.
    parent: Vec<Option<Block>>,
}

impl Schedule {
    /// The schedule of a function that returns this node.
    pub(super) fn new(graph: &Graph, result: Node) -> Schedule {
        let count = graph.nodes.len();
        let mut schedule = Schedule {
            same: Vec::new(),
            uses: vec![0; count],
            place: vec![None; count],
            is_named: vec![false; count],
            statements: vec![Vec::new(); graph.scopes.len()],
            items: graph.controls.iter().map(|control| vec![None; control.items.len()]).collect(),
            is_fork: graph.controls.iter().map(|control| control.form == ControlForm::Fork).collect(),
            parent: graph.scopes.iter().map(|scope| scope.parent).collect(),
        };
        schedule.find_same(graph);
        let is_live = schedule.live(graph, result);
        schedule.add_use(graph, result, 0);
        // Uses come after their operands, so that all uses of a node are known when it is reached, except for states of
        // loops, which have no block.
        for node in (0..count).rev().filter(|&node| is_live[node]) {
            schedule.put(graph, node);
        }
        schedule.statements.iter_mut().for_each(|nodes| nodes.sort_unstable());
        schedule
    }

    pub(super) fn same(&self, node: Node) -> Node {
        self.same[node]
    }
    /// The items of a control that are needed.
    pub(super) fn live_items(&self, control: usize) -> Vec<usize> {
        let items = self.items[control].iter().enumerate();
        items.filter_map(|(i, uses)| uses.is_some().then_some(i)).collect()
    }
    /// The item of a branch or loop in this block that a node is, if it is the only use.
    pub(super) fn sole_use(&self, graph: &Graph, node: Node, block: Block) -> Option<(usize, usize)> {
        let Op::Result(control, item) = *graph.op(self.same(node)) else { return None };
        let is_sole = self.items[control][item] == Some(1);
        (is_sole && self.place_of(graph, control) == Some(block)).then_some((control, item))
    }
    /// Whether a branch or fork is written with `else`.
    pub(super) fn has_else(&self, graph: &Graph, control: usize) -> bool {
        let this = &graph.controls[control];
        let is_computed = |i: usize| {
            let node = self.same(this.items[i].second);
            !self.is_free(graph, node) && !self.is_named[node]
        };
        self.is_fork[control]
            && (!self.statements[this.blocks[1]].is_empty()
                || self.live_items(control).into_iter().any(is_computed))
    }
    pub(super) fn place_of(&self, graph: &Graph, control: usize) -> Option<Block> {
        self.place[graph.controls[control].node]
    }

    // Members of composed values are replaced by these; states that never change by their initial values; and results
    // that are equal in both blocks by that value.
    fn find_same(&mut self, graph: &Graph) {
        for (node, recorded) in graph.nodes.iter().enumerate() {
            let same = match recorded.op {
                Op::State(control, i) => {
                    let item = &graph.controls[control].items[i];
                    if *graph.op(item.second) == Op::State(control, i) { self.same[item.first] } else { node }
                }
                Op::Extract(of, member) => match graph.op(self.same[of]) {
                    Op::Compose(members) => self.same[members[member]],
                    _ => node,
                },
                Op::Result(control, i) if graph.controls[control].form != ControlForm::Loop => {
                    let item = &graph.controls[control].items[i];
                    let first = self.same[item.first];
                    if first == self.same[item.second] { first } else { node }
                }
                _ => node,
            };
            self.same.push(same);
        }
    }

    fn live(&mut self, graph: &Graph, result: Node) -> Vec<bool> {
        let mut is_live = vec![false; graph.nodes.len()];
        let mut open = vec![result];
        while let Some(node) = open.pop() {
            let node = self.same(node);
            if std::mem::replace(&mut is_live[node], true) {
                continue;
            }
            open.extend(graph.op(node).operands());
            if let Op::Result(control, i) | Op::State(control, i) = *graph.op(node) {
                let this = &graph.controls[control];
                if self.items[control][i].is_none() {
                    self.items[control][i] = Some(0);
                    open.extend([this.items[i].first, this.items[i].second]);
                }
                open.extend([this.node, this.condition]);
                open.extend(this.stays);
            }
        }
        is_live
    }

    /// Whether a value costs nothing and is readable wherever it is used.
    pub(super) fn is_free(&self, graph: &Graph, node: Node) -> bool {
        let is_free = |&node: &Node| self.is_free(graph, self.same(node));
        match graph.op(node) {
            Op::Call(..) | Op::Binary(..) | Op::Control(_) => false,
            Op::Unary(_, of) => is_free(of),
            Op::Compose(members) => members.iter().all(|&member| is_constant(graph.op(self.same(member)))),
            _ => true,
        }
    }

    fn add_use(&mut self, graph: &Graph, node: Node, block: Block) {
        let node = self.same(node);
        let op = graph.op(node);
        if let Op::Result(control, i) | Op::State(control, i) = *op {
            let uses = &mut self.items[control][i];
            *uses = Some(uses.unwrap_or(0) + 1);
            if matches!(op, Op::Result(..)) {
                self.add_place(graph.controls[control].node, block);
            }
        } else if self.is_free(graph, node) {
            op.operands().iter().for_each(|&operand| self.add_use(graph, operand, block));
        } else {
            self.add_place(node, block);
        }
    }
    fn add_place(&mut self, node: Node, block: Block) {
        self.uses[node] += 1;
        self.place[node] = Some(self.place[node].map_or(block, |place| self.around(place, block)));
    }

    fn blocks_from(&self, block: Block) -> Vec<Block> {
        std::iter::successors(Some(block), |&block| self.parent[block]).collect()
    }
    /// The innermost block that contains both.
    fn around(&self, a: Block, b: Block) -> Block {
        let holds_b = self.blocks_from(b);
        self.blocks_from(a).into_iter().find(|block| holds_b.contains(block)).unwrap_or(0)
    }

    /// Places a node all of whose uses are known, and uses its operands there.
    fn put(&mut self, graph: &Graph, node: Node) {
        let Some(used) = self.place[node] else { return };
        let recorded = &graph.nodes[node];
        let mut place = used;
        for block in self.blocks_from(used).into_iter().take_while(|&block| block != recorded.block) {
            if graph.scopes[block].is_loop {
                place = self.parent[block].expect("loops stand in blocks");
            }
        }
        self.place[node] = Some(place);
        if let Op::Control(control) = recorded.op {
            self.statements[place].push(node);
            self.put_control(graph, control, place);
            return;
        }
        if self.uses[node] > 1 || place != used {
            self.is_named[node] = true;
            self.statements[place].push(node);
        }
        recorded.op.operands().iter().for_each(|&operand| self.add_use(graph, operand, place));
    }

    fn put_control(&mut self, graph: &Graph, control: usize, place: Block) {
        let this = &graph.controls[control];
        this.blocks.iter().for_each(|&block| self.parent[block] = Some(place));
        self.add_use(graph, this.condition, place);
        if let Some(stays) = this.stays {
            self.add_use(graph, stays, this.blocks[0]);
        }
        // Operations that only a branch uses are computed there.
        let is_for_it = |schedule: &Schedule, node: Node| {
            let node = schedule.same(node);
            match *graph.op(node) {
                Op::Result(other, _) => schedule.place_of(graph, other).is_none(),
                _ => !schedule.is_free(graph, node) && schedule.place[node].is_none(),
            }
        };
        self.is_fork[control] |= this.form == ControlForm::Branch
            && self.live_items(control).into_iter().any(|i| is_for_it(self, this.items[i].second));
        for i in self.live_items(control) {
            let item = &this.items[i];
            let [first, second] = match this.form {
                ControlForm::Branch if !self.is_fork[control] => [this.blocks[0], place],
                ControlForm::Branch | ControlForm::Fork => [this.blocks[0], this.blocks[1]],
                ControlForm::Loop => [place, this.blocks[0]],
            };
            self.add_use(graph, item.first, first);
            self.add_use(graph, item.second, second);
        }
    }
}

pub(super) fn is_constant(op: &Op) -> bool {
    matches!(op, Op::Float(_) | Op::Uint(_) | Op::Mask(_))
}
