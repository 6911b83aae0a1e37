//! What a render is asked for.

use crate::film::{Layer, Layout, Rectangle};
use crate::math::lanes::Level;
use crate::render::Region;
use crate::scene::{FilmMode, Fingerprint, Scene};
use crate::world::Finder;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Everything that a render is asked for, checked.
#[derive(Clone, Debug)]
pub struct Settings {
    /// What the window and the progress call it.
    pub name: String,
    /// The scene, with whatever the command line changed in it.
    pub scene: Arc<Scene>,
    /// The part of the film that is rendered.
    pub region: Region,
    /// The part of that which becomes the picture: around it are pixels whose samples reach into it.
    pub shown: Rectangle,
    /// The index of each pixel's first sample.
    pub first: u32,
    /// Samples a pixel, unless the time is up before.
    pub spp: u32,
    /// Stop at the first whole sample after this long.
    pub time: Option<Duration>,
    /// Stop when the estimated error, √relMSE_scaled without the worst 0.5% of pixels, is this small.
    pub noise: Option<f64>,
    /// Spend samples where the error is, `spp` of them a pixel at most.
    pub adaptive: bool,
    /// CPU workers.
    pub threads: NonZeroUsize,
    /// Which lanes they use.
    pub level: Level,
    /// What finds the surfaces that rays meet, on the CPU.
    pub finder: Finder,
    /// Who renders.
    pub device: DeviceChoice,
    /// Picture files.
    pub outputs: Vec<PathBuf>,
    /// Sample counts to write numbered pictures at.
    pub dump_at: Vec<u32>,
    /// Layers that EXR files get beside colour, at the end.
    pub layers: Vec<Layer>,
    /// Keep what a variance takes where samples are weighed, which costs memory and time.
    pub spreads: bool,
    /// Where every sample goes, if anywhere.
    pub samples: Option<PathBuf>,
    /// A film file to write, for going on and merging, if any.
    pub film: Option<PathBuf>,
    /// How often it is written while the render runs.
    pub checkpoint: Duration,
    /// The film file of a run that this one goes on with.
    pub resume: Option<PathBuf>,
    /// What tells the scene from others, where films or pictures are to say so.
    pub fingerprint: Option<Fingerprint>,
    /// Show which worker owns each pixel instead of what it saw: in the pictures, which then have to be PNG
    /// files, and at first in the window.
    pub overlay: bool,
    /// What people see of it.
    pub view: View,
    /// The camera as it stands in a scene file, where it is not the scene's own: it was moved in the window.
    pub moved: Option<String>,
    /// The host and port of a tev that shows it, too.
    pub tev: Option<String>,
}

impl Settings {
    /// What the film's words are.
    pub fn layout(&self) -> Layout {
        let (Region { width, height, .. }, shown) = (self.region, self.shown);
        let weighted = self.scene.film.mode() == FilmMode::Continuous;
        Layout { width, height, weighted, spreads: weighted && self.spreads, shown }
    }

    /// The part of the film that becomes the picture.
    pub fn picture_region(&self) -> Region {
        let (Region { film_width, x, y, .. }, shown) = (self.region, self.shown);
        Region { film_width, x: x + shown.x, y: y + shown.y, width: shown.width, height: shown.height }
    }

    /// The indices of each pixel's samples.
    pub fn range(&self) -> Range<u32> {
        self.first..self.first.saturating_add(self.spp)
    }

    /// The error at which the render ends, if it does at one.
    pub fn goal(&self) -> Option<f64> {
        self.noise.or(self.adaptive.then_some(ADAPTIVE_NOISE))
    }
}

/// The error that adaptive sampling ends at unless another is asked for.
pub const ADAPTIVE_NOISE: f64 = 0.01;

/// Who renders.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The CPU.
    Cpu,
    /// A GPU, of this name if one is given.
    Gpu(Option<String>),
    /// The CPU and a GPU, likewise.
    All(Option<String>),
}

/// What people see of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// A window, or an error without a display.
    Window,
    /// A window where there is a display, progress elsewhere.
    WindowIfPossible,
    /// Progress on the terminal.
    Progress,
    /// Nothing.
    Quiet,
}
