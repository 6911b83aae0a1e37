//! Scenes with a single error each, and the messages of the reader: line, column, problem and remedy. No invalid scene
//! is accepted.

/// A test that `$text` is rejected with these messages, one for each line.
macro_rules! broken {
    ($name:ident, $text:expr, [$($message:expr),+ $(,)?]) => {
        #[test]
        fn $name() {
            assert_messages(&String::from($text), &[$($message),+]);
        }
    };
}

mod entities;
mod environment;
mod groups;
mod keys;
mod lights;
mod materials;
mod modifiers;
mod syntax;
mod textures;
mod view;

use stride::scene::{Scene, parse};

fn assert_messages(text: &str, messages: &[&str]) {
    // Raw strings begin on a line of their own.
    let text = text.strip_prefix('\n').unwrap_or(text);
    let result: Result<Scene, _> = parse(text, "box.toml".as_ref()).map(|loaded| loaded.scene);
    let errors = result.expect_err("a scene came of it");
    let messages: Vec<String> = messages.iter().map(|message| format!("box.toml:{message}")).collect();
    assert_eq!(errors.to_string().lines().collect::<Vec<_>>(), messages);
}

const GREY: &str = "[materials.grey]\ntype = \"matte\"\nreflectance = [0.5, 0.5, 0.5]\n";

/// A grey material in lines 1 to 3, then `text`.
fn with_grey(text: &str) -> String {
    format!("{GREY}{}", text.trim_start_matches('\n'))
}

/// A grey entity: its shape in line 5 after `shape = `, more keys from line 7.
fn entity(shape: &str, more: &str) -> String {
    with_grey(&format!("[[entities]]\nshape = {shape}\nmaterial = \"grey\"\n{more}\n"))
}

/// Checkerboards in checkerboards, the outermost in line 4.
fn checkerboards(nesting: usize) -> String {
    let board =
        |i| format!("[materials.m{i}]\ntype = \"checkerboard\"\neven = \"m{}\"\nodd = \"grey\"\n", i + 1);
    let boards: String = (0..nesting).map(board).collect();
    with_grey(&format!("{boards}[materials.m{nesting}]\ntype = \"mirror\"\nreflectance = [1, 1, 1]\n"))
}

#[test]
fn sixteen_nested_checkerboards_are_accepted() {
    let loaded = parse(&checkerboards(16), "box.toml".as_ref()).expect("at the limit");
    assert_eq!(loaded.scene.materials.len(), 18);
}
