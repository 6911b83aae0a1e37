//! Scene files that are right, files that are no scene at all, and what is legal but surely unmeant.

mod keys;
mod meshes;
mod repository;
mod unreadable;
mod warnings;

use stride::scene::{Loaded, parse};

fn read(text: &str) -> Loaded {
    parse(text, "box.toml".as_ref()).unwrap_or_else(|errors| panic!("{errors}"))
}
