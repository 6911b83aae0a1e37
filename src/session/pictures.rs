//! The picture files of a render: at barriers, whenever the window asks for them, and at the end.

use super::error::Written;
use super::event::{Event, tell};
use super::identity::{facts, mattes_of, write_saying};
use super::layers::layers;
use super::settings::Settings;
use crate::film::cryptomatte::Mattes;
use crate::film::{Channel, Identity, Picture, Snapshot, ViewTransform};
use crate::output::window::Request;
use crate::output::{FilmSink, Format, Patience, numbered_path, write_owner_overlay};
use crate::render::Barrier;
use crate::render::accumulator::Outcome;
use crate::scene::Viewpoint;
use crossbeam_channel::{Receiver, Sender, never, select};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Unwritten pictures that are kept until their place can be written again.
const MOST_UNWRITTEN: usize = 4;

/// Says that something is in the way, as long as it can be heard.
pub(super) fn note(notes: &Sender<String>, line: String) {
    let _ = notes.send(line);
}

/// Closes when everything that is written at the end has been written.
pub(super) type Ended = Receiver<Infallible>;

/// Serves a window's requests: cameras by `tell`, and pictures by `save`, which gets what to save, how to show it, and
/// whether the end is written already, and says what came of it. The finisher sends over `ending` first: once
/// that is received no save is under way, and none is begun before the end is written. From then on nothing unfinished
/// is saved.
fn serve_saves(
    requests: &Receiver<Request>,
    ending: &Receiver<Ended>,
    tell: impl Fn(Viewpoint),
    save: impl Fn(&Snapshot, ViewTransform, bool) -> String,
) {
    let (mut ending, mut ended) = (ending.clone(), false);
    loop {
        select! {
            recv(ending) -> end => {
                if let Ok(end) = end {
                    ended = true;
                    // Nothing is ever sent over it: it closes.
                    let _ = end.recv();
                }
                ending = never();
            },
            recv(requests) -> request => {
                let (snapshot, view, reply) = match request {
                    Ok(Request::Save { snapshot, view, reply }) => (snapshot, view, reply),
                    Ok(Request::Tell(camera)) => {
                        tell(camera);
                        continue;
                    }
                    Err(_) => return,
                };
                let line = match ended && !snapshot.finished {
                    true => "the end is written already".to_owned(),
                    false => save(&snapshot, view, ended),
                };
                // The window may have closed meanwhile.
                let _ = reply.send(line);
            },
        }
    }
}

/// What the picture files of a render have in common, and who is told of those that can't be written.
#[derive(Clone)]
pub(super) struct Pictures<'a> {
    pub(super) settings: &'a Settings,
    pub(super) identity: &'a Identity,
    /// What the scene's things are called.
    pub(super) mattes: &'a Mattes,
    /// Who made each pixel.
    pub(super) owners: Arc<Vec<u32>>,
    pub(super) notes: Sender<String>,
}

impl Pictures<'_> {
    /// Writes pictures at barriers. One that can't be written is tried again with the next, and in the end with
    /// patience; only when too many wait for that is one put elsewhere at once.
    pub(super) fn write_barriers(&self, barriers: &Receiver<Barrier>) -> Written {
        let mut unwritten: VecDeque<(PathBuf, Identity, Picture)> = VecDeque::new();
        let mut first_error = Ok(());
        let view = ViewTransform::of(&self.settings.job.scene.film);
        let say = |line| note(&self.notes, line);
        let mut insist = |patience: &mut Patience, (path, facts, picture): (PathBuf, Identity, Picture)| {
            let write = |path: &Path| self.write(path, &picture, &facts, &[], view);
            let written = patience.write(&path, &say, write);
            let before = std::mem::replace(&mut first_error, Ok(()));
            first_error = before.and(written);
        };
        for Barrier { end, picture } in barriers {
            unwritten.retain(|(path, facts, picture)| self.write(path, picture, facts, &[], view).is_err());
            let held = u64::from(end - self.settings.job.first);
            let facts = facts(self.identity, &self.settings.holding([held, held]));
            for path in &self.settings.outputs.pictures {
                let path = numbered_path(path, end - self.settings.job.first);
                if let Err(error) = self.write(&path, &picture, &facts, &[], view) {
                    say(format!("{error}; the render goes on, and the picture is tried again"));
                    unwritten.push_back((path, facts.clone(), picture.clone()));
                }
            }
            // The render must not wait.
            while unwritten.len() > MOST_UNWRITTEN {
                unwritten.pop_front().into_iter().for_each(|it| insist(&mut Patience::none(), it));
            }
        }
        let mut patience = Patience::default();
        unwritten.into_iter().for_each(|it| insist(&mut patience, it));
        first_error
    }

    /// Writes what there is at the end, with patience: the film first, then the pictures with the layers that are wanted.
    /// Returns the first error, and the layers.
    pub(super) fn write_end(
        &self,
        sink: Option<&FilmSink>,
        outcome: &Outcome,
        picture: &Picture,
    ) -> (Written, Vec<Channel>) {
        let facts = facts(self.identity, &self.settings.holding(outcome.film.seen_range()));
        let (mut patience, say) = (Patience::default(), |line| note(&self.notes, line));
        let mut first_error = Ok(());
        if let Some(sink) = sink {
            let write = |path: &Path| sink.write(path, &outcome.film, outcome.milestone.as_ref());
            let written = patience.write(&sink.path, &say, write);
            first_error = first_error.and(written);
        }
        let layers = layers(self.settings, self.mattes, &outcome.film);
        let view = ViewTransform::of(&self.settings.job.scene.film);
        for path in &self.settings.outputs.pictures {
            let write = |path: &Path| self.write(path, picture, &facts, &layers, view);
            let written = patience.write(path, &say, write);
            first_error = first_error.and(written);
        }
        (first_error, layers)
    }

    /// Writes the outputs and tells the camera whenever the window asks for it, until it closes; see [`serve_saves`].
    pub(super) fn save_on_request(
        &self,
        requests: &Receiver<Request>,
        ending: &Receiver<Ended>,
        events: &Sender<Event>,
    ) {
        let say = |camera| tell(events, Event::Viewpoint(camera));
        // How far each pixel is a view does not tell.
        let facts = self.identity.clone().with("samples", "unfinished");
        serve_saves(requests, ending, say, |snapshot, view, whole| {
            let mut saved = Ok(());
            for path in &self.settings.outputs.pictures {
                // In the end all files are there, with layers and all; only what people see may look different.
                if whole && !matches!(Format::of(path), Ok(Format::Png)) {
                    continue;
                }
                saved = saved.and(self.write(path, &snapshot.picture, &facts, &[], view));
            }
            let names = self.settings.outputs.pictures.iter().map(|path| path.display().to_string());
            match saved {
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
            write_saying(path, picture, facts, (channels, &mattes), view)
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

    // In which order threads come to the channels is theirs to choose: a hundred rounds show many orders.
    #[test]
    fn what_a_window_saves_never_replaces_the_end() {
        for _ in 0..100 {
            save_about_the_end();
        }
    }

    fn save_about_the_end() {
        // Nothing is taken from it that is not asked for: a request lies in it until the saver is free.
        let (requests_out, requests) = bounded(1);
        let (ending_out, ending) = bounded::<Ended>(0);
        let (replies_out, replies) = unbounded();
        // What happens to the files, in order.
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
            // A save is under way: whoever writes the end is not let past it.
            let (written_out, written) = bounded(0);
            let Err(TrySendError::Full(written)) = ending_out.try_send(written) else {
                panic!("the end is let past a save that is under way");
            };
            go_out.send(()).unwrap();
            ending_out.send(written).unwrap();
            log_out.send("end").unwrap();
            // A request that comes while it is written waits: no save begins before it is written.
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
        assert_eq!(replies, ["false", "true", "the end is written already"]);
    }

    #[test]
    fn a_run_that_ends_without_a_word_leaves_the_window_its_saves() {
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
