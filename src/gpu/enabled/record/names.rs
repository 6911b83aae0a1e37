//! Names in WGSL.

use std::collections::HashMap;
use wgpu::naga::keywords::wgsl::RESERVED;

/// Names that the WGSL of functions uses besides their own.
const USED: [&str; 21] = [
    "abs",
    "bitcast",
    "bool",
    "copysign",
    "cross",
    "dot",
    "f32",
    "float_max",
    "float_min",
    "floor",
    "reverseBits",
    "scene",
    "select",
    "sqrt",
    "u32",
    "vec2f",
    "vec2u",
    "vec3f",
    "vec3u",
    "vec4f",
    "vec4u",
];

/// Built-in functions of WGSL that hand-written code may use.
const BUILT_IN: [&str; 18] = [
    "all",
    "any",
    "ceil",
    "clamp",
    "cos",
    "exp",
    "length",
    "log",
    "max",
    "min",
    "mix",
    "normalize",
    "pow",
    "reflect",
    "refract",
    "sign",
    "sin",
    "step",
];

/// A name for a field, with a trailing underscore if it is a reserved word.
pub(super) fn of_field(name: &str) -> String {
    let name = name.trim_start_matches("r#");
    let is_taken = RESERVED.contains(&name) || name.starts_with("__");
    if is_taken { format!("{name}_") } else { name.to_owned() }
}

/// The same for a value.
pub(super) fn of_value(name: &str) -> String {
    let name = of_field(name);
    if USED.contains(&name.as_str()) { name + "_" } else { name }
}

/// The same for a function.
pub(super) fn of_function(name: &str) -> String {
    let name = of_value(&snake_case(name));
    if BUILT_IN.contains(&name.as_str()) { name + "_" } else { name }
}

/// `Leaf_eval` and `leafEval` as `leaf_eval`.
pub(super) fn snake_case(name: &str) -> String {
    let mut snake = String::new();
    let mut before = '_';
    for c in name.chars() {
        if c.is_uppercase() && before != '_' && !before.is_uppercase() {
            snake.push('_');
        }
        snake.extend(c.to_lowercase());
        before = c;
    }
    snake
}

/// `leaf_eval` as `LeafEval`.
pub(super) fn camel_case(name: &str) -> String {
    let word = |word: &str| {
        let mut letters = word.chars();
        letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
    };
    name.split('_').map(word).collect()
}

/// The module's name for readers, without the crate.
pub(super) fn module(path: &str) -> &str {
    path.split_once("::").map_or(path, |(_, rest)| rest)
}

/// The names in a function, each of which is used once.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    given: HashMap<String, u32>,
    unnamed: u32,
}

impl Names {
    /// Reserves a name.
    pub(super) fn reserve(&mut self, name: &str) {
        self.given.entry(name.to_owned()).or_insert(1);
    }
    /// A name that no other value has: the suggestion if it is free.
    pub(super) fn give(&mut self, suggested: Option<&str>) -> String {
        let Some(suggested) = suggested else {
            loop {
                self.unnamed += 1;
                let name = format!("v{}", self.unnamed);
                if !self.given.contains_key(&name) {
                    self.reserve(&name);
                    return name;
                }
            }
        };
        let name = of_value(suggested);
        let uses = self.given.entry(name.clone()).or_insert(0);
        *uses += 1;
        if *uses == 1 {
            return name;
        }
        let numbered = format!("{}_{uses}", name.trim_end_matches('_'));
        if self.given.contains_key(&numbered) { self.give(Some(suggested)) } else { self.given(numbered) }
    }
    fn given(&mut self, name: String) -> String {
        self.reserve(&name);
        name
    }
}
