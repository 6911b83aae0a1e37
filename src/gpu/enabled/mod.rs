//! The room with a GPU.

mod device;
mod heap;
mod layout;
mod pace;
mod pipeline;
mod program;
mod readback;
mod rows;
mod tables;
mod tree;
mod variant;
mod worker;

#[cfg(test)]
mod tests;

pub use device::{Device, adapters};
pub use worker::GpuWorker;
