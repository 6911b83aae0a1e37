//! Which operations of a function are needed, and in which block each is computed.
//!
//! An operation is computed in the innermost block that holds all its uses, but not in a loop that it was recorded
//! outside of. One that is used once is part of the expression that uses it; others get a name. So what only one side of
//! a branch needs is computed there, and so is what a branch is given for where its condition does not hold.

use super::graph::{Block, Form, Graph, Node, Op};

/// See the module.
#[derive(Debug)]
pub(super) struct Schedule {
    /// What stands for each node: itself, unless it is known to be another.
    same: Vec<Node>,
    /// Uses of each node that is not free.
    uses: Vec<u32>,
    /// The block in which a node is computed.
    place: Vec<Option<Block>>,
    /// Whether a node gets a name.
    pub(super) is_named: Vec<bool>,
    /// The named nodes and the controls of each block, in the order in which they were recorded.
    pub(super) statements: Vec<Vec<Node>>,
    /// For each item of each control, how often its result is used; none if it is not needed.
    items: Vec<Vec<Option<u32>>>,
    /// Whether a control has something to compute where its condition does not hold.
    is_fork: Vec<bool>,
    /// The block around each block, controls being where they are needed.
    parent: Vec<Option<Block>>,
}

impl Schedule {
    /// For a function that gives this node.
    pub(super) fn new(graph: &Graph, result: Node) -> Schedule {
        let count = graph.nodes.len();
        let mut schedule = Schedule {
            same: Vec::new(),
            uses: vec![0; count],
            place: vec![None; count],
            is_named: vec![false; count],
            statements: vec![Vec::new(); graph.scopes.len()],
            items: graph.controls.iter().map(|control| vec![None; control.items.len()]).collect(),
            is_fork: graph.controls.iter().map(|control| control.form == Form::Fork).collect(),
            parent: graph.scopes.iter().map(|scope| scope.parent).collect(),
        };
        schedule.find_same(graph);
        let is_live = schedule.live(graph, result);
        schedule.add_use(graph, result, 0);
        // Uses come after what they use, so that all are known when their turn comes; but for states of loops, which
        // have no place.
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
    /// The item of a branch or loop in this block that a node is, if nothing else uses that.
    pub(super) fn sole_use(&self, graph: &Graph, node: Node, block: Block) -> Option<(usize, usize)> {
        let Op::Result(control, item) = *graph.op(self.same(node)) else { return None };
        let is_sole = self.items[control][item] == Some(1);
        (is_sole && self.place_of(graph, control) == Some(block)).then_some((control, item))
    }
    /// Whether a control that is no loop is written with `else`.
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

    // Members of what is put together are those, states that do not change are what they were before, and results that
    // are the same from both blocks are that.
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
                Op::Result(control, i) if graph.controls[control].form != Form::Loop => {
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

    /// Whether a value costs nothing and reads well wherever it is used.
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
    /// The innermost block that holds two.
    fn around(&self, a: Block, b: Block) -> Block {
        let holds_b = self.blocks_from(b);
        self.blocks_from(a).into_iter().find(|block| holds_b.contains(block)).unwrap_or(0)
    }

    /// Finds the place of a node all of whose uses are known, and uses its operands there.
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
        // What is computed for a branch alone is computed where it is needed.
        let is_for_it = |schedule: &Schedule, node: Node| {
            let node = schedule.same(node);
            match *graph.op(node) {
                Op::Result(other, _) => schedule.place_of(graph, other).is_none(),
                _ => !schedule.is_free(graph, node) && schedule.place[node].is_none(),
            }
        };
        self.is_fork[control] |= this.form == Form::Branch
            && self.live_items(control).into_iter().any(|i| is_for_it(self, this.items[i].second));
        for i in self.live_items(control) {
            let item = &this.items[i];
            let [first, second] = match this.form {
                Form::Branch if !self.is_fork[control] => [this.blocks[0], place],
                Form::Branch | Form::Fork => [this.blocks[0], this.blocks[1]],
                Form::Loop => [place, this.blocks[0]],
            };
            self.add_use(graph, item.first, first);
            self.add_use(graph, item.second, second);
        }
    }
}

pub(super) fn is_constant(op: &Op) -> bool {
    matches!(op, Op::Float(_) | Op::Uint(_) | Op::Mask(_))
}
