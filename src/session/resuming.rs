//! The film that a render begins with.

use super::error::SessionError;
use super::settings::Settings;
use crate::film::file::FilmFileError;
use crate::film::head::{Head, LAYERS};
use crate::film::{Film, Milestone};
use crate::output::{FilmError, open_film};

/// The film to begin with: an empty one, or that of the run that is gone on with and its last milestone.
pub(super) fn first_film(
    settings: &Settings,
    head: &Head,
) -> Result<(Film, Option<Milestone>), SessionError> {
    let Some(path) = &settings.outputs.resume else { return Ok((Film::with_layout(head.layout)?, None)) };
    let refuse = |reason: String| SessionError::Resume { path: path.clone(), reason };
    let file = open_film(path)?;
    if let Some(difference) = head.difference(file.head()) {
        let lacks = head.layout.layers.without(file.head().layout.layers);
        let remedy = match difference.name.as_str() {
            "program" => "samples of different versions may differ: finish it with the one that began it",
            "scene" => {
                "the scene file, or one that it names, is not what it was: undo that, or begin another film"
            }
            LAYERS => {
                return Err(refuse(format!(
                    "{difference}: the film was begun without `layers` {lacks}; leave these out, or begin another film with them"
                )));
            }
            _ => "give this render the settings of the film, or begin another film",
        };
        return Err(refuse(format!("{difference}; {remedy}")));
    }
    if head.layout.spreads && !file.head().layout.spreads {
        return Err(refuse(
            "it was begun without `layers` variance, and has not the sums that this takes; leave the layer out, or begin another film".to_owned(),
        ));
    }
    if file.head().layout != head.layout {
        let [theirs, ours] = [file.head().layout, head.layout].map(|layout| {
            let words = if layout.weighted { "weighted" } else { "plain" };
            let spreads = if layout.spreads { " with sums for a variance" } else { "" };
            let light = if layout.light.is_some() { " and a light image" } else { "" };
            format!("{}×{} {words} pixels{spreads}{light}", layout.width, layout.height)
        });
        return Err(refuse(format!(
            "it has {theirs}, and its facts say {ours}: the program that wrote it made a mistake; begin another film"
        )));
    }
    let holding = file.holding().clone();
    let nothing = holding.least() == 0 && holding.open().is_none();
    if !nothing && holding.start() != Some(settings.job.first) {
        let from = settings.job.first;
        return Err(refuse(format!(
            "it holds the samples {holding}, and a render goes on without a gap from sample {from}; render what is missing with `range`, and merge"
        )));
    }
    let milestone = file.milestone().cloned();
    let film = file.read().map_err(|reason| FilmError { path: path.clone(), reason })?;
    let most = film.seen_range()[1];
    if most > u64::from(settings.stopping.spp) {
        let (asked, end) = (settings.range(), u64::from(settings.job.first) + most);
        return Err(refuse(format!(
            "it has the samples up to {end} already, and {} to {} are asked for; ask for more (`samples`), or begin another film",
            asked.start, asked.end
        )));
    }
    if let Some(Milestone { samples, plan: Some(plan), .. }) = &milestone
        && (plan.ends().len() as u64 != head.layout.len() || !plan.allows(*samples, |place| film.seen(place)))
    {
        let reason = FilmFileError::Contradiction("its pixels have other samples than it planned");
        return Err(FilmError { path: path.clone(), reason }.into());
    }
    if let Some(early) = settings.outputs.dump_at.iter().find(|&&at| u64::from(at) <= most) {
        return Err(refuse(format!(
            "it has {most} samples a pixel already: there is no picture of {early} to be had any more (`dump_at`)"
        )));
    }
    Ok((film, milestone))
}
