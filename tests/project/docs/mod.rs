//! The documentation: its links, scenes, pictures, sections and sentences.

mod example;
mod links;
mod markdown;
mod pictures;
mod scenes;
mod sentences;

use std::fs;
use std::path::{Path, PathBuf};

/// The folder of the package.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The text of a file, by its path from the root.
fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The files with an extension in a folder, by their paths from the root, sorted.
fn files(folder: &str, extension: &str) -> Vec<String> {
    let entries = fs::read_dir(root().join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut files: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .map(|path| format!("{folder}/{}", name(&path)))
        .collect();
    files.sort();
    files
}

/// The name of a file.
fn name(path: &Path) -> String {
    path.file_name().expect("a name").to_string_lossy().into_owned()
}

/// The name of a file without its extension.
fn stem(path: &str) -> String {
    PathBuf::from(path).file_stem().expect("a name").to_string_lossy().into_owned()
}

/// The chapters of the guide.
fn chapters() -> Vec<String> {
    files("docs", "md").into_iter().filter(|file| file != "docs/SUMMARY.md").collect()
}

/// Everything that is written for users and contributors.
fn documents() -> Vec<String> {
    ["README.md".to_owned(), "CONTRIBUTING.md".to_owned()].into_iter().chain(chapters()).collect()
}

#[test]
fn the_summary_lists_every_chapter() {
    let summary = text("docs/SUMMARY.md");
    for chapter in chapters() {
        let link = format!("({})", chapter.strip_prefix("docs/").expect("a chapter"));
        assert!(summary.contains(&link), "docs/SUMMARY.md lacks {chapter}");
    }
}

#[test]
fn front_pages_are_short() {
    let readme = text("README.md");
    assert!(readme.lines().count() < 150, "README.md is too long");
    assert!(text("CONTRIBUTING.md").lines().count() <= 120, "CONTRIBUTING.md is too long");
    let bullets: Vec<_> = readme.lines().filter(|line| line.starts_with("- ")).take(5).collect();
    assert_eq!(bullets.len(), 5);
    for bullet in bullets {
        let words = markdown::words(bullet);
        assert!(words <= 15, "{words} words: {bullet}");
    }
}
