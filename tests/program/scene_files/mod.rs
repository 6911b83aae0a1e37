//! Valid scene files, files that are no scenes, and warnings.

mod keys;
mod meshes;
mod repository;
mod unreadable;
mod warnings;

use stride::scene::{Loaded, parse};

fn read(text: &str) -> Loaded {
    parse(text, "box.toml".as_ref()).unwrap_or_else(|errors| panic!("{errors}"))
}
