//! What a render is asked for.

use crate::film::Layer;
use crate::math::lanes::Level;
use crate::scene::{FilmMode, Filter, Integrator, Sampler, Scene, Sources, Tone};
use crate::session::{DeviceChoice, View};
use crate::world::Finder;
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

/// A render of a scene: what is asked for, and then the run.
///
/// What is not asked for is as the scene says, or as `stride render` does it: the CPU with one thread a core, to the
/// scene's number of samples. No file is written unless one is named. Settings that can be left to the scene take a value
/// or an `Option`, of which `None` leaves it so.
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
    pub(super) world: Finder,
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
    pub(super) view: View,
}

/// What is rendered.
impl Render {
    /// A render of a scene as it says itself. The scene is copied, but for its meshes, which are shared.
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
            world: Finder::Fastest,
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
            view: View::default(),
        }
    }

    /// The files that the scene's meshes come from: [`Loaded::sources`](crate::scene::Loaded::sources). Film files name them,
    /// so that messages can say which one has changed; no sample depends on their names.
    pub fn sources(self, sources: Sources) -> Render {
        Render { sources, ..self }
    }

    /// Width and height of the film in pixels, each 1 to [`LONGEST_SIDE`](crate::scene::LONGEST_SIDE).
    pub fn size(mut self, size: impl Into<Option<(u32, u32)>>) -> Render {
        if let Some((width, height)) = size.into() {
            (self.scene.film.width, self.scene.film.height) = (width, height);
        }
        self
    }

    /// The part of the film that is rendered, in pixels: column and row of its first one from the top left, its width
    /// and its height. The pixels are those of the whole picture.
    pub fn crop(self, crop: impl Into<Option<[u32; 4]>>) -> Render {
        Render { crop: crop.into(), ..self }
    }

    /// The seed of all randomness.
    pub fn seed(mut self, seed: impl Into<Option<u32>>) -> Render {
        set(&mut self.scene.render.seed, seed);
        self
    }

    /// How light is followed.
    pub fn integrator(mut self, integrator: impl Into<Option<Integrator>>) -> Render {
        set(&mut self.scene.render.integrator, integrator);
        self
    }

    /// Where random numbers come from.
    pub fn sampler(mut self, sampler: impl Into<Option<Sampler>>) -> Render {
        set(&mut self.scene.render.sampler, sampler);
        self
    }

    /// The largest number of bounces, 0 (emitters only) to [`MOST_BOUNCES`](crate::scene::MOST_BOUNCES), or
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

    /// Whether pixels draw samples of their own from the filter, or each sample counts in every pixel in reach.
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

/// When it ends.
impl Render {
    /// Samples a pixel, at least 1: those with the numbers 0 to `samples` − 1, also where a film is gone on with that
    /// begins later.
    pub fn samples(self, samples: impl Into<Option<u32>>) -> Render {
        Render { samples: samples.into(), ..self }
    }

    /// Only these samples of each pixel, for merging. An end of `u32::MAX` is none.
    pub fn range(self, range: impl Into<Option<Range<u32>>>) -> Render {
        Render { range: range.into(), ..self }
    }

    /// Ends at a whole sample after this time, or at the end of `samples` or `range`. Neither the scene's samples nor
    /// those that a resumed film was begun for count then.
    pub fn time(self, time: impl Into<Option<Duration>>) -> Render {
        Render { time: time.into(), ..self }
    }

    /// Ends when the estimated error (√relMSE_scaled without the worst 0.5% of pixels, above 0 and below 1) is this
    /// small, or at `samples`. It is known from 16 samples a pixel on, and never of a black picture.
    pub fn noise(self, error: impl Into<Option<f64>>) -> Render {
        Render { noise: error.into(), ..self }
    }

    /// Spends samples where the error is, until it is that of `noise` (or
    /// [`ADAPTIVE_NOISE`](crate::session::ADAPTIVE_NOISE)) on the whole, or pixels have `samples`.
    pub fn adaptive(mut self, adaptive: impl Into<Option<bool>>) -> Render {
        set(&mut self.scene.render.adaptive, adaptive);
        self
    }
}

/// Who renders. On the CPU none of this changes a bit.
impl Render {
    /// Threads that render, 1 to [`MOST_THREADS`](crate::session::MOST_THREADS); one a core unless it is said.
    pub fn threads(self, threads: impl Into<Option<usize>>) -> Render {
        Render { threads: threads.into(), ..self }
    }

    /// The lanes of the CPU; the widest that there are unless it is said.
    pub fn level(self, level: impl Into<Option<Level>>) -> Render {
        Render { level: level.into(), ..self }
    }

    /// What finds the surfaces that rays meet, on the CPU.
    pub fn world(self, world: Finder) -> Render {
        Render { world, ..self }
    }

    /// The devices.
    pub fn device(self, device: DeviceChoice) -> Render {
        Render { device, ..self }
    }
}

/// What becomes of it.
impl Render {
    /// Layers beside colour, in memory, in EXR files and in film files, each once and in the order of [`Layer::ALL`]. A
    /// render that goes on with a film shows the layers that were shown before, unless some are given.
    pub fn layers(self, layers: impl IntoIterator<Item = Layer>) -> Render {
        let asked: Vec<Layer> = layers.into_iter().collect();
        let layers = Layer::ALL.into_iter().filter(|layer| asked.contains(layer)).collect();
        Render { layers, ..self }
    }

    /// A picture file to write at the end: `.png`, `.exr` or `.hdr`. May be called several times.
    pub fn output(mut self, file: impl Into<PathBuf>) -> Render {
        self.files.push(file.into());
        self
    }

    /// Colours the pixels of PNG files by the worker that owns them, instead of what they saw.
    pub fn overlay(self, overlay: bool) -> Render {
        Render { overlay, ..self }
    }

    /// Numbers of samples, each at least 1, to write numbered pictures at, too.
    pub fn dump_at(self, samples: impl IntoIterator<Item = u32>) -> Render {
        let mut dump_at: Vec<u32> = samples.into_iter().collect();
        dump_at.sort_unstable();
        dump_at.dedup();
        Render { dump_at, ..self }
    }

    /// A NumPy file of every sample to write, `.npy`.
    pub fn sample_file(self, file: impl Into<PathBuf>) -> Render {
        Render { sample_file: Some(file.into()), ..self }
    }

    /// A film file to write, `.film`, which can be gone on with and merged.
    pub fn film(self, file: impl Into<PathBuf>) -> Render {
        Render { film: Some(file.into()), ..self }
    }

    /// How often the film file is written while the render runs; every minute unless it is said.
    pub fn checkpoint(self, time: impl Into<Option<Duration>>) -> Render {
        Render { checkpoint: time.into(), ..self }
    }

    /// A film file to go on with, which is the one that is written unless `film` names another.
    pub fn resume(self, file: impl Into<PathBuf>) -> Render {
        Render { resume: Some(file.into()), ..self }
    }

    /// A file that nothing may be written over: the scene's, for instance.
    pub fn keep(mut self, file: impl Into<PathBuf>) -> Render {
        self.kept.push(file.into());
        self
    }

    /// A file that the caller is going to write itself, for which no other file may have the same place.
    pub fn beside(mut self, file: impl Into<PathBuf>) -> Render {
        self.others.push(file.into());
        self
    }

    /// Where the render is shown while it runs. A window needs the program's main thread; all of the render is run there
    /// then.
    pub fn view(self, view: View) -> Render {
        Render { view, ..self }
    }
}

fn set<T>(place: &mut T, value: impl Into<Option<T>>) {
    if let Some(value) = value.into() {
        *place = value;
    }
}
