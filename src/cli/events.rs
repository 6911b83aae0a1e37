//! Prints the events of a render on standard error: progress, problems, and the conclusion at the end. The camera, on
//! request, is printed on standard output.
//!
//! Either stream may be closed, which is not an error.

use super::failure::with_options;
use super::reporter::Reporter;
use crate::session::{Conclusion, Event, sample_counts};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::io::{StderrLock, Write};

/// Runs a function that sends events, and prints them meanwhile. With `quiet`, it prints only problems that affect the
/// files, and warnings about the result.
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

/// Warns if the picture is wrong, or the requested error was not reached.
fn warn(conclusion: &Conclusion, out: &mut StderrLock<'_>) -> std::io::Result<()> {
    let Conclusion { too_bright, faint, noise, is_noise_asked, totals, .. } = conclusion;
    if *too_bright > 0 {
        writeln!(
            out,
            "warning: {too_bright} samples were rejected because they are infinite or above 2³⁰, the maximum of a film. Divide all emissions, intensities and radiances of the scene by one number and raise its exposure. With point lights, a smaller unit of length also helps"
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

/// Reports the written files, and everything unexpected: rejected samples with a command to trace one, pictures that
/// were not reached, an empty result.
fn conclude(conclusion: &Conclusion, out: &mut StderrLock<'_>) -> std::io::Result<()> {
    let Conclusion { files, totals, noise, rejects, .. } = conclusion;
    if totals.samples > 0 && conclusion.is_written && !files.is_empty() {
        let mut notes = Vec::new();
        if let Some(spp) = conclusion.stopped_before {
            notes.push(format!("stopped early, before {spp} spp"));
        }
        if conclusion.is_overtime {
            notes.push("the time limit came long before the next whole sample".to_owned());
        }
        // With adaptive sampling this is intended, and reported below.
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
        let note = if conclusion.is_whole { ", and no samples are missing" } else { "" };
        writeln!(out, "warning: {}; the CPU continued{note}", with_options(lost))?;
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
            "{} rejected:",
            left_out([totals.rejected.saturating_sub(contributions), contributions])
        )?;
    }
    for (traced, _, reject) in rejects {
        writeln!(out, "  pixel {} sample {}: {reject}", traced.pixel, traced.sample)?;
    }
    if let Some((traced, [x, y], _)) = rejects.first() {
        writeln!(out, "  trace one: stride trace SCENE --pixel {x},{y} --sample {}", traced.sample)?;
    }
    for spp in &conclusion.unreached {
        writeln!(out, "the render ended before {spp} samples per pixel: their picture was not written")?;
    }
    if totals.samples == 0 {
        writeln!(out, "nothing was rendered: no picture was written")?;
    }
    Ok(())
}

/// The numbers of samples and contributions, with the verb: "1 sample was", "2 samples and 1 contribution were".
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
    fn rejected_samples_and_contributions_are_counted_separately() {
        assert_eq!(left_out([1, 0]), "1 sample was");
        assert_eq!(left_out([0, 3]), "3 contributions were");
        assert_eq!(left_out([2, 1]), "2 samples and 1 contribution were");
    }
}
