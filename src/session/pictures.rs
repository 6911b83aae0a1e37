//! The picture files of a render: at barriers, on request of the window, and at the end.

use super::error::Written;
use super::event::{Event, send_event};
use super::identity::{facts, mattes_of, write_with_facts};
use super::layers::layers;
use super::settings::RenderSettings;
use crate::film::cryptomatte::Mattes;
use crate::film::{Channel, Identity, Picture, Snapshot, ViewTransform};
use crate::output::window::Request;
use crate::output::{FilmSink, Format, RetryPolicy, numbered_path, write_owner_overlay};
use crate::render::Barrier;
use crate::render::accumulator::Outcome;
use crate::scene::Viewpoint;
use crossbeam_channel::{Receiver, Sender, never, select};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pictures that are kept in memory until they can be written.
const MOST_UNWRITTEN: usize = 4;

/// Sends a note about a problem, unless the channel is closed.
pub(super) fn note(notes: &Sender<String>, line: String) {
    let _ = notes.send(line);
}

/// Closes when all final files have been written.
pub(super) type Ended = Receiver<Infallible>;

/// Serves a window's requests: reports cameras by `print_camera`, and saves pictures by `save`, which receives the snapshot,
/// the view transform and whether the final files are already written, and returns a message. The finisher sends over
/// `ending` first: once that is received no save is in progress, and none begins before the final files are written.
/// After that unfinished pictures are not saved.
fn serve_saves(
    requests: &Receiver<Request>,
    ending: &Receiver<Ended>,
    print_camera: impl Fn(Viewpoint),
    save: impl Fn(&Snapshot, ViewTransform, bool) -> String,
) {
    let (mut ending, mut ended) = (ending.clone(), false);
    loop {
        select! {
            recv(ending) -> end => {
                if let Ok(end) = end {
                    ended = true;
                    // The channel carries no messages: it closes.
                    let _ = end.recv();
                }
                ending = never();
            },
            recv(requests) -> request => {
                let (snapshot, view, reply) = match request {
                    Ok(Request::Save { snapshot, view, reply }) => (snapshot, view, reply),
                    Ok(Request::PrintCamera(camera)) => {
                        print_camera(camera);
                        continue;
                    }
                    Err(_) => return,
                };
                let line = match ended && !snapshot.finished {
                    true => "the final files are already written".to_owned(),
                    false => save(&snapshot, view, ended),
                };
                // The window may have closed.
                let _ = reply.send(line);
            },
        }
    }
}

/// The common settings of the picture files of a render, and the channel for notes about write errors.
#[derive(Clone)]
pub(super) struct Pictures<'a> {
    pub(super) settings: &'a RenderSettings,
    pub(super) identity: &'a Identity,
    /// The names of entities and materials.
    pub(super) mattes: &'a Mattes,
    /// The worker that rendered each pixel.
    pub(super) owners: Arc<Vec<u32>>,
    pub(super) notes: Sender<String>,
}

impl Pictures<'_> {
    /// Writes pictures at barriers. One that cannot be written is retried with the next, and at the end with several
    /// attempts. Only if too many wait is one written elsewhere at once.
    pub(super) fn write_barriers(&self, barriers: &Receiver<Barrier>) -> Written {
        let mut unwritten: VecDeque<(PathBuf, Identity, Picture)> = VecDeque::new();
        let mut first_error = Ok(());
        let view = ViewTransform::of(&self.settings.job.scene.film);
        let say = |line| note(&self.notes, line);
        let mut insist = |retries: &mut RetryPolicy, (path, facts, picture): (PathBuf, Identity, Picture)| {
            let write = |path: &Path| self.write(path, &picture, &facts, &[], view);
            let written = retries.write(&path, &say, write);
            let before = std::mem::replace(&mut first_error, Ok(()));
            first_error = before.and(written);
        };
        for Barrier { end, picture } in barriers {
            unwritten.retain(|(path, facts, picture)| self.write(path, picture, facts, &[], view).is_err());
            let count = u64::from(end - self.settings.job.first);
            let facts = facts(self.identity, &self.settings.sample_ranges([count, count]));
            for path in &self.settings.outputs.pictures {
                let path = numbered_path(path, end - self.settings.job.first);
                if let Err(error) = self.write(&path, &picture, &facts, &[], view) {
                    say(format!("{error}; the render continues and will retry the picture"));
                    unwritten.push_back((path, facts.clone(), picture.clone()));
                }
            }
            // The render must not wait.
            while unwritten.len() > MOST_UNWRITTEN {
                unwritten.pop_front().into_iter().for_each(|it| insist(&mut RetryPolicy::none(), it));
            }
        }
        let mut retries = RetryPolicy::default();
        unwritten.into_iter().for_each(|it| insist(&mut retries, it));
        first_error
    }

    /// Writes the final files, with retries: the film first, then the pictures with the requested layers. Returns the
    /// first error, and the layers.
    pub(super) fn write_end(
        &self,
        sink: Option<&FilmSink>,
        outcome: &Outcome,
        picture: &Picture,
    ) -> (Written, Vec<Channel>) {
        let facts = facts(self.identity, &self.settings.sample_ranges(outcome.film.seen_range()));
        let (mut retries, say) = (RetryPolicy::default(), |line| note(&self.notes, line));
        let mut first_error = Ok(());
        if let Some(sink) = sink {
            let write = |path: &Path| sink.write(path, &outcome.film, outcome.milestone.as_ref());
            let written = retries.write(&sink.path, &say, write);
            first_error = first_error.and(written);
        }
        let layers = layers(self.settings, self.mattes, &outcome.film);
        let view = ViewTransform::of(&self.settings.job.scene.film);
        for path in &self.settings.outputs.pictures {
            let write = |path: &Path| self.write(path, picture, &facts, &layers, view);
            let written = retries.write(path, &say, write);
            first_error = first_error.and(written);
        }
        (first_error, layers)
    }

    /// Writes the outputs and reports the camera on request of the window, until it closes; see [`serve_saves`].
    pub(super) fn save_on_request(
        &self,
        requests: &Receiver<Request>,
        ending: &Receiver<Ended>,
        events: &Sender<Event>,
    ) {
        let say = |camera| send_event(events, Event::Viewpoint(camera));
        // A view does not show the samples of each pixel.
        let facts = self.identity.clone().with("samples", "unfinished");
        serve_saves(requests, ending, say, |snapshot, view, whole| {
            let mut saved = Ok(());
            for path in &self.settings.outputs.pictures {
                // The final files are complete, with layers; a save may only change the view.
                if whole && !matches!(Format::of(path), Ok(Format::Png)) {
                    continue;
                }
                saved = saved.and(self.write(path, &snapshot.picture, &facts, &[], view));
            }
            let names = self.settings.outputs.pictures.iter().map(|path| path.display().to_string());
            match saved {
                Ok(()) if names.len() == 0 => "nothing was saved: no picture file is named".to_owned(),
                Ok(()) => format!("saved {}", names.collect::<Vec<_>>().join(", ")),
                Err(error) => error.to_string(),
            }
        });
    }

    fn write(
        &self,
        path: &Path,
        picture: &Picture,
        facts: &Identity,
        channels: &[Channel],
        view: ViewTransform,
    ) -> Written {
        if self.settings.outputs.overlay {
            write_owner_overlay(path, &self.owners, picture.width, picture.height)
        } else {
            let mattes = mattes_of(&self.settings.outputs.layers, self.mattes);
            write_with_facts(path, picture, facts, (channels, &mattes), view)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Statistics;
    use crossbeam_channel::{TrySendError, bounded, unbounded};

    fn request(finished: bool, replies: &Sender<String>) -> Request {
        let snapshot = Snapshot {
            picture: Picture { width: 1, height: 1, rgb: vec![[0.0; 3]] },
            statistics: Arc::new(Statistics { counts: vec![1], variances: vec![0.0] }),
            owners: Arc::new(vec![0]),
            spp_done: 1.0,
            spp_before: 0.0,
            spp_target: None,
            noise: None,
            samples: 1,
            seconds: 1.0,
            finished,
        };
        Request::Save { snapshot: Arc::new(snapshot), view: ViewTransform::default(), reply: replies.clone() }
    }

    // The order in which threads reach the channels varies: a hundred rounds show many orders.
    #[test]
    fn saves_of_the_window_never_replace_the_final_files() {
        for _ in 0..100 {
            save_about_the_end();
        }
    }

    fn save_about_the_end() {
        // The channel has no buffer: a request waits until the saver is ready.
        let (requests_out, requests) = bounded(1);
        let (ending_out, ending) = bounded::<Ended>(0);
        let (replies_out, replies) = unbounded();
        // The sequence of operations on the files.
        let (log_out, log) = unbounded();
        let (go_out, go) = bounded(1);
        std::thread::scope(|scope| {
            let saves = log_out.clone();
            scope.spawn(move || {
                serve_saves(&requests, &ending, drop, |snapshot, _, whole| {
                    saves.send("save begins").unwrap();
                    go.recv().unwrap();
                    saves.send(if whole { "save of the end" } else { "save" }).unwrap();
                    format!("{}", snapshot.finished)
                });
            });
            requests_out.send(request(false, &replies_out)).unwrap();
            assert_eq!(log.recv().unwrap(), "save begins");
            // A save is in progress: the final write must wait for it.
            let (written_out, written) = bounded(0);
            let Err(TrySendError::Full(written)) = ending_out.try_send(written) else {
                panic!("the final write did not wait for a save");
            };
            go_out.send(()).unwrap();
            ending_out.send(written).unwrap();
            log_out.send("end").unwrap();
            // A request during the final write waits: no save begins before it is done.
            requests_out.send(request(true, &replies_out)).unwrap();
            log_out.send("end is written").unwrap();
            drop(written_out);
            requests_out.send(request(false, &replies_out)).unwrap();
            go_out.send(()).unwrap();
            drop(requests_out);
        });
        drop((log_out, replies_out));
        let log: Vec<_> = log.iter().collect();
        assert_eq!(log, ["save", "end", "end is written", "save begins", "save of the end"]);
        let replies: Vec<_> = replies.iter().collect();
        assert_eq!(replies, ["false", "true", "the final files are already written"]);
    }

    #[test]
    fn the_window_can_save_after_a_run_without_an_end_message() {
        let (requests_out, requests) = bounded(1);
        let (ending_out, ending) = bounded::<Ended>(0);
        let (replies_out, replies) = unbounded();
        drop(ending_out);
        std::thread::scope(|scope| {
            scope.spawn(move || serve_saves(&requests, &ending, drop, |_, _, whole| format!("{whole}")));
            requests_out.send(request(false, &replies_out)).unwrap();
            drop(requests_out);
        });
        assert_eq!(replies.recv().unwrap(), "false");
    }
}
