//! The program: its commands, files, errors and outputs.

#[path = "../common/mod.rs"]
mod common;

mod adaptive;
mod bench;
mod benches;
mod cli_errors;
mod compare;
mod continuous;
mod convert;
mod cryptomatte;
mod digests;
mod film;
mod info;
mod layers;
mod noise;
mod readers;
mod render;
mod resume;
mod scene_errors;
mod scene_files;
#[cfg(unix)]
mod split;
mod stopping;
#[cfg(all(target_os = "linux", feature = "window"))]
mod window;
