//! The check that no object contains itself, and that objects are not nested too deep.

use super::limits::MOST_NESTING;
use super::object::{Object, Property, Value};
use super::report::Place;

/// The first error in the nesting of objects, and its place. The first object is the scene.
pub(super) fn problem(objects: &[Object]) -> Option<(Place, String)> {
    // Depth-first search with an explicit stack, because a file may have a long chain of objects.
    let mut nesting: Vec<Option<usize>> = vec![None; objects.len()];
    let mut open = vec![false; objects.len()];
    let mut stack = vec![(0, 0)];
    *open.first_mut()? = true;
    while let Some((object, next)) = stack.last_mut() {
        let (object, at) = (*object, *next);
        *next += 1;
        match objects[object].properties.get(at) {
            Some(&Property { value: Value::Object(named), place, .. }) => {
                if open[named] {
                    return Some((place, format!("{} contains itself", objects[named].what())));
                }
                if nesting[named].is_none() {
                    open[named] = true;
                    stack.push((named, 0));
                }
            }
            Some(_) => {}
            None => {
                let deepest = objects[object].objects().filter_map(|(named, _)| nesting[named]).max();
                let depth = deepest.map_or(0, |deepest| deepest + 1);
                if depth > MOST_NESTING {
                    let message = format!("objects are nested more than {MOST_NESTING} deep");
                    return Some((objects[object].place, message));
                }
                nesting[object] = Some(depth);
                open[object] = false;
                stack.pop();
            }
        }
    }
    None
}
