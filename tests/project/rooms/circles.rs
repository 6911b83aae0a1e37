//! No two files of a module import each other, directly or indirectly.

use super::paths::paths;
use super::sources::{module_of, sources, src};
use super::tokens::tokens;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The modules of a crate, with their contents.
#[derive(Default)]
struct Modules {
    /// Tokens by the module's path from the crate's root, without tests.
    tokens: BTreeMap<Vec<String>, Vec<String>>,
}

impl Modules {
    fn add(&mut self, file: &Path, source: &str) {
        let is_test = file.iter().any(|part| part == "tests" || part == "tests.rs");
        if !is_test {
            self.tokens.insert(module_of(file), without_tests(tokens(source)));
        }
    }

    /// The modules of the same room from which each module imports.
    fn imports(&self) -> BTreeMap<&[String], BTreeSet<&[String]>> {
        let mut imports = BTreeMap::new();
        for (module, tokens) in &self.tokens {
            let paths = paths(tokens, module);
            let taken = paths.iter().filter(|named| !named.is_passed_on);
            let from = taken.filter_map(|named| self.definer(&named.path, 0));
            let others = from.filter(|other| *other != module.as_slice() && other.first() == module.first());
            imports.insert(module.as_slice(), others.collect::<BTreeSet<_>>());
        }
        imports
    }

    /// The module that defines the target of a path from the crate's root, with re-exports resolved.
    fn definer(&self, path: &[String], passed_on: usize) -> Option<&[String]> {
        let depth = (1..=path.len()).rev().find(|&depth| self.tokens.contains_key(&path[..depth]))?;
        let (module, tokens) = self.tokens.get_key_value(&path[..depth])?;
        let Some(name) = path.get(depth) else { return Some(module) };
        let known = paths(tokens, module);
        // A name that the module imports itself; chains of re-exports are short.
        match known.iter().find(|named| named.known == *name && named.path != path) {
            Some(named) if passed_on < 8 => self.definer(&named.path, passed_on + 1),
            _ => Some(module),
        }
    }

    /// Groups of modules that import from each other, directly or indirectly.
    fn circles(&self) -> Vec<Vec<String>> {
        let imports = self.imports();
        let reached = |from: &[String]| {
            let mut seen = BTreeSet::new();
            let mut open: Vec<&[String]> = imports[from].iter().copied().collect();
            while let Some(next) = open.pop() {
                if seen.insert(next) {
                    open.extend(&imports[next]);
                }
            }
            seen
        };
        let all: BTreeMap<_, _> = imports.keys().map(|&module| (module, reached(module))).collect();
        let mut circles = BTreeSet::new();
        for (module, reached) in &all {
            if reached.contains(module) {
                let members =
                    all.iter().filter(|(other, back)| reached.contains(*other) && back.contains(module));
                circles.insert(members.map(|(member, _)| member.join("::")).collect::<Vec<_>>());
            }
        }
        circles.into_iter().collect()
    }
}

/// Tokens without modules and functions for tests.
fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let mut kept = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        let is_test =
            ["#", "[", "cfg", "(", "test", ")", "]"].iter().zip(&tokens[i..]).filter(|(a, b)| a == b).count()
                == 7;
        if is_test {
            let mut depth = 0;
            while i < tokens.len() {
                match tokens[i].as_str() {
                    "{" => depth += 1,
                    "}" if depth == 1 => break,
                    "}" => depth -= 1,
                    ";" if depth == 0 => break,
                    _ => {}
                }
                i += 1;
            }
        } else {
            kept.push(tokens[i].clone());
        }
        i += 1;
    }
    kept
}

#[test]
fn no_two_files_of_a_room_import_each_other() {
    let mut files = Vec::new();
    sources(&src(), &mut files);
    let mut modules = Modules::default();
    for path in files {
        let file = path.strip_prefix(src()).unwrap();
        if file != Path::new("lib.rs") {
            modules.add(file, &fs::read_to_string(&path).unwrap());
        }
    }
    let arrows: usize = modules.imports().values().map(BTreeSet::len).sum();
    assert!(arrows > 150, "only {arrows} imports within rooms are seen");
    let circles = modules.circles();
    assert!(circles.is_empty(), "circles of files: {circles:#?}");
}

#[test]
fn cycles_are_found_in_every_notation() {
    let circles = |files: &[(&str, &str)]| {
        let mut modules = Modules::default();
        files.iter().for_each(|(file, source)| modules.add(Path::new(file), source));
        modules.circles()
    };
    let pair = [vec!["film::noise".to_owned(), "film::plan".to_owned()]];
    // Both ways, by any path; by way of re-exports of the folder; not in tests.
    let there = ("film/noise.rs", "use super::plan::Plan;");
    assert_eq!(circles(&[there, ("film/plan.rs", "use super::noise::{self, Noise};")]), pair);
    assert_eq!(circles(&[there, ("film/plan.rs", "fn f() -> crate::film::noise::Noise {}")]), pair);
    let folder =
        ("film/mod.rs", "mod noise; mod plan; pub use noise::{Noise, least}; pub use plan::Plan as Goal;");
    let by_folder = ("film/noise.rs", "use super::Goal;");
    assert_eq!(
        circles(&[folder, by_folder, ("film/plan.rs", "use crate::film::{least as most, Other};")]),
        pair
    );
    assert_eq!(
        circles(&[folder, by_folder, ("film/plan.rs", "mod tests { use super::super::Noise; }")]).len(),
        0
    );
    assert_eq!(
        circles(&[there, ("film/plan.rs", "#[cfg(test)] mod tests { use crate::film::noise; }")]).len(),
        0
    );
    // Through a third module; by a folder's own file, unless it only re-exports its parts.
    let third = [
        ("film/a.rs", "use super::b::B;"),
        ("film/b.rs", "use super::c::C;"),
        ("film/c.rs", "use super::a::A;"),
    ];
    assert_eq!(circles(&third)[0].len(), 3);
    let uses = ("film/mod.rs", "mod a; use a::A; pub struct B(A);");
    assert_eq!(circles(&[uses, ("film/a.rs", "use super::B;")]).len(), 1);
    let calls = ("film/mod.rs", "mod a; pub struct B; fn f() { a::g() }");
    assert_eq!(circles(&[calls, ("film/a.rs", "use super::B;")]).len(), 1);
    assert_eq!(circles(&[calls, ("film/a.rs", "use super::super::math::B;")]).len(), 0);
    assert_eq!(
        circles(&[("film/mod.rs", "mod a; pub use a::A; pub struct B;"), ("film/a.rs", "use super::B;")])
            .len(),
        0
    );
}
