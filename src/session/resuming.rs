//! The film at the start of a render.

use super::error::SessionError;
use super::settings::RenderSettings;
use crate::film::file::FilmFileError;
use crate::film::head::{Head, LAYERS};
use crate::film::{Film, Milestone};
use crate::output::{FilmError, open_film};

/// The film to start with: an empty one, or that of the resumed run with its last milestone.
pub(super) fn first_film(
    settings: &RenderSettings,
    head: &Head,
) -> Result<(Film, Option<Milestone>), SessionError> {
    let Some(path) = &settings.outputs.resume else { return Ok((Film::with_layout(head.layout)?, None)) };
    let refuse = |reason: String| SessionError::Resume { path: path.clone(), reason };
    let file = open_film(path)?;
    if let Some(difference) = head.difference(file.head()) {
        let lacks = head.layout.layers.without(file.head().layout.layers);
        let remedy = match difference.name.as_str() {
            "program" => "samples of different versions may differ: finish it with the version that began it",
            "scene" => {
                "the scene file, or a file that it names, has changed: undo the change, or begin another film"
            }
            LAYERS => {
                return Err(refuse(format!(
                    "{difference}: the film was begun without `layers` {lacks}; omit these, or begin another film with them"
                )));
            }
            _ => "use the settings of the film, or begin another film",
        };
        return Err(refuse(format!("{difference}; {remedy}")));
    }
    if head.layout.spreads && !file.head().layout.spreads {
        return Err(refuse(
            "it was begun without `layers` variance, and lacks the sums for it; omit the layer, or begin another film".to_owned(),
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
            "it has {theirs}, but its facts say {ours}: this is a bug in the program that wrote it; begin another film"
        )));
    }
    let sample_ranges = file.sample_ranges().clone();
    let nothing = sample_ranges.least() == 0 && sample_ranges.open().is_none();
    if !nothing && sample_ranges.start() != Some(settings.job.first) {
        let from = settings.job.first;
        return Err(refuse(format!(
            "it has the samples {sample_ranges}, but a render must continue without a gap from sample {from}; render the missing samples with `range`, and merge"
        )));
    }
    let milestone = file.milestone().cloned();
    let film = file.read().map_err(|reason| FilmError { path: path.clone(), reason })?;
    let most = film.seen_range()[1];
    if most > u64::from(settings.stopping.spp) {
        let (asked, end) = (settings.range(), u64::from(settings.job.first) + most);
        return Err(refuse(format!(
            "it already has the samples up to {end}, and {} to {} are requested; request more (`samples`), or begin another film",
            asked.start, asked.end
        )));
    }
    if let Some(Milestone { samples, plan: Some(plan), .. }) = &milestone
        && (plan.ends().len() as u64 != head.layout.len() || !plan.allows(*samples, |place| film.seen(place)))
    {
        let reason = FilmFileError::Contradiction("the sample counts of its pixels do not match its plan");
        return Err(FilmError { path: path.clone(), reason }.into());
    }
    if let Some(early) = settings.outputs.dump_at.iter().find(|&&at| u64::from(at) <= most) {
        return Err(refuse(format!(
            "it already has {most} samples per pixel: a picture of {early} cannot be made any more (`dump_at`)"
        )));
    }
    Ok((film, milestone))
}
