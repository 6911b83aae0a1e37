//! The types of WGSL, and their composition into the values of programs.

use super::names;
use crate::math::lanes::Layout;
use std::collections::HashSet;

/// The type of a value in WGSL.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    /// `f32`.
    Float,
    /// `u32`.
    Uint,
    /// `bool`.
    Mask,
    /// `vec2f` to `vec4f`.
    Floats(u32),
    /// `vec2u` to `vec4u`.
    Uints(u32),
    /// A structure, by its index in [`Structures`].
    Structure(usize),
    /// The result of a hand-written function that reads a row. Only its fields are used, each with its own kind.
    Row,
}

/// The WGSL type of a value of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum ValueType {
    /// One number.
    Number(Kind),
    /// A vector or structure of other values.
    Group(Kind, Vec<ValueType>),
}

impl ValueType {
    pub(super) fn kind(&self) -> Kind {
        match self {
            ValueType::Number(kind) | ValueType::Group(kind, _) => *kind,
        }
    }
    /// The number of numbers in it.
    pub(super) fn len(&self) -> usize {
        match self {
            ValueType::Number(_) => 1,
            ValueType::Group(_, members) => members.iter().map(ValueType::len).sum(),
        }
    }
}

/// A structure of WGSL.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Structure {
    pub(super) name: String,
    pub(super) fields: Vec<(String, ValueType)>,
    /// Whether hand-written WGSL declares it.
    pub(super) by_hand: bool,
}

/// All structures, in order of dependency.
#[derive(Debug, Default)]
pub(super) struct Structures {
    all: Vec<Structure>,
    by_hand: HashSet<String>,
    pub(super) errors: Vec<String>,
}

impl Structures {
    /// No structures yet; `by_hand` names those that hand-written WGSL declares.
    pub(super) fn new(by_hand: &[&str]) -> Structures {
        Structures { by_hand: by_hand.iter().map(|&name| name.to_owned()).collect(), ..Structures::default() }
    }

    pub(super) fn get(&self, structure: usize) -> &Structure {
        &self.all[structure]
    }

    pub(super) fn kind_name(&self, kind: Kind) -> String {
        match kind {
            Kind::Float => "f32".to_owned(),
            Kind::Uint => "u32".to_owned(),
            Kind::Mask => "bool".to_owned(),
            Kind::Floats(n) => format!("vec{n}f"),
            Kind::Uints(n) => format!("vec{n}u"),
            Kind::Structure(structure) => self.all[structure].name.clone(),
            Kind::Row => unreachable!("rows are bound by `let`, which has no type"),
        }
    }

    /// The WGSL declaration of one structure.
    pub(super) fn declaration(&self, structure: usize) -> String {
        let Structure { name, fields, .. } = &self.all[structure];
        let mut text = format!("struct {name} {{\n");
        for (field, value_type) in fields {
            text.push_str(&format!("    {field}: {},\n", self.kind_name(value_type.kind())));
        }
        text + "}\n"
    }

    /// The structures that a kind depends on, including itself.
    pub(super) fn needs(&self, kind: Kind, into: &mut HashSet<usize>) {
        if let Kind::Structure(structure) = kind
            && into.insert(structure)
        {
            for (_, value_type) in &self.all[structure].fields {
                self.needs(value_type.kind(), into);
            }
        }
    }

    /// A value as one WGSL value; `None` if it has no numbers. `context` names the structure of a tuple.
    pub(super) fn value_type(&mut self, layout: &Layout, context: &str) -> Option<ValueType> {
        match layout {
            Layout::Float => Some(ValueType::Number(Kind::Float)),
            Layout::Uint => Some(ValueType::Number(Kind::Uint)),
            Layout::Mask => Some(ValueType::Number(Kind::Mask)),
            Layout::Vector => {
                Some(ValueType::Group(Kind::Floats(3), vec![ValueType::Number(Kind::Float); 3]))
            }
            Layout::Record { name, fields } => {
                let fields = fields.iter().filter_map(|(field, layout)| {
                    let context = format!("{name}{}", names::camel_case(field));
                    Some((names::of_field(field), self.value_type(layout, &context)?))
                });
                let fields = fields.collect();
                self.structure((*name).to_owned(), fields)
            }
            Layout::List(list) => {
                if let Some(value_type) = vector(list) {
                    return Some(value_type);
                }
                if let [only] = list.as_slice() {
                    return self.value_type(only, context);
                }
                let names = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth"];
                let fields = list.iter().enumerate().filter_map(|(i, layout)| {
                    let name = names.get(i).map_or_else(|| format!("number_{i}"), |&name| name.to_owned());
                    let context = format!("{context}{}", names::camel_case(&name));
                    Some((name, self.value_type(layout, &context)?))
                });
                let fields = fields.collect();
                self.structure(context.to_owned(), fields)
            }
        }
    }

    /// The values that a block returns: the members of a tuple individually, including those of nested tuples.
    pub(super) fn members(&mut self, layout: &Layout) -> Vec<ValueType> {
        let members = match layout {
            Layout::List(list) => list.as_slice(),
            one => std::slice::from_ref(one),
        };
        let shapes = members.iter().flat_map(|member| self.flat(member, "tuple"));
        shapes.map(|(_, value_type)| value_type).collect()
    }

    /// A value as several named WGSL values: the members of tuples individually.
    pub(super) fn flat(&mut self, layout: &Layout, name: &str) -> Vec<(String, ValueType)> {
        match layout {
            Layout::List(list) if vector(list).is_none() => {
                let named = |i: usize| if list.len() == 1 { name.to_owned() } else { format!("{name}_{i}") };
                list.iter().enumerate().flat_map(|(i, layout)| self.flat(layout, &named(i))).collect()
            }
            layout => {
                let context = names::camel_case(name);
                self.value_type(layout, &context)
                    .map(|value_type| (name.to_owned(), value_type))
                    .into_iter()
                    .collect()
            }
        }
    }

    fn structure(&mut self, name: String, fields: Vec<(String, ValueType)>) -> Option<ValueType> {
        if fields.is_empty() {
            return None;
        }
        let members = fields.iter().map(|(_, value_type)| value_type.clone()).collect();
        let known = self.all.iter().position(|structure| structure.name == name);
        let place = known.unwrap_or(self.all.len());
        if known.is_none() {
            let by_hand = self.by_hand.contains(&name);
            self.all.push(Structure { name, fields, by_hand });
        } else if self.all[place].fields != fields {
            self.errors.push(format!("two structures are called {name}"));
        }
        Some(ValueType::Group(Kind::Structure(place), members))
    }
}

/// Two to four floats or integers form a vector.
fn vector(list: &[Layout]) -> Option<ValueType> {
    let n = list.len();
    let (kind, member) = match list.first()? {
        Layout::Float => (Kind::Floats(n as u32), Kind::Float),
        Layout::Uint => (Kind::Uints(n as u32), Kind::Uint),
        _ => return None,
    };
    let is_vector = (2..=4).contains(&n) && list.iter().all(|layout| *layout == list[0]);
    is_vector.then(|| ValueType::Group(kind, vec![ValueType::Number(member); n]))
}
