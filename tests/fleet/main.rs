//! Renders on many machines: servers, workers and collectors as processes of their own, which are killed and paused.
#![cfg(all(feature = "fleet", unix))]

#[path = "../common/mod.rs"]
mod common;
mod ends;
mod errors;
mod files;
mod jobs;
mod kills;
mod machines;
mod verify;
