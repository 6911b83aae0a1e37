//! What a render says on standard error: progress, notes, warnings, and at the end what came of it.

use super::report::Noise;
use super::settings::{Settings, View};
use crate::output::{Progress, Reporter};
use crate::render::accumulator::{Outcome, Totals};
use crossbeam_channel::{Receiver, select};
use std::io::Write;

/// Warns of radiance that a film cannot keep, even where quiet is wanted: the picture is not that of the scene. Of
/// radiance that is too small the render may have warned already.
pub(super) fn warn_of_radiance(settings: &Settings, outcome: &Outcome) {
    let too_bright = outcome.reject_counts.too_bright;
    if too_bright > 0 {
        let _ = writeln!(
            std::io::stderr(),
            "warning: {too_bright} samples are infinite or brighter than 2³⁰, the most that a film keeps, and are left out: divide every emission, intensity and radiance of the scene by one number and raise its exposure, or, where point lights light it, measure lengths in a smaller unit"
        );
    }
    if !outcome.has_warned_of_faint
        && outcome.totals.samples > 0
        && let Some(warning) = outcome.faint.warning(&outcome.film, settings.scene.has_light())
    {
        let _ = writeln!(std::io::stderr(), "warning: {warning}");
    }
}

/// What came of the goal of an error, if one was asked for. Those who want quiet are warned, too, where it was missed:
/// the picture is not what was asked for.
pub(super) fn warn_of_noise(settings: &Settings, outcome: &Outcome) -> Option<Noise> {
    let noise = settings.noise.map(|asked| Noise::of(asked, outcome))?;
    if !noise.reached() && outcome.totals.samples > 0 {
        let _ = writeln!(std::io::stderr(), "warning: {noise}");
    }
    Some(noise)
}

/// Says where the pictures are, if they were written, and all that a user would not expect: samples that were left out
/// and how to look at one of them, pictures that were not reached, nothing at all.
pub(super) fn tell(
    settings: &Settings,
    outcome: &Outcome,
    is_written: bool,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let files = settings.outputs.iter().chain(&settings.film).chain(&settings.samples);
    let names: Vec<String> = files.map(|path| path.display().to_string()).collect();
    if outcome.totals.samples > 0 && is_written && !names.is_empty() {
        let spp = outcome.totals.spp;
        let is_early = settings.time.is_none() && settings.goal().is_none() && spp < settings.spp;
        let mut notes = Vec::new();
        if is_early {
            notes.push(format!("stopped early, before {} spp", settings.spp));
        }
        if outcome.overtime {
            notes.push("the time was up long before the next sample of every pixel was done".to_owned());
        }
        // With adaptive sampling it is said below, and on purpose.
        if !outcome.whole && !settings.adaptive {
            notes.push(sample_counts(outcome));
        }
        let note = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
        writeln!(out, "wrote {}{note}", names.join(", "))?;
    }
    if let Some(camera) = settings.moved.as_ref().filter(|_| outcome.totals.samples > 0) {
        writeln!(out, "seen from\n{}", camera.trim_end())?;
    }
    if let Some(lost) = &outcome.lost {
        let note = if outcome.whole { ", and nothing is missing" } else { "" };
        writeln!(out, "warning: {lost}; the CPU went on{note}")?;
    }
    if let Some(noise) = settings.goal().map(|asked| Noise::of(asked, outcome))
        && (noise.reached() || settings.noise.is_none())
    {
        writeln!(out, "{noise}")?;
    }
    if settings.adaptive && outcome.totals.samples > 0 {
        let ([least, most], len) = (outcome.film.seen_range(), f64::from(settings.region.len()));
        let mean = outcome.totals.samples as f64 / len;
        writeln!(out, "pixels have {least} to {most} samples, {mean:.1} on average")?;
    }
    let rejected = outcome.totals.rejected;
    if rejected > 0 {
        writeln!(out, "{rejected} {} left out:", if rejected == 1 { "sample was" } else { "samples were" })?;
    }
    for (traced, reject) in &outcome.rejects {
        writeln!(out, "  pixel {} sample {}: {reject}", traced.pixel, traced.sample)?;
    }
    if let Some((traced, _)) = outcome.rejects.first() {
        let (x, y) = (traced.pixel % settings.region.film_width, traced.pixel / settings.region.film_width);
        writeln!(out, "  look at one: stride trace SCENE --pixel {x},{y} --sample {}", traced.sample)?;
    }
    for &spp in &outcome.unreached {
        let spp = spp - settings.first;
        writeln!(out, "the render ended before {spp} samples a pixel: there is no picture of them")?;
    }
    if outcome.totals.samples == 0 {
        writeln!(out, "nothing was rendered yet: no picture is written")?;
    }
    Ok(())
}

/// Says which samples pixels have. Each has its first ones.
pub(super) fn sample_counts(outcome: &Outcome) -> String {
    match outcome.film.seen_range() {
        [least, most] if least == most => format!("every pixel has its first {least} samples"),
        [0, most] => format!("pixels have between no sample and their first {most}"),
        [least, most] => format!("every pixel has its first {least} samples, and some have up to {most}"),
    }
}

pub(super) fn show_progress(settings: &Settings, totals: &Receiver<Totals>, notes: &Receiver<String>) {
    let mut reporter = Reporter::stderr(settings.view == View::Quiet);
    let mut last = Totals::default();
    loop {
        select! {
            recv(totals) -> totals => match totals {
                Ok(totals) => {
                    reporter.update(&progress(settings, &totals));
                    last = totals;
                }
                Err(_) => break,
            },
            recv(notes) -> note => match note {
                // Also for those who want quiet: a note is of what went wrong.
                Ok(note) if settings.view == View::Quiet => show_note(&note),
                Ok(note) => reporter.note(&note),
                Err(_) => break,
            },
        }
    }
    reporter.finish(&progress(settings, &last));
    show_notes(notes);
}

pub(super) fn show_notes(notes: &Receiver<String>) {
    notes.iter().for_each(|note| show_note(&note));
}

fn show_note(note: &str) {
    let _ = writeln!(std::io::stderr(), "{note}");
}

fn progress(settings: &Settings, totals: &Totals) -> Progress {
    let len = f64::from(settings.region.len());
    Progress {
        spp_done: totals.samples as f64 / len,
        spp_before: totals.before as f64 / len,
        spp_target: (settings.spp < u32::MAX).then_some(settings.spp),
        seconds: totals.elapsed.as_secs_f64(),
        samples: totals.made(),
        time_limit: settings.time.map(|time| time.as_secs_f64()),
        noise: totals.noise,
    }
}
