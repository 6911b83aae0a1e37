//! Events of a render. The caller decides how to show them.

use super::report::Noise;
use super::settings::RenderSettings;
use crate::film::Reject;
use crate::output::Progress;
use crate::render::Traced;
use crate::render::accumulator::{Outcome, Totals};
use crate::scene::Viewpoint;
use crossbeam_channel::{Receiver, Sender, select};
use std::path::PathBuf;

/// An event of a render.
#[derive(Clone, Debug)]
pub enum Event {
    /// The progress. Some are dropped if the caller receives events slowly. There are none with a window, which shows
    /// the progress itself.
    Progress(Progress),
    /// The final progress. No more samples are made; outputs are written after this.
    Ended(Progress),
    /// A problem that does not stop the render: a file that cannot be written yet, a viewer that has disconnected.
    Note(String),
    /// The CPU renders without the requested GPU, for this reason.
    CpuAlone(String),
    /// The camera of the window, on the user's request.
    Viewpoint(Viewpoint),
    /// The conclusion of a render, when all outputs are written. A render whose camera is moved sends one for each
    /// camera that was rendered to its end.
    Concluded(Box<Conclusion>),
}

/// A summary of a render that has ended, for the user.
#[derive(Clone, Debug)]
pub struct Conclusion {
    /// The files that were to be written.
    pub files: Vec<PathBuf>,
    /// Whether all of them were written.
    pub is_written: bool,
    /// The figures.
    pub totals: Totals,
    /// The minimum and the maximum number of samples per pixel.
    pub spp_range: [u64; 2],
    /// Whether every pixel has exactly [`Totals::spp`] samples.
    pub is_whole: bool,
    /// Pixels that were rendered.
    pub pixels: u32,
    /// Whether sampling was adaptive.
    pub is_adaptive: bool,
    /// The requested samples per pixel, if the render ended early without another criterion for its end.
    pub stopped_before: Option<u32>,
    /// Whether the time was up long before the next whole sample.
    pub is_overtime: bool,
    /// The requested samples per pixel of pictures that were not reached.
    pub unreached: Vec<u32>,
    /// The position of the moved camera, if it was moved.
    pub moved: Option<Viewpoint>,
    /// Descriptions of the devices that were lost.
    pub lost: Vec<String>,
    /// The requested and the estimated error, if the render was to end at an error.
    pub noise: Option<Noise>,
    /// Whether the user requested the error by number.
    pub is_noise_asked: bool,
    /// Some of the rejected samples, each with the column and row of its pixel.
    pub rejects: Vec<(Traced, [u32; 2], Reject)>,
    /// The number of rejected contributions: the rest of [`Totals::rejected`] are samples.
    pub rejected_contributions: u64,
    /// The number of samples that are infinite or too bright for a film.
    pub too_bright: u64,
    /// A warning that radiance is too small for a film, unless a note has already given it.
    pub faint: Option<String>,
}

impl Conclusion {
    pub(super) fn of(settings: &RenderSettings, outcome: &Outcome, is_written: bool) -> Conclusion {
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

/// Sends an event, unless the channel is closed.
pub(super) fn send_event(events: &Sender<Event>, event: Event) {
    let _ = events.send(event);
}

/// The process that reports progress and notes until both channels have closed. The render has ended when `totals`
/// closes.
pub(super) fn report_events(
    settings: &RenderSettings,
    totals: &Receiver<Totals>,
    notes: &Receiver<String>,
    events: &Sender<Event>,
) {
    let mut last = Totals::default();
    loop {
        select! {
            recv(totals) -> totals => match totals {
                Ok(totals) => {
                    send_event(events, Event::Progress(progress(settings, &totals)));
                    last = totals;
                }
                Err(_) => break,
            },
            recv(notes) -> note => match note {
                Ok(note) => send_event(events, Event::Note(note)),
                Err(_) => break,
            },
        }
    }
    send_event(events, Event::Ended(progress(settings, &last)));
    report_notes(notes, events);
}

/// The process that reports notes.
pub(super) fn report_notes(notes: &Receiver<String>, events: &Sender<Event>) {
    notes.iter().for_each(|note| send_event(events, Event::Note(note)));
}

fn progress(settings: &RenderSettings, totals: &Totals) -> Progress {
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
