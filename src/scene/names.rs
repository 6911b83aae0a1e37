//! Names of materials and textures: their indices, and an order in which each follows those that it refers to.

use super::spelling::{list, nearest, quote, shorten};
use std::collections::HashMap;

/// The maximum nesting of materials: the GPU resolves them with a bounded loop.
pub const MAX_NESTING: usize = 16;

/// Finds materials or textures by name.
pub struct Names<'n> {
    what: &'static str,
    names: Vec<&'n str>,
    by_name: HashMap<&'n str, usize>,
}

impl<'n> Names<'n> {
    /// The names of materials in their order, without duplicates.
    pub fn new(names: impl Iterator<Item = &'n str>) -> Self {
        Self::of("materials", names)
    }

    /// The same for items with another word in messages, such as "groups".
    pub fn of(what: &'static str, names: impl Iterator<Item = &'n str>) -> Self {
        let names: Vec<_> = names.collect();
        let by_name = names.iter().enumerate().map(|(i, name)| (*name, i)).collect();
        Self { what, names, by_name }
    }

    /// The index of the material with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// A suggestion for an unknown name; `None` if there are no materials.
    pub fn instead(&self, name: &str) -> Option<String> {
        match nearest(name, self.names.iter().copied()) {
            Some(nearest) => Some(format!("did you mean {}?", quote(nearest))),
            None => list(self.names.iter().copied()).map(|all| format!("the {} are {all}", self.what)),
        }
    }

    /// A cycle as `a → b → a`, shortened in the middle if it is long.
    pub fn circle(&self, nodes: &[usize]) -> String {
        let mut text = String::new();
        for &node in nodes.iter().take(MOST_SHOWN) {
            text += &format!("{} → ", shorten(self.names[node]));
        }
        if nodes.len() > MOST_SHOWN {
            text += "… → ";
        }
        text + &nodes.first().map_or_else(String::new, |&first| shorten(self.names[first]))
    }
}

/// The maximum number of materials of a cycle in a message.
const MOST_SHOWN: usize = 8;

/// The reason why materials cannot be ordered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Disorder {
    /// A material contains itself.
    Circle {
        /// The material and the chain to itself, truncated if it is long.
        nodes: Vec<usize>,
        /// The last of the chain, which refers to the first.
        last: usize,
        /// The reference in it, by its position.
        edge: usize,
    },
    /// Materials are nested more than [`MAX_NESTING`] levels deep. The materials that contain this one are not
    /// reported.
    TooDeep(usize),
}

/// The materials in an order in which each follows those that it refers to: `edges[i]` are those that material i refers
/// to.
///
/// If there is no such order, `report` is called with each reason, and its last result is the error.
pub fn order<E>(edges: &[Vec<usize>], mut report: impl FnMut(Disorder) -> E) -> Result<Vec<usize>, E> {
    // Depth first with an explicit stack: a file may chain as many materials as it has room for.
    let mut marks = vec![Mark::New; edges.len()];
    let mut nesting = vec![0; edges.len()];
    let mut order = Vec::with_capacity(edges.len());
    let mut outcome = Ok(());
    for root in 0..edges.len() {
        if marks[root] != Mark::New {
            continue;
        }
        marks[root] = Mark::Open;
        let mut stack = vec![(root, edges[root].iter().enumerate())];
        while let Some((node, rest)) = stack.last_mut() {
            let node = *node;
            let Some((edge, &named)) = rest.next() else {
                stack.pop();
                marks[node] = Mark::Done;
                order.push(node);
                nesting[node] = edges[node].iter().map(|&named| nesting[named] + 1).max().unwrap_or(0);
                if nesting[node] == MAX_NESTING + 1 {
                    outcome = Err(report(Disorder::TooDeep(node)));
                }
                continue;
            };
            match marks[named] {
                Mark::New => {
                    marks[named] = Mark::Open;
                    stack.push((named, edges[named].iter().enumerate()));
                }
                Mark::Open => {
                    // No more than are shown: a file may have as many cycles as materials.
                    let nodes = stack.iter().map(|(i, _)| *i).skip_while(|i| *i != named);
                    let nodes = nodes.take(MOST_SHOWN + 1).collect();
                    outcome = Err(report(Disorder::Circle { nodes, last: node, edge }));
                }
                Mark::Done => {}
            }
        }
    }
    outcome.map(|()| order)
}

/// The progress of a material in [`order`].
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    New,
    Open,
    Done,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_get_the_nearest_suggestion() {
        let names = Names::new(["red", "green"].into_iter());
        assert_eq!((names.find("green"), names.find("rad")), (Some(1), None));
        assert_eq!(names.instead("rad").as_deref(), Some("did you mean \"red\"?"));
        assert_eq!(names.instead("velvet").as_deref(), Some("the materials are \"red\", \"green\""));
        assert_eq!(Names::new([].into_iter()).instead("red"), None);
        assert_eq!(names.circle(&[0, 1]), "red → green → red");
        let long = names.circle(&[0, 1, 0, 1, 0, 1, 0, 1, 0]);
        assert_eq!(long, "red → green → red → green → red → green → red → green → … → red");
    }

    #[test]
    fn each_follows_those_that_it_refers_to() {
        let order = |edges: &[Vec<usize>]| {
            let mut reported = Vec::new();
            order(edges, |disorder| reported.push(disorder)).map_err(|()| reported)
        };
        assert_eq!(order(&[vec![2, 1], vec![2], vec![]]), Ok(vec![2, 1, 0]));
        assert_eq!(order(&[]), Ok(vec![]));
        let itself = Disorder::Circle { nodes: vec![0], last: 0, edge: 1 };
        assert_eq!(order(&[vec![1, 0], vec![]]), Err(vec![itself]));
        let circle = Disorder::Circle { nodes: vec![1, 2], last: 2, edge: 0 };
        assert_eq!(order(&[vec![1], vec![2], vec![1]]), Err(vec![circle]));
        // So many that recursion would overflow the stack.
        let chain =
            |length: usize| (0..length).map(|i| (i + 1..length).take(1).collect()).collect::<Vec<_>>();
        assert_eq!(order(&chain(MAX_NESTING + 1)).map(|order| order[0]), Ok(MAX_NESTING));
        let deep = 1_000_000;
        assert_eq!(order(&chain(deep)), Err(vec![Disorder::TooDeep(deep - MAX_NESTING - 2)]));
    }
}
