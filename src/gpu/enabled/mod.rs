//! The room with a GPU.

mod device;
mod heap;
mod layout;
mod pace;
mod pipeline;
mod program;
mod readback;
#[allow(dead_code, reason = "the program is still written by hand")]
mod record;
mod rows;
mod tables;
mod tree;
mod variant;
mod worker;

#[cfg(test)]
mod tests;

pub use device::{Device, adapters};
pub use worker::GpuWorker;
