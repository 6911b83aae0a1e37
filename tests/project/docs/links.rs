//! Links lead somewhere.

use super::markdown;
use super::{documents, root, text};
use std::fs;
use std::path::Path;

/// What is wrong with the links of a text that stands in a file of this path.
fn broken(path: &str, text: &str) -> Vec<String> {
    let mut broken = Vec::new();
    for (line, target) in markdown::links(text) {
        if target.contains("://") || target.starts_with("mailto:") {
            continue;
        }
        let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
        let folder = Path::new(path).parent().expect("a folder");
        let linked = root().join(folder).join(file);
        let anchors = match file {
            "" => markdown::anchors(text),
            _ if !linked.exists() => {
                broken.push(format!("{path}:{line}: there is no {file}"));
                continue;
            }
            _ if anchor.is_empty() => continue,
            _ => markdown::anchors(&fs::read_to_string(&linked).unwrap_or_default()),
        };
        if !anchors.iter().any(|other| other == anchor) {
            broken.push(format!("{path}:{line}: there is no heading for {target}"));
        }
    }
    broken
}

/// Paths in the inline code of a text that lead nowhere. `NAME` in one stands for any name, and charts are made.
fn lost_paths(path: &str, text: &str) -> Vec<String> {
    let text = markdown::without_code(text);
    let lines = text.lines().enumerate();
    let codes = lines.flat_map(|(i, line)| line.split('`').skip(1).step_by(2).map(move |code| (i + 1, code)));
    let is_path = |code: &str| {
        let folders = ["src/", "tests/", "benches/", "docs/", "scenes/", "examples/", "fuzz/"];
        let is_made = code.contains("NAME") || code.ends_with(".svg") || code.contains([' ', '*']);
        folders.iter().any(|folder| code.starts_with(folder)) && !is_made
    };
    let lost = codes.filter(|(_, code)| is_path(code) && !root().join(code).exists());
    lost.map(|(line, code)| format!("{path}:{line}: there is no {code}")).collect()
}

#[test]
fn paths_lead_to_files() {
    let lost: Vec<_> = documents().iter().flat_map(|path| lost_paths(path, &text(path))).collect();
    assert!(lost.is_empty(), "{}", lost.join("\n"));
    let made = "`src/lib.rs` `src/NAME.rs` `docs/a.svg`\n`src/none.rs` src/lost.rs\n";
    assert_eq!(lost_paths("made.md", made), ["made.md:2: there is no src/none.rs"]);
}

#[test]
fn links_lead_to_files_and_headings() {
    let documents = documents().into_iter().chain(["docs/SUMMARY.md".to_owned()]);
    let broken: Vec<_> = documents.flat_map(|path| broken(&path, &text(&path))).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn broken_links_are_found() {
    let of = |text: &str| broken("docs/made.md", text);
    assert_eq!(of("[a](scene-format.md#film) [b](../README.md) [c](#d)\n# D\n"), [""; 0]);
    assert_eq!(of("\n[a](nowhere.md)"), ["docs/made.md:2: there is no nowhere.md"]);
    assert_eq!(of("![a](pictures/none.png)"), ["docs/made.md:1: there is no pictures/none.png"]);
    assert_eq!(
        of("[a](scene-format.md#none)"),
        ["docs/made.md:1: there is no heading for scene-format.md#none"]
    );
    assert_eq!(of("[a](#none)"), ["docs/made.md:1: there is no heading for #none"]);
}
