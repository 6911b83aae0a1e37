//! The film of a job: what it holds, its checkpoint on disk, where it ends, and its outputs.

use super::job::JobDevice;
use super::unit::Posted;
use crate::film::file::FilmFileError;
use crate::film::head::Head;
use crate::film::noise::FIRST_MILESTONE;
use crate::film::{Film, Milestone, SampleRanges};
use crate::fleet::FleetError;
use crate::output::atomic::discard_drafts;
use crate::output::film::write_film_if;
use crate::output::{FilmError, open_film};
use crate::session::{RenderSettings, film_head, write_film_pictures};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A film that is gathered from those of units.
pub(super) struct Gathering {
    settings: RenderSettings,
    /// The devices that the job allows.
    allowed: JobDevice,
    /// The device whose samples it has, once there are some.
    device: Option<String>,
    film: Film,
    held: SampleRanges,
    milestone: Option<Milestone>,
    /// The film file of the last checkpoint.
    checkpoint: PathBuf,
}

/// Why a result is not added.
pub(super) enum Refusal {
    /// It belongs to another render, or is not what it says. The film is unchanged.
    Other(String),
    /// It contradicts itself, which is only found when it has been added: the film must be loaded again.
    Spoiled(String),
    /// Its file cannot be read here.
    Unread(FleetError),
}

impl Gathering {
    /// An empty film, or that of the last checkpoint. From now on an earlier collector that was paused in the middle of a
    /// file does not replace it.
    pub(super) fn open(
        settings: RenderSettings,
        allowed: JobDevice,
        checkpoint: &Path,
    ) -> Result<Gathering, FleetError> {
        discard_drafts(checkpoint)?;
        settings.outputs.pictures.iter().try_for_each(|path| discard_drafts(path))?;
        let film = Film::with_layout(settings.job.layout()).map_err(crate::session::SessionError::from)?;
        let mut gathering = Gathering {
            settings,
            allowed,
            device: None,
            film,
            held: SampleRanges::default(),
            milestone: None,
            checkpoint: checkpoint.to_path_buf(),
        };
        gathering.reload()?;
        Ok(gathering)
    }

    /// Returns to the last checkpoint.
    pub(super) fn reload(&mut self) -> Result<(), FleetError> {
        self.film =
            Film::with_layout(self.settings.job.layout()).map_err(crate::session::SessionError::from)?;
        (self.held, self.milestone, self.device) = (SampleRanges::default(), None, None);
        if !self.checkpoint.exists() {
            return Ok(());
        }
        let file = open_film(&self.checkpoint)?;
        let device = file.head().identity.get("device").unwrap_or_default().to_owned();
        if let Some(difference) = self.head(&device).difference(file.head()) {
            return Err(FleetError::Job(format!(
                "{:?} belongs to another render: {difference}; name another film (--film)",
                self.checkpoint
            )));
        }
        if file.sample_ranges().open().is_some() || file.head().layout != self.settings.job.layout() {
            return Err(FleetError::Job(format!("{:?} is not the film of this job", self.checkpoint)));
        }
        (self.held, self.milestone) = (file.sample_ranges().clone(), file.milestone().cloned());
        file.add_to(&mut self.film).map_err(|reason| FilmError { path: self.checkpoint.clone(), reason })?;
        self.device = Some(device);
        Ok(())
    }

    /// The header of the film on a device.
    fn head(&self, device: &str) -> Head {
        film_head(&self.settings, device)
    }

    pub(super) fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    pub(super) fn held(&self) -> &SampleRanges {
        &self.held
    }

    /// Samples per pixel from sample 0 on, without a gap.
    pub(super) fn completed(&self) -> u32 {
        self.held.whole().first().filter(|range| range.start == 0).map_or(0, |range| range.end)
    }

    /// Changes the number of samples per pixel at the end.
    pub(super) fn set_target(&mut self, target: u32) {
        self.settings.stopping.spp = target;
    }

    /// Whether some of these samples are in the film.
    pub(super) fn has_some_of(&self, range: &Range<u32>) -> bool {
        self.held.overlap(&prefix(range)).is_some()
    }

    /// Adds the film file of a result. Its checksum has been compared.
    pub(super) fn add(&mut self, posted: &Posted, path: &Path) -> Result<(), Refusal> {
        let other = |why: String| Refusal::Other(why);
        let or = |refusal: fn(String) -> Refusal| {
            move |error: FilmFileError| match error {
                FilmFileError::Io(reason) => {
                    Refusal::Unread(FleetError::File { path: path.to_path_buf(), reason })
                }
                error => refusal(error.to_string()),
            }
        };
        let file = open_film(path).map_err(|error| or(Refusal::Other)(error.reason))?;
        let device = file.head().identity.get("device").unwrap_or_default().to_owned();
        if !self.allowed.allows(&device) {
            return Err(other(format!("its samples come from another device, {device}")));
        }
        let ours = self.head(self.device.as_deref().unwrap_or(&device));
        if let Some(difference) = ours.difference(file.head()) {
            return Err(other(format!("it belongs to another render: {difference}")));
        }
        if file.head().layout != ours.layout {
            return Err(other("it has other kinds of sums".to_owned()));
        }
        let range = posted.unit.range();
        if *file.sample_ranges() != prefix(&range) {
            let has = file.sample_ranges();
            return Err(other(format!("it has the samples {has}, not {}..{}", range.start, range.end)));
        }
        if self.has_some_of(&range) {
            return Err(other("its samples have been added before".to_owned()));
        }
        file.add_to(&mut self.film).map_err(or(Refusal::Spoiled))?;
        self.held.join(&prefix(&range));
        self.device = Some(device);
        Ok(())
    }

    /// The next milestone, if the render ends at an error.
    fn next_gate(&self) -> Option<u32> {
        self.settings.stopping.noise?;
        Some(match &self.milestone {
            None => FIRST_MILESTONE,
            Some(milestone) => milestone.samples.saturating_mul(2),
        })
    }

    /// Samples per pixel at the end, as far as it is known.
    pub(super) fn end(&self) -> u32 {
        let target = self.settings.stopping.spp;
        let asked = self.settings.stopping.noise;
        let end = self.milestone.as_ref().zip(asked).and_then(|(milestone, asked)| milestone.end(asked));
        end.map_or(target, |end| end.max(self.completed()).min(target))
    }

    /// Samples per pixel up to which units may be issued: those beyond a milestone depend on it.
    pub(super) fn limit(&self) -> u32 {
        self.next_gate().map_or(self.end(), |gate| gate.min(self.end()))
    }

    /// Passes the milestones that are complete, as the accumulator of one machine does.
    pub(super) fn pass_gates(&mut self) {
        while let Some(gate) = self.next_gate().filter(|&gate| gate < self.end() && self.completed() == gate)
        {
            self.milestone = Some(Milestone::new(gate, self.film.picture(), self.milestone.as_ref()));
        }
    }

    /// Whether the film is complete.
    pub(super) fn is_complete(&self) -> bool {
        self.completed() == self.end()
    }

    /// The estimated error at the samples so far, and the requested one.
    pub(super) fn noise(&self) -> Option<[f64; 2]> {
        let asked = self.settings.stopping.noise?;
        Some([self.milestone.as_ref()?.error_at(self.completed())?, asked])
    }

    /// Writes the checkpoint, unless `may` fails, which is called when the file has been begun.
    pub(super) fn save(&self, may: impl FnOnce() -> Result<(), FleetError>) -> Result<(), FleetError> {
        let Some(device) = &self.device else { return Ok(()) };
        let head = self.head(device);
        write_film_if(&self.checkpoint, &head, &self.film, &self.held, self.milestone.as_ref(), may)
    }

    /// Writes the outputs of the samples so far, unless `may` fails. Returns whether there are any.
    pub(super) fn write(&self, may: impl Fn() -> Result<(), FleetError>) -> Result<bool, FleetError> {
        let Some(device) = &self.device else { return Ok(false) };
        let saved = if self.settings.outputs.film.is_some() { self.save(&may) } else { may() };
        match saved {
            // The pictures may be on another disk.
            Ok(()) | Err(FleetError::Output(_)) => {}
            Err(error) => return Err(error),
        }
        write_film_pictures(&self.settings, &self.head(device), &self.film, &self.held)?;
        saved.map(|()| true)
    }

    /// Removes the checkpoint, unless it is an output.
    pub(super) fn remove_checkpoint(&self) {
        if self.settings.outputs.film.as_ref() != Some(&self.checkpoint) {
            let _ = std::fs::remove_file(&self.checkpoint);
        }
    }
}

/// The samples of a range, for every pixel.
fn prefix(range: &Range<u32>) -> SampleRanges {
    let len = u64::from(range.end - range.start);
    SampleRanges::prefix(range.clone(), len, len)
}
