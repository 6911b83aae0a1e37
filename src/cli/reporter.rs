//! Progress without a window: a bar on a terminal, plain lines elsewhere.
//!
//! It is a courtesy: an error on its way out (a closed pipe, a terminal that hung up) is passed over in
//! silence.

use crate::output::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, Write};

/// Tells a person, or a log, how far a run has come.
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
        // Hidden, as indicatif does on a pipe or a dumb terminal.
        if bar.is_hidden() {
            return Self::lines(Box::new(io::stderr()));
        }
        Self { target: Target::Bar(bar) }
    }

    /// Plain lines to `out`.
    fn lines(out: Box<dyn Write + Send>) -> Self {
        Self { target: Target::Lines(Lines { out, last_seconds: None, last_tenth: 0 }) }
    }

    /// Shows how far the run is. May be called as often as one likes: it writes no more than can be read.
    pub(super) fn update(&mut self, progress: &Progress) {
        match &mut self.target {
            Target::Bar(bar) => {
                if bar.message().is_empty() {
                    bar.set_style(style(progress.fraction().is_some()));
                }
                // Message first: it is the position that may draw.
                bar.set_message(progress.to_string());
                bar.set_position((progress.fraction().unwrap_or(0.0) * BAR_STEPS as f64) as u64);
            }
            Target::Lines(lines) => lines.update(progress),
        }
    }

    /// A line of its own, above the bar if there is one; a warning for instance.
    pub(super) fn note(&mut self, text: &str) {
        match &mut self.target {
            Target::Bar(bar) => bar.println(text),
            Target::Lines(lines) => lines.write(text),
        }
    }

    /// Takes the bar away and leaves one line that says what the run amounted to.
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

/// The bar counts in thousandths of the run.
const BAR_STEPS: u64 = 1000;

fn style(has_end: bool) -> ProgressStyle {
    let template = if has_end { "{bar:24} {percent:>3}%  {wide_msg}" } else { "{spinner} {wide_msg}" };
    // The templates are ours; should indicatif ever refuse one, its own bar will do.
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

struct Lines {
    out: Box<dyn Write + Send>,
    /// The run's clock at the last line.
    last_seconds: Option<f64>,
    /// The tenth of the run the last line fell into.
    last_tenth: u32,
}

/// Lines are at least this far apart …
const LINE_SECONDS: f64 = 2.0;
/// … and at most this far: between the two they wait for the next tenth of the run.
const LONGEST_SILENCE: f64 = 30.0;

impl Lines {
    fn update(&mut self, progress: &Progress) {
        let tenth = (progress.fraction().unwrap_or(0.0) * 10.0) as u32;
        let silence = progress.seconds - self.last_seconds.unwrap_or(0.0);
        let due = silence >= LONGEST_SILENCE
            || (silence >= LINE_SECONDS && (tenth > self.last_tenth || self.last_seconds.is_none()));
        if due {
            let percent =
                progress.fraction().map_or(String::new(), |part| format!("{:3.0}%  ", part * 100.0));
            self.write(&format!("{percent}{progress}"));
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

    /// What a run over `seconds` writes when it is updated ten times a second.
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
    fn a_long_run_gets_a_line_a_tenth() {
        let lines = log(100.0, |t| at(t * 5.0, t));
        // The first after two seconds, one at each tenth, the summary.
        assert_eq!(lines.len(), 11, "{lines:#?}");
        assert!(lines[0].starts_with("  2%  10/500 spp"), "{}", lines[0]);
        assert!(lines[1].starts_with(" 10%  50/500 spp"), "{}", lines[1]);
        assert!(lines[10].starts_with("500 spp in 1 min 40 s"), "{}", lines[10]);
    }

    #[test]
    fn a_short_run_gets_its_summary_only() {
        assert_eq!(log(1.5, |t| at(t * 300.0, t)).len(), 1);
    }

    #[test]
    fn lines_are_never_closer_than_two_seconds_nor_farther_than_thirty() {
        assert_eq!(log(5.0, |t| at(t * 100.0, t)).len(), 3);
        let endless = |t| Progress { spp_target: None, ..at(t, t) };
        let lines = log(93.0, endless);
        assert_eq!(lines.len(), 5, "{lines:#?}");
        assert!(lines[1].starts_with("32 spp"), "{}", lines[1]);
    }

    #[test]
    fn a_closed_pipe_is_no_panic() {
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
