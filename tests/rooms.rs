//! A room imports only rooms above it.

use std::fs;
use std::path::{Path, PathBuf};

/// The rooms from top to bottom.
const ROOMS: [&str; 16] = [
    "math",
    "sampling",
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
