//! The common part of all measurements: a scene, its renders, and outputs for the results.

use super::table::Table;
use crate::cli::arguments::SceneArguments;
use crate::cli::events::print_events;
use crate::cli::failure::{Failure, usage};
use crate::cli::print::print;
use crate::cli::stop;
use crate::film::Identity;
use crate::math::lanes::Level;
use crate::output::atomic::{check_place, write_atomically};
use crate::output::plot::Chart;
use crate::sampling::Region;
use crate::scene::{Choice, Fingerprint, Loaded, Sampler, Scene, Sources, UNLIMITED};
use crate::session::{
    self, CPU, Devices, Outputs, RenderJob, RenderSettings, Report, Stopping, ViewerSettings, film_head,
};
use crossbeam_channel::Receiver;
use std::convert::Infallible;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments common to all measurements.
#[derive(Debug, clap::Args)]
pub(super) struct CommonArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Samples per pixel
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub(super) spp: u32,
    /// Write the table as comma-separated values, with a header row
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
    /// Write a chart as SVG
    #[arg(long, value_name = "FILE.svg")]
    pub(super) plot: Option<PathBuf>,
    /// Print only the table and errors
    #[arg(short, long)]
    pub(super) quiet: bool,
}

/// Whether a render reports its progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verbosity {
    /// Progress is reported, unless `--quiet` is given.
    Progress,
    /// Progress is not reported.
    Quiet,
}

/// The setup of measurements: a scene, the SIMD level, and the request to stop.
pub(super) struct Bench<'a> {
    pub(super) arguments: &'a CommonArguments,
    pub(super) scene: Scene,
    sources: Sources,
    pub(super) level: Level,
    pub(super) stop: Receiver<Infallible>,
}

impl<'a> Bench<'a> {
    /// Reads the scene and checks that the results can be written, before measuring anything.
    pub(super) fn open(arguments: &'a CommonArguments) -> Result<Bench<'a>, Failure> {
        let level = Level::from_environment().map_err(usage)?;
        if let Some(path) = &arguments.plot {
            check_plot(path)?;
            if arguments.csv.as_ref() == Some(path) {
                return Err(usage(format!("--csv and --plot are both {}", path.display())));
            }
        }
        let Loaded { scene, sources, .. } = arguments.scene.load_whole(arguments.quiet)?;
        for path in [&arguments.csv, &arguments.plot].into_iter().flatten() {
            check_place(path)?;
        }
        let stop = stop::handler()?;
        Ok(Bench { arguments, scene, sources, level, stop })
    }

    /// Renders a variant of the scene; `None` if Ctrl-C was pressed before the end. Warns about rejected samples,
    /// because the figures then belong to another picture.
    pub(super) fn render(
        &self,
        scene: Scene,
        spp: u32,
        threads: NonZeroUsize,
        loudness: Verbosity,
    ) -> Result<Option<Report>, Failure> {
        let settings = self.settings(scene, spp, threads);
        let is_quiet = self.arguments.quiet || loudness == Verbosity::Quiet;
        let report = print_events(is_quiet, |events| session::run(&settings, events, &self.stop))?;
        if report.totals.rejected > 0 {
            self.print_progress(&format!("warning: {} samples were rejected", report.totals.rejected));
        }
        Ok((report.whole && report.totals.spp == spp).then_some(report))
    }

    fn settings(&self, scene: Scene, spp: u32, threads: NonZeroUsize) -> RenderSettings {
        let region = Region::whole(scene.film.width, scene.film.height);
        RenderSettings {
            job: RenderJob::new(Arc::new(scene), region),
            stopping: Stopping::at(spp),
            devices: Devices::cpu(threads, self.level),
            outputs: Outputs::default(),
            view: ViewerSettings { name: self.arguments.scene.name(), ..ViewerSettings::default() },
        }
    }

    /// The facts that a picture of the scene has in its file.
    pub(super) fn identity(&self) -> Identity {
        let mut settings = self.settings(self.scene.clone(), self.arguments.spp, NonZeroUsize::MIN);
        settings.job.fingerprint = Some(Fingerprint::of(&self.scene, &self.sources));
        film_head(&settings, CPU).identity
    }

    /// Renders briefly, so that processor clocks and caches are warm for the measurement.
    pub(super) fn warm_up(&self, threads: NonZeroUsize) -> Result<(), Failure> {
        self.print_progress("warming up");
        self.render(self.scene.clone(), (self.arguments.spp / 8).max(1), threads, Verbosity::Quiet).map(drop)
    }

    /// Prints a progress message.
    pub(super) fn print_progress(&self, line: &str) {
        if !self.arguments.quiet {
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }

    /// Prints the table and writes the files: all of them, even if one fails.
    pub(super) fn publish(
        &self,
        circumstances: &str,
        table: &Table,
        remarks: &str,
        chart: &Chart,
    ) -> Result<(), Failure> {
        if table.is_empty() {
            return Err(anyhow::anyhow!("stopped before the first measurement was finished").into());
        }
        let printed = print(&format!("{circumstances}\n\n{table}{remarks}"));
        let write = |path: &Option<PathBuf>, text: &str| match path {
            Some(path) => write_atomically(path, |out| out.write_all(text.as_bytes())),
            None => Ok(()),
        };
        let csv = write(&self.arguments.csv, &table.csv());
        let plot = write(&self.arguments.plot, &chart.svg());
        printed?;
        csv?;
        Ok(plot?)
    }

    /// The description of the render in a chart's subtitle.
    pub(super) fn circumstances(&self, more: &[String]) -> String {
        self.circumstances_of(&[self.scene.render.sampler], more)
    }

    /// The same, for renders with several samplers.
    pub(super) fn circumstances_of(&self, samplers: &[Sampler], more: &[String]) -> String {
        let Scene { film, render, .. } = &self.scene;
        let samplers: Vec<&str> = samplers.iter().map(|sampler| sampler.name()).collect();
        let mut words = vec![
            self.arguments.scene.name(),
            format!("{}×{} pixels", film.width, film.height),
            render.integrator.name().to_owned(),
            samplers.join(", "),
        ];
        words.extend_from_slice(more);
        words.join(" · ")
    }

    pub(super) fn depth(&self) -> String {
        match self.scene.render.max_depth {
            UNLIMITED => "depth unlimited".to_owned(),
            depth => format!("depth {depth}"),
        }
    }

    pub(super) fn spp(&self) -> String {
        counted(self.arguments.spp.into(), "sample per pixel", "samples per pixel")
    }
}

/// Rejects file names of charts without the extension .svg.
fn check_plot(path: &Path) -> Result<(), Failure> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg")) {
        return Ok(());
    }
    Err(usage(format!("--plot {}: charts are SVG; choose a name that ends in .svg", path.display())))
}

/// The requested number of threads, or one per core.
pub(super) fn threads_or_cores(threads: Option<u16>) -> NonZeroUsize {
    let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    threads.and_then(|threads| NonZeroUsize::new(threads.into())).unwrap_or_else(cores)
}

/// "1 thread", "2 threads".
pub(super) fn counted(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Times of one setting, in seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct Times(pub(super) Vec<f64>);

impl Times {
    /// The middle one, or the mean of the two in the middle. Other programs can only make a run slower, and
    /// seldom more than half of the runs.
    pub(super) fn median(&self) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        if sorted.len() % 2 == 1 { sorted[middle] } else { (sorted[middle - 1] + sorted[middle]) / 2.0 }
    }

    pub(super) fn fastest(&self) -> f64 {
        self.0.iter().copied().fold(f64::INFINITY, f64::min)
    }

    pub(super) fn slowest(&self) -> f64 {
        self.0.iter().copied().fold(0.0, f64::max)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// "median of 3, whiskers: fastest and slowest"; `None` for a single run.
pub(super) fn repeats(repeat: u16) -> Option<String> {
    (repeat > 1).then(|| format!("median of {repeat}, whiskers: fastest and slowest"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(Times(vec![3.0, 1.0, 2.0]).median(), 2.0);
        assert_eq!(Times(vec![4.0, 1.0, 2.0, 3.0]).median(), 2.5);
        assert_eq!(Times(vec![7.0]).median(), 7.0);
        let times = Times(vec![3.0, 1.0, 2.0]);
        assert_eq!((times.fastest(), times.slowest()), (1.0, 3.0));
    }

    #[test]
    fn charts_are_svg() {
        assert!(check_plot(Path::new("a/b.SVG")).is_ok());
        for bad in ["a.png", "svg", "a", "a.svg.gz"] {
            assert!(matches!(check_plot(Path::new(bad)), Err(Failure::Usage(_))), "{bad}");
        }
    }
}
