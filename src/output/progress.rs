//! Progress without a window: a bar on a terminal, plain lines elsewhere, nothing if that is asked for.
//!
//! It is a courtesy: an error on its way out (a closed pipe, a terminal that hung up) is passed over in
//! silence.

use std::fmt;
use std::io::{self, Write};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::human;
use crate::film::Snapshot;

/// How far a run has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Samples per pixel so far, the mean over the picture.
    pub spp_done: f64,
    /// Samples per pixel of those that an earlier run had made.
    pub spp_before: f64,
    /// Samples per pixel the run is to reach, where it has such an end.
    pub spp_target: Option<u32>,
    /// Seconds since the first ray.
    pub seconds: f64,
    /// Samples since then, all pixels together.
    pub samples: u64,
    /// Seconds after which the run ends, where it has such an end.
    pub time_limit: Option<f64>,
    /// What the error is by estimate, and the one to end at, where it has such an end.
    pub noise: Option<[f64; 2]>,
}

impl Progress {
    /// What a snapshot says, in a run that ends after `time_limit` seconds.
    pub fn of(snapshot: &Snapshot, time_limit: Option<f64>) -> Self {
        Self {
            spp_done: snapshot.spp_done,
            spp_before: snapshot.spp_before,
            spp_target: snapshot.spp_target,
            seconds: snapshot.seconds,
            samples: snapshot.samples,
            time_limit,
            noise: snapshot.noise,
        }
    }

    /// Samples a second since the first ray; `None` before there is anything to tell.
    pub fn rate(&self) -> Option<f64> {
        (self.samples > 0 && self.seconds > 0.0).then(|| self.samples as f64 / self.seconds)
    }

    /// The part that is done, in [0, 1]; `None` for a run without an end.
    pub fn fraction(&self) -> Option<f64> {
        let by_samples =
            self.spp_target.filter(|&target| target > 0).map(|target| self.spp_done / f64::from(target));
        let by_time = self.time_limit.filter(|&limit| limit > 0.0).map(|limit| self.seconds / limit);
        // Errors fall as 1/√n.
        let by_noise = self.noise.map(|[now, asked]| (asked / now).powi(2));
        // Whichever end comes first ends the run.
        by_samples
            .into_iter()
            .chain(by_time)
            .chain(by_noise)
            .reduce(f64::max)
            .map(|part| part.clamp(0.0, 1.0))
    }

    /// Seconds left, if it goes on as it went; `None` for a run without an end, or one that has hardly begun.
    pub fn seconds_left(&self) -> Option<f64> {
        let at_end = self.noise.map(|[now, asked]| self.spp_done * (now / asked).powi(2));
        let target = self.spp_target.map(f64::from).into_iter().chain(at_end).reduce(f64::min);
        let by_samples = target
            .filter(|_| self.spp_done > self.spp_before)
            .map(|target| target - self.spp_done)
            .map(|to_do| self.seconds * to_do / (self.spp_done - self.spp_before));
        let by_time = self.time_limit.map(|limit| limit - self.seconds);
        by_samples.into_iter().chain(by_time).reduce(f64::min).map(|left| left.max(0.0))
    }

    /// "500 spp in 1 min 12 s, 7.9 Msamples/s": what a run amounted to.
    pub fn summary(&self) -> String {
        let spp = human::samples_per_pixel(self.spp_done);
        let mut text = format!("{spp} spp in {}", human::duration(self.seconds));
        if let Some(rate) = self.rate() {
            text += &format!(", {}", human::samples_per_second(rate));
        }
        text
    }
}

/// "128/500 spp, 7.9 Msamples/s, 41 s left".
impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&human::samples_per_pixel(self.spp_done))?;
        if let Some(target) = self.spp_target {
            write!(f, "/{target}")?;
        }
        f.write_str(" spp")?;
        if let Some([now, asked]) = self.noise {
            write!(f, ", noise {now:.4} of {asked}")?;
        }
        if let Some(rate) = self.rate() {
            write!(f, ", {}", human::samples_per_second(rate))?;
        }
        if let Some(left) = self.seconds_left() {
            // Rounded up: "0 s left" and still going would be a lie.
            write!(f, ", {} left", human::duration(left.ceil()))?;
        }
        Ok(())
    }
}

/// Tells a person, or a log, how far a run has come.
pub struct Reporter {
    target: Target,
}

enum Target {
    Quiet,
    Bar(ProgressBar),
    Lines(Lines),
}

impl Reporter {
    /// A bar if standard error is a terminal, lines otherwise; neither if `quiet`.
    pub fn stderr(quiet: bool) -> Self {
        if quiet {
            return Self { target: Target::Quiet };
        }
        let bar = ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr());
        // Hidden, as indicatif does on a pipe or a dumb terminal.
        if bar.is_hidden() {
            return Self::lines(Box::new(io::stderr()));
        }
        Self { target: Target::Bar(bar) }
    }

    /// Plain lines to `out`.
    pub fn lines(out: Box<dyn Write + Send>) -> Self {
        Self { target: Target::Lines(Lines { out, last_seconds: None, last_tenth: 0 }) }
    }

    /// Shows how far the run is. May be called as often as one likes: it writes no more than can be read.
    pub fn update(&mut self, progress: &Progress) {
        match &mut self.target {
            Target::Quiet => {}
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

    /// A line of its own, above the bar if there is one; a warning for instance. Nothing if quiet.
    pub fn note(&mut self, text: &str) {
        match &mut self.target {
            Target::Quiet => {}
            Target::Bar(bar) => bar.println(text),
            Target::Lines(lines) => lines.write(text),
        }
    }

    /// Takes the bar away and leaves one line that says what the run amounted to.
    pub fn finish(mut self, progress: &Progress) {
        match &mut self.target {
            Target::Quiet => {}
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

    fn at(spp_done: f64, seconds: f64) -> Progress {
        let samples = (spp_done * 307_200.0) as u64;
        Progress {
            spp_done,
            spp_before: 0.0,
            spp_target: Some(500),
            seconds,
            samples,
            time_limit: None,
            noise: None,
        }
    }

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
    fn says_samples_rate_and_time_left() {
        assert_eq!(at(128.0, 5.0).to_string(), "128/500 spp, 7.9 Msamples/s, 15 s left");
        assert_eq!(at(0.0, 0.0).to_string(), "0/500 spp");
        assert_eq!(Progress { spp_target: None, ..at(128.0, 5.0) }.to_string(), "128 spp, 7.9 Msamples/s");
        assert_eq!(at(500.0, 72.0).to_string(), "500/500 spp, 2.1 Msamples/s, 0 s left");
        assert_eq!(at(500.0, 72.0).summary(), "500 spp in 1 min 12 s, 2.1 Msamples/s");
        assert_eq!(at(0.0, 0.0).summary(), "0 spp in 0 s");
    }

    #[test]
    fn the_nearer_end_counts() {
        let both = Progress { time_limit: Some(10.0), ..at(100.0, 5.0) };
        assert_eq!(both.fraction(), Some(0.5));
        assert_eq!(both.seconds_left(), Some(5.0));
        let samples = Progress { time_limit: Some(1000.0), ..both };
        assert_eq!(samples.fraction(), Some(0.2));
        assert_eq!(samples.seconds_left(), Some(20.0));
        // 100 samples with an error that must be halved: 300 more.
        let noisy = Progress { noise: Some([0.02, 0.01]), ..samples };
        assert_eq!((noisy.fraction(), noisy.seconds_left()), (Some(0.25), Some(15.0)));
        assert!(noisy.to_string().starts_with("100/500 spp, noise 0.0200 of 0.01, "), "{noisy}");
        let gone_on_with = Progress { spp_before: 50.0, ..samples };
        assert_eq!(gone_on_with.seconds_left(), Some(40.0));
        let neither = Progress { spp_target: None, time_limit: None, ..both };
        assert_eq!((neither.fraction(), neither.seconds_left()), (None, None));
        let late = Progress { time_limit: Some(4.0), ..both };
        assert_eq!((late.fraction(), late.seconds_left()), (Some(1.0), Some(0.0)));
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
