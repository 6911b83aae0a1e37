//! stub
use crate::render::*;
use crate::world::*;
use crossbeam_channel::*;
/// e
#[derive(Debug, thiserror::Error)]
#[error("no gpu")]
pub struct GpuError;
/// d
pub struct Device;
impl Device {
    /// o
    pub fn open(_n: Option<&str>) -> Result<Device, GpuError> {
        Err(GpuError)
    }
    /// d
    pub fn description(&self) -> String {
        String::new()
    }
}
/// w
pub struct GpuWorker;
impl GpuWorker {
    /// n
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        _: Device,
        _: &CompiledScene,
        _: &Geometry,
        _: crate::scene::Integrator,
        _: &crate::integrator::Settings<crate::sampling::Independent>,
        _: Region,
        _: Stride,
        _: usize,
        _: bool,
    ) -> Result<Self, GpuError> {
        Err(GpuError)
    }
    /// r
    pub fn run(&mut self, _: &Receiver<Order>, _: &Sender<SampleBatch>) -> Result<(), GpuError> {
        Err(GpuError)
    }
}
