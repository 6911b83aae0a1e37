//! `stride bench noise`: error against samples per pixel.
//!
//! With independent samples the error falls as 1/√n: a line of slope −½ on logarithmic axes. With `sobol` it falls
//! faster where radiance is smooth. The error is the root of the mean squared difference from a reference that has
//! another seed and many more samples, so that the two are independent. A reference of R samples has an error of its
//! own: if its samples are independent, the measured error at n independent samples is √(1 + n/R) times the true error,
//! at most 1.6% too large at the default R of 32 n.

use super::measurement::{Bench, CommonArguments, Verbosity, counted, threads_or_cores};
use super::reference;
use super::statistics::{Fit, fit, standard_error};
use super::table::{Cell, Table, significant};
use crate::cli::arguments::samplers;
use crate::cli::failure::{Failure, usage};
use crate::film::Picture;
use crate::film::compare::{mean_without_worst, squared_errors};
use crate::film::noise::WORST;
use crate::output::plot::{Axis, Chart, Point, Scale, Series, Style};
use crate::scene::{Choice, Sampler};
use crate::session::MOST_THREADS;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    mut_arg("spp", |spp| spp.default_value("32").help(
        "Largest number of samples per pixel; errors are measured at 1, 2, 4, … up to the largest power of two that is \
         not above it"
    )),
    mut_arg("sampler", |sampler| sampler.value_parser(samplers).value_name("NAME,…").help(format!(
        "Samplers to compare, instead of the scene's: {}, or several, separated by commas",
        Sampler::listed()
    ))),
    mut_arg("seed", |seed| seed.help("First of the measured seeds, instead of the scene's")),
    mut_arg("csv", |csv| csv.help("Write the table as comma-separated values, with a header row and all digits")),
    mut_arg("plot", |plot| plot.help("Write a chart of the errors of all samplers as SVG; whiskers are ± values")),
    after_help = AFTER_HELP
)]
pub(super) struct NoiseArguments {
    #[command(flatten)]
    common: CommonArguments,
    /// Picture to compare with, instead of rendering a reference: OpenEXR, of the size of the film, with the same
    /// camera and filter, another seed, and many times the samples
    #[arg(long, value_name = "FILE.exr", conflicts_with = "reference_spp")]
    reference: Option<PathBuf>,
    /// Samples per pixel of the rendered reference [default: 32 times the largest measured number]
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 30))]
    reference_spp: Option<u32>,
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)),
        help = format!("Rendering threads, 1 to {MOST_THREADS} [default: one per core]"))]
    threads: Option<u16>,
    /// Number of independent seeds, which count up from the first; several are needed for ±
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeat: u16,
}

const AFTER_HELP: &str = "\
Figures:
  RMS error           Root of the mean squared difference from the reference, over
                      pixels, channels and seeds, in the scene's unit of radiance.
  Error × √samples    Constant while the error falls as 1/√samples.
  Without worst 0.5%  RMS error without the pixels of the largest errors, which are
                      chosen anew for each picture.
  Slope               Slope of the straight line fitted to log(error) over
                      log(samples); −0.5 for independent samples.
  R²                  Share of the variation of log(error) that the line explains.
  ±                   Standard error over the seeds (jackknife); the error of the
                      reference, which all seeds share, is not included.";

/// Samples of the reference per sample of the largest measured picture.
const REFERENCE_FACTOR: u32 = 32;

/// Mean squared errors of radiance in one picture.
#[derive(Clone, Copy, Debug)]
struct Squares {
    all: f64,
    without_worst: f64,
}

/// One row of the table.
#[derive(Clone, Debug)]
struct Measured {
    sampler: Sampler,
    spp: u32,
    /// By seed.
    squares: Vec<Squares>,
}

/// Selects an error.
type Which = fn(&Squares) -> f64;

const ALL: Which = |squares| squares.all;
const REST: Which = |squares| squares.without_worst;

/// A figure and its standard error over seeds.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    value: f64,
    deviation: Option<f64>,
}

impl Measured {
    /// The root-mean-square error over all seeds, or all but one.
    fn root(&self, which: Which, left_out: Option<usize>) -> f64 {
        let seeds = self.squares.iter().enumerate().filter(|(seed, _)| Some(*seed) != left_out);
        let (count, sum) =
            seeds.fold((0.0, 0.0), |(count, sum), (_, squares)| (count + 1.0, sum + which(squares)));
        f64::sqrt(sum / count)
    }

    fn error(&self, which: Which) -> Estimate {
        let deviation = standard_error(self.squares.len(), |seed| Some(self.root(which, Some(seed))));
        Estimate { value: self.root(which, None), deviation }
    }
}

/// The slope of errors against samples per pixel.
#[derive(Clone, Copy, Debug)]
struct Slope {
    fit: Fit,
    deviation: Option<f64>,
}

fn slope(rows: &[Measured], which: Which) -> Option<Slope> {
    let fit = |left_out| fit(rows.iter().map(|row| (row.spp.into(), row.root(which, left_out))));
    let seeds = rows.first().map_or(0, |row| row.squares.len());
    let deviation = standard_error(seeds, |seed| fit(Some(seed)).map(|fit| fit.slope));
    Some(Slope { fit: fit(None)?, deviation })
}

pub(super) fn run(arguments: &NoiseArguments) -> Result<(), Failure> {
    let spp = arguments.common.spp;
    let steps: Vec<u32> = (0..32).map(|power| 1 << power).take_while(|&step| step <= spp).collect();
    let most = steps.last().copied().unwrap_or(1);
    let reference_spp = arguments.reference_spp.unwrap_or(most * REFERENCE_FACTOR);
    if reference_spp <= most {
        return Err(usage(format!(
            "--reference-spp {reference_spp} is too small for {}; set it to many times as many",
            counted(most.into(), "sample per pixel", "samples per pixel")
        )));
    }
    if let Some(path) = &arguments.reference {
        reference::check_name(path)?;
    }
    let bench = Bench::open(&arguments.common)?;
    let threads = threads_or_cores(arguments.threads);
    let (reference, source) = match &arguments.reference {
        Some(path) => (Some(reference::read(path, &bench)?), format!("reference {}", path.display())),
        None => {
            let picture = reference::render(&bench, reference_spp, threads)?;
            (picture, format!("reference of {reference_spp} samples per pixel"))
        }
    };
    let samplers = arguments.common.scene.samplers().unwrap_or_else(|| vec![bench.scene.render.sampler]);
    // By sampler: their rows.
    let rows = match &reference {
        Some(reference) => measure(&bench, arguments, &samplers, &steps, reference)?,
        None => Vec::new(),
    };

    let seeds = counted(arguments.repeat.into(), "seed", "seeds");
    let circumstances = bench.circumstances_of(&samplers, &[bench.depth(), source, seeds.clone()]);
    let slopes: Vec<_> = rows.iter().map(|rows| [slope(rows, ALL), slope(rows, REST)]).collect();
    let mut remarks = "\n".to_owned();
    for (rows, [all, rest]) in rows.iter().zip(&slopes) {
        let name = rows.first().map_or("", |row| row.sampler.name());
        let [all, rest] = [all, rest].map(|slope| describe_slope(*slope));
        remarks += &format!("Slope of {name} on logarithmic axes: {all}; {WITHOUT_WORST}: {rest}\n");
    }
    remarks += &match arguments.repeat {
        1 => "There is no ± with --repeat 1: it is the standard error over several seeds.\n".to_owned(),
        _ => format!("± is the standard error over {seeds}, without the error of the reference.\n"),
    };
    let chart = chart(&rows, &slopes, &circumstances);
    bench.publish(&circumstances, &table(&rows), &remarks, &chart)
}

const WITHOUT_WORST: &str = "without the worst 0.5% of pixels";

/// Renders pictures until all are done or Ctrl-C is pressed, and returns the errors of each sampler. Each picture is a
/// separate render: it equals the picture of a longer one at that point, and all together take as long as one more.
/// Every number of samples is measured with all samplers before the next, so that an interrupted table compares them.
fn measure(
    bench: &Bench,
    arguments: &NoiseArguments,
    samplers: &[Sampler],
    steps: &[u32],
    reference: &Picture,
) -> Result<Vec<Vec<Measured>>, Failure> {
    let threads = threads_or_cores(arguments.threads);
    let mut rows = vec![Vec::new(); samplers.len()];
    'steps: for &spp in steps {
        for (&sampler, rows) in samplers.iter().zip(&mut rows) {
            let mut row = Measured { sampler, spp, squares: Vec::new() };
            for replicate in 0..arguments.repeat {
                let mut scene = bench.scene.clone();
                scene.render.sampler = sampler;
                scene.render.seed = scene.render.seed.wrapping_add(replicate.into());
                let Some(report) = bench.render(scene, spp, threads, Verbosity::Quiet)? else { break 'steps };
                let errors = squared_errors(&report.picture, reference);
                let [all, without_worst] = [0.0, WORST].map(|share| mean_without_worst(&errors, share));
                row.squares.push(Squares { all, without_worst });
            }
            let samples = counted(spp.into(), "sample per pixel", "samples per pixel");
            let error = describe(row.error(ALL));
            bench.print_progress(&format!("{}, {samples}: RMS error {error}", sampler.name()));
            rows.push(row);
        }
    }
    rows.retain(|rows| !rows.is_empty());
    Ok(rows)
}

/// "0.1234 ± 0.0012".
fn describe(Estimate { value, deviation }: Estimate) -> String {
    let value = significant(value, 4);
    deviation.map_or_else(|| value.clone(), |deviation| format!("{value} ± {}", significant(deviation, 2)))
}

fn table(rows: &[Vec<Measured>]) -> Table {
    let mut table = Table::new(&[
        ("Sampler", "sampler"),
        ("Samples", "spp"),
        ("RMS error", "rms_error"),
        ("", "rms_error_standard_error"),
        ("Error × √samples", "rms_error_times_root_spp"),
        ("Without worst 0.5%", "rms_error_without_worst"),
        ("", "rms_error_without_worst_standard_error"),
        ("Error × √samples", "rms_error_without_worst_times_root_spp"),
    ]);
    for row in rows.iter().flatten() {
        let mut cells = vec![Cell::word(row.sampler.name()), Cell::count(row.spp)];
        for which in [ALL, REST] {
            let error = row.error(which);
            let scaled = error.value * f64::from(row.spp).sqrt();
            cells.push(Cell::new(describe(error), error.value));
            cells.push(error.deviation.map_or_else(Cell::nothing, |deviation| Cell::new("", deviation)));
            cells.push(Cell::new(significant(scaled, 4), scaled));
        }
        table.push(cells);
    }
    table
}

/// "−0.501 ± 0.002 (R² 0.9998)".
fn describe_slope(slope: Option<Slope>) -> String {
    let Some(Slope { fit: Fit { slope, explained }, deviation }) = slope else {
        return "none: fewer than three errors are above zero".to_owned();
    };
    let deviation = deviation.map_or_else(String::new, |deviation| format!(" ± {deviation:.3}"));
    format!("{slope:.3}{deviation} (R² {explained:.4})").replace('-', "−")
}

fn chart(rows: &[Vec<Measured>], slopes: &[[Option<Slope>; 2]], circumstances: &str) -> Chart {
    let named = |name: String, slope: Option<Slope>| match slope {
        Some(Slope { fit, .. }) => format!("{name}: slope {:.3}", fit.slope).replace('-', "−"),
        None => name,
    };
    let curve = |label: String, rows: &[Measured], which: Which| {
        let point = |row: &Measured| {
            let Estimate { value: y, deviation } = row.error(which);
            // A whisker down to zero has no end on a logarithmic axis.
            let range =
                deviation.filter(|deviation| *deviation < y).map(|deviation| [y - deviation, y + deviation]);
            Point { range, ..Point::at(row.spp.into(), y) }
        };
        Series { label, points: rows.iter().map(point).collect(), style: Style::Measured }
    };
    let mut series = Vec::new();
    for (rows, [all, rest]) in rows.iter().zip(slopes) {
        let name = rows.first().map_or("", |row| row.sampler.name());
        series.push(curve(named(format!("{name}, all pixels"), *all), rows, ALL));
        series.push(curve(named(format!("{name}, without the worst 0.5%"), *rest), rows, REST));
    }
    // Beside the highest curve, so that neither hides the other, and across the whole chart. Its height is the
    // curve's mean on these axes, so that neither end appears as the reference.
    let level = |rows: &Vec<Measured>| {
        let logarithm = |row: &Measured| (row.error(ALL).value * f64::from(row.spp).sqrt()).ln();
        (rows.iter().map(logarithm).sum::<f64>() / rows.len() as f64).exp()
    };
    let steps = rows.iter().flatten().map(|row| f64::from(row.spp));
    let level = 1.15 * rows.iter().map(level).fold(0.0, f64::max);
    if let (Some(first), Some(last)) = (steps.clone().min_by(f64::total_cmp), steps.max_by(f64::total_cmp)) {
        let at = |spp: f64| spp.sqrt().recip();
        let ends = [(first / 4.0, 2.0 * at(first)), (last * 4.0, at(last) / 2.0)];
        let points = ends.map(|(spp, error)| Point::at(spp, level * error)).to_vec();
        series.push(Series { label: "slope −½".to_owned(), points, style: Style::Guide });
    }
    Chart {
        title: "Error against samples".to_owned(),
        subtitle: circumstances.to_owned(),
        x: Axis { label: "Samples per pixel".to_owned(), scale: Scale::Binary },
        y: Axis { label: "RMS error (W·m⁻²·sr⁻¹)".to_owned(), scale: Scale::Decimal },
        series,
    }
}
