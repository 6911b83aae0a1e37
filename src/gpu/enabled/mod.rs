//! The GPU worker in builds with GPU support.

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

/// The WGSL of a job on an adapter with uniforms and a single page of tables: the recorded functions and the
/// hand-written ones.
pub fn wgsl(job: &Job<'_>) -> Result<String, GpuError> {
    program::of_job(job)
}
