//! A room imports only rooms above it.

use super::sources::{module_of, sources, src};
use super::tokens::tokens;
use std::fs;
use std::path::Path;

/// The rooms from top to bottom.
const ROOMS: [&str; 20] = [
    "math",
    "sampling",
    "parameter",
    "shape",
    "texture",
    "material",
    "light",
    "camera",
    "scene",
    "world",
    "integrator",
    "film",
    "render",
    "gpu",
    "output",
    "session",
    "api",
    "fleet",
    "cli",
    "main",
];

fn rank(room: &str) -> Option<usize> {
    ROOMS.iter().position(|&r| r == room)
}

/// The rooms to which a path at the crate's root refers: `a::…`, `{a::…, b}`, `*`. Starts after the `::`.
fn named(tokens: &[String]) -> Vec<String> {
    match tokens.first().map(String::as_str) {
        Some("{") => {
            let mut names = Vec::new();
            let (mut depth, mut expects) = (0, true);
            for token in tokens {
                match token.as_str() {
                    "{" => depth += 1,
                    "}" => depth -= 1,
                    "," if depth == 1 => expects = true,
                    name if depth == 1 && expects => {
                        names.push(name.to_owned());
                        expects = false;
                    }
                    _ => {}
                }
                if depth == 0 {
                    break;
                }
            }
            names
        }
        Some(name) => vec![name.to_owned()],
        None => Vec::new(),
    }
}

/// The forbidden imports of a source, given by its path below `src`.
fn violations(file: &Path, source: &str) -> Vec<String> {
    let mut module = module_of(file);
    let Some(own) = module.first().cloned() else { return Vec::new() };
    let Some(own_rank) = rank(&own) else {
        return vec![format!("{}: no room is called `{own}`", file.display())];
    };
    let tokens = tokens(source);
    let at = |i: usize| tokens.get(i).map(String::as_str).unwrap_or("");
    let mut found = Vec::new();
    // For each open brace, whether it opened a module.
    let mut braces = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        match at(i) {
            "{" => {
                let opens_module = i >= 2 && at(i - 2) == "mod";
                if opens_module {
                    module.push(at(i - 1).to_owned());
                }
                braces.push(opens_module);
            }
            "}" if braces.pop() == Some(true) => {
                module.pop();
            }
            "crate" if at(i + 1) == "::" => {
                judge(&named(&tokens[i + 2..]), own_rank, file, &mut found);
            }
            // `pub(crate)` refers to no room; anything else could be an alias for the root.
            "crate" if !(at(i - 1) == "(" && at(i + 1) == ")") => {
                found.push(format!("{}: the crate itself, by another name", file.display()));
            }
            "super" => {
                let mut steps = 1;
                while at(i + 1) == "::" && at(i + 2) == "super" {
                    (steps, i) = (steps + 1, i + 2);
                }
                if steps >= module.len() && at(i + 1) == "::" {
                    judge(&named(&tokens[i + 2..]), own_rank, file, &mut found);
                }
            }
            _ => {}
        }
        i += 1;
    }
    found
}

fn judge(names: &[String], own: usize, file: &Path, found: &mut Vec<String>) {
    for name in names {
        match rank(name) {
            Some(rank) if rank <= own => {}
            Some(_) => found.push(format!("{}: `{}` imports `{name}`, below it", file.display(), ROOMS[own])),
            None => found.push(format!("{}: `{name}` is no room", file.display())),
        }
    }
}

#[test]
fn every_room_imports_only_rooms_above_it() {
    let mut files = Vec::new();
    sources(&src(), &mut files);
    assert!(files.len() > 40, "only {} files", files.len());
    let mut found = Vec::new();
    for path in files {
        let file = path.strip_prefix(src()).unwrap();
        if file != Path::new("lib.rs") {
            found.extend(violations(file, &fs::read_to_string(&path).unwrap()));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn the_map_shows_the_rooms_in_their_order() {
    let map = fs::read_to_string(src().join("lib.rs")).unwrap();
    let rows = map.lines().filter_map(|line| line.strip_prefix("//! | [`")?.split('`').next());
    let shown: Vec<usize> = rows.map(|room| rank(room).unwrap_or_else(|| panic!("{room}"))).collect();
    assert!(shown.len() >= 13 && shown.is_sorted(), "{shown:?}");
    for line in map.lines().filter_map(|line| line.strip_prefix("pub mod ")) {
        let room = line.trim_end_matches(';');
        assert!(shown.contains(&rank(room).unwrap()), "`{room}` is not on the map");
    }
}

#[test]
fn violations_of_the_order_are_detected() {
    let found = |file: &str, source: &str| violations(Path::new(file), source).len();
    // Upwards, sideways and within: allowed.
    assert_eq!(found("world/simple.rs", "use crate::math::Ray; use super::Hit; use crate::world::Union;"), 0);
    assert_eq!(found("world/mod.rs", "use crate::{math::{Float, Ray}, shape::Shape};"), 0);
    assert_eq!(found("film/sums.rs", "mod tests { use super::*; use super::super::Picture; }"), 0);
    assert_eq!(
        found("math/ray.rs", "pub(crate) struct A<'a>(&'a str); // crate::film\n/* use crate::film; */"),
        0
    );
    assert_eq!(found("math/ray.rs", "const A: &str = \"use crate::film\"; const B: char = '\"';"), 0);
    // Downwards, in every notation.
    assert_eq!(found("math/ray.rs", "use crate::film::Film;"), 1);
    assert_eq!(found("math/ray.rs", "fn f() -> crate::film::Film { todo() }"), 1);
    assert_eq!(found("shape/plane.rs", "use crate::{math::{Ray, Vec3}, world::World, film};"), 2);
    assert_eq!(found("shape/plane.rs", "use super::super::world::World;"), 1);
    assert_eq!(found("shape/mod.rs", "use super::world::World;"), 1);
    assert_eq!(found("camera.rs", "use super::{scene::Scene, math::Ray};"), 1);
    assert_eq!(found("camera.rs", "mod tests { use super::super::scene; }"), 1);
    assert_eq!(found("camera.rs", "mod tests { use super::*; } use super::film;"), 1);
    assert_eq!(found("light/area.rs", "use crate :: /* sly */ integrator :: Integrator;"), 1);
    assert_eq!(found("light/area.rs", "const C: char = '{'; mod a { use super::super::super::film; }"), 1);
    assert_eq!(found("light/area.rs", "use crate::*;"), 1);
    assert_eq!(found("light/area.rs", "use crate as root; use root::film;"), 1);
    assert_eq!(found("light/area.rs", "use crate::helpers::f;"), 1);
    assert_eq!(found("attic/mod.rs", ""), 1);
}
