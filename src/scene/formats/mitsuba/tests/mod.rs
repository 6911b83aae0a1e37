//! Whole scenes: their conversion, errors, and reports of parts without a counterpart.

mod broken;
mod converted;
mod files;
mod lacking;
mod limits;
mod scenes;

use super::parse;
use crate::scene::formats::LoadOptions;
use crate::scene::toml::Loaded;
use crate::scene::{Scene, SceneErrors};
use std::path::Path;

/// A scene with a small film in line 1, and `body` from line 2 on.
fn whole(body: &str) -> String {
    format!("<scene version=\"3.0.0\"><sensor type=\"perspective\" id=\"main\"/>\n{body}\n</scene>")
}

fn read_with(text: &str, options: &LoadOptions) -> Result<Loaded, SceneErrors> {
    parse(text, Path::new("a.xml"), options)
}

/// The result of reading a text.
fn read(text: &str) -> Loaded {
    read_with(text, &LoadOptions::default()).unwrap_or_else(|errors| panic!("{errors}\n{text}"))
}

/// The scene with these elements.
fn scene(body: &str) -> Scene {
    read(&whole(body)).scene
}

/// The warnings about a scene with these elements, except the one about darkness.
fn warnings(body: &str) -> Vec<String> {
    let dark = "nothing in the scene shines";
    let warnings = read(&whole(body)).warnings.into_iter().filter(|warning| warning.message != dark);
    warnings.map(|warning| warning.to_string()).collect()
}

/// The errors of a text.
fn errors(text: &str) -> Vec<String> {
    let errors = read_with(text, &LoadOptions::default()).expect_err("a scene came of it");
    errors.to_string().lines().map(str::to_owned).collect()
}
