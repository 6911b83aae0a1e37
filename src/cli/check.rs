//! `stride check`: reports errors and warnings in a scene file.

use super::arguments::shown;
use super::failure::Failure;
use super::print::print;
use super::reading::{ReadingArguments, scene_file};
use crate::world::Size;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct CheckArguments {
    #[arg(help = scene_file())]
    scene: PathBuf,
    #[command(flatten)]
    reading: ReadingArguments,
}

pub(super) fn run(arguments: &CheckArguments) -> Result<(), Failure> {
    let loaded = arguments.reading.load(&arguments.scene, true)?;
    Size::of(&loaded.scene).check()?;
    let mut text = String::new();
    for warning in &loaded.warnings {
        text += &format!("warning: {warning}\n");
    }
    let scene = loaded.scene;
    let count = |n: usize, one: &str, many: &str| format!("{n} {}", if n == 1 { one } else { many });
    let groups = match scene.place_counts().iter().sum::<u64>() {
        0 => String::new(),
        places => format!(", {}", count(places as usize, "instance of a group", "instances of groups")),
    };
    text += &format!(
        "{}: valid: {}×{} pixels, {}{groups}, {}\n",
        shown(&arguments.scene),
        scene.film.width,
        scene.film.height,
        count(scene.entities.len(), "entity", "entities"),
        count(scene.materials.len(), "material", "materials"),
    );
    Ok(print(&text)?)
}
