//! The GPU as a worker: the same strides, orders and batches as on the CPU.
//!
//! Its program is recorded from the code that lanes run, except for a hand-written part in WGSL. A stride is divided
//! again, over the invocations of a dispatch (report §3.2, figure 3.1), and each invocation sums its pixels' samples
//! exactly. One device therefore produces the same bits for any dispatches.
//!
//! The feature `gpu` selects the implementation. Without it, [`Device::open`] returns an error.

#[cfg(feature = "gpu")]
mod enabled;
#[cfg(feature = "gpu")]
pub use enabled::{Device, GpuWorker, adapters, wgsl};

#[cfg(not(feature = "gpu"))]
mod disabled;
#[cfg(not(feature = "gpu"))]
pub use disabled::{Device, GpuWorker, adapters, wgsl};

use crate::film::Splatter;
use crate::sampling::Region;
use crate::sampling::warp::FilmOffset;
use crate::scene::RenderSettings;
use crate::world::{CompiledScene, World};
use std::fmt;

/// The job of a GPU worker: the counterpart of a CPU worker's fields and integrator.
#[derive(Clone, Copy, Debug)]
pub struct Job<'a> {
    /// The tables of the scene.
    pub scene: &'a CompiledScene,
    /// The surfaces that rays can hit.
    pub world: &'a World,
    /// The integrator, its depth limit, and the sampler.
    pub render: &'a RenderSettings,
    /// The distribution of samples around a pixel's centre.
    pub offset: FilmOffset,
    /// The part of the film that is rendered.
    pub region: Region,
    /// The worker's number.
    pub index: usize,
    /// Whether a sink needs every sample. Samples are then returned individually and not summed.
    pub sends_samples: bool,
    /// The filter by which samples are added to the film, if they count in all pixels around them.
    pub splatter: Option<&'a Splatter>,
}

/// The kind of an adapter, in order of preference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A graphics card with its own memory.
    Discrete,
    /// A graphics processor that shares the CPU's memory.
    Integrated,
    /// A graphics card in a virtual machine.
    Virtual,
    /// Not reported by the driver.
    Other,
    /// A software implementation on the CPU.
    Software,
}

impl fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            AdapterKind::Discrete => "discrete GPU",
            AdapterKind::Integrated => "integrated GPU",
            AdapterKind::Virtual => "virtual GPU",
            AdapterKind::Other => "unknown kind",
            AdapterKind::Software => "software",
        })
    }
}

/// An adapter and its limits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterInfo {
    /// The name that ``device` gpu:NAME` is matched with.
    pub name: String,
    /// The kind of device.
    pub kind: AdapterKind,
    /// The graphics API: Vulkan, Metal or DirectX 12.
    pub backend: String,
    /// The driver and its version.
    pub driver: String,
    /// The maximum size of a buffer binding, in bytes.
    pub max_binding: u64,
    /// The maximum number of invocations in a workgroup.
    pub max_workgroup_size: u32,
}

impl fmt::Display for AdapterInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {})", self.name, self.kind, self.backend)
    }
}

/// The reason why a GPU cannot render, or failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// The program was built without GPU support.
    #[error(
        "this stride was built without GPU support: build it with --features gpu, or render with `device` cpu"
    )]
    NotBuilt,
    /// The system has no usable adapter.
    #[error(
        "no GPU was found: install a Vulkan driver and its loader (on Debian and Ubuntu the packages mesa-vulkan-drivers and libvulkan1, or your vendor's driver), or render with `device` cpu"
    )]
    NoAdapter,
    /// No adapter has the requested name.
    #[error("no GPU is called “{wanted}”; there is {}", list(.available))]
    NoSuchAdapter {
        /// The requested name.
        wanted: String,
        /// The available adapters.
        available: Vec<String>,
    },
    /// The adapter provides no device, or lacks a required feature.
    #[error("{adapter} cannot be used: {message}; try another with `device` gpu:NAME, or `device` cpu")]
    Unusable {
        /// The adapter's name.
        adapter: String,
        /// The reason.
        message: String,
    },
    /// The GPU does not support this.
    #[error("the GPU does not support {0}; render with `device` cpu")]
    Unsupported(String),
    /// The scene does not fit.
    #[error("{what} take {needed} bytes, but {adapter} binds {limit} at most; render with `device` cpu")]
    TooLarge {
        /// The data that is too large.
        what: &'static str,
        /// Its size in bytes.
        needed: u64,
        /// The adapter's name.
        adapter: String,
        /// The adapter's limit in bytes.
        limit: u64,
    },
    /// The driver ends loops early, even with one path per invocation.
    #[error(
        "{adapter} ends the loops of a shader before one sample is done: one sample tests too many lights or surfaces for its driver; try another with `device` gpu:NAME, or render with `device` cpu"
    )]
    CutShort {
        /// The adapter's name.
        adapter: String,
    },
    /// The device failed while it worked. Results sent before remain valid.
    #[error("{adapter} failed: {message}")]
    Failed {
        /// The adapter's name.
        adapter: String,
        /// The driver's message.
        message: String,
    },
}

fn list(names: &[String]) -> String {
    names.join(", ")
}
