//! What a render leaves behind: pictures, and a film to go on with.

use super::error::SessionError;
use super::settings::Settings;
use crate::film::cryptomatte::{Mattes, Names};
use crate::film::file::{FilmFileError, Head, Piece};
use crate::film::{Channel, Film, Holding, Identity, Layer, Milestone, Picture, Snapshot, ViewTransform};
use crate::output::window::Request;
use crate::output::{
    Crop, FilmSink, Format, OutputError, Patience, PictureOptions, SampleDump, numbered_path, open_film,
    suffixed_path, write_owner_overlay, write_picture,
};
use crate::render::accumulator::Outcome;
use crate::render::{Barrier, Region};
use crate::scene::{self, Fingerprint, Scene, UNLIMITED};
use crossbeam_channel::{Receiver, Sender, never, select};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(super) type Written = Result<(), OutputError>;

/// Unwritten pictures that are kept until their place can be written again.
const MOST_UNWRITTEN: usize = 4;

/// What determines the bits of a render's samples, on a device.
fn identity(settings: &Settings, device: &str) -> Identity {
    let (scene, region) = (&settings.scene, settings.picture_region());
    let max_depth = match scene.render.max_depth {
        UNLIMITED => "unlimited".to_owned(),
        bounces => bounces.to_string(),
    };
    let identity = Identity::default()
        .with("program", concat!("stride ", env!("CARGO_PKG_VERSION")))
        .with("scene", settings.fingerprint.as_ref().map_or("unknown".to_owned(), Fingerprint::digits))
        .with("size", format_args!("{}x{}", scene.film.width, scene.film.height))
        .with("crop", format_args!("{},{},{},{}", region.x, region.y, region.width, region.height))
        .with("filter", scene.film.filter)
        .with("mode", scene.film.mode())
        .with("integrator", scene.render.integrator)
        .with("sampler", scene.render.sampler)
        .with("max depth", max_depth)
        .with("seed", scene.render.seed)
        .with("device", device);
    // Where samples go depends on where the render is to end.
    let identity = match settings.goal().filter(|_| settings.adaptive) {
        None => identity,
        Some(noise) if settings.spp == u32::MAX => identity.with("adaptive", format_args!("noise {noise}")),
        Some(noise) => {
            identity.with("adaptive", format_args!("noise {noise}, at most {} samples", settings.spp))
        }
    };
    match &settings.moved {
        Some(camera) => identity.with("camera", one_line(camera)),
        None => identity,
    }
}

/// A camera's text, in a line.
fn one_line(camera: &str) -> String {
    camera.lines().skip(1).collect::<Vec<_>>().join("; ")
}

/// The settings for a camera that was moved in the window: pictures go to names that nothing has yet, and nothing
/// else is written.
pub(super) fn moved(settings: &Settings, camera: String) -> Result<Settings, SessionError> {
    let parsed = scene::parse(&camera, Path::new("the moved camera"));
    let parsed = parsed.map_err(|_| SessionError::Process("moved camera"))?;
    let scene = Scene { camera: parsed.scene.camera, ..(*settings.scene).clone() };
    let names = |view: u32| {
        let name = |path: &PathBuf| suffixed_path(path, &format!("view-{view}"));
        settings.outputs.iter().map(name).collect::<Vec<_>>()
    };
    let free = (1..).map(names).find(|names| !names.iter().any(|path| path.exists()));
    Ok(Settings {
        scene: Arc::new(scene),
        moved: Some(camera),
        outputs: free.unwrap_or_default(),
        film: None,
        resume: None,
        ..settings.clone()
    })
}

/// What a film file of this render says of itself.
pub(super) fn head(settings: &Settings, device: &str) -> Head {
    let range = settings.range();
    let mut notes = Identity::default()
        .with("exposure", settings.scene.film.exposure)
        .with("tone", settings.scene.film.tone.name())
        .with("asked", format_args!("{}..{}", range.start, range.end));
    if !settings.layers.is_empty() {
        let names: Vec<&str> = settings.layers.iter().map(|layer| layer.name()).collect();
        notes = notes.with("layers", names.join(","));
    }
    if let Some(outline) = settings.fingerprint.as_ref().and_then(Fingerprint::outline) {
        notes = notes.with("parts", outline);
    }
    Head { layout: settings.layout(), identity: identity(settings, device), notes }
}

/// What a dump says beside the facts of its samples: notes that don't determine their bits.
pub(crate) const NOTES: [&str; 6] = ["exposure", "tone", "asked", "layers", "parts", "rendered"];

/// What a dump of this render's samples says of itself: facts and notes of a film, and where there are samples.
/// A header has no room for the scene's parts, which only tell people what differs.
pub(super) fn dumped(settings: &Settings, head: &Head) -> Identity {
    let Region { x, y, width, height, .. } = settings.region;
    let all = head.identity.facts().chain(head.notes.facts()).filter(|&(name, _)| name != "parts");
    all.fold(Identity::default(), |all, (name, value)| all.with(name, value))
        .with("rendered", format_args!("{x},{y},{width},{height}"))
}

/// Finds out, before hours of rendering, whether the film file that is asked for can say what it is of.
pub(super) fn check_film(settings: &Settings, head: &Head) -> Written {
    let Some(path) = &settings.film else { return Ok(()) };
    head.check().map_err(|error| OutputError::from_io(path, error))
}

/// What writes the film file, if there is to be one.
pub(super) fn film_sink(settings: &Settings, head: &Head) -> Option<FilmSink> {
    settings.film.clone().map(|path| FilmSink { path, head: head.clone(), range: settings.range() })
}

/// What an EXR says of itself: what determines its bits.
pub(crate) fn facts(identity: &Identity, holding: &Holding) -> Identity {
    identity.clone().with("samples", holding)
}

/// The film to begin with: an empty one, or that of the run that is gone on with and its last milestone.
pub(super) fn first_film(
    settings: &Settings,
    head: &Head,
) -> Result<(Film, Option<Milestone>), SessionError> {
    let Some(path) = &settings.resume else { return Ok((Film::with_layout(head.layout)?, None)) };
    let refuse = |reason: String| SessionError::Resume { path: path.clone(), reason };
    let file = open_film(path)?;
    if let Some(difference) = head.difference(file.head()) {
        let remedy = match difference.name.as_str() {
            "program" => "samples of different versions may differ: finish it with the one that began it",
            "scene" => {
                "the scene file, or one that it names, is not what it was: undo that, or begin another film"
            }
            _ => "give this render the settings of the film, or begin another film",
        };
        return Err(refuse(format!("{difference}; {remedy}")));
    }
    if head.layout.spreads && !file.head().layout.spreads {
        return Err(refuse(
            "it was begun without --layers variance, and has not the sums that this takes; leave the layer out, or begin another film".to_owned(),
        ));
    }
    if file.head().layout != head.layout {
        let [theirs, ours] = [file.head().layout, head.layout].map(|layout| {
            let words = if layout.weighted { "weighted" } else { "plain" };
            format!("{}×{} {words} pixels", layout.width, layout.height)
        });
        return Err(refuse(format!(
            "it lies otherwise than its facts say, in {theirs}, not {ours}: whatever wrote it made a mistake"
        )));
    }
    let holding = file.holding().clone();
    let nothing = holding.least() == 0 && holding.open().is_none();
    if !nothing && holding.start() != Some(settings.first) {
        let from = settings.first;
        return Err(refuse(format!(
            "it holds the samples {holding}, and a render goes on without a gap from sample {from}; render what is missing with --range, and merge"
        )));
    }
    let milestone = file.milestone().cloned();
    let film = file.read().map_err(|reason| crate::output::FilmError { path: path.clone(), reason })?;
    let most = film.seen_range()[1];
    if most > u64::from(settings.spp) {
        let (asked, end) = (settings.range(), u64::from(settings.first) + most);
        return Err(refuse(format!(
            "it has the samples up to {end} already, and {} to {} are asked for; ask for more (--spp), or begin another film",
            asked.start, asked.end
        )));
    }
    if let Some(Milestone { samples, plan: Some(plan), .. }) = &milestone
        && (plan.ends().len() as u64 != head.layout.len() || !plan.allows(*samples, |place| film.seen(place)))
    {
        let reason = FilmFileError::Contradiction("its pixels have other samples than it planned");
        return Err(crate::output::FilmError { path: path.clone(), reason }.into());
    }
    if let Some(early) = settings.dump_at.iter().find(|&&at| u64::from(at) <= most) {
        return Err(refuse(format!(
            "it has {most} samples a pixel already: there is no picture of {early} to be had any more (--dump-at)"
        )));
    }
    Ok((film, milestone))
}

/// The process that writes the film while the render runs.
pub(super) fn keep_film(sink: &FilmSink, pieces: &Receiver<Piece>, notes: &Sender<String>) {
    sink.keep(pieces, |line| tell(notes, line));
}

/// Tells the user, as long as anybody listens.
pub(super) fn tell(notes: &Sender<String>, line: String) {
    let _ = notes.send(line);
}

pub(super) fn keep_samples(
    mut dump: SampleDump,
    samples: &Receiver<Vec<crate::integrator::Sample>>,
) -> Written {
    for samples in samples {
        dump.write(&samples)?;
    }
    dump.finish().map(drop)
}

/// Closes when everything that is written at the end has been written.
pub(super) type Ended = Receiver<Infallible>;

/// Serves a window's requests by `save`, which gets what to save, how to show it, and whether the end is written
/// already, and says what came of it. Whoever writes the end sends over `ending` first: once that is received no save
/// is under way, and none is begun before the end is written. From then on nothing unfinished is saved.
fn serve_saves(
    requests: &Receiver<Request>,
    ending: &Receiver<Ended>,
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
                let Ok(Request::Save { snapshot, view, reply }) = request else { return };
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
        let view = ViewTransform::of(&self.settings.scene.film);
        let say = |line| tell(&self.notes, line);
        let mut insist = |patience: &mut Patience, (path, facts, picture): (PathBuf, Identity, Picture)| {
            let write = |path: &Path| self.write(path, &picture, &facts, &[], view);
            let written = patience.write(&path, &say, write);
            let before = std::mem::replace(&mut first_error, Ok(()));
            first_error = before.and(written);
        };
        for Barrier { end, picture } in barriers {
            unwritten.retain(|(path, facts, picture)| self.write(path, picture, facts, &[], view).is_err());
            let held = u64::from(end - self.settings.first);
            let facts = facts(self.identity, &Holding::prefix(self.settings.range(), held, held));
            for path in &self.settings.outputs {
                let path = numbered_path(path, end - self.settings.first);
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

    /// Writes what there is at the end, with patience: the film first, then the pictures with the layers that
    /// `layers` makes. Returns the first error.
    pub(super) fn write_end(
        &self,
        sink: Option<&FilmSink>,
        outcome: &Outcome,
        picture: &Picture,
        layers: impl FnOnce() -> Vec<Channel>,
    ) -> Written {
        let [least, most] = outcome.film.seen_range();
        let facts = facts(self.identity, &Holding::prefix(self.settings.range(), least, most));
        let (mut patience, say) = (Patience::default(), |line| tell(&self.notes, line));
        let mut first_error = Ok(());
        if let Some(sink) = sink {
            let write = |path: &Path| sink.write(path, &outcome.film, outcome.milestone.as_ref());
            let written = patience.write(&sink.path, &say, write);
            first_error = first_error.and(written);
        }
        let (layers, view) = (layers(), ViewTransform::of(&self.settings.scene.film));
        for path in &self.settings.outputs {
            let write = |path: &Path| self.write(path, picture, &facts, &layers, view);
            let written = patience.write(path, &say, write);
            first_error = first_error.and(written);
        }
        first_error
    }

    /// Writes the outputs whenever the window asks for it, until it closes; see [`serve_saves`].
    pub(super) fn save_on_request(&self, requests: &Receiver<Request>, ending: &Receiver<Ended>) {
        // How far each pixel is a view does not tell.
        let facts = self.identity.clone().with("samples", "unfinished");
        serve_saves(requests, ending, |snapshot, view, whole| {
            let mut saved = Ok(());
            for path in &self.settings.outputs {
                // In the end all files are there, with layers and all; only what people see may look different.
                if whole && !matches!(Format::of(path), Ok(Format::Png)) {
                    continue;
                }
                saved = saved.and(self.write(path, &snapshot.picture, &facts, &[], view));
            }
            let names = self.settings.outputs.iter().map(|path| path.display().to_string());
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
        if self.settings.overlay {
            write_owner_overlay(path, &self.owners, picture.width, picture.height)
        } else {
            let crop = Crop::of(facts);
            let of_layer = |layer: &Layer| layer.names(self.mattes).filter(|_| !channels.is_empty());
            let mattes: Vec<&Names> = self.settings.layers.iter().filter_map(of_layer).collect();
            let options = PictureOptions { view, facts: Some(facts), channels, mattes: &mattes, crop };
            write_picture(path, picture, &options)
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
                serve_saves(&requests, &ending, |snapshot, _, whole| {
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
            scope.spawn(move || serve_saves(&requests, &ending, |_, _, whole| format!("{whole}")));
            requests_out.send(request(false, &replies_out)).unwrap();
            drop(requests_out);
        });
        assert_eq!(replies.recv().unwrap(), "false");
    }
}
