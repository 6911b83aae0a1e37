//! The end of a render: its outputs and errors.

use super::error::{SessionError, Written};
use super::event::{Event, report_notes};
use super::identity;
use super::pictures::{Ended, Pictures};
use super::process::Process;
use super::report::sample_counts;
use super::settings::RenderSettings;
use crate::film::cryptomatte::Mattes;
use crate::film::head::Head;
use crate::film::{Channel, Picture};
use crate::output::FilmSink;
use crate::output::window::ExitReason;
use crate::render::accumulator::{Inbox, Outcome, Unanswered};
use crate::render::{Accumulator, Stride};
use crate::sampling::Region;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;

/// The process from the film to the files. It is a single process, so that files are written while the window stays
/// open.
pub(super) struct Finisher<'a, 'scope> {
    pub(super) pictures: Pictures<'a>,
    pub(super) sink: Option<&'a FilmSink>,
    /// The process that writes checkpoints.
    pub(super) film_writer: Option<Process<'scope, ()>>,
    /// The reason why the window left the render, available before the accumulator notices.
    pub(super) exit_reason: Receiver<ExitReason>,
    /// Informs the process that saves for the window of the coming end.
    pub(super) ending: Sender<Ended>,
}

/// The result of a [`Finisher`].
pub(super) struct Finished {
    pub(super) outcome: Outcome,
    pub(super) picture: Picture,
    pub(super) layers: Vec<Channel>,
    pub(super) written: Written,
    pub(super) is_suspended: bool,
}

impl Finisher<'_, '_> {
    /// Runs the accumulator and writes its outcome: the film first, then the pictures.
    pub(super) fn run(self, accumulator: Accumulator, inbox: Inbox) -> Result<Finished, SessionError> {
        let Finisher { pictures, sink, film_writer, exit_reason, ending } = self;
        let outcome = accumulator.run(inbox);
        let is_suspended = is_suspended(&outcome, exit_reason.try_recv().ok().as_ref());
        // The owners of pixels may have changed.
        let pictures = Pictures { owners: Arc::clone(&outcome.owners), ..pictures };
        let picture = outcome.film.picture();
        // Neither a pending checkpoint nor a save of the window must replace the final files.
        let kept = film_writer.map_or(Ok(()), Process::join);
        let (written_out, written) = bounded(0);
        // Without a window there is no save to wait for.
        let _ = ending.send(written);
        // A black picture must not replace an existing file.
        let (written, layers) = match outcome.totals.samples {
            0 => (Ok(()), Vec::new()),
            _ if is_suspended => (Ok(()), Vec::new()),
            _ => pictures.write_end(sink, &outcome, &picture),
        };
        drop(written_out);
        kept.map(|()| Finished { outcome, picture, layers, written, is_suspended })
    }
}

/// Whether a render is suspended: the camera has moved, and there was no failure. A failed render is not resumed, and
/// so is written at once.
fn is_suspended(outcome: &Outcome, exit_reason: Option<&ExitReason>) -> bool {
    outcome.failure.is_none()
        && outcome.unanswered.is_empty()
        && matches!(exit_reason, Some(ExitReason::Moved(_) | ExitReason::SceneCamera))
}

/// Writes the suspended render of the scene's own camera.
pub(super) fn write_suspended(
    settings: &RenderSettings,
    head: &Head,
    (outcome, picture): (&Outcome, &Picture),
    events: &Sender<Event>,
) -> Result<(), SessionError> {
    if outcome.totals.samples == 0 {
        return Ok(());
    }
    let sink = identity::film_sink(settings, head);
    let mattes = Mattes::of(&settings.job.scene);
    let (notes_out, notes) = bounded(16);
    let written = std::thread::scope(|scope| {
        scope.spawn(move || report_notes(&notes, events));
        let (identity, mattes, owners) = (&head.identity, &mattes, Arc::clone(&outcome.owners));
        let pictures = Pictures { settings, identity, mattes, owners, notes: notes_out };
        pictures.write_end(sink.as_ref(), outcome, picture).0
    });
    Ok(written?)
}

/// The first error, if there was any.
pub(super) fn problem(
    outcome: &Outcome,
    written: Written,
    dumped: Result<Written, SessionError>,
    painted: Result<Written, SessionError>,
    abandoned: impl Fn(&Unanswered) -> String,
) -> Option<SessionError> {
    if outcome.failure.is_some() || !outcome.unanswered.is_empty() {
        let kept = match written {
            Err(error) => format!("the picture so far could not be written: {error}"),
            Ok(()) if outcome.totals.samples == 0 => "nothing had been rendered".to_owned(),
            Ok(()) => {
                let counts = sample_counts(outcome.film.seen_range());
                format!("the picture so far has been written: {counts}")
            }
        };
        return Some(match &outcome.failure {
            Some(failure) => SessionError::Worker(failure.clone(), kept),
            None => {
                let silent: Vec<String> = outcome.unanswered.iter().map(abandoned).collect();
                SessionError::Unanswered(silent.join("; "), kept)
            }
        });
    }
    let files = || -> Result<(), SessionError> {
        written?;
        dumped??;
        painted??;
        Ok(())
    };
    files().err()
}

/// Describes a worker that did not stop: its complete order, so that it can be repeated, and a way to find the slow
/// path.
pub(super) fn describe_abandoned(
    silent: &Unanswered,
    names: &[String],
    gpu: Option<usize>,
    region: Region,
) -> String {
    let name = names.get(silent.worker).map_or("a worker", String::as_str);
    let within = silent.within.as_secs_f64();
    let silence = format!("{name} did not stop within {within} s of the request, and was abandoned");
    let Some((order, slots)) = silent.order.as_ref().filter(|(_, slots)| !slots.is_empty()) else {
        return format!("{silence}. It had no order");
    };
    let Stride { first, step, run } = order.stride;
    let place = match run {
        1 => format!("{first} + {step}·i"),
        run => format!("{first} + {step}·(i div {run}) + (i mod {run})"),
    };
    let Region { x, y, width, .. } = region;
    let from = region.pixel(order.stride.place(slots.start));
    let [first_sample, last_sample] = [order.first, order.end - 1];
    let hint = if gpu == Some(silent.worker) {
        "The CPU traces the same paths, which shows whether the scene or the device is slow"
    } else {
        "At least one path among them is slow or endless"
    };
    format!(
        "{silence}. Its order: samples {first_sample} to {last_sample} of {} pixels with i = {} to {}, each at column {x} + p mod {width} and row {y} + p div {width} for p = {place}. {hint}. Trace them with stride trace SCENE --pixel {},{} --sample {first_sample}",
        slots.len(),
        slots.start,
        slots.end - 1,
        from.x,
        from.y,
    )
}
