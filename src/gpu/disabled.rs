//! The room without a GPU: the same signatures, and nothing behind them.

use super::{AdapterInfo, GpuError, Job};
use crate::render::{Assignment, FirstHitTracer, SampleBatch};
use crossbeam_channel::{Receiver, Sender};

/// A GPU, of which there is none in this build.
#[derive(Clone, Debug)]
pub enum Device {}

impl Device {
    /// Says that this build has no GPU support.
    pub fn open(_name: Option<&str>) -> Result<Device, GpuError> {
        Err(GpuError::NotBuilt)
    }

    /// What the device is.
    pub fn description(&self) -> &AdapterInfo {
        match *self {}
    }
}

/// The adapters of this machine: none that this build could use.
pub fn adapters() -> Vec<AdapterInfo> {
    Vec::new()
}

/// A program for a GPU, of which there is none in this build.
pub fn wgsl(_job: &Job<'_>) -> Result<String, GpuError> {
    Err(GpuError::NotBuilt)
}

/// A worker on a GPU, of which there is none in this build.
#[derive(Debug)]
pub enum GpuWorker {}

impl GpuWorker {
    /// A worker needs a device, of which there is none.
    pub fn new(device: &Device, _job: &Job<'_>) -> Result<GpuWorker, GpuError> {
        match *device {}
    }

    /// A worker that cannot be there looks at nothing.
    pub fn trace_first_hits_with(&mut self, _tracer: Option<FirstHitTracer>) {
        match *self {}
    }

    /// A worker that cannot be there cannot run.
    pub fn run(
        &mut self,
        _orders: &Receiver<Assignment>,
        _batches: &Sender<SampleBatch>,
    ) -> Result<(), GpuError> {
        match *self {}
    }

    /// A worker that cannot be there cannot run, and so need not stop.
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
    fn a_gpu_is_refused_with_a_remedy() {
        let error = Device::open(None).unwrap_err();
        assert_eq!(error, GpuError::NotBuilt);
        assert!(error.to_string().contains("--features gpu"));
        assert_eq!(adapters(), []);
    }
}
