//! The end of a render: what is written then, and what is said of what went wrong.

use super::error::{SessionError, Written};
use super::event::{Event, narrate_notes};
use super::identity;
use super::pictures::{Ended, Pictures};
use super::process::Process;
use super::report::sample_counts;
use super::settings::Settings;
use crate::film::cryptomatte::Mattes;
use crate::film::head::Head;
use crate::film::{Channel, Picture};
use crate::output::FilmSink;
use crate::output::window::Left;
use crate::render::accumulator::{Inbox, Outcome, Unanswered};
use crate::render::{Accumulator, Stride};
use crate::sampling::Region;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;

/// The process from the film to the files. It is one, so that they are written while the window stays open.
pub(super) struct Finisher<'a, 'scope> {
    pub(super) pictures: Pictures<'a>,
    pub(super) sink: Option<&'a FilmSink>,
    /// The process that writes checkpoints.
    pub(super) keeper: Option<Process<'scope, ()>>,
    /// Why the window left the render, before the accumulator hears that it did.
    pub(super) left: Receiver<Left>,
    /// Where the saver of the window hears that the end is coming.
    pub(super) ending: Sender<Ended>,
}

/// What comes of it.
pub(super) struct Finished {
    pub(super) outcome: Outcome,
    pub(super) picture: Picture,
    pub(super) layers: Vec<Channel>,
    pub(super) written: Written,
    pub(super) is_aside: bool,
}

impl Finisher<'_, '_> {
    /// Runs the accumulator, and writes what it comes to: the film first, then the pictures.
    pub(super) fn run(self, accumulator: Accumulator, inbox: Inbox) -> Result<Finished, SessionError> {
        let Finisher { pictures, sink, keeper, left, ending } = self;
        let outcome = accumulator.run(inbox);
        let is_aside = is_aside(&outcome, left.try_recv().ok().as_ref());
        // Whose pixels they are may have changed on the way.
        let pictures = Pictures { owners: Arc::clone(&outcome.owners), ..pictures };
        let picture = outcome.film.picture();
        // Neither a checkpoint that is still on its way nor what the window saves must replace the end.
        let kept = keeper.map_or(Ok(()), Process::join);
        let (written_out, written) = bounded(0);
        // Without a window there is nothing to wait for.
        let _ = ending.send(written);
        // A black picture is no replacement for whatever is there.
        let (written, layers) = match outcome.totals.samples {
            0 => (Ok(()), Vec::new()),
            _ if is_aside => (Ok(()), Vec::new()),
            _ => pictures.write_end(sink, &outcome, &picture),
        };
        drop(written_out);
        kept.map(|()| Finished { outcome, picture, layers, written, is_aside })
    }
}

/// Whether a render is set aside: the camera has moved on, and nothing has failed. A render that failed is not gone on
/// with, so that it is written.
fn is_aside(outcome: &Outcome, left: Option<&Left>) -> bool {
    outcome.failure.is_none()
        && outcome.unanswered.is_empty()
        && matches!(left, Some(Left::Moved(_) | Left::Home))
}

/// Writes the render of the scene's own camera that was set aside.
pub(super) fn write_aside(
    settings: &Settings,
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
        scope.spawn(move || narrate_notes(&notes, events));
        let (identity, mattes, owners) = (&head.identity, &mattes, Arc::clone(&outcome.owners));
        let pictures = Pictures { settings, identity, mattes, owners, notes: notes_out };
        pictures.write_end(sink.as_ref(), outcome, picture).0
    });
    Ok(written?)
}

/// The first thing that went wrong, if any did.
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
            Ok(()) if outcome.totals.samples == 0 => "nothing had been rendered yet".to_owned(),
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

/// Describes a worker that did not stop: its whole order, so that it can be repeated, and a way to find the path that
/// takes long.
pub(super) fn describe_abandoned(
    silent: &Unanswered,
    names: &[String],
    gpu: Option<usize>,
    region: Region,
) -> String {
    let name = names.get(silent.worker).map_or("a worker", String::as_str);
    let within = silent.within.as_secs_f64();
    let silence = format!("{name} did not stop within {within} s of the request to, and was abandoned");
    let Some((order, slots)) = silent.order.as_ref().filter(|(_, slots)| !slots.is_empty()) else {
        return format!("{silence}: it held no order");
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
        "a CPU takes the same paths, and shows whether the scene or the device is slow"
    } else {
        "one of them is slow or takes forever"
    };
    format!(
        "{silence}: it held the samples {first_sample} to {last_sample} of {} pixels, which have numbers i from {} to {}, each in column {x} + p mod {width} and row {y} + p div {width} for p = {place}; {hint}: try them with stride trace SCENE --pixel {},{} --sample {first_sample}",
        slots.len(),
        slots.start,
        slots.end - 1,
        from.x,
        from.y,
    )
}
