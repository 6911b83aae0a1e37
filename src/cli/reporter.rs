//! Progress without a window: a bar on a terminal, plain lines elsewhere.
//!
//! Progress is not essential: errors of the output (a closed pipe, a terminal that disconnected) are ignored.

use crate::output::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, Write};

/// Reports progress to a terminal or a log.
pub(super) struct Reporter {
    target: Target,
}

enum Target {
    Bar(ProgressBar),
    Lines(Lines),
}

impl Reporter {
    /// A bar if standard error is a terminal, lines otherwise.
    pub(super) fn stderr() -> Self {
        let bar = ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr());
        // indicatif hides the bar on a pipe or a dumb terminal.
        if bar.is_hidden() {
            return Self::lines(Box::new(io::stderr()));
        }
        Self { target: Target::Bar(bar) }
    }

    /// Plain lines to `out`.
    fn lines(out: Box<dyn Write + Send>) -> Self {
        Self { target: Target::Lines(Lines { out, last_seconds: None, last_tenth: 0 }) }
    }

    /// Shows the progress. May be called at any rate: the output is limited to a readable one.
    pub(super) fn update(&mut self, progress: &Progress) {
        self.update_with(progress, "");
    }

    /// Shows the progress behind other words.
    pub(super) fn update_with(&mut self, progress: &Progress, before: &str) {
        let words = if before.is_empty() { progress.to_string() } else { format!("{before}, {progress}") };
        match &mut self.target {
            Target::Bar(bar) => {
                if bar.message().is_empty() {
                    bar.set_style(style(progress.fraction().is_some()));
                }
                // The message is set first, because setting the position may draw.
                bar.set_message(words);
                bar.set_position((progress.fraction().unwrap_or(0.0) * BAR_STEPS as f64) as u64);
            }
            Target::Lines(lines) => lines.update(progress, &words),
        }
    }

    /// Prints a separate line, above the bar if there is one; a warning for instance.
    pub(super) fn note(&mut self, text: &str) {
        match &mut self.target {
            Target::Bar(bar) => bar.println(text),
            Target::Lines(lines) => lines.write(text),
        }
    }

    /// Removes the bar and prints one line with a summary of the run.
    pub(super) fn finish(mut self, progress: &Progress) {
        match &mut self.target {
            Target::Bar(bar) => {
                bar.finish_and_clear();
                let _ = writeln!(io::stderr(), "{}", progress.summary());
            }
            Target::Lines(lines) => lines.write(&progress.summary()),
        }
    }
}

/// The length of the bar, in thousandths of the run.
const BAR_STEPS: u64 = 1000;

fn style(has_end: bool) -> ProgressStyle {
    let template = if has_end { "{bar:24} {percent:>3}%  {wide_msg}" } else { "{spinner} {wide_msg}" };
    // The templates are tested; if indicatif rejects one nevertheless, its default bar is used.
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

struct Lines {
    out: Box<dyn Write + Send>,
    /// The run's time at the last line.
    last_seconds: Option<f64>,
    /// The tenth of the run in which the last line was printed.
    last_tenth: u32,
}

/// The shortest interval between lines, in seconds.
const LINE_SECONDS: f64 = 2.0;
/// The longest interval between lines; within these limits a line appears at each tenth of the run.
const LONGEST_SILENCE: f64 = 30.0;

impl Lines {
    fn update(&mut self, progress: &Progress, words: &str) {
        let tenth = (progress.fraction().unwrap_or(0.0) * 10.0) as u32;
        let silence = progress.seconds - self.last_seconds.unwrap_or(0.0);
        let due = silence >= LONGEST_SILENCE
            || (silence >= LINE_SECONDS && (tenth > self.last_tenth || self.last_seconds.is_none()));
        if due {
            let percent =
                progress.fraction().map_or(String::new(), |part| format!("{:3.0}%  ", part * 100.0));
            self.write(&format!("{percent}{words}"));
            self.last_seconds = Some(progress.seconds);
            self.last_tenth = tenth;
        }
    }

    fn write(&mut self, text: &str) {
        let _ = writeln!(self.out, "{text}").and_then(|()| self.out.flush());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::progress::tests::at;

    /// The output of a run over `seconds` that is updated ten times a second.
    fn log(seconds: f64, progress: impl Fn(f64) -> Progress) -> Vec<String> {
        let (sender, receiver) = crossbeam_channel::unbounded();
        struct Pipe(crossbeam_channel::Sender<Vec<u8>>);
        impl Write for Pipe {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                self.0.send(bytes.to_vec()).unwrap();
                Ok(bytes.len())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut reporter = Reporter::lines(Box::new(Pipe(sender)));
        for tick in 0..(seconds * 10.0) as u32 {
            reporter.update(&progress(f64::from(tick) / 10.0));
        }
        reporter.finish(&progress(seconds));
        let text: Vec<u8> = receiver.try_iter().flatten().collect();
        String::from_utf8(text).unwrap().lines().map(str::to_string).collect()
    }

    #[test]
    fn a_long_run_prints_a_line_per_tenth() {
        let lines = log(100.0, |t| at(t * 5.0, t));
        // The first after two seconds, one at each tenth, and the summary.
        assert_eq!(lines.len(), 11, "{lines:#?}");
        assert!(lines[0].starts_with("  2%  10/500 spp"), "{}", lines[0]);
        assert!(lines[1].starts_with(" 10%  50/500 spp"), "{}", lines[1]);
        assert!(lines[10].starts_with("500 spp in 1 min 40 s"), "{}", lines[10]);
    }

    #[test]
    fn a_short_run_prints_only_its_summary() {
        assert_eq!(log(1.5, |t| at(t * 300.0, t)).len(), 1);
    }

    #[test]
    fn lines_are_two_to_thirty_seconds_apart() {
        assert_eq!(log(5.0, |t| at(t * 100.0, t)).len(), 3);
        let endless = |t| Progress { spp_target: None, ..at(t, t) };
        let lines = log(93.0, endless);
        assert_eq!(lines.len(), 5, "{lines:#?}");
        assert!(lines[1].starts_with("32 spp"), "{}", lines[1]);
    }

    #[test]
    fn a_closed_pipe_causes_no_panic() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Err(io::ErrorKind::BrokenPipe.into())
            }
        }
        let mut reporter = Reporter::lines(Box::new(Closed));
        reporter.update(&at(1.0, 3.0));
        reporter.note("a warning");
        reporter.finish(&at(2.0, 6.0));
    }

    #[test]
    fn the_bar_s_templates_are_accepted() {
        for template in ["{bar:24} {percent:>3}%  {wide_msg}", "{spinner} {wide_msg}"] {
            assert!(ProgressStyle::with_template(template).is_ok());
        }
        let _ = (style(true), style(false));
    }
}
