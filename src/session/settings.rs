//! The settings of a render.

use crate::film::{Layer, LayerSet, Layout, LightScale, SampleRanges, Weights};
use crate::integrator;
use crate::math::lanes::Level;
use crate::sampling::{Rectangle, Region};
use crate::scene::{FilmMode, Fingerprint, Scene, Viewpoint};
use crate::world::AcceleratorChoice;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// The checked settings of a render.
#[derive(Clone, Debug)]
pub struct RenderSettings {
    /// The scene, and the part of it to render.
    pub job: RenderJob,
    /// The criteria for the end of the render.
    pub stopping: Stopping,
    /// The devices that render.
    pub devices: Devices,
    /// The files to write.
    pub outputs: Outputs,
    /// The viewers that show the render.
    pub view: ViewerSettings,
}

impl RenderSettings {
    /// The range of sample indices of each pixel.
    pub fn range(&self) -> Range<u32> {
        self.job.first..self.job.first.saturating_add(self.stopping.spp)
    }

    /// Samples per pixel, if they are limited: a range up to the last index is unlimited.
    pub fn target(&self) -> Option<u32> {
        (self.range().end < u32::MAX).then_some(self.stopping.spp)
    }

    /// The samples in a film with this minimum and maximum number of samples per pixel.
    pub(super) fn sample_ranges(&self, [least, most]: [u64; 2]) -> SampleRanges {
        SampleRanges::prefix(self.range(), least, most)
    }
}

/// The scene to render: together with the devices, it determines the bits of the samples.
#[derive(Clone, Debug)]
pub struct RenderJob {
    /// The scene, including the caller's changes.
    pub scene: Arc<Scene>,
    /// The fingerprint of the scene, if films or pictures are to contain it.
    pub fingerprint: Option<Fingerprint>,
    /// The part of the film that is rendered.
    pub region: Region,
    /// The part of that which becomes the picture. The pixels around it are rendered because their samples contribute
    /// to it.
    pub shown: Rectangle,
    /// The index of each pixel's first sample.
    pub first: u32,
    /// Whether to compute the sums for the variance of weighted samples, which cost memory and time.
    pub spreads: bool,
    /// The layers of first hits whose sums the film stores, which cost memory and time.
    pub layers: LayerSet,
    /// The position of the moved camera, if the scene's camera was moved in the window.
    pub moved: Option<Viewpoint>,
}

impl RenderJob {
    /// The picture of a part of a scene's film, from sample 0 on. The pixels around it whose samples contribute to it
    /// are rendered as well.
    pub fn new(scene: Arc<Scene>, picture: Region) -> RenderJob {
        let reach = Weights::of(&scene.film).map_or(0, |weights| weights.reach());
        let (region, shown) = picture.with_margin(reach, scene.film.height);
        let (fingerprint, layers) = (None, LayerSet::NONE);
        RenderJob { scene, fingerprint, region, shown, first: 0, spreads: false, layers, moved: None }
    }

    /// The layout of the film.
    pub fn layout(&self) -> Layout {
        let (Region { width, height, .. }, shown) = (self.region, self.shown);
        let Scene { film, render, .. } = &*self.scene;
        let weighted = film.mode() == FilmMode::Continuous;
        let light = integrator::contributes(render.integrator)
            .then(|| LightScale::new(film.width * film.height, &Weights::of_contributions(film)));
        let spreads = weighted && self.spreads;
        Layout { width, height, weighted, spreads, light, layers: self.layers, shown }
    }

    /// The part of the film that becomes the picture.
    pub fn picture_region(&self) -> Region {
        let (Region { film_width, x, y, .. }, shown) = (self.region, self.shown);
        Region { film_width, x: x + shown.x, y: y + shown.y, width: shown.width, height: shown.height }
    }
}

/// The criteria for the end of a render; the first one met ends it.
#[derive(Clone, Debug)]
pub struct Stopping {
    /// Samples per pixel, at least 1.
    pub spp: u32,
    /// The time limit. The render ends at the first whole sample after it.
    pub time: Option<Duration>,
    /// The estimated error, √relMSE_scaled without the worst 0.5% of pixels, above 0 and below 1.
    pub noise: Option<f64>,
    /// Whether sampling is adaptive, with at most `spp` samples per pixel.
    pub adaptive: bool,
}

impl Stopping {
    /// Ends at this number of samples per pixel, and for no other reason.
    pub fn at(spp: u32) -> Stopping {
        Stopping { spp, time: None, noise: None, adaptive: false }
    }

    /// The error at which the render ends, if there is one.
    pub fn goal(&self) -> Option<f64> {
        self.noise.or(self.adaptive.then_some(ADAPTIVE_NOISE))
    }
}

/// The default error of adaptive sampling.
pub const ADAPTIVE_NOISE: f64 = 0.01;

/// The maximum number of threads of a render.
pub const MOST_THREADS: u16 = 1024;

/// The devices that render.
#[derive(Clone, Debug)]
pub struct Devices {
    /// The choice of devices.
    pub choice: DeviceChoice,
    /// The number of CPU workers, at most [`MOST_THREADS`].
    pub threads: NonZeroUsize,
    /// The SIMD level of the CPU workers.
    pub level: Level,
    /// The acceleration structure on the CPU.
    pub accelerator: AcceleratorChoice,
}

impl Devices {
    /// CPU threads only.
    pub fn cpu(threads: NonZeroUsize, level: Level) -> Devices {
        Devices { choice: DeviceChoice::Cpu, threads, level, accelerator: AcceleratorChoice::Fastest }
    }
}

/// A choice of devices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The CPU.
    Cpu,
    /// A GPU, with a name that contains this text if it is given.
    Gpu(Option<String>),
    /// The CPU and a GPU, with a name that contains this text if it is given.
    All(Option<String>),
}

/// The files that a render writes, and the film file that it resumes.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Picture files to write at the end: `.png`, `.exr` or `.hdr`.
    pub pictures: Vec<PathBuf>,
    /// Whether pictures show the worker that owns each pixel instead of radiance. They must then be PNG files. A window
    /// starts with this view.
    pub overlay: bool,
    /// Samples per pixel at which to write numbered pictures.
    pub dump_at: Vec<u32>,
    /// Layers for EXR files at the end. Those made of first hits must be in [`RenderJob::layers`].
    pub layers: Vec<Layer>,
    /// The NumPy file for all samples, if requested.
    pub samples: Option<PathBuf>,
    /// Whether all samples are sent to the caller: see [`Prepared::sending`](super::Prepared::sending).
    pub sends_samples: bool,
    /// The film file for resuming and merging, if requested.
    pub film: Option<PathBuf>,
    /// The interval at which the film file is written during the render.
    pub checkpoint: Duration,
    /// The film file to resume, if there is one.
    pub resume: Option<PathBuf>,
}

impl Outputs {
    /// Whether single samples are needed.
    pub fn wants_samples(&self) -> bool {
        self.samples.is_some() || self.sends_samples
    }
}

impl Default for Outputs {
    /// No files.
    fn default() -> Outputs {
        Outputs {
            pictures: Vec::new(),
            overlay: false,
            dump_at: Vec::new(),
            layers: Vec::new(),
            samples: None,
            sends_samples: false,
            film: None,
            checkpoint: Duration::MAX,
            resume: None,
        }
    }
}

/// The viewers of a render.
#[derive(Clone, Debug, Default)]
pub struct ViewerSettings {
    /// The name of the render in viewers.
    pub name: String,
    /// Whether to open a window.
    pub window: WindowChoice,
    /// The host and port of a tev viewer, if there is one.
    pub tev: Option<String>,
}

/// Whether to open a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WindowChoice {
    /// No window.
    #[default]
    None,
    /// A window, if there is a display.
    IfPossible,
    /// A window; without a display the render fails.
    Required,
}
