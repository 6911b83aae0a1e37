//! The paths that integrators trace, and the samples that they return.

use crate::camera::Camera;
use crate::math::{Float, Ray};
use crate::sampling::warp::FilmOffset;
use crate::sampling::{Block, Contribution, Independent, PathId, Pixel, Sample, Sampler, Sobol};
use crate::scene;

/// Paths to trace: a range of sample indices, for each of some pixels.
#[derive(Clone, Copy, Debug)]
pub struct Paths<'a> {
    /// The indices of the pixels.
    pub pixels: &'a [Pixel],
    /// The first sample index.
    pub first_sample: u32,
    /// The number of samples per pixel.
    pub samples: u32,
}

impl Paths<'_> {
    /// The number of paths.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.pixels.len() * self.samples as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A finished path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finished {
    /// The index of its pixel in [`Paths::pixels`].
    pub slot: u32,
    /// Its sample.
    pub sample: Sample,
}

/// The results of tracing paths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// The sample of each path.
    pub finished: Vec<Finished>,
    /// The contributions of samples to any pixel.
    pub contributions: Vec<Contribution>,
}

impl Found {
    /// Clears the results and keeps the memory.
    pub fn clear(&mut self) {
        self.finished.clear();
        self.contributions.clear();
    }
}

/// Settings that all integrators share.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// The source of random numbers.
    pub sampler: Sampler,
    /// The distribution of samples around a pixel's centre.
    pub offset: FilmOffset,
    /// The maximum number of bounces; [`crate::scene::UNLIMITED`] only for integrators that end their paths otherwise.
    pub max_depth: u32,
}

impl Settings {
    /// The settings of a scene.
    pub fn new(render: &scene::RenderSettings, offset: FilmOffset) -> Settings {
        let seed = render.seed;
        let sampler = match render.sampler {
            scene::Sampler::Independent => Independent { seed }.into(),
            scene::Sampler::Sobol => Sobol { seed }.into(),
        };
        Settings { sampler, offset, max_depth: render.max_depth }
    }
}

/// The film position of a path, in pixels from the top left, and its camera ray.
#[inline(always)]
pub(crate) fn camera_ray<F: Float>(
    settings: &Settings,
    camera: &Camera,
    path: PathId<F>,
    centre: [F; 2],
) -> (F, F, Ray<F>) {
    let [u, v, lens_u, lens_v] = settings.sampler.draw(path, Block::CAMERA.number::<F>());
    let x = centre[0] + settings.offset.sample(u);
    let y = centre[1] + settings.offset.sample(v);
    (x, y, camera.ray(x, y, [lens_u, lens_v]))
}
