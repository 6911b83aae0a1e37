//! Functions: their beginnings and ends, their calls, and the selection of functions for the program.

use super::{Done, Frame, Handle, State};
use crate::gpu::enabled::record::graph::{Graph, Op};
use crate::gpu::enabled::record::kind::Kind;
use crate::gpu::enabled::record::names;
use crate::gpu::enabled::record::text::{self, Written};
use crate::math::lanes::{Function, Layout};

/// The layouts of the parameters: the members of a tuple.
fn members(layout: Layout) -> Vec<Layout> {
    match layout {
        Layout::List(list) => list,
        one => vec![one],
    }
}

impl State {
    /// Begins a function, unless it is already recorded and need not be compared. Returns the numbers of its
    /// parameters.
    pub(in super::super) fn enter(
        &mut self,
        function: &'static Function,
        arguments: Layout,
    ) -> Option<Vec<Handle>> {
        match self.stack.iter().rposition(|frame| frame.function.name == function.name) {
            // The root only lists this function's arguments; this function itself is recorded instead.
            Some(0) => self.stack[0].stands_for_other = true,
            Some(_) => panic!("{} > {}: WGSL has no recursion", self.trace(), function.name),
            None => {}
        }
        // Calls within a function that has been compared have been compared, too.
        let compared =
            |frame: &Frame| !frame.stands_for_other && self.places.contains_key(frame.function.name);
        if self.places.contains_key(function.name) && (!self.checks || self.stack.iter().any(compared)) {
            return None;
        }
        let layouts = members(arguments);
        assert_eq!(layouts.len(), function.parameters.len(), "{}: the number of parameters", function.name);
        let named = function.parameters.iter().copied().zip(&layouts);
        let parameters: Vec<_> =
            named.flat_map(|(name, layout)| self.structures.flat(layout, name)).collect();
        let mut graph = Graph::new();
        let mut numbers = Vec::new();
        for (i, (_, value_type)) in parameters.iter().enumerate() {
            let node = graph.record(Op::Parameter(i), value_type.kind());
            graph.explode(value_type, node, &mut numbers);
        }
        self.frames += 1;
        self.stack.push(Frame {
            number: self.frames,
            function,
            parameters,
            layouts,
            graph,
            stands_for_other: false,
        });
        Some(self.handles(&numbers))
    }

    /// Excludes the current function from the program, but not the functions that it calls.
    pub(in super::super) fn stand_for_others(&mut self) {
        self.frame().stands_for_other = true;
    }

    /// Ends the function with its result.
    pub(in super::super) fn leave(&mut self, layout: Layout, numbers: &[(Handle, Kind)]) {
        let numbers = self.nodes(numbers);
        let function = self.frame().function;
        let name = names::of_function(function.name);
        let value_type = self.structures.value_type(&layout, &format!("{}Result", names::camel_case(&name)));
        let result = value_type.map(|value_type| self.implode(&value_type, &mut numbers.into_iter()));
        let frame = self.stack.pop().expect("a function is being recorded");
        let written = text::function(&name, &frame.parameters, result, &frame.graph, &self.structures);
        if frame.stands_for_other {
            for done in self.done.iter_mut().filter(|done| written.calls.contains(&done.name)) {
                done.is_root = true;
            }
            return;
        }
        let comment = format!("// From `{}`.\n", names::module(function.module));
        let written = Written { text: comment + &written.text, ..written };
        if let Some(&place) = self.places.get(function.name) {
            let first = &self.done[place].written.text;
            if *first != written.text {
                let second = &written.text;
                self.errors.push(format!("two functions are called {name}:\n\n{first}\n{second}"));
            }
            return;
        }
        self.places.insert(function.name, self.done.len());
        let parameters = function.parameters.iter().copied().zip(frame.layouts).collect();
        let parameter_names = frame.parameters.into_iter().map(|(name, _)| name).collect();
        self.done.push(Done {
            function,
            name,
            parameters,
            result: layout,
            written,
            is_root: false,
            parameter_names,
        });
    }

    /// Records the call of a recorded function.
    pub(in super::super) fn called(
        &mut self,
        function: &'static Function,
        layouts: (Layout, Layout),
        arguments: &[(Handle, Kind)],
    ) -> Vec<Handle> {
        let done = self.done[self.places[function.name]].clone();
        let given = members(layouts.0.clone());
        if done.parameters.iter().map(|(_, layout)| layout).ne(&given) || done.result != layouts.1 {
            let trace = self.trace();
            self.errors.push(format!("{trace}: two functions of other parameters are called {}", done.name));
        }
        let context = format!("{}Result", names::camel_case(&done.name));
        self.call(&done.name, &context, &given, layouts.1, arguments, &done.parameter_names)
    }

    /// Records the call of a hand-written function.
    pub(in super::super) fn device(
        &mut self,
        name: &str,
        layouts: (Layout, Layout),
        arguments: &[(Handle, Kind)],
    ) -> Vec<Handle> {
        let context = format!("{}Result", names::camel_case(name));
        self.call(name, &context, &members(layouts.0), layouts.1, arguments, &[])
    }

    fn call(
        &mut self,
        name: &str,
        context: &str,
        parameters: &[Layout],
        result: Layout,
        arguments: &[(Handle, Kind)],
        parameter_names: &[String],
    ) -> Vec<Handle> {
        let mut numbers = self.nodes(arguments).into_iter();
        let shapes = parameters.iter().flat_map(|layout| self.structures.flat(layout, "argument"));
        let shapes: Vec<_> = shapes.collect();
        let Some(result) = self.structures.value_type(&result, context) else { return Vec::new() };
        let arguments: Vec<_> =
            shapes.iter().map(|(_, value_type)| self.implode(value_type, &mut numbers)).collect();
        let graph = self.graph();
        for (&argument, name) in arguments.iter().zip(parameter_names) {
            graph.suggest(argument, name);
        }
        let node = graph.call(name, arguments, result.kind());
        let mut numbers = Vec::new();
        graph.explode(&result, node, &mut numbers);
        self.handles(&numbers)
    }

    /// Marks a function as needed even if no other function calls it.
    pub(in super::super) fn want(&mut self, function: &'static Function) {
        let place = self.places[function.name];
        self.done[place].is_root = true;
    }

    /// The needed functions and those that they call; callees come first.
    pub(in super::super) fn wanted(&self) -> Vec<&Done> {
        let mut wanted = vec![false; self.done.len()];
        for (i, done) in self.done.iter().enumerate().rev() {
            wanted[i] |= done.is_root;
            if wanted[i] {
                for callee in
                    (0..i).filter(|&callee| done.written.calls.contains(self.done[callee].name.as_str()))
                {
                    wanted[callee] = true;
                }
            }
        }
        self.done.iter().zip(wanted).filter_map(|(done, wanted)| wanted.then_some(done)).collect()
    }
}
