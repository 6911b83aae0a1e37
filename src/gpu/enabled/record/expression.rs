//! Expressions in WGSL.

use super::graph::{Binary, Node, Op, Unary};
use super::kind::Kind;
use super::operators::{LETTERS, Outermost, Text, binary, float, is_term, uint};
use super::text::{WIDTH, Writer};

/// The room that a line needs besides an expression: for the name that it is assigned to.
const ROOM: usize = 14;
/// The length of the longest expression that may be followed by a member access.
const LONGEST_WHOLE: usize = 60;
/// The length of the shortest part that gets a name of its own if the whole is too long.
const SHORTEST: usize = 12;

impl Writer<'_> {
    /// The expression of a node. If it is too long, some of its operands get names first.
    pub(super) fn expression(&mut self, node: Node) -> Text {
        self.written_out(node, true)
    }
    fn operand(&mut self, node: Node) -> Text {
        self.written_out(node, false)
    }

    fn written_out(&mut self, node: Node, is_whole: bool) -> Text {
        let node = self.schedule.same(node);
        if let Some(name) = self.named.get(&node) {
            return Text::name(name);
        }
        match self.graph.op(node) {
            Op::Float(bits) => float(f32::from_bits(*bits)),
            Op::Uint(value) => uint(*value),
            Op::Mask(value) => Text::name(value.to_string()),
            Op::Parameter(i) => Text::name(&self.parameters[*i]),
            Op::Given(text) => Text::name(&**text),
            Op::Result(control, i) | Op::State(control, i) => Text::name(&self.variables[&(*control, *i)]),
            Op::Field(of, field) => {
                let of = self.whole(*of);
                Text::name(format!("{of}.{field}"))
            }
            Op::Extract(of, member) => {
                let of = self.schedule.same(*of);
                let text = self.whole(of);
                match self.graph.kind(of) {
                    Kind::Structure(structure) => {
                        let (field, _) = &self.structures.get(structure).fields[*member];
                        Text::name(format!("{text}.{field}"))
                    }
                    _ => Text::name(format!("{text}.{}", LETTERS[*member])),
                }
            }
            Op::Unary(op, of) => self.unary(*op, *of),
            Op::Binary(op, [a, b]) => {
                let is_mask = self.graph.kind(*a) == Kind::Mask;
                let texts = self.fitting(&[*a, *b], 4);
                let [a, b] = <[Text; 2]>::try_from(texts).expect("two for two");
                binary(*op, is_mask, a, b)
            }
            Op::Call(function, arguments) => {
                self.written.calls.insert(function.to_string());
                self.listed(function, arguments, is_whole)
            }
            Op::Compose(members) => self.composed(node, members, is_whole),
            Op::Control(_) => unreachable!("a control is a statement"),
        }
    }

    fn unary(&mut self, op: Unary, of: Node) -> Text {
        if op == Unary::Negate {
            let of = self.operand(of).into_primary();
            return Text::new(format!("-{of}"), Outermost::Unary);
        }
        let of = self.schedule.same(of);
        let opposite = match *self.graph.op(of) {
            Op::Binary(Binary::Equal, operands) => Some(("!=", operands)),
            // Not valid for floats, where neither may hold for NaN.
            Op::Binary(Binary::Less, operands) if self.graph.kind(operands[0]) == Kind::Uint => {
                Some((">=", operands))
            }
            _ => None,
        };
        if let Some((symbol, operands)) = opposite.filter(|_| !self.named.contains_key(&of)) {
            let texts = self.fitting(&operands, 4).into_iter().map(|text| text.within(is_term));
            let text = texts.collect::<Vec<_>>().join(&format!(" {symbol} "));
            return Text::new(text, Outermost::Comparison);
        }
        let of = self.operand(of).into_primary();
        Text::new(format!("!{of}"), Outermost::Unary)
    }

    /// A call or a constructor.
    fn listed(&mut self, head: &str, members: &[Node], is_whole: bool) -> Text {
        let texts = if is_whole {
            members.iter().map(|&member| self.operand(member)).collect()
        } else {
            self.fitting(members, head.len() + 2)
        };
        call(head, texts)
    }

    pub(super) fn composed(&mut self, node: Node, members: &[Node], is_whole: bool) -> Text {
        let kind = self.graph.kind(node);
        let head = self.structures.kind_name(kind);
        if let Kind::Structure(_) = kind {
            self.structures.needs(kind, &mut self.written.structures);
            return self.listed(&head, members, is_whole);
        }
        let members: Vec<_> = members.iter().map(|&member| self.schedule.same(member)).collect();
        if members.iter().all(|&member| member == members[0]) {
            let text = self.operand(members[0]).text;
            return Text::name(format!("{head}({text})"));
        }
        let mut texts: Vec<(Node, Text)> = Vec::new();
        let mut rest = members.as_slice();
        while let Some((&first, after)) = rest.split_first() {
            let run = self.run(rest);
            if run < 2 {
                texts.push((first, self.operand(first)));
                rest = after;
                continue;
            }
            let of = self.operand(self.vector_of(first)).into_primary();
            let letters: String = rest[..run].iter().map(|&member| self.letter(member)).collect();
            let text = Text::name(format!("{of}.{letters}"));
            if run == members.len() {
                let is_all =
                    self.graph.kind(self.vector_of(first)) == kind && letters == LETTERS[..run].concat();
                return if is_all { Text::name(of) } else { text };
            }
            texts.push((first, text));
            rest = &rest[run..];
        }
        let texts =
            if is_whole { texts.into_iter().map(|(_, text)| text).collect() } else { self.fit(texts, 7) };
        call(&head, texts)
    }
    /// The number of leading nodes that are members of one vector.
    fn run(&self, nodes: &[Node]) -> usize {
        let vector = |node: Node| match *self.graph.op(node) {
            Op::Extract(of, _) if !self.named.contains_key(&node) => {
                let of = self.schedule.same(of);
                matches!(self.graph.kind(of), Kind::Floats(_) | Kind::Uints(_)).then_some(of)
            }
            _ => None,
        };
        let first = vector(nodes[0]);
        if first.is_none() { 1 } else { nodes.iter().take_while(|&&node| vector(node) == first).count() }
    }
    fn vector_of(&self, member: Node) -> Node {
        if let Op::Extract(of, _) = *self.graph.op(member) { self.schedule.same(of) } else { member }
    }
    fn letter(&self, node: Node) -> &'static str {
        if let Op::Extract(_, member) = *self.graph.op(node) { LETTERS[member] } else { "" }
    }

    /// The expressions of operands on one line, given the number of other characters on it.
    fn fitting(&mut self, nodes: &[Node], besides: usize) -> Vec<Text> {
        let texts = nodes.iter().map(|&node| (node, self.operand(node))).collect();
        self.fit(texts, besides)
    }
    fn fit(&mut self, mut texts: Vec<(Node, Text)>, besides: usize) -> Vec<Text> {
        let room = (WIDTH - ROOM).saturating_sub(4 * self.indent);
        loop {
            let length: usize = texts.iter().map(|(_, text)| text.text.chars().count() + 2).sum();
            let longest = texts.iter_mut().max_by_key(|(_, text)| text.text.len());
            match longest {
                Some((node, text)) if length + besides > room && text.text.len() > SHORTEST => {
                    *text = self.named_text(*node, &text.text);
                }
                _ => break,
            }
        }
        texts.into_iter().map(|(_, text)| text).collect()
    }

    /// An expression that is followed by a member access.
    fn whole(&mut self, node: Node) -> String {
        let text = self.operand(node);
        if text.text.len() > LONGEST_WHOLE {
            self.named_text(node, &text.text).text
        } else {
            text.into_primary()
        }
    }

    /// Gives a node's expression a name.
    fn named_text(&mut self, node: Node, text: &str) -> Text {
        let node = self.schedule.same(node);
        let name = self.bind(text, self.hint(node).as_deref());
        // Free nodes may be used in other blocks, where the name is out of scope.
        if !self.schedule.is_free(self.graph, node) {
            self.named.insert(node, name.clone());
        }
        Text::name(name)
    }
}

fn call(head: &str, arguments: Vec<Text>) -> Text {
    let last = arguments.len().saturating_sub(1);
    // `a < b, c > d` would be parsed as a template list.
    let argument =
        |(i, text): (usize, Text)| text.within(|outermost| outermost != Outermost::Comparison || i == last);
    let arguments: Vec<_> = arguments.into_iter().enumerate().map(argument).collect();
    let text = format!("{head}({})", arguments.join(", "));
    Text { text, outermost: Outermost::Primary, list: Some((head.to_owned(), arguments)) }
}
