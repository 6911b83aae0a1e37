//! The GPU worker in builds without GPU support: the same signatures, which cannot be used.

use super::{AdapterInfo, GpuError, Job};
use crate::render::{Assignment, FirstHitTracer, SampleBatch};
use crossbeam_channel::{Receiver, Sender};

/// A GPU. It cannot exist in this build.
#[derive(Clone, Debug)]
pub enum Device {}

impl Device {
    /// Returns the error that this build has no GPU support.
    pub fn open(_name: Option<&str>) -> Result<Device, GpuError> {
        Err(GpuError::NotBuilt)
    }

    /// The description of the device.
    pub fn description(&self) -> &AdapterInfo {
        match *self {}
    }
}

/// The adapters of this machine that this build can use: none.
pub fn adapters() -> Vec<AdapterInfo> {
    Vec::new()
}

/// The program for a GPU; an error in this build.
pub fn wgsl(_job: &Job<'_>) -> Result<String, GpuError> {
    Err(GpuError::NotBuilt)
}

/// A worker on a GPU. It cannot exist in this build.
#[derive(Debug)]
pub enum GpuWorker {}

impl GpuWorker {
    /// Cannot be called: there is no device.
    pub fn new(device: &Device, _job: &Job<'_>) -> Result<GpuWorker, GpuError> {
        match *device {}
    }

    /// Cannot be called: there is no worker.
    pub fn trace_first_hits_with(&mut self, _tracer: Option<FirstHitTracer>) {
        match *self {}
    }

    /// Cannot be called: there is no worker.
    pub fn run(
        &mut self,
        _orders: &Receiver<Assignment>,
        _batches: &Sender<SampleBatch>,
    ) -> Result<(), GpuError> {
        match *self {}
    }

    /// Cannot be called: there is no worker.
    pub fn run_until(
        &mut self,
        _orders: &Receiver<Assignment>,
        _stop: &Receiver<()>,
        _batches: &Sender<SampleBatch>,
    ) -> Result<(), GpuError> {
        match *self {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opening_a_gpu_fails_with_a_remedy() {
        let error = Device::open(None).unwrap_err();
        assert_eq!(error, GpuError::NotBuilt);
        assert!(error.to_string().contains("--features gpu"));
        assert_eq!(adapters(), []);
    }
}
