//! The validation of settings, and their defaults.

use super::builder::Render;
use super::error::{Error, SettingsError};
use super::places::check_places;
use crate::film::{Film, Layer, LayerSet, Layout};
use crate::integrator;
use crate::math::lanes::Level;
use crate::output::open_film;
use crate::sampling::Region;
use crate::scene::{self, FilmMode, Fingerprint, Scene};
use crate::session::{DeviceChoice, Devices, MOST_THREADS, Outputs, RenderJob, RenderSettings, Stopping};
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// The default interval at which the film file is written.
const CHECKPOINT: Duration = Duration::from_secs(60);

/// Pixel indices have 32 bits, with a margin for strides that step beyond the end.
const MOST_PIXELS: u64 = 1 << 31;

impl Render {
    /// The complete and checked settings: scene, devices, outputs. All files are checked to be writable, and no file is
    /// left behind. For callers that run [`crate::session`] themselves.
    pub fn settings(&self) -> Result<RenderSettings, Error> {
        let scene = &self.scene;
        check_film(scene)?;
        let problems = scene.problems();
        if !problems.is_empty() {
            return Err(Error::Scene(problems));
        }
        self.check_numbers()?;
        let picture = part(self.crop, scene.film.width, scene.film.height)?;
        let resumed = self.resume.as_deref().map(Resumed::read).transpose()?;
        let Range { start: first, end } = self.which_samples(resumed.as_ref())?;
        let shown = match &resumed {
            Some(film) if self.layers.is_empty() => film.shown.clone(),
            _ => self.layers.clone(),
        };
        // The film keeps its layers, whatever is written this time.
        let spreads = shown.contains(&Layer::Variance) || resumed.as_ref().is_some_and(|film| film.spreads);
        let layers = LayerSet::new(&shown, scene.entities.len(), scene.materials.len());
        let layers = resumed.map_or(layers, |film| film.layers.with(layers));
        let spp = end - first;
        self.check_together(first, spp)?;
        let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let threads = self.threads.and_then(NonZeroUsize::new).unwrap_or_else(cores);
        let level = self.level.unwrap_or_else(Level::widest);
        let settings = RenderSettings {
            job: RenderJob { first, spreads, layers, ..RenderJob::new(Arc::new(scene.clone()), picture) },
            stopping: Stopping { spp, time: self.time, noise: self.noise, adaptive: scene.render.adaptive },
            devices: Devices { choice: self.device.clone(), threads, level, accelerator: self.world },
            outputs: Outputs {
                pictures: self.files.clone(),
                overlay: self.overlay,
                dump_at: self.dump_at.clone(),
                layers: shown,
                samples: self.sample_file.clone(),
                sends_samples: false,
                film: self.film.clone().or_else(|| self.resume.clone()),
                checkpoint: self.checkpoint.unwrap_or(CHECKPOINT),
                resume: self.resume.clone(),
            },
            view: self.view.clone(),
        };
        if self.checkpoint.is_some() && settings.outputs.film.is_none() {
            return Err(SettingsError::CheckpointOfNoFilm.into());
        }
        check_places(&settings.outputs, &self.kept, &self.others)?;
        let fingerprint = Some(Fingerprint::of(scene, &self.sources));
        Ok(RenderSettings { job: RenderJob { fingerprint, ..settings.job }, ..settings })
    }

    /// Checks each number against its range.
    fn check_numbers(&self) -> Result<(), SettingsError> {
        let wrong = |setting, range, value: String| Err(SettingsError::OutOfRange { setting, range, value });
        if let Some(error) = self.noise
            && !(error > 0.0 && error < 1.0)
        {
            return wrong("noise", "a number above 0 and below 1, like 0.01", error.to_string());
        }
        if let Some(threads) = self.threads
            && !(1..=usize::from(MOST_THREADS)).contains(&threads)
        {
            return Err(SettingsError::Threads(threads));
        }
        if self.samples == Some(0) {
            return wrong("samples", "1 or more", "0".to_owned());
        }
        if self.dump_at.contains(&0) {
            return wrong("dump_at", "1 or more", "0".to_owned());
        }
        let times = [("time", self.time), ("checkpoint", self.checkpoint)];
        if let Some((setting, _)) = times.into_iter().find(|(_, time)| *time == Some(Duration::ZERO)) {
            return wrong(setting, "above 0", "0s".to_owned());
        }
        Ok(())
    }

    /// Checks combinations of settings, for a render from sample `first` with `spp` samples per pixel.
    fn check_together(&self, first: u32, spp: u32) -> Result<(), SettingsError> {
        if self.noise.is_some() && first > 0 {
            return Err(SettingsError::NoiseOfLaterSamples);
        }
        if self.layers.contains(&Layer::Variance) && integrator::contributes(self.scene.render.integrator) {
            return Err(SettingsError::VarianceOfContributions);
        }
        if self.scene.render.adaptive {
            self.check_adaptive(first)?;
        }
        match self.dump_at.iter().find(|&&at| at > spp) {
            Some(&at) => Err(SettingsError::DumpPastEnd { at, samples: spp }),
            None => Ok(()),
        }
    }

    fn check_adaptive(&self, first: u32) -> Result<(), SettingsError> {
        if self.range.is_some() || first > 0 {
            Err(SettingsError::AdaptiveRange)
        } else if !self.dump_at.is_empty() {
            Err(SettingsError::AdaptiveDump)
        } else if self.device != DeviceChoice::Cpu {
            Err(SettingsError::AdaptiveDevice)
        } else if self.scene.film.mode() == FilmMode::Continuous {
            Err(SettingsError::AdaptiveMode)
        } else {
            Ok(())
        }
    }

    /// The range of sample indices of a pixel; by default the scene's number.
    fn which_samples(&self, resumed: Option<&Resumed>) -> Result<Range<u32>, SettingsError> {
        if let Some(range) = &self.range {
            if self.samples.is_some() {
                return Err(SettingsError::RangeAndSamples);
            }
            if range.is_empty() {
                return Err(SettingsError::EmptyRange(range.clone()));
            }
            return Ok(range.clone());
        }
        let (first, begun_for) = resumed.map_or((0, None), |film| (film.first, film.end));
        let end = match (self.samples, begun_for) {
            (Some(samples), _) if samples > first => samples,
            (Some(samples), _) => return Err(SettingsError::BeforeFilm { samples, first }),
            // A limit of time or error alone replaces the range that the film was begun for.
            (None, _) if self.time.is_some() || self.noise.is_some() => u32::MAX,
            (None, Some(end)) => end,
            (None, None) => first.saturating_add(self.scene.render.samples),
        };
        Ok(first..end)
    }
}

/// The samples and layers of a resumed film.
struct Resumed {
    /// Its first sample index.
    first: u32,
    /// The end of its requested range, if it is known.
    end: Option<u32>,
    /// Whether it has the sums for the variance of weighted samples.
    spreads: bool,
    /// The layers of first hits whose sums it has.
    layers: LayerSet,
    /// The layers of its last render.
    shown: Vec<Layer>,
}

impl Resumed {
    fn read(path: &Path) -> Result<Resumed, Error> {
        let film = open_film(path)?;
        let asked = film.head().asked();
        let first = film.sample_ranges().start().or(asked.as_ref().map(|asked| asked.start)).unwrap_or(0);
        let end = asked.map(|asked| asked.end).filter(|&end| end > first && end < u32::MAX);
        let Layout { spreads, layers, .. } = film.head().layout;
        let shown = film.head().layers_shown();
        Ok(Resumed { first, end, spreads, layers, shown })
    }
}

/// Checks film and integrator settings that a caller may change, with messages for callers.
pub(crate) fn check_film(scene: &Scene) -> Result<(), SettingsError> {
    let endless = scene::endless(scene.render.integrator, scene.render.max_depth);
    if let Some(problem) = scene.film.problem().or(endless) {
        return Err(SettingsError::Scene(problem));
    }
    let (width, height) = (scene.film.width, scene.film.height);
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        let gigabytes = Film::memory(&Layout::plain(width, height)) as f64 / 1e9;
        return Err(SettingsError::TooManyPixels { width, height, gigabytes });
    }
    Ok(())
}

/// A part of a film, given by column and row of its first pixel, width and height; or the whole film.
pub(crate) fn part(crop: Option<[u32; 4]>, width: u32, height: u32) -> Result<Region, SettingsError> {
    let Some([x, y, w, h]) = crop else { return Ok(Region::whole(width, height)) };
    let fits =
        |from: u32, len: u32, side: u32| len > 0 && from.checked_add(len).is_some_and(|end| end <= side);
    if fits(x, w, width) && fits(y, h, height) {
        Ok(Region { film_width: width, x, y, width: w, height: h })
    } else {
        Err(SettingsError::Crop { crop: [x, y, w, h], film: [width, height] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unlimited_samples_are_not_a_target() {
        let target =
            |range: Range<u32>| Render::new(&Scene::default()).range(range).settings().unwrap().target();
        assert_eq!((target(16..u32::MAX), target(16..20)), (None, Some(4)));
    }

    #[test]
    fn a_part_lies_within_the_film() {
        assert!(part(Some([0, 0, 4, 4]), 4, 4).is_ok());
        for bad in [[0, 0, 5, 4], [1, 0, 4, 4], [0, 0, 0, 1], [u32::MAX, 0, 2, 1]] {
            let error = part(Some(bad), 4, 4).unwrap_err();
            assert_eq!(error, SettingsError::Crop { crop: bad, film: [4, 4] });
        }
    }
}
