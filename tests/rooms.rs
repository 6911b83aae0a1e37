//! A room imports only rooms above it, and no two files of a room import each other, not by way of others either.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms from top to bottom.
const ROOMS: [&str; 18] = [
    "math",
    "sampling",
    "parameter",
    "shape",
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
    "cli",
    "main",
];

fn rank(room: &str) -> Option<usize> {
    ROOMS.iter().position(|&r| r == room)
}

/// Words and punctuation of a source, without comments and the insides of strings.
fn tokens(source: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = source;
    while let Some(c) = rest.chars().next() {
        let len = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            comment(rest)
        } else if let Some(len) = raw_string(rest) {
            len
        } else if c == '"' {
            quoted(rest, '"')
        } else if c == '\'' && is_char(rest) {
            quoted(rest, '\'')
        } else if c.is_alphanumeric() || c == '_' {
            let len = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            tokens.push(rest[..len].to_owned());
            len
        } else if rest.starts_with("::") {
            tokens.push("::".to_owned());
            2
        } else {
            if !c.is_whitespace() {
                tokens.push(c.to_string());
            }
            c.len_utf8()
        };
        rest = &rest[len..];
    }
    tokens
}

/// Block comments nest.
fn comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        let step = match &text.as_bytes()[at..] {
            [b'/', b'*', ..] => {
                depth += 1;
                2
            }
            [b'*', b'/', ..] => {
                depth -= 1;
                2
            }
            _ => 1,
        };
        at += step;
        if depth == 0 {
            break;
        }
    }
    at
}

fn raw_string(text: &str) -> Option<usize> {
    let after = text.strip_prefix("br").or_else(|| text.strip_prefix('r'))?;
    let hashes = after.len() - after.trim_start_matches('#').len();
    let body = after[hashes..].strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(hashes));
    let close = body.find(&end).map_or(body.len(), |at| at + end.len());
    Some(text.len() - body.len() + close)
}

/// Whether a quote opens a character and no lifetime.
fn is_char(text: &str) -> bool {
    let mut chars = text[1..].chars();
    matches!((chars.next(), chars.next()), (Some('\\'), _) | (Some(_), Some('\'')))
}

fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + c.len_utf8(),
            _ => {}
        }
    }
    text.len()
}

/// The rooms that a path at the crate's root names: `a::…`, `{a::…, b}`, `*`. Starts after the `::`.
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

/// The module that a file holds, as a path from the crate's root.
fn module_of(file: &Path) -> Vec<String> {
    let mut module: Vec<String> =
        file.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if module.last().is_some_and(|last| last == "mod") {
        module.pop();
    }
    module
}

/// What a source, at a path below `src`, imports that it must not.
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
            // `pub(crate)` names no room; anything else could be an alias for the root.
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

fn sources(dir: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
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

/// The modules of a crate: what their files say.
#[derive(Default)]
struct Modules {
    /// Tokens by the module's path from the crate's root, tests left out.
    tokens: BTreeMap<Vec<String>, Vec<String>>,
}

/// A path as a source has it.
struct Named {
    /// From the crate's root.
    path: Vec<String>,
    /// The name by which the source knows what it leads to.
    known: String,
    /// Whether the source only passes it on, as by `pub use`.
    is_passed_on: bool,
}

impl Modules {
    fn add(&mut self, file: &Path, source: &str) {
        let is_test = file.iter().any(|part| part == "tests" || part == "tests.rs");
        if !is_test {
            self.tokens.insert(module_of(file), without_tests(tokens(source)));
        }
    }

    /// The modules of the same room that each module takes something from.
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

    /// The module that defines what a path from the crate's root leads to, through the names that modules pass on.
    fn definer(&self, path: &[String], passed_on: usize) -> Option<&[String]> {
        let depth = (1..=path.len()).rev().find(|&depth| self.tokens.contains_key(&path[..depth]))?;
        let (module, tokens) = self.tokens.get_key_value(&path[..depth])?;
        let Some(name) = path.get(depth) else { return Some(module) };
        let known = paths(tokens, module);
        // A name that the module itself knows from elsewhere; no name goes through many hands.
        match known.iter().find(|named| named.known == *name && named.path != path) {
            Some(named) if passed_on < 8 => self.definer(&named.path, passed_on + 1),
            _ => Some(module),
        }
    }

    /// Groups of modules of which each takes something from each other, be it by way of others.
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

/// Tokens without modules and functions that only tests have.
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

/// The paths in some tokens that begin with `crate`, `super` or `self`, from the crate's root, with the names by which
/// a `use` makes what they lead to known. A path within a module that the tokens open counts as the outer module's.
fn paths(tokens: &[String], module: &[String]) -> Vec<Named> {
    let mut found = Vec::new();
    // Since the last `use` of a `pub use`: what comes up to the semicolon is passed on.
    let mut passes_on = false;
    let mut i = 0;
    while i < tokens.len() {
        if tokens[i] == ";" {
            passes_on = false;
        }
        if tokens[i] == "use" && i > 0 && (tokens[i - 1] == "pub" || tokens[i - 1] == ")") {
            passes_on = true;
        }
        let begins = matches!(tokens[i].as_str(), "crate" | "super" | "self")
            && tokens.get(i + 1).is_some_and(|next| next == "::")
            && (i == 0 || tokens[i - 1] != "::");
        if begins {
            let mut base = match tokens[i].as_str() {
                "crate" => Vec::new(),
                "self" => module.to_vec(),
                _ => module[..module.len().saturating_sub(1)].to_vec(),
            };
            let mut at = i + 2;
            while tokens.get(at).is_some_and(|token| token == "super") {
                base.pop();
                at += 2;
            }
            i = tree(tokens, at, &base, passes_on, &mut found);
        } else if tokens[i] == "use"
            && tokens.get(i + 2).is_some_and(|next| next == "::")
            && tokens[i + 1] != "::"
        {
            // Of a module of its own: `pub use simple::Simple`.
            if !matches!(tokens[i + 1].as_str(), "crate" | "super" | "self") {
                i = tree(tokens, i + 1, module, passes_on, &mut found);
                continue;
            }
            i += 1;
        } else if is_part(tokens, i) {
            i = tree(tokens, i, module, passes_on, &mut found);
        } else {
            i += 1;
        }
    }
    found
}

/// Whether a path begins here with the name of a module that the tokens declare: `noise::least()`.
fn is_part(tokens: &[String], i: usize) -> bool {
    let is_path = tokens.get(i + 1).is_some_and(|next| next == "::") && (i == 0 || tokens[i - 1] != "::");
    is_path && tokens.windows(3).any(|some| some[0] == "mod" && some[1] == tokens[i] && some[2] == ";")
}

/// A tree of names behind a path; returns where it ends.
fn tree(
    tokens: &[String],
    mut at: usize,
    base: &[String],
    is_passed_on: bool,
    found: &mut Vec<Named>,
) -> usize {
    let mut path = base.to_vec();
    loop {
        match tokens.get(at).map(String::as_str) {
            Some("{") => {
                at += 1;
                while tokens.get(at).is_some_and(|token| token != "}") {
                    at = tree(tokens, at, &path, is_passed_on, found);
                    if tokens.get(at).is_some_and(|token| token == ",") {
                        at += 1;
                    }
                }
                return at + 1;
            }
            Some("self") if tokens.get(at + 1).is_none_or(|token| token != "::") => {
                let known = path.last().cloned().unwrap_or_default();
                found.push(Named { path, known, is_passed_on });
                return at + 1;
            }
            Some(name) if name.chars().all(|c| c.is_alphanumeric() || c == '_') => {
                path.push(name.to_owned());
                at += 1;
            }
            _ => return at + 1,
        }
        if tokens.get(at).is_some_and(|token| token == "::") {
            at += 1;
            continue;
        }
        let mut known = path.last().cloned().unwrap_or_default();
        if tokens.get(at).is_some_and(|token| token == "as") {
            known = tokens.get(at + 1).cloned().unwrap_or_default();
            at += 2;
        }
        found.push(Named { path, known, is_passed_on });
        return at;
    }
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
fn circles_are_found_in_all_the_ways_that_they_can_be_written() {
    let circles = |files: &[(&str, &str)]| {
        let mut modules = Modules::default();
        files.iter().for_each(|(file, source)| modules.add(Path::new(file), source));
        modules.circles()
    };
    let pair = [vec!["film::noise".to_owned(), "film::plan".to_owned()]];
    // Both ways, by whatever path; by way of what the folder passes on; not in tests.
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
    // Through a third; by a folder's own file, unless that only passes its parts on.
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

/// Whether a source makes a ray out of numbers, be it only its origin.
fn makes_rays(source: &str) -> bool {
    let tokens = tokens(source);
    let is_field = |token: &str| ["o", "d", "time", "."].contains(&token);
    tokens.iter().any(|token| token == "offset_origin")
        || tokens.windows(3).any(|three| {
            let [name, then, last] = [0, 1, 2].map(|i| three[i].as_str());
            name == "Ray" && (then == "{" && is_field(last) || then == "::" && last == "new")
        })
}

#[test]
fn integrators_get_their_rays_from_cameras_and_interactions() {
    let mut files = Vec::new();
    sources(&src().join("integrator"), &mut files);
    assert!(files.len() > 8, "only {} files", files.len());
    for file in files {
        assert!(!makes_rays(&fs::read_to_string(&file).unwrap()), "{} makes a ray", file.display());
    }
    for makes in [
        "Ray { o, d }",
        "math::Ray {d: n, o: p}",
        "Ray::new(o, d)",
        "crate::shape::offset_origin(p, n, error, d)",
    ] {
        assert!(makes_rays(makes), "{makes}");
    }
    for does_not in
        ["Event::Ray { depth, origin }", "at.scattered(d)", "// Ray { o, d }", "fn f() -> Ray { at }"]
    {
        assert!(!makes_rays(does_not), "{does_not}");
    }
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
fn ways_round_the_order_are_caught() {
    let found = |file: &str, source: &str| violations(Path::new(file), source).len();
    // Upwards, sideways and within: fine.
    assert_eq!(found("world/simple.rs", "use crate::math::Ray; use super::Hit; use crate::world::Union;"), 0);
    assert_eq!(found("world/mod.rs", "use crate::{math::{Float, Ray}, shape::Shape};"), 0);
    assert_eq!(found("film/sums.rs", "mod tests { use super::*; use super::super::Picture; }"), 0);
    assert_eq!(
        found("math/ray.rs", "pub(crate) struct A<'a>(&'a str); // crate::film\n/* use crate::film; */"),
        0
    );
    assert_eq!(found("math/ray.rs", "const A: &str = \"use crate::film\"; const B: char = '\"';"), 0);
    // Downwards, in all the ways that it can be written.
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
