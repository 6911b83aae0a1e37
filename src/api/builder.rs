//! The settings of a render.

use crate::film::Layer;
use crate::math::lanes::Level;
use crate::scene::{FilmMode, Filter, Integrator, Sampler, Scene, Sources, Tone};
use crate::session::{DeviceChoice, ViewerSettings};
use crate::world::AcceleratorChoice;
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

/// The settings of a render, as a builder, and the methods that run it.
///
/// Settings default to those of the scene and of `stride render`: the CPU with one thread per core, and the scene's
/// number of samples. Files are written only if they are named. Settings with a default in the scene take a value or an
/// `Option`; `None` selects the default. Invalid settings are reported by the methods that start the render.
///
/// ```
/// # use stride::{Render, Scene};
/// let picture = Render::new(&Scene::default()).size((4, 3)).samples(1).run()?.picture;
/// assert_eq!((picture.width, picture.height), (4, 3));
/// # Ok::<(), stride::Error>(())
/// ```
#[derive(Clone, Debug)]
#[must_use = "nothing is rendered before `run` or `start`"]
pub struct Render {
    pub(super) scene: Scene,
    pub(super) sources: Sources,
    pub(super) crop: Option<[u32; 4]>,
    pub(super) samples: Option<u32>,
    pub(super) range: Option<Range<u32>>,
    pub(super) time: Option<Duration>,
    pub(super) noise: Option<f64>,
    pub(super) threads: Option<usize>,
    pub(super) level: Option<Level>,
    pub(super) world: AcceleratorChoice,
    pub(super) device: DeviceChoice,
    pub(super) files: Vec<PathBuf>,
    pub(super) overlay: bool,
    pub(super) dump_at: Vec<u32>,
    pub(super) layers: Vec<Layer>,
    pub(super) sample_file: Option<PathBuf>,
    pub(super) film: Option<PathBuf>,
    pub(super) checkpoint: Option<Duration>,
    pub(super) resume: Option<PathBuf>,
    pub(super) kept: Vec<PathBuf>,
    pub(super) others: Vec<PathBuf>,
    pub(super) view: ViewerSettings,
}

/// The scene and its film.
impl Render {
    /// A render with the settings of the scene. The scene is copied, except for its meshes, which are shared.
    pub fn new(scene: &Scene) -> Render {
        Render {
            scene: scene.clone(),
            sources: Sources::default(),
            crop: None,
            samples: None,
            range: None,
            time: None,
            noise: None,
            threads: None,
            level: None,
            world: AcceleratorChoice::Fastest,
            device: DeviceChoice::Cpu,
            files: Vec::new(),
            overlay: false,
            dump_at: Vec::new(),
            layers: Vec::new(),
            sample_file: None,
            film: None,
            checkpoint: None,
            resume: None,
            kept: Vec::new(),
            others: Vec::new(),
            view: ViewerSettings::default(),
        }
    }

    /// The files of the scene's meshes: [`Loaded::sources`](crate::scene::Loaded::sources). Film files contain their
    /// names, so that messages can name a changed file; samples do not depend on them.
    pub fn sources(self, sources: Sources) -> Render {
        Render { sources, ..self }
    }

    /// Width and height of the film in pixels, each from 1 to [`LONGEST_SIDE`](crate::scene::LONGEST_SIDE).
    pub fn size(mut self, size: impl Into<Option<(u32, u32)>>) -> Render {
        if let Some((width, height)) = size.into() {
            (self.scene.film.width, self.scene.film.height) = (width, height);
        }
        self
    }

    /// The part of the film to render, in pixels: column and row of its first pixel from the top left, width and
    /// height. Its pixels equal those of the whole picture.
    pub fn crop(self, crop: impl Into<Option<[u32; 4]>>) -> Render {
        Render { crop: crop.into(), ..self }
    }

    /// The seed of all random numbers.
    pub fn seed(mut self, seed: impl Into<Option<u32>>) -> Render {
        set(&mut self.scene.render.seed, seed);
        self
    }

    /// The integrator.
    pub fn integrator(mut self, integrator: impl Into<Option<Integrator>>) -> Render {
        set(&mut self.scene.render.integrator, integrator);
        self
    }

    /// The sampler.
    pub fn sampler(mut self, sampler: impl Into<Option<Sampler>>) -> Render {
        set(&mut self.scene.render.sampler, sampler);
        self
    }

    /// The maximum number of bounces, from 0 (emitters only) to [`MOST_BOUNCES`](crate::scene::MOST_BOUNCES), or
    /// [`UNLIMITED`](crate::scene::UNLIMITED).
    pub fn max_depth(mut self, max_depth: impl Into<Option<u32>>) -> Render {
        set(&mut self.scene.render.max_depth, max_depth);
        self
    }

    /// The reconstruction filter.
    pub fn filter(mut self, filter: impl Into<Option<Filter>>) -> Render {
        set(&mut self.scene.film.filter, filter);
        self
    }

    /// Whether samples are drawn from the filter for each pixel, or are weighted in all pixels within the filter
    /// radius.
    pub fn film_mode(mut self, mode: impl Into<Option<FilmMode>>) -> Render {
        self.scene.film.mode = mode.into().or(self.scene.film.mode);
        self
    }

    /// The exposure of PNG files and windows in stops, within [`EXPOSURES`](crate::scene::EXPOSURES).
    pub fn exposure(mut self, exposure: impl Into<Option<f64>>) -> Render {
        set(&mut self.scene.film.exposure, exposure);
        self
    }

    /// The tone curve of PNG files and windows.
    pub fn tone(mut self, tone: impl Into<Option<Tone>>) -> Render {
        set(&mut self.scene.film.tone, tone);
        self
    }
}

/// The end of the render.
impl Render {
    /// Samples per pixel, at least 1: those with the indices 0 to `samples` − 1, even if a resumed film begins later.
    pub fn samples(self, samples: impl Into<Option<u32>>) -> Render {
        Render { samples: samples.into(), ..self }
    }

    /// The range of sample indices of each pixel, for merging. An end of `u32::MAX` means unlimited.
    pub fn range(self, range: impl Into<Option<Range<u32>>>) -> Render {
        Render { range: range.into(), ..self }
    }

    /// The time limit: the render ends at the first whole sample after it, or at the end of `samples` or `range`. The
    /// scene's samples and those requested for a resumed film are ignored.
    pub fn time(self, time: impl Into<Option<Duration>>) -> Render {
        Render { time: time.into(), ..self }
    }

    /// The error at which the render ends, above 0 and below 1, estimated as √relMSE_scaled without the worst 0.5% of
    /// pixels; or at `samples`. The estimate starts at 16 samples per pixel, and a black picture has none.
    pub fn noise(self, error: impl Into<Option<f64>>) -> Render {
        Render { noise: error.into(), ..self }
    }

    /// Whether to distribute samples by error, until the picture has the error `noise` (or
    /// [`ADAPTIVE_NOISE`](crate::session::ADAPTIVE_NOISE)), or pixels have `samples` samples.
    pub fn adaptive(mut self, adaptive: impl Into<Option<bool>>) -> Render {
        set(&mut self.scene.render.adaptive, adaptive);
        self
    }
}

/// The devices that render. On the CPU these settings do not affect the picture.
impl Render {
    /// The number of threads, from 1 to [`MOST_THREADS`](crate::session::MOST_THREADS); by default one per core.
    pub fn threads(self, threads: impl Into<Option<usize>>) -> Render {
        Render { threads: threads.into(), ..self }
    }

    /// The SIMD level of the CPU; by default the widest available one.
    pub fn level(self, level: impl Into<Option<Level>>) -> Render {
        Render { level: level.into(), ..self }
    }

    /// The acceleration structure on the CPU.
    pub fn world(self, world: AcceleratorChoice) -> Render {
        Render { world, ..self }
    }

    /// The devices.
    pub fn device(self, device: DeviceChoice) -> Render {
        Render { device, ..self }
    }
}

/// The outputs.
impl Render {
    /// Layers beside colour, in the report, in EXR files and in film files, each once and in the order of
    /// [`Layer::ALL`]. A resumed render shows the previous layers by default.
    pub fn layers(self, layers: impl IntoIterator<Item = Layer>) -> Render {
        let asked: Vec<Layer> = layers.into_iter().collect();
        let layers = Layer::ALL.into_iter().filter(|layer| asked.contains(layer)).collect();
        Render { layers, ..self }
    }

    /// Adds a picture file to write at the end: `.png`, `.exr` or `.hdr`. May be called several times.
    pub fn output(mut self, file: impl Into<PathBuf>) -> Render {
        self.files.push(file.into());
        self
    }

    /// Whether PNG files show the worker that owns each pixel instead of radiance.
    pub fn overlay(self, overlay: bool) -> Render {
        Render { overlay, ..self }
    }

    /// Samples per pixel, each at least 1, at which to write numbered pictures.
    pub fn dump_at(self, samples: impl IntoIterator<Item = u32>) -> Render {
        let mut dump_at: Vec<u32> = samples.into_iter().collect();
        dump_at.sort_unstable();
        dump_at.dedup();
        Render { dump_at, ..self }
    }

    /// The NumPy file for all samples, `.npy`.
    pub fn sample_file(self, file: impl Into<PathBuf>) -> Render {
        Render { sample_file: Some(file.into()), ..self }
    }

    /// The film file to write, `.film`, for resuming and merging.
    pub fn film(self, file: impl Into<PathBuf>) -> Render {
        Render { film: Some(file.into()), ..self }
    }

    /// The interval at which the film file is written during the render; by default one minute.
    pub fn checkpoint(self, time: impl Into<Option<Duration>>) -> Render {
        Render { checkpoint: time.into(), ..self }
    }

    /// The film file to resume, which is also written unless `film` names another.
    pub fn resume(self, file: impl Into<PathBuf>) -> Render {
        Render { resume: Some(file.into()), ..self }
    }

    /// Protects a file, such as the scene's, from being overwritten by an output. May be called several times.
    pub fn keep(mut self, file: impl Into<PathBuf>) -> Render {
        self.kept.push(file.into());
        self
    }

    /// Reserves a file that the caller will write itself: no output may have the same path. May be called several
    /// times.
    pub fn beside(mut self, file: impl Into<PathBuf>) -> Render {
        self.others.push(file.into());
        self
    }

    /// The viewers of the render. A window requires the program's main thread, on which the whole render then runs.
    pub fn view(self, view: ViewerSettings) -> Render {
        Render { view, ..self }
    }
}

fn set<T>(place: &mut T, value: impl Into<Option<T>>) {
    if let Some(value) = value.into() {
        *place = value;
    }
}
