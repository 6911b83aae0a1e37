//! Functions as WGSL: statements. `expression` writes what stands in them.

use super::graph::{Block, ControlForm, Graph, Item, Node, Op};
use super::kind::{Kind, Structures, ValueType};
use super::names::{Names, snake_case};
use super::operators::Text;
use super::schedule::Schedule;
use std::collections::{HashMap, HashSet};

/// The maximum number of columns of a line that can be broken.
pub(super) const WIDTH: usize = 110;

/// A function in WGSL, with its dependencies.
#[derive(Clone, Debug, Default)]
pub(super) struct Written {
    pub(super) text: String,
    /// The functions that it calls.
    pub(super) calls: HashSet<String>,
    /// The structures that it names.
    pub(super) structures: HashSet<usize>,
}

/// Writes one function.
pub(super) struct Writer<'a> {
    pub(super) graph: &'a Graph,
    pub(super) structures: &'a Structures,
    pub(super) schedule: Schedule,
    pub(super) parameters: Vec<String>,
    pub(super) names: Names,
    /// The names of nodes.
    pub(super) named: HashMap<Node, String>,
    /// The names of the items of controls.
    pub(super) variables: HashMap<(usize, usize), String>,
    pub(super) lines: Vec<String>,
    pub(super) indent: usize,
    pub(super) written: Written,
}

/// The text of a function that returns `result`, if it returns anything.
pub(super) fn function(
    name: &str,
    parameters: &[(String, ValueType)],
    result: Option<Node>,
    graph: &Graph,
    structures: &Structures,
) -> Written {
    let mut names = Names::default();
    names.reserve(name);
    graph.nodes.iter().for_each(|recorded| match &recorded.op {
        Op::Call(function, _) => names.reserve(function),
        Op::Given(text) => names.reserve(text.split(['.', '[', '(']).next().unwrap_or("")),
        _ => {}
    });
    let parameter_names: Vec<_> = parameters.iter().map(|(name, _)| names.give(Some(name))).collect();
    let typed = parameter_names.iter().zip(parameters);
    let typed: Vec<_> = typed
        .map(|(name, (_, value_type))| format!("{name}: {}", structures.kind_name(value_type.kind())))
        .collect();
    let end =
        result.map_or(" {".to_owned(), |node| format!(" -> {} {{", structures.kind_name(graph.kind(node))));
    let mut writer = Writer {
        graph,
        structures,
        schedule: Schedule::new(graph, result.unwrap_or(0)),
        parameters: parameter_names,
        names,
        named: HashMap::new(),
        variables: HashMap::new(),
        lines: Vec::new(),
        indent: 0,
        written: Written::default(),
    };
    writer.list(&format!("fn {name}"), &typed, &end);
    writer.indent = 1;
    if let Some(node) = result {
        let value = writer.schedule.same(node);
        let members = match graph.op(value) {
            Op::Compose(members) if writer.is_composed(value) => members.clone(),
            _ => vec![value],
        };
        writer.finish(0, value, members);
        structures.needs(graph.kind(node), &mut writer.written.structures);
    }
    parameters
        .iter()
        .for_each(|(_, value_type)| structures.needs(value_type.kind(), &mut writer.written.structures));
    writer.indent = 0;
    writer.line("}");
    writer.written.text = writer.lines.join("\n") + "\n";
    writer.written
}

impl Writer<'_> {
    pub(super) fn line(&mut self, text: &str) {
        self.lines.push(format!("{}{text}", "    ".repeat(self.indent)));
    }

    /// A list in parentheses with a prefix and a suffix, on one line if it fits, otherwise one member per line.
    fn list(&mut self, before: &str, members: &[String], after: &str) {
        let line = format!("{before}({}){after}", members.join(", "));
        if members.is_empty() || self.indent * 4 + line.chars().count() <= WIDTH {
            return self.line(&line);
        }
        self.line(&format!("{before}("));
        self.indent += 1;
        members.iter().for_each(|member| self.line(&format!("{member},")));
        self.indent -= 1;
        self.line(&format!("){after}"));
    }

    /// A statement that ends with an expression.
    fn statement(&mut self, before: &str, text: Text) {
        match text.list {
            Some((head, members)) => self.list(&format!("{before}{head}"), &members, ";"),
            None => self.line(&format!("{before}{};", text.text)),
        }
    }
    /// A statement that ends with a node's expression.
    fn compute(&mut self, before: &str, node: Node) {
        let text = self.expression(node);
        self.statement(before, text);
    }

    /// Names a value, for expressions that are too long.
    pub(super) fn bind(&mut self, text: &str, hint: Option<&str>) -> String {
        let name = self.names.give(hint);
        self.line(&format!("let {name} = {text};"));
        name
    }

    /// The suggested name of a value.
    pub(super) fn hint(&self, node: Node) -> Option<String> {
        let recorded = &self.graph.nodes[node];
        match (&recorded.hint, recorded.kind) {
            (Some(hint), _) => Some(hint.to_string()),
            (None, Kind::Structure(structure)) => Some(snake_case(&self.structures.get(structure).name)),
            _ => None,
        }
    }

    /// The statements of a block.
    fn block(&mut self, block: Block) {
        for node in self.schedule.statements[block].clone() {
            self.node(node);
        }
    }
    fn node(&mut self, node: Node) {
        if let Op::Control(control) = *self.graph.op(node) {
            return match self.graph.controls[control].form {
                ControlForm::Loop => self.repeat(control),
                ControlForm::Branch | ControlForm::Fork => self.branch(control),
            };
        }
        let text = self.expression(node);
        let name = self.names.give(self.hint(node).as_deref());
        self.statement(&format!("let {name} = "), text);
        self.named.insert(node, name);
    }

    /// The statements of the last block of the function. A branch at its end returns from within.
    fn finish(&mut self, block: Block, value: Node, members: Vec<Node>) {
        let statements = self.schedule.statements[block].clone();
        let Some(control) = self.last_branch(block, &members) else {
            self.block(block);
            let text = self.returned(value, &members);
            return self.statement("return ", text);
        };
        statements[..statements.len() - 1].iter().for_each(|&node| self.node(node));
        let this = &self.graph.controls[control];
        let in_arm = |schedule: &Schedule, of: fn(&Item) -> Node| {
            let member = |&member: &Node| match *self.graph.op(schedule.same(member)) {
                Op::Result(other, i) if other == control => of(&this.items[i]),
                _ => member,
            };
            members.iter().map(member).collect()
        };
        let (first, second): (Vec<_>, Vec<_>) =
            (in_arm(&self.schedule, |item| item.first), in_arm(&self.schedule, |item| item.second));
        let condition = self.expression(this.condition).text;
        self.line(&format!("if {condition} {{"));
        self.indent += 1;
        // Names from the first arm are out of scope in the second.
        let named = self.named.clone();
        self.finish(this.blocks[0], value, first);
        self.named = named;
        self.indent -= 1;
        self.line("}");
        self.finish(this.blocks[1], value, second);
    }

    /// The value that the function returns: `value`, combined with any other members.
    fn returned(&mut self, value: Node, members: &[Node]) -> Text {
        match members {
            [only] if !self.is_composed(value) => self.expression(*only),
            members => self.composed(value, members, true),
        }
    }
    fn is_composed(&self, value: Node) -> bool {
        matches!(self.graph.op(value), Op::Compose(_)) && !self.schedule.is_named[value]
    }

    /// The branch at the end of a block all of whose items are returned, if the other members can be repeated in each
    /// arm.
    fn last_branch(&self, block: Block, members: &[Node]) -> Option<usize> {
        let Op::Control(control) = *self.graph.op(*self.schedule.statements[block].last()?) else {
            return None;
        };
        let is_item = |&member: &Node| {
            self.schedule.sole_use(self.graph, member, block).is_some_and(|(other, _)| other == control)
        };
        let items = members.iter().filter(|member| is_item(member)).count();
        let may = self.graph.controls[control].form != ControlForm::Loop
            && items == self.schedule.live_items(control).len()
            && members.iter().all(|member| {
                is_item(member) || self.schedule.is_free(self.graph, self.schedule.same(*member))
            });
        may.then_some(control)
    }

    fn name_item(&mut self, control: usize, item: usize) -> String {
        let this = &self.graph.controls[control].items[item];
        let nodes = this.nodes.iter().copied();
        let hinted =
            nodes.chain([this.first, this.second]).find_map(|node| self.hint(self.schedule.same(node)));
        self.names.give(hinted.as_deref())
    }

    /// Lets a control whose result is used only by this item assign the item's variable.
    fn share(&mut self, control: usize, item: usize, name: &str) {
        self.variables.insert((control, item), name.to_owned());
        let this = &self.graph.controls[control];
        if this.form != ControlForm::Loop
            && !self.schedule.has_else(self.graph, control)
            && let Some(place) = self.schedule.place_of(self.graph, control)
            && let Some((other, of)) = self.schedule.sole_use(self.graph, this.items[item].second, place)
        {
            self.share(other, of, name);
        }
    }

    fn branch(&mut self, control: usize) {
        let this = &self.graph.controls[control];
        let items = self.schedule.live_items(control);
        let place = self.schedule.place_of(self.graph, control).expect("it is needed");
        let has_else = self.schedule.has_else(self.graph, control);
        for &i in &items {
            let second = this.items[i].second;
            let before = match self.schedule.sole_use(self.graph, second, place) {
                Some(before) if !has_else => self.variables.get(&before).cloned(),
                _ => None,
            };
            let own = self.variables.get(&(control, i)).cloned();
            let is_declared = own.is_some();
            let is_shared = before.is_some();
            let name = before.or(own).unwrap_or_else(|| self.name_item(control, i));
            let var = if is_declared { "" } else { "var " };
            if !has_else && !is_shared {
                let text = self.expression(second);
                self.statement(&format!("{var}{name} = "), text);
            } else if !is_shared && !is_declared {
                let kind = this.items[i].value_type.kind();
                self.structures.needs(kind, &mut self.written.structures);
                let kind = self.structures.kind_name(kind);
                self.line(&format!("var {name}: {kind};"));
            }
            self.variables.insert((control, i), name);
        }
        let condition = self.expression(this.condition).text;
        self.line(&format!("if {condition} {{"));
        self.arms(control, &items, has_else);
        self.line("}");
    }

    /// The blocks of a branch, from after the first brace to before the last one.
    fn arms(&mut self, control: usize, items: &[usize], has_else: bool) {
        let this = &self.graph.controls[control];
        self.indent += 1;
        self.arm(control, this.blocks[0], items, |item| item.first);
        self.indent -= 1;
        if has_else && !self.chained(control, items) {
            self.line("} else {");
            self.indent += 1;
            self.arm(control, this.blocks[1], items, |item| item.second);
            self.indent -= 1;
        }
    }

    fn share_all(&mut self, control: usize, block: Block, items: &[usize], value: fn(&Item) -> Node) {
        for &i in items {
            let name = self.variables[&(control, i)].clone();
            let node = value(&self.graph.controls[control].items[i]);
            if let Some((other, of)) = self.schedule.sole_use(self.graph, node, block) {
                self.share(other, of, &name);
            }
        }
    }

    fn arm(&mut self, control: usize, block: Block, items: &[usize], value: fn(&Item) -> Node) {
        self.share_all(control, block, items, value);
        self.block(block);
        for &i in items {
            let node = value(&self.graph.controls[control].items[i]);
            if self.schedule.sole_use(self.graph, node, block).is_none() {
                let name = self.variables[&(control, i)].clone();
                self.compute(&format!("{name} = "), node);
            }
        }
    }

    /// Writes `else if` if the other block is only a fork that yields the same items. Returns whether it did.
    fn chained(&mut self, control: usize, items: &[usize]) -> bool {
        let this = &self.graph.controls[control];
        let block = this.blocks[1];
        let [only] = self.schedule.statements[block][..] else { return false };
        let Op::Control(inner) = *self.graph.op(only) else { return false };
        let is_same = |&i: &usize| {
            self.schedule.sole_use(self.graph, this.items[i].second, block).is_some_and(|(of, _)| of == inner)
        };
        if self.graph.controls[inner].form == ControlForm::Loop || !items.iter().all(is_same) {
            return false;
        }
        let inner_items = self.schedule.live_items(inner);
        if inner_items.len() != items.len() {
            return false;
        }
        // A condition that needs lines of its own cannot be written here.
        let (lines, names, named) = (self.lines.len(), self.names.clone(), self.named.clone());
        let condition = self.expression(self.graph.controls[inner].condition).text;
        if self.lines.len() > lines {
            self.lines.truncate(lines);
            (self.names, self.named) = (names, named);
            return false;
        }
        self.share_all(control, block, items, |item| item.second);
        self.line(&format!("}} else if {condition} {{"));
        self.arms(inner, &inner_items, true);
        true
    }

    fn repeat(&mut self, control: usize) {
        let this = &self.graph.controls[control];
        let (items, body) = (self.schedule.live_items(control), this.blocks[0]);
        for &i in &items {
            let own = self.variables.get(&(control, i)).cloned();
            let var = if own.is_some() { "" } else { "var " };
            let text = self.expression(this.items[i].first);
            let name = own.unwrap_or_else(|| self.name_item(control, i));
            self.statement(&format!("{var}{name} = "), text);
            self.variables.insert((control, i), name);
        }
        let stays = this.stays.expect("loops say whether they go on");
        // A loop that is always entered tests its condition at its end.
        let live = if self.is_always(this.condition) {
            self.line("loop {");
            None
        } else {
            let live = self.names.give(Some("live"));
            self.compute(&format!("var {live} = "), this.condition);
            self.line(&format!("while {live} {{"));
            Some(live)
        };
        self.indent += 1;
        self.block(body);
        let mut stays = (!self.is_always(stays)).then(|| (stays, self.expression(stays)));
        let mut assignments: Vec<(String, Text)> = Vec::new();
        let mut assigned = HashSet::new();
        for &i in &items {
            let next = this.items[i].second;
            let mut text = self.expression(next);
            let name = self.variables[&(control, i)].clone();
            // All variables are assigned simultaneously: a value that reads one of them is computed before the
            // assignments.
            if self.reads_any(control, next, &assigned) {
                let next = self.names.give(Some(&format!("next_{}", name.trim_end_matches('_'))));
                self.statement(&format!("let {next} = "), text);
                text = Text::name(next);
            }
            assigned.insert(i);
            assignments.push((name, text));
        }
        match (live, &mut stays) {
            (Some(live), stays) => {
                let text = stays.take().map_or(Text::name("true"), |(_, text)| text);
                self.statement(&format!("{live} = "), text);
            }
            (None, Some((node, text))) if self.reads_any(control, *node, &assigned) => {
                let name = self.bind(&text.text, Some("stays"));
                *text = Text::name(name);
            }
            _ => {}
        }
        for (name, text) in assignments {
            self.statement(&format!("{name} = "), text);
        }
        if let Some((_, text)) = stays {
            let ends = text.opposite();
            self.line(&format!("if {ends} {{"));
            self.line("    break;");
            self.line("}");
        }
        self.indent -= 1;
        self.line("}");
    }

    fn is_always(&self, node: Node) -> bool {
        *self.graph.op(self.schedule.same(node)) == Op::Mask(true)
    }
    /// Whether a node's expression reads some items of a loop's state.
    fn reads_any(&self, control: usize, node: Node, items: &HashSet<usize>) -> bool {
        let node = self.schedule.same(node);
        match *self.graph.op(node) {
            _ if self.named.contains_key(&node) => false,
            Op::State(of, i) => of == control && items.contains(&i),
            _ => {
                self.graph.op(node).operands().iter().any(|&operand| self.reads_any(control, operand, items))
            }
        }
    }
}
