//! What a render tells while it runs. The caller decides what of it is shown, and where.

use super::report::Noise;
use super::settings::Settings;
use crate::film::Reject;
use crate::output::Progress;
use crate::render::Traced;
use crate::render::accumulator::{Outcome, Totals};
use crate::scene::Viewpoint;
use crossbeam_channel::{Receiver, Sender, select};
use std::path::PathBuf;

/// Something that a render tells.
#[derive(Clone, Debug)]
pub enum Event {
    /// How far it is. If events are taken more slowly than they come, some of these are left out. There are none beside
    /// a window, which shows it.
    Progress(Progress),
    /// How far it came. No more samples are made; what there is is written from now on.
    Ended(Progress),
    /// A difficulty that was got over, or is going to be: a file that can't be written yet, a viewer that has gone.
    Note(String),
    /// The CPU renders without the GPU that was asked for, for this reason.
    CpuAlone(String),
    /// Where the camera of the window is, whose user asked to be told.
    Viewpoint(Viewpoint),
    /// What a render came to, when all is written. A render whose camera is moved tells it for each camera that it came
    /// to an end with.
    Concluded(Box<Conclusion>),
}

/// What a user should know of a render that has ended, beside the files.
#[derive(Clone, Debug)]
pub struct Conclusion {
    /// The files that were to be written, and whether all of them were.
    pub files: Vec<PathBuf>,
    /// Whether all of them were written.
    pub is_written: bool,
    /// The figures.
    pub totals: Totals,
    /// The fewest and the most samples that a pixel has.
    pub spp_range: [u64; 2],
    /// Whether every pixel has [`Totals::spp`] samples and no other.
    pub is_whole: bool,
    /// Pixels that were rendered.
    pub pixels: u32,
    /// Whether samples were spent where the error is.
    pub is_adaptive: bool,
    /// The samples a pixel that were asked for, if the render ended before them though nothing else was to end it.
    pub stopped_before: Option<u32>,
    /// Whether the time was up long before the next sample of every pixel was done.
    pub is_overtime: bool,
    /// Numbers of samples a pixel that pictures were asked for at, and that were not reached.
    pub unreached: Vec<u32>,
    /// Where the camera was moved to, if it was.
    pub moved: Option<Viewpoint>,
    /// What became of devices that were lost on the way.
    pub lost: Vec<String>,
    /// What became of the error at which the render was to end, if it was to end at one.
    pub noise: Option<Noise>,
    /// Whether the error was asked for by number.
    pub is_noise_asked: bool,
    /// Some of the samples that were left out, each with the column and row of its pixel.
    pub rejects: Vec<(Traced, [u32; 2], Reject)>,
    /// Contributions of samples that were left out: the other [`Totals::rejected`] are samples.
    pub rejected_contributions: u64,
    /// Samples that are infinite or too bright for a film.
    pub too_bright: u64,
    /// A warning that radiance is too small for a film, if it is and no note has said so.
    pub faint: Option<String>,
}

impl Conclusion {
    pub(super) fn of(settings: &Settings, outcome: &Outcome, is_written: bool) -> Conclusion {
        let (job, stopping, outputs) = (&settings.job, &settings.stopping, &settings.outputs);
        let (totals, film_width) = (outcome.totals, job.region.film_width);
        let may_end_early = stopping.time.is_some() || stopping.goal().is_some();
        let is_faint_known = outcome.has_warned_of_faint || totals.samples == 0;
        let faint = || outcome.faint.warning(&outcome.film, job.scene.has_light());
        let place = |traced: Traced| [traced.pixel % film_width, traced.pixel / film_width];
        let rejects = outcome.rejects.iter();
        Conclusion {
            files: outputs.pictures.iter().chain(&outputs.film).chain(&outputs.samples).cloned().collect(),
            is_written,
            totals,
            spp_range: outcome.film.seen_range(),
            is_whole: outcome.whole,
            pixels: job.region.len(),
            is_adaptive: stopping.adaptive,
            stopped_before: settings.target().filter(|&target| !may_end_early && totals.spp < target),
            is_overtime: outcome.overtime,
            unreached: outcome.unreached.iter().map(|end| end - job.first).collect(),
            moved: job.moved.clone(),
            lost: outcome.lost.iter().map(ToString::to_string).collect(),
            noise: stopping.goal().map(|asked| Noise::of(asked, outcome)),
            is_noise_asked: stopping.noise.is_some(),
            rejects: rejects.map(|&(traced, reject)| (traced, place(traced), reject)).collect(),
            rejected_contributions: outcome.film.lost_contributions()[0],
            too_bright: outcome.reject_counts.too_bright,
            faint: if is_faint_known { None } else { faint() },
        }
    }
}

/// Tells an event, as long as it can be heard.
pub(super) fn tell(events: &Sender<Event>, event: Event) {
    let _ = events.send(event);
}

/// The process that tells of progress and difficulties, until both channels have closed. The end of `totals` is the end
/// of the render.
pub(super) fn narrate(
    settings: &Settings,
    totals: &Receiver<Totals>,
    notes: &Receiver<String>,
    events: &Sender<Event>,
) {
    let mut last = Totals::default();
    loop {
        select! {
            recv(totals) -> totals => match totals {
                Ok(totals) => {
                    tell(events, Event::Progress(progress(settings, &totals)));
                    last = totals;
                }
                Err(_) => break,
            },
            recv(notes) -> note => match note {
                Ok(note) => tell(events, Event::Note(note)),
                Err(_) => break,
            },
        }
    }
    tell(events, Event::Ended(progress(settings, &last)));
    narrate_notes(notes, events);
}

/// The process that tells of difficulties.
pub(super) fn narrate_notes(notes: &Receiver<String>, events: &Sender<Event>) {
    notes.iter().for_each(|note| tell(events, Event::Note(note)));
}

fn progress(settings: &Settings, totals: &Totals) -> Progress {
    let len = f64::from(settings.job.region.len());
    Progress {
        spp_done: totals.samples as f64 / len,
        spp_before: totals.before as f64 / len,
        spp_target: settings.target(),
        seconds: totals.elapsed.as_secs_f64(),
        samples: totals.made(),
        time_limit: settings.stopping.time.map(|time| time.as_secs_f64()),
        noise: totals.noise,
    }
}
