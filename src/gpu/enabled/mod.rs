//! The room with a GPU.

mod device;
mod heap;
mod layout;
mod pace;
mod pipeline;
mod program;
mod readback;
mod record;
mod recorded;
mod rows;
mod tables;
mod tree;
mod variant;
mod worker;

#[cfg(test)]
mod tests;

pub use device::{Device, adapters};
pub use worker::GpuWorker;

use crate::gpu::{GpuError, Job};

/// The WGSL that a GPU runs for a job, on an adapter with uniforms that takes all tables in one buffer: the recorded functions,
/// and those written by hand.
pub fn wgsl(job: &Job<'_>) -> Result<String, GpuError> {
    program::of_job(job)
}
