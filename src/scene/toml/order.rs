//! The order of tables that refer to each other.

use super::declared::Values;
use super::report::{Diagnostics, Placed, Read, Reported};
use super::table::Named;
use crate::scene::names::{self, Disorder, MAX_NESTING, Names};
use crate::scene::spelling::quote;

/// Materials or textures in an order in which each follows those that it refers to.
pub(super) fn order(
    raw: &[Named<Read<Values>>],
    edges: &[Vec<Placed<usize>>],
    names: &Names<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<Vec<usize>, Reported> {
    let named: Vec<Vec<usize>> =
        edges.iter().map(|edges| edges.iter().map(|edge| edge.value).collect()).collect();
    names::order(&named, |disorder| match disorder {
        Disorder::Circle { nodes, last, edge } => {
            let kind = kind(&raw[nodes[0]]);
            let message = format!("{kind} contains itself: {}", names.circle(&nodes));
            diagnostics.error(edges[last][edge].at, message)
        }
        Disorder::TooDeep(node) => {
            let (kind, name) = (kind(&raw[node]), quote(&raw[node].name));
            let message = format!("{kind} {name} is nested more than {MAX_NESTING} levels deep");
            diagnostics.error(raw[node].at, message)
        }
    })
}

/// The name of a material's or a texture's kind.
fn kind(named: &Named<Read<Values>>) -> &'static str {
    named.value.as_ref().map_or("material", |values| values.declaration.name)
}
