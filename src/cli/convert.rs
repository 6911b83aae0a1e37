//! `stride convert`: converts a scene file of any format to TOML.

use super::arguments::shown;
use super::failure::{Failure, usage};
use super::print::print;
use super::reading::{ReadingArguments, scene_file};
use crate::output::atomic::write_atomically;
use crate::scene::formats::Format;
use crate::scene::writing;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct ConvertArguments {
    #[arg(help = scene_file())]
    scene: PathBuf,
    /// Scene file to write, in TOML; its meshes and pictures are written to a folder beside it
    #[arg(short, long = "output", value_name = "FILE.toml")]
    output: PathBuf,
    #[command(flatten)]
    reading: ReadingArguments,
    /// Print only errors
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(arguments: &ConvertArguments) -> Result<(), Failure> {
    let output = &arguments.output;
    let own = Format::own();
    let is_own = |path: &Path| Format::of(path).is_some_and(|format| format.extension == own.extension);
    if !is_own(output) {
        return Err(usage(format!("{} does not end in .{}", output.display(), own.extension)));
    }
    if fs::canonicalize(output)
        .is_ok_and(|path| fs::canonicalize(&arguments.scene).is_ok_and(|scene| scene == path))
    {
        return Err(usage(format!("{} is the scene itself; choose another name", output.display())));
    }
    let loaded = arguments.reading.load(&arguments.scene, arguments.quiet)?;
    if !arguments.quiet {
        for warning in &loaded.warnings {
            let _ = writeln!(std::io::stderr(), "warning: {warning}");
        }
        if let Some([x, y, width, height]) = loaded.crop {
            let _ = writeln!(
                std::io::stderr(),
                "warning: a scene file in TOML has no crop: render it with --crop {x},{y},{width},{height}"
            );
        }
    }
    let folder = arguments.scene.parent().unwrap_or(Path::new(""));
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let beside = PathBuf::from(format!("{stem}-files"));
    let written =
        writing::write(&loaded.scene, folder, &beside).map_err(|message| anyhow::anyhow!("{message}"))?;
    let into = output.parent().unwrap_or(Path::new(""));
    if !written.files.is_empty() {
        let made = fs::create_dir_all(into.join(&beside));
        made.map_err(|error| anyhow::anyhow!("{}: cannot be made: {error}", into.join(&beside).display()))?;
    }
    for (path, contents) in &written.files {
        write_atomically(&into.join(path), |out| contents.write(out))?;
    }
    write_atomically(output, |out| out.write_all(written.text.as_bytes()))?;
    if arguments.quiet {
        return Ok(());
    }
    let files = match written.files.len() {
        0 => String::new(),
        1 => format!(" and a file in {}", shown(&into.join(&beside))),
        n => format!(" and {n} files in {}", shown(&into.join(&beside))),
    };
    Ok(print(&format!("{}{files}\n", shown(output)))?)
}
