//! What a render is asked for.

use crate::film::{Holding, Layer, LayerSet, Layout, LightScale, Weights};
use crate::integrator;
use crate::math::lanes::Level;
use crate::sampling::{Rectangle, Region};
use crate::scene::{FilmMode, Fingerprint, Scene, Viewpoint};
use crate::world::Finder;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Everything that a render is asked for, checked.
#[derive(Clone, Debug)]
pub struct Settings {
    /// What is rendered.
    pub job: Job,
    /// When it ends.
    pub stopping: Stopping,
    /// What renders it.
    pub devices: Devices,
    /// Where it is written.
    pub outputs: Outputs,
    /// Where it is shown.
    pub view: View,
}

impl Settings {
    /// The indices of each pixel's samples.
    pub fn range(&self) -> Range<u32> {
        self.job.first..self.job.first.saturating_add(self.stopping.spp)
    }

    /// Samples a pixel, if they are limited: a range that goes on to the last number is not.
    pub fn target(&self) -> Option<u32> {
        (self.range().end < u32::MAX).then_some(self.stopping.spp)
    }

    /// The samples in a film whose pixels have between so many and so many of them.
    pub(super) fn holding(&self, [least, most]: [u64; 2]) -> Holding {
        Holding::prefix(self.range(), least, most)
    }
}

/// What is rendered: with the devices, all that the bits of the samples depend on.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene, with whatever the caller changed in it.
    pub scene: Arc<Scene>,
    /// What tells the scene from others, where films or pictures are to say so.
    pub fingerprint: Option<Fingerprint>,
    /// The part of the film that is rendered.
    pub region: Region,
    /// The part of that which becomes the picture: around it are pixels whose samples reach into it.
    pub shown: Rectangle,
    /// The index of each pixel's first sample.
    pub first: u32,
    /// Keep what a variance takes where samples are weighed, which costs memory and time.
    pub spreads: bool,
    /// The layers of first hits that the film keeps the sums of, which costs memory and time.
    pub layers: LayerSet,
    /// Where the scene's camera was moved to in the window, if it was.
    pub moved: Option<Viewpoint>,
}

impl Job {
    /// The picture of a part of a scene's film, from sample 0 on. As many pixels around it are rendered as have samples
    /// that reach into it.
    pub fn new(scene: Arc<Scene>, picture: Region) -> Job {
        let reach = Weights::of(&scene.film).map_or(0, |weights| weights.reach());
        let (region, shown) = picture.with_margin(reach, scene.film.height);
        let (fingerprint, layers) = (None, LayerSet::NONE);
        Job { scene, fingerprint, region, shown, first: 0, spreads: false, layers, moved: None }
    }

    /// What the film's words are.
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

/// When a render ends: whatever comes first.
#[derive(Clone, Debug)]
pub struct Stopping {
    /// At so many samples a pixel.
    pub spp: u32,
    /// At the first whole sample after this long.
    pub time: Option<Duration>,
    /// At this estimated error, √relMSE_scaled without the worst 0.5% of pixels.
    pub noise: Option<f64>,
    /// Spend samples where the error is, `spp` of them a pixel at most.
    pub adaptive: bool,
}

impl Stopping {
    /// At so many samples a pixel, and for no other reason.
    pub fn at(spp: u32) -> Stopping {
        Stopping { spp, time: None, noise: None, adaptive: false }
    }

    /// The error at which the render ends, if it does at one.
    pub fn goal(&self) -> Option<f64> {
        self.noise.or(self.adaptive.then_some(ADAPTIVE_NOISE))
    }
}

/// The error that adaptive sampling ends at unless another is asked for.
pub const ADAPTIVE_NOISE: f64 = 0.01;

/// The most threads that a render may have.
pub const MOST_THREADS: u16 = 1024;

/// What renders.
#[derive(Clone, Debug)]
pub struct Devices {
    /// Which devices.
    pub choice: DeviceChoice,
    /// CPU workers, [`MOST_THREADS`] at most.
    pub threads: NonZeroUsize,
    /// The lanes that they use.
    pub level: Level,
    /// What finds the surfaces that rays meet, on the CPU.
    pub finder: Finder,
}

impl Devices {
    /// So many threads of the CPU.
    pub fn cpu(threads: NonZeroUsize, level: Level) -> Devices {
        Devices { choice: DeviceChoice::Cpu, threads, level, finder: Finder::Fastest }
    }
}

/// Which devices render.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The CPU.
    Cpu,
    /// A GPU, of this name if one is given.
    Gpu(Option<String>),
    /// The CPU and a GPU, likewise.
    All(Option<String>),
}

/// The files that a render writes, and the one that it goes on with.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Picture files.
    pub pictures: Vec<PathBuf>,
    /// Show which worker owns each pixel instead of what it saw: in the pictures, which then have to be PNG
    /// files, and at first in the window.
    pub overlay: bool,
    /// Sample counts to write numbered pictures at.
    pub dump_at: Vec<u32>,
    /// Layers that EXR files get beside colour, at the end. Those that first hits tell must be among [`Job::layers`].
    pub layers: Vec<Layer>,
    /// A dump of every sample, if any.
    pub samples: Option<PathBuf>,
    /// Every sample is sent to the caller: see [`Prepared::sending`](super::Prepared::sending).
    pub sends_samples: bool,
    /// A film file, for going on and merging, if any.
    pub film: Option<PathBuf>,
    /// How often the film file is written while the render runs.
    pub checkpoint: Duration,
    /// The film file of a run that this one goes on with.
    pub resume: Option<PathBuf>,
}

impl Outputs {
    /// Whether samples are wanted one by one.
    pub fn wants_samples(&self) -> bool {
        self.samples.is_some() || self.sends_samples
    }
}

impl Default for Outputs {
    /// No file.
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

/// Where a render is shown while it runs.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// What viewers call it.
    pub name: String,
    /// Whether it is shown in a window.
    pub window: WindowChoice,
    /// The host and port of a tev that shows it, too.
    pub tev: Option<String>,
}

/// Whether a render is shown in a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WindowChoice {
    /// In none.
    #[default]
    None,
    /// In one, where there is a display.
    IfPossible,
    /// In one; without a display there is an error.
    Required,
}
