//! Long sentences, in documents, help texts and messages.

use super::markdown::{without_code, without_inline_code, words};
use super::{documents, root, text};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The most words of a sentence.
const MOST: usize = 35;

/// How sentences begin that are meant to be long.
const MEANT: &[&str] = &[
    // A remedy with the figures that it needs.
    "the picture is black: no sample saw light",
    "others are as bright as {brightest",
    "warning: {too_bright} samples are infinite",
    "{silence}: it held the samples",
    // Lists of names.
    "Layers that EXR files get beside colour",
];

/// Sentences of a paragraph with more words than [`MOST`].
fn long(paragraph: &str) -> Vec<String> {
    let mut sentences = vec![String::new()];
    for word in paragraph.split_whitespace() {
        let sentence = sentences.last_mut().expect("a sentence");
        if !sentence.is_empty() {
            sentence.push(' ');
        }
        *sentence += word;
        if word.trim_end_matches(['"', ')', '*', '_']).ends_with(['.', '!', '?']) {
            sentences.push(String::new());
        }
    }
    let is_meant = |sentence: &String| MEANT.iter().any(|start| sentence.starts_with(start));
    sentences.into_iter().filter(|s| words(s) > MOST && !is_meant(s)).collect()
}

/// The paragraphs of a Markdown text: items of lists and cells of tables are ones, targets of links are left out.
fn paragraphs(text: &str) -> Vec<String> {
    let mut paragraphs = vec![String::new()];
    for line in without_code(text).lines() {
        let line = without_inline_code(line);
        let start = line.trim_start();
        if start.starts_with('|') {
            paragraphs.extend(start.split('|').map(str::to_owned));
            paragraphs.push(String::new());
            continue;
        }
        let number = start.split_once(". ").is_some_and(|(n, _)| n.parse::<u32>().is_ok());
        if start.is_empty() || start.starts_with(['#', '-', '*']) || number {
            paragraphs.push(String::new());
        }
        let mut parts = start.split("](");
        let mut kept = parts.next().expect("a first part").to_owned();
        for part in parts {
            kept += part.split_once(')').map_or("", |(_, rest)| rest);
        }
        let paragraph = paragraphs.last_mut().expect("a paragraph");
        *paragraph += &kept;
        paragraph.push(' ');
    }
    paragraphs
}

/// The string literals of Rust code, without those of its tests; `\` at the end of a line joins it to the next.
fn literals(code: &str) -> Vec<String> {
    let code = code.split("#[cfg(test)]").next().expect("a first part");
    let (mut literals, mut rest) = (Vec::new(), code);
    while let Some(at) = rest.find(['"', '\'', '/']) {
        let (before, from) = rest.split_at(at);
        let is_raw = before.ends_with('r') || before.ends_with('#');
        rest = match from.as_bytes() {
            [b'/', b'/', ..] => from.split_once('\n').map_or("", |(_, rest)| rest),
            // A character, not the start of a lifetime.
            [b'\'', b'"', b'\'', ..] => &from[3..],
            [b'\'', b'\\', b'"' | b'\'' | b'\\', b'\'', ..] => &from[4..],
            [b'"', ..] if is_raw => from[1..].split_once('"').map_or("", |(_, rest)| rest),
            [b'"', ..] => {
                let mut end = 1;
                while !matches!(from.as_bytes().get(end), None | Some(b'"')) {
                    end += if from.as_bytes()[end] == b'\\' { 2 } else { 1 };
                }
                let literal = from.get(1..end).unwrap_or_default();
                let lines: Vec<_> = literal.split("\\\n").map(str::trim_start).collect();
                literals.push(lines.concat());
                from.get(end + 1..).unwrap_or_default()
            }
            _ => &from[1..],
        };
    }
    literals
}

/// The files of Rust code below a folder, without tests.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests");
        match path.is_dir() {
            true if !is_test => sources(&path, found),
            false if !is_test && path.extension().is_some_and(|e| e == "rs") => found.push(path),
            _ => {}
        }
    }
    found.sort();
}

fn list(found: &[String]) {
    assert!(found.is_empty(), "sentences of more than {MOST} words:\n{}", found.join("\n"));
}

#[test]
fn sentences_of_documents_are_short() {
    let of = |path: String| {
        let sentences = paragraphs(&text(&path)).iter().flat_map(|p| long(p)).collect::<Vec<_>>();
        sentences.into_iter().map(move |sentence| format!("{path}: {sentence}"))
    };
    list(&documents().into_iter().flat_map(of).collect::<Vec<_>>());
}

#[test]
fn sentences_of_help_texts_are_short() {
    let mut found = Vec::new();
    let commands = [
        "",
        "render",
        "check",
        "trace",
        "split",
        "merge",
        "develop",
        "compare",
        "convert",
        "info",
        "bench",
        "bench threads",
        "bench depth",
        "bench noise",
    ];
    let with_fleet = [
        "submit",
        "work",
        "jobs",
        "jobs list",
        "jobs watch",
        "jobs cancel",
        "jobs remove",
        "jobs collect",
        "jobs extend",
        "jobs priority",
        "fleet",
        "fleet local",
    ];
    for command in commands.into_iter().chain(with_fleet.into_iter().filter(|_| cfg!(feature = "fleet"))) {
        let arguments = command.split_whitespace().chain(["--help"]);
        let output = Command::new(env!("CARGO_BIN_EXE_stride")).args(arguments).output().expect("it runs");
        let help = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(help.contains("Usage: stride"), "{help}");
        // An option's text ends where an empty line or another option follows.
        let lines = help.lines().map(|line| match line.trim_start().starts_with('-') {
            true => format!("\n\n{line}\n\n"),
            false => format!("{line}\n"),
        });
        let paragraphs = lines.collect::<String>();
        let prose = paragraphs.split("\n\n").filter(|text| !text.trim_start().starts_with("Commands:"));
        found.extend(prose.flat_map(long).map(|s| format!("{command}: {s}")));
    }
    list(&found);
}

#[test]
fn sentences_of_messages_are_short() {
    let mut paths = Vec::new();
    sources(&root().join("src"), &mut paths);
    assert!(paths.len() > 100);
    let mut found = Vec::new();
    for path in paths {
        let code = fs::read_to_string(&path).expect("code");
        let messages = literals(&code);
        // Programs and style sheets in strings have braces at the ends of lines.
        let is_prose = |literal: &&String| !["{\n", "}\n", ";\n"].iter().any(|end| literal.contains(end));
        let sentences = messages.iter().filter(is_prose).flat_map(|literal| long(literal));
        found.extend(sentences.map(|sentence| format!("{}: {sentence}", path.display())));
    }
    list(&found);
}

#[test]
fn long_sentences_are_found() {
    let words = |n: usize| vec!["word"; n].join(" ");
    let (short, too_long) = (words(MOST) + ".", words(MOST + 1) + ".");
    let of = |text: &str| paragraphs(text).iter().flat_map(|p| long(p)).count();
    assert_eq!(of(&format!("{short} {short}\n\n{short}")), 0);
    assert_eq!(of(&format!("{short} {too_long}\n\n- {too_long}\n- {short}")), 2);
    assert_eq!(of(&format!("| {short} | {too_long} |")), 1);
    assert_eq!(of(&format!("```\n{too_long}\n```\n")), 0, "code is not prose");
    let joined = format!("{}\n{}.", words(20), words(20));
    assert_eq!(of(&joined), 1, "a sentence may take several lines");
    let code = r##"let (a, b) = ("one", 'x'); let c = "t\"w\
        o"; let d: &'static str = r#"raw"#; // "no"
        let e = '"'; #[cfg(test)] let f = "test";"##;
    assert_eq!(literals(code), ["one", "t\\\"wo"]);
}
