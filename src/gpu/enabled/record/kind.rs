//! What kinds of values WGSL has, and how the values of programs are made of them.

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
    /// A structure, by its place among [`Structures`].
    Structure(usize),
    /// What a function written by hand reads; only its fields are asked for, and their kinds are said there.
    Row,
}

/// A value of a program as a value in WGSL.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// One number.
    Number(Kind),
    /// A vector or a structure of others.
    Group(Kind, Vec<Shape>),
}

impl Shape {
    pub(super) fn kind(&self) -> Kind {
        match self {
            Shape::Number(kind) | Shape::Group(kind, _) => *kind,
        }
    }
    /// How many numbers there are.
    pub(super) fn len(&self) -> usize {
        match self {
            Shape::Number(_) => 1,
            Shape::Group(_, members) => members.iter().map(Shape::len).sum(),
        }
    }
}

/// A structure of WGSL.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Structure {
    pub(super) name: String,
    pub(super) fields: Vec<(String, Shape)>,
    /// Whether WGSL that is written by hand declares it.
    pub(super) by_hand: bool,
}

/// All structures, those first that others have as fields.
#[derive(Debug, Default)]
pub(super) struct Structures {
    all: Vec<Structure>,
    by_hand: HashSet<String>,
    pub(super) errors: Vec<String>,
}

impl Structures {
    /// With the names of those that WGSL written by hand declares.
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

    /// Declares one structure in WGSL.
    pub(super) fn declaration(&self, structure: usize) -> String {
        let Structure { name, fields, .. } = &self.all[structure];
        let mut text = format!("struct {name} {{\n");
        for (field, shape) in fields {
            text.push_str(&format!("    {field}: {},\n", self.kind_name(shape.kind())));
        }
        text + "}\n"
    }

    /// The structures that a kind needs, itself among them.
    pub(super) fn needs(&self, kind: Kind, into: &mut HashSet<usize>) {
        if let Kind::Structure(structure) = kind
            && into.insert(structure)
        {
            for (_, shape) in &self.all[structure].fields {
                self.needs(shape.kind(), into);
            }
        }
    }

    /// A value as one value of WGSL; none if it has no numbers. `context` names the structure of a tuple.
    pub(super) fn shape(&mut self, layout: &Layout, context: &str) -> Option<Shape> {
        match layout {
            Layout::Float => Some(Shape::Number(Kind::Float)),
            Layout::Uint => Some(Shape::Number(Kind::Uint)),
            Layout::Mask => Some(Shape::Number(Kind::Mask)),
            Layout::Vector => Some(Shape::Group(Kind::Floats(3), vec![Shape::Number(Kind::Float); 3])),
            Layout::Record { name, fields } => {
                let fields = fields.iter().filter_map(|(field, layout)| {
                    let context = format!("{name}{}", names::camel_case(field));
                    Some((names::of_field(field), self.shape(layout, &context)?))
                });
                let fields = fields.collect();
                self.structure((*name).to_owned(), fields)
            }
            Layout::List(list) => {
                if let Some(shape) = vector(list) {
                    return Some(shape);
                }
                if let [only] = list.as_slice() {
                    return self.shape(only, context);
                }
                let names = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth"];
                let fields = list.iter().enumerate().filter_map(|(i, layout)| {
                    let name = names.get(i).map_or_else(|| format!("number_{i}"), |&name| name.to_owned());
                    let context = format!("{context}{}", names::camel_case(&name));
                    Some((name, self.shape(layout, &context)?))
                });
                let fields = fields.collect();
                self.structure(context.to_owned(), fields)
            }
        }
    }

    /// The values that a block gives: the members of a tuple each for itself, and those of tuples among them.
    pub(super) fn members(&mut self, layout: &Layout) -> Vec<Shape> {
        let members = match layout {
            Layout::List(list) => list.as_slice(),
            one => std::slice::from_ref(one),
        };
        let shapes = members.iter().flat_map(|member| self.flat(member, "tuple"));
        shapes.map(|(_, shape)| shape).collect()
    }

    /// A value as several values of WGSL, with names: the members of tuples each for itself.
    pub(super) fn flat(&mut self, layout: &Layout, name: &str) -> Vec<(String, Shape)> {
        match layout {
            Layout::List(list) if vector(list).is_none() => {
                let named = |i: usize| if list.len() == 1 { name.to_owned() } else { format!("{name}_{i}") };
                list.iter().enumerate().flat_map(|(i, layout)| self.flat(layout, &named(i))).collect()
            }
            layout => {
                let context = names::camel_case(name);
                self.shape(layout, &context).map(|shape| (name.to_owned(), shape)).into_iter().collect()
            }
        }
    }

    fn structure(&mut self, name: String, fields: Vec<(String, Shape)>) -> Option<Shape> {
        if fields.is_empty() {
            return None;
        }
        let members = fields.iter().map(|(_, shape)| shape.clone()).collect();
        let known = self.all.iter().position(|structure| structure.name == name);
        let place = known.unwrap_or(self.all.len());
        if known.is_none() {
            let by_hand = self.by_hand.contains(&name);
            self.all.push(Structure { name, fields, by_hand });
        } else if self.all[place].fields != fields {
            self.errors.push(format!("two structures are called {name}"));
        }
        Some(Shape::Group(Kind::Structure(place), members))
    }
}

/// Two to four floats or integers are a vector.
fn vector(list: &[Layout]) -> Option<Shape> {
    let n = list.len();
    let (kind, member) = match list.first()? {
        Layout::Float => (Kind::Floats(n as u32), Kind::Float),
        Layout::Uint => (Kind::Uints(n as u32), Kind::Uint),
        _ => return None,
    };
    let is_vector = (2..=4).contains(&n) && list.iter().all(|layout| *layout == list[0]);
    is_vector.then(|| Shape::Group(kind, vec![Shape::Number(member); n]))
}
