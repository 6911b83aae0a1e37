//! What a render leaves behind: pictures, and a film to go on with.

use super::{SessionError, Settings};
use crate::film::file::{Head, Piece};
use crate::film::{Film, Identity, Milestone, Picture};
use crate::output::window::Request;
use crate::output::{
    FilmSink, OutputError, Patience, PictureOptions, SampleDump, numbered_path, open_film,
    write_owner_overlay, write_picture,
};
use crate::render::Barrier;
use crate::render::accumulator::Outcome;
use crossbeam_channel::{Receiver, Sender};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

pub(super) type Written = Result<(), OutputError>;

/// Unwritten pictures that are kept until their place can be written again.
const MOST_UNWRITTEN: usize = 4;

/// What determines the bits of a render's samples, on a device.
fn identity(settings: &Settings, device: &str) -> Identity {
    let (scene, region) = (&settings.scene, settings.region);
    Identity::default()
        .with("program", concat!("stride ", env!("CARGO_PKG_VERSION")))
        .with("scene", settings.fingerprint.as_deref().unwrap_or("unknown"))
        .with("size", format_args!("{}x{}", scene.film.width, scene.film.height))
        .with("crop", format_args!("{},{},{},{}", region.x, region.y, region.width, region.height))
        .with("filter", scene.film.filter)
        .with("integrator", scene.render.integrator)
        .with("sampler", scene.render.sampler)
        .with("max depth", scene.render.max_depth)
        .with("seed", scene.render.seed)
        .with("device", device)
}

/// What a film file of this render says of itself.
pub(super) fn head(settings: &Settings, device: &str) -> Head {
    let range = settings.range();
    let notes = Identity::default()
        .with("exposure", settings.scene.film.exposure)
        .with("asked", format_args!("{}..{}", range.start, range.end));
    let (width, height) = (settings.region.width, settings.region.height);
    Head { width, height, identity: identity(settings, device), notes }
}

/// The film to begin with: an empty one, or that of the run that is gone on with and its last milestone.
pub(super) fn first_film(
    settings: &Settings,
    head: &Head,
) -> Result<(Film, Option<Milestone>), SessionError> {
    let Some(path) = &settings.resume else { return Ok((Film::new(head.width, head.height)?, None)) };
    let refuse = |reason: String| SessionError::Resume { path: path.clone(), reason };
    let file = open_film(path)?;
    if let Some(difference) = head.identity.difference(&file.head().identity) {
        let remedy = match difference.name.as_str() {
            "program" => "samples of different versions may differ: finish it with the one that began it",
            "scene" => "the scene file, or one that it names, is not what it was",
            _ => "give this render the settings of the film, or begin another film",
        };
        return Err(refuse(format!("{difference}; {remedy}")));
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
        let spp = settings.spp;
        return Err(refuse(format!("it has {most} samples a pixel already, and {spp} are asked for")));
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

/// Writes pictures at barriers. One that can't be written is tried again with the next, and in the end with
/// patience; only when too many wait for that is one put elsewhere at once.
pub(super) fn write_barriers(
    settings: &Settings,
    owners: &[u32],
    barriers: &Receiver<Barrier>,
    notes: &Sender<String>,
) -> Written {
    let mut unwritten: VecDeque<(PathBuf, Picture)> = VecDeque::new();
    let mut first_error = Ok(());
    let exposure = settings.scene.film.exposure;
    let say = |line| tell(notes, line);
    let mut insist = |(path, picture): (PathBuf, Picture)| {
        let write = |path: &Path| write_output(settings, path, &picture, owners, exposure);
        let written = Patience::default().write(&path, &say, write);
        let before = std::mem::replace(&mut first_error, Ok(()));
        first_error = before.and(written);
    };
    for Barrier { end, picture } in barriers {
        unwritten.retain(|(path, picture)| write_output(settings, path, picture, owners, exposure).is_err());
        for path in &settings.outputs {
            let path = numbered_path(path, end - settings.first);
            if let Err(error) = write_output(settings, &path, &picture, owners, exposure) {
                say(format!("{error}; the render goes on, and the picture is tried again"));
                unwritten.push_back((path, picture.clone()));
            }
        }
        while unwritten.len() > MOST_UNWRITTEN {
            unwritten.pop_front().into_iter().for_each(&mut insist);
        }
    }
    unwritten.into_iter().for_each(insist);
    first_error
}

/// Writes what there is at the end, with patience: film and pictures. Returns the first error.
pub(super) fn write_end(
    settings: &Settings,
    sink: Option<&FilmSink>,
    outcome: &Outcome,
    picture: &Picture,
    owners: &[u32],
    notes: &Sender<String>,
) -> Written {
    let (mut patience, say) = (Patience::default(), |line| tell(notes, line));
    let mut first_error = Ok(());
    if let Some(sink) = sink {
        let write = |path: &Path| sink.write(path, &outcome.film, outcome.milestone.as_ref());
        let written = patience.write(&sink.path, &say, write);
        first_error = first_error.and(written);
    }
    let exposure = settings.scene.film.exposure;
    for path in &settings.outputs {
        let write = |path: &Path| write_output(settings, path, picture, owners, exposure);
        let written = patience.write(path, &say, write);
        first_error = first_error.and(written);
    }
    first_error
}

fn write_output(
    settings: &Settings,
    path: &Path,
    picture: &Picture,
    owners: &[u32],
    exposure: f64,
) -> Written {
    if settings.overlay {
        write_owner_overlay(path, owners, picture.width, picture.height)
    } else {
        write_picture(path, picture, &PictureOptions { exposure })
    }
}

/// Writes the outputs whenever the window asks for it.
pub(super) fn save_on_request(settings: &Settings, owners: &[u32], requests: &Receiver<Request>) {
    for Request::Save { snapshot, exposure, reply } in requests {
        let mut saved = Ok(());
        for path in &settings.outputs {
            saved = saved.and(write_output(settings, path, &snapshot.picture, owners, exposure));
        }
        let names: Vec<String> = settings.outputs.iter().map(|path| path.display().to_string()).collect();
        let line = match saved {
            Ok(()) => format!("saved {}", names.join(", ")),
            Err(error) => error.to_string(),
        };
        // The window may have closed meanwhile.
        let _ = reply.send(line);
    }
}
