//! The GPU as one more worker: the same strides, the same orders, the same batches.
//!
//! Its program is recorded from the code that lanes run, but for a part that is written by hand in the WGSL beside this
//! file. A stride is split once more, over the invocations of a dispatch (report §3.2, figure 3.1), and each invocation
//! adds its pixels' samples up exactly, so that the same device gives the same bits whatever the dispatches were.
//!
//! The feature `gpu` decides which half of this room is compiled. Without it [`Device::open`] says so.

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

/// What a GPU worker is to do, and who it is: the counterpart of a CPU worker's fields and integrator.
#[derive(Clone, Copy, Debug)]
pub struct Job<'a> {
    /// The tables.
    pub scene: &'a CompiledScene,
    /// What rays meet.
    pub world: &'a World,
    /// The integrator, its depth, and chance.
    pub render: &'a RenderSettings,
    /// How samples are spread around a pixel's centre.
    pub offset: FilmOffset,
    /// The part of the film that is rendered.
    pub region: Region,
    /// The worker's number.
    pub index: usize,
    /// Whether a sink wants every sample: then they travel one by one, and nothing is summed up.
    pub sends_samples: bool,
    /// What puts samples on the film where they count in all pixels around them.
    pub splatter: Option<&'a Splatter>,
}

/// What kind of device an adapter is; the better ones for rendering come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A graphics card with memory of its own.
    Discrete,
    /// A graphics unit that shares the processor's memory.
    Integrated,
    /// A graphics card lent to a virtual machine.
    Virtual,
    /// The driver doesn't say.
    Other,
    /// The processor, pretending.
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

/// An adapter and what it can do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterInfo {
    /// The name that ``device` gpu:NAME` looks into.
    pub name: String,
    /// What kind of device it is.
    pub kind: AdapterKind,
    /// The system's interface to it: Vulkan, Metal or DirectX 12.
    pub backend: String,
    /// The driver and its version.
    pub driver: String,
    /// The largest part of a buffer that a shader can see, in bytes.
    pub max_binding: u64,
    /// The most invocations in a workgroup.
    pub max_workgroup_size: u32,
}

impl fmt::Display for AdapterInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {})", self.name, self.kind, self.backend)
    }
}

/// Why a GPU cannot render, or could not go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// The program was built without the feature.
    #[error(
        "this stride was built without GPU support: build it with --features gpu, or render with `device` cpu"
    )]
    NotBuilt,
    /// The system has no adapter that could be used.
    #[error(
        "no GPU was found: install a Vulkan driver and its loader (on Debian and Ubuntu the packages mesa-vulkan-drivers and libvulkan1, or your vendor's driver), or render with `device` cpu"
    )]
    NoAdapter,
    /// No adapter has the name that was asked for.
    #[error("no GPU is called “{wanted}”; there is {}", list(.available))]
    NoSuchAdapter {
        /// What was asked for.
        wanted: String,
        /// What there is.
        available: Vec<String>,
    },
    /// The adapter did not give a device, or lacks something without which nothing works.
    #[error("{adapter} cannot be used: {message}; try another with `device` gpu:NAME, or `device` cpu")]
    Unusable {
        /// Its name.
        adapter: String,
        /// What is wrong.
        message: String,
    },
    /// The GPU does not render this.
    #[error("the GPU does not take {0}; render with `device` cpu")]
    Unsupported(String),
    /// The scene does not fit.
    #[error("{what} take {needed} bytes, but {adapter} binds {limit} at most; render with `device` cpu")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// Its size in bytes.
        needed: u64,
        /// The adapter's name.
        adapter: String,
        /// The adapter's limit in bytes.
        limit: u64,
    },
    /// The driver ends loops before their end, and does so even if an invocation has one path to follow.
    #[error(
        "{adapter} ends the loops of a shader before one sample is done: one asks too many lights or surfaces for its driver; try another with `device` gpu:NAME, or render with `device` cpu"
    )]
    CutShort {
        /// The adapter's name.
        adapter: String,
    },
    /// The device failed while it worked. What it had sent before is good.
    #[error("{adapter} failed: {message}")]
    Failed {
        /// The adapter's name.
        adapter: String,
        /// What the driver says.
        message: String,
    },
}

fn list(names: &[String]) -> String {
    names.join(", ")
}
