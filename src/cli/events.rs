//! Prints what a render tells, on standard error: progress, difficulties, and at the end what came of it; a camera that
//! is asked for goes to standard output.
//!
//! Either may be closed: all of it is a courtesy.

use super::failure::with_options;
use super::reporter::Reporter;
use crate::session::{Conclusion, Event, sample_counts};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::io::{StderrLock, Write};

/// Runs something that tells events, and prints them meanwhile. If `quiet`, only what makes the files other than those
/// that were asked for.
pub(super) fn print_events<T>(quiet: bool, run: impl FnOnce(Sender<Event>) -> T) -> T {
    let (events_out, events) = bounded(16);
    std::thread::scope(|scope| {
        scope.spawn(move || print(quiet, &events));
        run(events_out)
    })
}

fn print(quiet: bool, events: &Receiver<Event>) {
    let mut reporter = None;
    for event in events {
        match event {
            Event::Progress(_) | Event::Ended(_) | Event::CpuAlone(_) if quiet => {}
            Event::Progress(progress) => {
                reporter.get_or_insert_with(Reporter::stderr).update(&progress);
            }
            Event::Ended(progress) => {
                reporter.take().unwrap_or_else(Reporter::stderr).finish(&progress);
            }
            Event::Note(note) => match &mut reporter {
                Some(reporter) => reporter.note(&note),
                None => say(&note),
            },
            Event::CpuAlone(reason) => {
                say(&format!("warning: {}; the CPU renders alone", with_options(&reason)));
            }
            Event::Viewpoint(camera) => {
                let mut out = std::io::stdout().lock();
                let _ = write!(out, "{camera}").and_then(|()| out.flush());
            }
            Event::Concluded(conclusion) => {
                let mut out = std::io::stderr().lock();
                let _ = warn(&conclusion, &mut out);
                if !quiet {
                    let _ = conclude(&conclusion, &mut out);
                }
            }
        }
    }
}

fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Warns where the picture is not that of the scene, or not what was asked for.
fn warn(conclusion: &Conclusion, out: &mut StderrLock<'_>) -> std::io::Result<()> {
    let Conclusion { too_bright, faint, noise, is_noise_asked, totals, .. } = conclusion;
    if *too_bright > 0 {
        writeln!(
            out,
            "warning: {too_bright} samples are infinite or brighter than 2³⁰, the most that a film keeps, and are left out: divide every emission, intensity and radiance of the scene by one number and raise its exposure, or, where point lights light it, measure lengths in a smaller unit"
        )?;
    }
    if let Some(faint) = faint {
        writeln!(out, "warning: {faint}")?;
    }
    match noise {
        Some(noise) if *is_noise_asked && !noise.reached() && totals.samples > 0 => {
            writeln!(out, "warning: {noise}")
        }
        _ => Ok(()),
    }
}

/// Says where the pictures are, if they were written, and all that a user would not expect: samples that were left out
/// and how to look at one of them, pictures that were not reached, nothing at all.
fn conclude(conclusion: &Conclusion, out: &mut StderrLock<'_>) -> std::io::Result<()> {
    let Conclusion { files, totals, noise, rejects, .. } = conclusion;
    if totals.samples > 0 && conclusion.is_written && !files.is_empty() {
        let mut notes = Vec::new();
        if let Some(spp) = conclusion.stopped_before {
            notes.push(format!("stopped early, before {spp} spp"));
        }
        if conclusion.is_overtime {
            notes.push("the time was up long before the next sample of every pixel was done".to_owned());
        }
        // With adaptive sampling it is said below, and on purpose.
        if !conclusion.is_whole && !conclusion.is_adaptive {
            notes.push(sample_counts(conclusion.spp_range));
        }
        let note = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
        let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
        writeln!(out, "wrote {}{note}", names.join(", "))?;
    }
    if let Some(camera) = conclusion.moved.as_ref().filter(|_| totals.samples > 0) {
        writeln!(out, "seen from\n{}", camera.to_string().trim_end())?;
    }
    for lost in &conclusion.lost {
        let note = if conclusion.is_whole { ", and nothing is missing" } else { "" };
        writeln!(out, "warning: {}; the CPU went on{note}", with_options(lost))?;
    }
    if let Some(noise) = noise.filter(|noise| noise.reached() || !conclusion.is_noise_asked) {
        writeln!(out, "{noise}")?;
    }
    if conclusion.is_adaptive && totals.samples > 0 {
        let [least, most] = conclusion.spp_range;
        let mean = totals.samples as f64 / f64::from(conclusion.pixels);
        writeln!(out, "pixels have {least} to {most} samples, {mean:.1} on average")?;
    }
    if totals.rejected > 0 {
        let contributions = conclusion.rejected_contributions;
        writeln!(
            out,
            "{} left out:",
            left_out([totals.rejected.saturating_sub(contributions), contributions])
        )?;
    }
    for (traced, _, reject) in rejects {
        writeln!(out, "  pixel {} sample {}: {reject}", traced.pixel, traced.sample)?;
    }
    if let Some((traced, [x, y], _)) = rejects.first() {
        writeln!(out, "  look at one: stride trace SCENE --pixel {x},{y} --sample {}", traced.sample)?;
    }
    for spp in &conclusion.unreached {
        writeln!(out, "the render ended before {spp} samples a pixel: there is no picture of them")?;
    }
    if totals.samples == 0 {
        writeln!(out, "nothing was rendered yet: no picture is written")?;
    }
    Ok(())
}

/// So many samples and contributions, and the verb: "1 sample was", "2 samples and 1 contribution were".
fn left_out([samples, contributions]: [u64; 2]) -> String {
    let count = |count: u64, what: &str| {
        (count > 0).then(|| format!("{count} {what}{}", if count == 1 { "" } else { "s" }))
    };
    let both = [count(samples, "sample"), count(contributions, "contribution")];
    let verb = if samples + contributions == 1 { "was" } else { "were" };
    format!("{} {verb}", both.into_iter().flatten().collect::<Vec<_>>().join(" and "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_and_contributions_that_were_left_out_are_told_apart() {
        assert_eq!(left_out([1, 0]), "1 sample was");
        assert_eq!(left_out([0, 3]), "3 contributions were");
        assert_eq!(left_out([2, 1]), "2 samples and 1 contribution were");
    }
}
