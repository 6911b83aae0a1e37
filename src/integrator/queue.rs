//! Camera rays that are computed ahead for free lanes.

use super::paths::{Paths, Settings, camera_ray};
use crate::camera::Camera;
use crate::math::lanes::MAX_LANES;
use crate::math::{LaneFloat, LaneMask, LaneUint, Mask, Ray, Uint, Vec3};
use crate::sampling::PathId;

/// The properties of a path that do not change along it.
#[derive(Clone, Copy)]
pub(super) struct Start<F: LaneFloat> {
    /// The index of its pixel in [`Paths::pixels`].
    pub slot: F::Uint,
    pub id: PathId<F>,
    /// Film position in pixels from the top left.
    pub x: F,
    pub y: F,
}

impl<F: LaneFloat> Start<F> {
    /// Placeholders, for lanes without a path.
    pub(super) fn nowhere() -> Self {
        let zero = F::Uint::splat(0);
        Start { slot: zero, id: PathId { pixel: zero, sample: zero }, x: F::zero(), y: F::zero() }
    }
}

/// The next paths of a block, computed for all lanes at a time. A lane whose path has ended takes one of them, and no
/// camera ray is computed for busy lanes.
pub(super) struct Queue<'a> {
    paths: &'a Paths<'a>,
    /// The next path to compute, as (pixel, sample) in `paths`.
    next: (usize, u32),
    /// The entries from `taken` to `made` hold computed paths.
    made: u32,
    taken: u32,
    slot: [u32; MAX_LANES],
    pixel: [u32; MAX_LANES],
    sample: [u32; MAX_LANES],
    x: [f32; MAX_LANES],
    y: [f32; MAX_LANES],
    origin: [[f32; MAX_LANES]; 3],
    direction: [[f32; MAX_LANES]; 3],
    time: [f32; MAX_LANES],
}

impl<'a> Queue<'a> {
    pub(super) fn new(paths: &'a Paths<'a>) -> Self {
        let (words, floats) = ([0; MAX_LANES], [0.0; MAX_LANES]);
        Queue {
            paths,
            next: if paths.is_empty() { (paths.pixels.len(), 0) } else { (0, 0) },
            made: 0,
            taken: 0,
            slot: words,
            pixel: words,
            sample: words,
            x: floats,
            y: floats,
            origin: [floats; 3],
            direction: [floats; 3],
            time: floats,
        }
    }

    /// Gives paths and their first rays to the idle lanes, as long as there are any. Returns the lanes that got one.
    #[inline(always)]
    pub(super) fn take<F: LaneFloat>(
        &mut self,
        idle: F::Mask,
        settings: &Settings,
        camera: &Camera,
        start: &mut Start<F>,
        ray: &mut Ray<F>,
    ) -> F::Mask {
        let mut given = F::Mask::splat(false);
        let mut wanting = idle;
        while wanting.any() {
            if self.taken == self.made {
                if self.next.0 == self.paths.pixels.len() {
                    break;
                }
                self.make::<F>(settings, camera);
            }
            let rank = F::Uint::rank(wanting);
            let served = wanting & rank.lt(F::Uint::splat(self.made - self.taken));
            let place = rank + F::Uint::splat(self.taken);
            replace_words::<F>(&mut start.slot, served, &self.slot, place);
            replace_words::<F>(&mut start.id.pixel, served, &self.pixel, place);
            replace_words::<F>(&mut start.id.sample, served, &self.sample, place);
            start.x = F::select(served, F::gather(&self.x, place), start.x);
            start.y = F::select(served, F::gather(&self.y, place), start.y);
            ray.o = Vec3::select(served, Vec3::gather(&self.origin, place), ray.o);
            ray.d = Vec3::select(served, Vec3::gather(&self.direction, place), ray.d);
            ray.time = F::select(served, F::gather(&self.time, place), ray.time);
            self.taken += served.bits().count_ones();
            given = given | served;
            wanting = wanting & !served;
        }
        given
    }

    /// Computes the next paths.
    #[inline(always)]
    fn make<F: LaneFloat>(&mut self, settings: &Settings, camera: &Camera) {
        let (mut slot, mut sample) = self.next;
        self.made = 0;
        self.taken = 0;
        while (self.made as usize) < F::LANES && slot < self.paths.pixels.len() {
            let place = self.made as usize;
            let pixel = self.paths.pixels[slot];
            self.slot[place] = slot as u32;
            self.pixel[place] = pixel.index;
            self.sample[place] = self.paths.first_sample + sample;
            self.x[place] = pixel.x as f32 + 0.5;
            self.y[place] = pixel.y as f32 + 0.5;
            self.made += 1;
            sample += 1;
            if sample == self.paths.samples {
                (slot, sample) = (slot + 1, 0);
            }
        }
        self.next = (slot, sample);
        let id = PathId { pixel: F::Uint::load(&self.pixel), sample: F::Uint::load(&self.sample) };
        let (x, y, ray) = camera_ray(settings, camera, id, [F::load(&self.x), F::load(&self.y)]);
        x.store(&mut self.x);
        y.store(&mut self.y);
        ray.o.store(&mut self.origin);
        ray.d.store(&mut self.direction);
        ray.time.store(&mut self.time);
    }
}

/// Looks up new words for the lanes of a mask.
#[inline(always)]
fn replace_words<F: LaneFloat>(words: &mut F::Uint, lanes: F::Mask, row: &[u32], place: F::Uint) {
    *words = F::Uint::select(lanes, F::Uint::gather(row, place), *words);
}
