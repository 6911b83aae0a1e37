//! `stride bench noise`: error against samples per pixel.
//!
//! With independent samples the error falls as 1/√n: a line of slope −½ on logarithmic axes. With `sobol` it falls
//! faster where radiance is smooth. The error is the root of the mean squared difference from a reference that has
//! another seed and many more samples, so that the two are independent. A reference of R samples has an error of its
//! own: if its samples are independent, the measured error at n independent samples is √(1 + n/R) times the true error,
//! at most 1.6% too large at the default R of 32 n.

use super::measurement::{Bench, CommonArguments, Verbosity, counted, threads_or_cores};
use super::reference::{self, FACTOR, Planned};
use super::statistics::{Fit, fit, standard_error};
use super::table::{Cell, Table, significant};
use super::verdict::{Costs, advantage};
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
    mut_arg("csv", |csv| csv.help(
        "Write the table and the slopes as comma-separated values, with a header row and all digits"
    )),
    mut_arg("plot", |plot| plot.help(
        "Write a chart of the RMS errors of all samplers as SVG, with slopes in the legend; whiskers are ± values"
    )),
    after_help = AFTER_HELP
)]
pub(super) struct NoiseArguments {
    #[command(flatten)]
    common: CommonArguments,
    /// Picture to compare with, instead of rendering a reference: OpenEXR, of the same scene, size, filter and depth,
    /// another seed, and at least 32 times as many samples as the largest measured number
    #[arg(long, value_name = "FILE.exr", conflicts_with = "reference_spp")]
    reference: Option<PathBuf>,
    /// Samples per pixel of the rendered reference [default: 32 times the largest measured number]
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 30))]
    reference_spp: Option<u32>,
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)),
        help = format!("Rendering threads, 1 to {MOST_THREADS} [default: one per core]"))]
    threads: Option<u16>,
    /// Number of samples per pixel from which the line is fitted, rounded up to a power of two
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    first_spp: u32,
    /// Number of independent seeds, which count up from the first; several are needed for ±
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeat: u16,
    /// Measure the time of each picture as well, and draw the errors against it; times differ from run to run
    #[arg(long)]
    times: bool,
}

const AFTER_HELP: &str = "\
Figures:
  RMS error           Root of the mean squared difference from the reference,
                      over pixels, channels and seeds, in the scene's unit of
                      radiance.
  Error × √samples    Constant while the error falls as 1/√samples.
  Local slope         Slope of log(error) over log(samples) from the row above.
  Without worst 0.5%  RMS error without the pixels of the largest errors, which
                      are chosen anew for each picture. Its slope is biased
                      where errors have heavy tails.
  Slope               Slope of the straight line fitted to log(error) over
                      log(samples), from --first-spp on. For all pixels it is
                      −0.5 on average with independent samples.
  R²                  Share of the variation of log(error) that the line
                      explains.
  Fewer samples       How many times fewer samples the better of two samplers
                      needs for the error that the worse one has at its largest
                      number of samples. Between measured numbers the error is
                      interpolated on logarithmic axes.
  Time                With --times: mean time of a picture, from the first ray
                      to the last sample.
  ±                   Standard error over the seeds (jackknife). It covers
                      neither the error of the reference, which all seeds
                      share, nor the misfit of the line.";

/// Mean squared errors of radiance in one picture, and the seconds that it took.
#[derive(Clone, Copy, Debug)]
struct Squares {
    all: f64,
    without_worst: f64,
    seconds: f64,
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

impl Estimate {
    /// One over the figure. To first order |d(1/r)| = dr/r².
    fn reciprocal(self) -> Estimate {
        let square = self.value * self.value;
        Estimate { value: self.value.recip(), deviation: self.deviation.map(|deviation| deviation / square) }
    }
}

impl Measured {
    /// The root-mean-square error over all seeds, or all but one.
    fn root(&self, which: Which, left_out: Option<usize>) -> f64 {
        let seeds = self.squares.iter().enumerate().filter(|(seed, _)| Some(*seed) != left_out);
        let (count, sum) =
            seeds.fold((0.0, 0.0), |(count, sum), (_, squares)| (count + 1.0, sum + which(squares)));
        f64::sqrt(sum / count)
    }

    /// The mean time of a picture over all seeds, or all but one.
    fn seconds(&self, left_out: Option<usize>) -> f64 {
        let seeds = self.squares.iter().enumerate().filter(|(seed, _)| Some(*seed) != left_out);
        let (count, sum) = seeds.fold((0.0, 0.0), |(count, sum), (_, one)| (count + 1.0, sum + one.seconds));
        sum / count
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

/// The slope of all errors from `first` samples per pixel on.
fn slope(rows: &[Measured], first: u32, which: Which) -> Option<Slope> {
    let fitted = || rows.iter().filter(|row| row.spp >= first);
    let fit = |left_out| fit(fitted().map(|row| (row.spp.into(), row.root(which, left_out))));
    let seeds = rows.first().map_or(0, |row| row.squares.len());
    let deviation = standard_error(seeds, |seed| fit(Some(seed)).map(|fit| fit.slope));
    Some(Slope { fit: fit(None)?, deviation })
}

/// The slope of the errors of all pixels between two rows; `None` if there is no error in one.
fn local_slope(before: &Measured, row: &Measured) -> Option<Estimate> {
    let slope = |left_out| {
        let fall = row.root(ALL, left_out) / before.root(ALL, left_out);
        let slope = fall.ln() / (f64::from(row.spp) / f64::from(before.spp)).ln();
        slope.is_finite().then_some(slope)
    };
    let deviation = standard_error(row.squares.len(), |seed| slope(Some(seed)));
    Some(Estimate { value: slope(None)?, deviation })
}

/// The errors of a sampler: its rows, and the slopes of all pixels and without the worst ones.
#[derive(Debug)]
struct Curve {
    rows: Vec<Measured>,
    slopes: [Option<Slope>; 2],
}

impl Curve {
    fn new(rows: Vec<Measured>, first: u32) -> Curve {
        let slopes = [ALL, REST].map(|which| slope(&rows, first, which));
        Curve { rows, slopes }
    }

    fn name(&self) -> &'static str {
        self.rows.first().map_or("", |row| row.sampler.name())
    }

    /// The errors of the first `rows` against a cost, without one seed.
    fn costs(&self, rows: usize, cost: Cost, left_out: Option<usize>) -> Costs {
        self.rows[..rows].iter().map(|row| (cost(row, left_out), row.root(ALL, left_out))).collect()
    }
}

/// The cost of a picture, over all seeds but one.
type Cost = fn(&Measured, Option<usize>) -> f64;

const SAMPLES: Cost = |row, _| row.spp.into();
const TIME: Cost = |row, left_out| row.seconds(left_out);

/// The comparison of each sampler with the one whose last error is the largest, in a line each.
fn verdicts(curves: &[Curve], with_times: bool) -> String {
    // All have this number of rows, unless the measurement was interrupted.
    let rows = curves.iter().map(|curve| curve.rows.len()).min().unwrap_or(0);
    let Some(last) = rows.checked_sub(1) else { return String::new() };
    let error = |curve: &Curve| curve.rows[last].root(ALL, None);
    let Some(worst) = curves.iter().max_by(|a, b| error(a).total_cmp(&error(b))) else {
        return String::new();
    };
    let (spp, seeds) = (worst.rows[last].spp, worst.rows[last].squares.len());
    let mut lines = String::new();
    for other in curves.iter().filter(|other| other.name() != worst.name()) {
        let of = |cost: Cost| {
            let ratio =
                |left_out| advantage(&worst.costs(rows, cost, left_out), &other.costs(rows, cost, left_out));
            Some(Estimate { value: ratio(None)?, deviation: standard_error(seeds, |seed| ratio(Some(seed))) })
        };
        let (name, worst_name) = (other.name(), worst.name());
        let at = format!(
            "RMS error {} ({worst_name} with {})",
            significant(error(worst), 4),
            counted(spp.into(), "sample per pixel", "samples per pixel")
        );
        let Some(samples) = of(SAMPLES) else {
            let first = &other.rows[0];
            let why = if first.root(ALL, None) < error(worst) {
                let count = counted(first.spp.into(), "sample per pixel", "samples per pixel");
                format!("{name} already has a smaller error with {count}")
            } else {
                format!("the errors of {name} do not give its number of samples")
            };
            lines += &format!("{name} is not compared with {worst_name} at {at}: {why}.\n");
            continue;
        };
        let (insignificantly, unknown) = match samples.deviation {
            Some(deviation) if samples.value - 1.0 <= 2.0 * deviation => {
                ("does not differ significantly: it ", "")
            }
            Some(_) => ("", ""),
            None => ("", "; without ± it is unknown whether the difference is significant"),
        };
        let time = with_times.then(|| match of(TIME) {
            Some(time) if time.value < 1.0 => {
                format!(
                    "; by the measured times it takes {} times as long",
                    describe_ratio(time.reciprocal())
                )
            }
            Some(time) => {
                format!("; by the measured times it needs {} times less time", describe_ratio(time))
            }
            None => "; the measured times do not give its time at that error".to_owned(),
        });
        lines += &format!(
            "{name} {insignificantly}needs {} times fewer samples than {worst_name} at {at}{}{unknown}.\n",
            describe_ratio(samples),
            time.unwrap_or_default()
        );
    }
    lines
}

/// "3.10 ± 0.12".
fn describe_ratio(Estimate { value, deviation }: Estimate) -> String {
    let deviation = deviation.map_or_else(String::new, |deviation| format!(" ± {deviation:.2}"));
    format!("{value:.2}{deviation}")
}

pub(super) fn run(arguments: &NoiseArguments) -> Result<(), Failure> {
    let spp = arguments.common.spp;
    let steps: Vec<u32> = (0..32).map(|power| 1 << power).take_while(|&step| step <= spp).collect();
    let most = steps.last().copied().unwrap_or(1);
    let reference_spp = arguments.reference_spp.unwrap_or(most * FACTOR);
    if reference_spp <= most {
        return Err(usage(format!(
            "--reference-spp {reference_spp} is too small for {}; set it to many times as many",
            counted(most.into(), "sample per pixel", "samples per pixel")
        )));
    }
    let first = arguments.first_spp.next_power_of_two();
    if first > most {
        return Err(usage(format!(
            "--first-spp {} is above the largest measured number, {most}",
            arguments.first_spp
        )));
    }
    if let Some(path) = &arguments.reference {
        reference::check_name(path)?;
    }
    let bench = Bench::open(&arguments.common)?;
    let threads = threads_or_cores(arguments.threads);
    let samplers = arguments.common.scene.samplers().unwrap_or_else(|| vec![bench.scene.render.sampler]);
    let (first_seed, seeds) = (bench.scene.render.seed, arguments.repeat);
    let planned = Planned { samplers: &samplers, first_seed, seeds, most };
    let reference = match &arguments.reference {
        Some(path) => Some(reference::read(path, &bench, planned)?),
        None => reference::render(&bench, reference_spp, planned, threads)?,
    };
    let (curves, source) = match &reference {
        Some(reference) => {
            let rows = measure(&bench, arguments, &samplers, &steps, &reference.picture)?;
            let curves = rows.into_iter().map(|rows| Curve::new(rows, first)).collect();
            (curves, format!("Reference: {}", reference.about))
        }
        None => (Vec::new(), String::new()),
    };

    let seeds = counted(seeds.into(), "seed", "seeds");
    let circumstances = bench.circumstances_of(&samplers, &[bench.depth(), seeds.clone()]);
    let mut remarks = format!("\n{source}\n");
    for curve in &curves {
        let [all, rest] = curve.slopes.map(describe_slope);
        let last = curve.rows.last().map_or(most, |row| row.spp);
        let from = format!("{} from {first} to {last} samples", curve.name());
        remarks += &format!("Slope of {from}: {all}; {WITHOUT_WORST}: {rest}\n");
    }
    remarks += &verdicts(&curves, arguments.times);
    if arguments.times {
        remarks += &format!(
            "Times were measured with {}; they differ from run to run.\n",
            counted(threads.get() as u64, "thread", "threads")
        );
    }
    remarks += &match arguments.repeat {
        1 => "There is no ± with --repeat 1: it is the standard error over several seeds.\n".to_owned(),
        _ => format!(
            "± is the standard error over {seeds}. It does not include the error of the reference or the misfit of the line.\n"
        ),
    };
    let chart = chart(&curves, &format!("{circumstances}\n{source}"), arguments.times);
    bench.publish(&circumstances, &table(&curves, first, arguments.times), &remarks, &chart)
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
                let seconds = report.totals.elapsed.as_secs_f64();
                row.squares.push(Squares { all, without_worst, seconds });
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

/// "−0.501 ± 0.002".
fn describe_exponent(Estimate { value, deviation }: Estimate) -> String {
    let deviation = deviation.map_or_else(String::new, |deviation| format!(" ± {deviation:.3}"));
    format!("{value:.3}{deviation}").replace('-', "−")
}

/// One row for each sampler and number of samples. The slopes are in all rows of the sampler. Only times depend on
/// anything but the settings, so without them the table is the same in every run.
fn table(curves: &[Curve], first: u32, with_times: bool) -> Table {
    let mut columns = vec![("Sampler", "sampler"), ("Samples", "spp")];
    if with_times {
        columns.push(("Time", "seconds"));
    }
    columns.extend([
        ("RMS error", "rms_error"),
        ("", "rms_error_standard_error"),
        ("Error × √samples", "rms_error_times_root_spp"),
        ("Local slope", "local_slope"),
        ("", "local_slope_standard_error"),
        ("Without worst 0.5%", "rms_error_without_worst"),
        ("", "rms_error_without_worst_standard_error"),
        ("", "rms_error_without_worst_times_root_spp"),
        ("", "slope_from_spp"),
        ("", "slope"),
        ("", "slope_standard_error"),
        ("", "slope_without_worst"),
        ("", "slope_without_worst_standard_error"),
    ]);
    let mut table = Table::new(&columns);
    let number = |value: Option<f64>| value.map_or_else(Cell::nothing, |value| Cell::new("", value));
    for curve in curves {
        for (i, row) in curve.rows.iter().enumerate() {
            let errors = |which: Which| {
                let error = row.error(which);
                let scaled = error.value * f64::from(row.spp).sqrt();
                let shown = Cell::new(describe(error), error.value);
                [shown, number(error.deviation), Cell::new(significant(scaled, 4), scaled)]
            };
            let local = i.checked_sub(1).and_then(|before| local_slope(&curve.rows[before], row));
            let shown = |local: Estimate| Cell::new(describe_exponent(local), local.value);
            let local = [local.map_or_else(Cell::nothing, shown), number(local.and_then(|l| l.deviation))];
            let mut cells = vec![Cell::word(row.sampler.name()), Cell::count(row.spp)];
            cells.extend(with_times.then(|| Cell::seconds(row.seconds(None))));
            cells.extend(errors(ALL).into_iter().chain(local).chain(errors(REST)));
            cells.push(Cell::count(first));
            for slope in curve.slopes {
                cells.push(number(slope.map(|slope| slope.fit.slope)));
                cells.push(number(slope.and_then(|slope| slope.deviation)));
            }
            table.push(cells);
        }
    }
    table
}

/// "−0.501 ± 0.002 (R² 0.9998)".
fn describe_slope(slope: Option<Slope>) -> String {
    let Some(Slope { fit: Fit { slope, explained }, deviation }) = slope else {
        return "none, because a line needs three errors above zero".to_owned();
    };
    format!("{} (R² {explained:.4})", describe_exponent(Estimate { value: slope, deviation }))
}

/// A chart of the errors of all pixels. Without the worst pixels slopes are biased, so that chart and table would seem to
/// disagree.
fn chart(curves: &[Curve], circumstances: &str, with_times: bool) -> Chart {
    let cost = if with_times { TIME } else { SAMPLES };
    let measured = |curve: &Curve| {
        let point = |row: &Measured| {
            let Estimate { value: y, deviation } = row.error(ALL);
            // A whisker down to zero has no end on a logarithmic axis.
            let range =
                deviation.filter(|deviation| *deviation < y).map(|deviation| [y - deviation, y + deviation]);
            Point { range, ..Point::at(cost(row, None), y) }
        };
        let slope =
            curve.slopes[0].map(|slope| Estimate { value: slope.fit.slope, deviation: slope.deviation });
        // The slope is that against samples.
        let slope = slope.filter(|_| !with_times);
        let slope = slope.map(|slope| format!(": slope {}", describe_exponent(slope)));
        let label = format!("{}{}", curve.name(), slope.unwrap_or_default());
        Series { label, points: curve.rows.iter().map(point).collect(), style: Style::Measured }
    };
    let mut series: Vec<Series> = curves.iter().map(measured).collect();
    // Beside the highest curve, so that neither hides the other, and across the whole chart. Its height is the
    // curve's mean on these axes, so that neither end appears as the reference.
    let level = |Curve { rows, .. }: &Curve| {
        let logarithm = |row: &Measured| (row.error(ALL).value * cost(row, None).sqrt()).ln();
        (rows.iter().map(logarithm).sum::<f64>() / rows.len() as f64).exp()
    };
    let steps = curves.iter().flat_map(|curve| &curve.rows).map(|row| cost(row, None));
    let level = 1.15 * curves.iter().map(level).fold(0.0, f64::max);
    if let (Some(first), Some(last)) = (steps.clone().min_by(f64::total_cmp), steps.max_by(f64::total_cmp)) {
        let at = |cost: f64| cost.sqrt().recip();
        let ends = [(first / 4.0, 2.0 * at(first)), (last * 4.0, at(last) / 2.0)];
        let points = ends.map(|(cost, error)| Point::at(cost, level * error)).to_vec();
        series.push(Series { label: "slope −½".to_owned(), points, style: Style::Guide });
    }
    let (title, x) = match with_times {
        false => ("samples", Axis { label: "Samples per pixel".to_owned(), scale: Scale::Binary }),
        true => ("time", Axis { label: "Measured time of a picture (s)".to_owned(), scale: Scale::Decimal }),
    };
    Chart {
        title: format!("Error against {title}"),
        subtitle: circumstances.to_owned(),
        x,
        y: Axis { label: "RMS error (W·m⁻²·sr⁻¹)".to_owned(), scale: Scale::Decimal },
        series,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of 1/√(n·factor) at 1 to 256 samples, that of each seed off by a share, in times of n·pace.
    fn curve(sampler: Sampler, factor: f64, pace: f64, shares: &[f64]) -> Curve {
        let row = |power: u32| {
            let n = f64::from(1_u32 << power);
            let square = |share: &f64| {
                let all = (1.0 + share) / (n * factor);
                Squares { all, without_worst: all, seconds: n * pace }
            };
            Measured { sampler, spp: 1 << power, squares: shares.iter().map(square).collect() }
        };
        Curve::new((0..9).map(row).collect(), 1)
    }

    #[test]
    fn the_verdict_compares_costs_at_an_equal_error() {
        let same = [0.0; 4];
        let independent = || curve(Sampler::Independent, 1.0, 0.5, &same);
        let place = "at RMS error 0.06250 (independent with 256 samples per pixel)";
        let at = format!("than independent {place}.\n");
        let curves = [curve(Sampler::Sobol, 3.1, 1.0, &same), independent()];
        assert_eq!(verdicts(&curves, false), format!("sobol needs 3.10 ± 0.00 times fewer samples {at}"));
        // Half as fast for each sample, it takes 2/3.1 of the time.
        let timed = |time: &str| {
            let needs = "sobol needs 3.10 ± 0.00 times fewer samples";
            format!("{needs} than independent {place}; by the measured times it {time}.\n")
        };
        assert_eq!(verdicts(&curves, true), timed("needs 1.55 ± 0.00 times less time"));
        // With ten times the time for each sample, it takes 10/3.1 of the time.
        let curves = [curve(Sampler::Sobol, 3.1, 5.0, &same), independent()];
        assert_eq!(verdicts(&curves, true), timed("takes 3.23 ± 0.00 times as long"));
        // A factor of 1.1 is less than its error, which is that of the mean of four shares of standard deviation 0.23.
        let noisy = curve(Sampler::Sobol, 1.1, 1.0, &[0.2, -0.2, 0.2, -0.2]);
        let said = verdicts(&[noisy, independent()], false);
        assert_eq!(
            said,
            format!("sobol does not differ significantly: it needs 1.10 ± 0.13 times fewer samples {at}")
        );
        // Without several seeds, and without a second sampler.
        let [one, other] =
            [(Sampler::Sobol, 2.0), (Sampler::Independent, 1.0)].map(|(s, f)| curve(s, f, 1.0, &[0.0]));
        let unknown = "without ± it is unknown whether the difference is significant";
        assert_eq!(
            verdicts(&[one, other], false),
            format!("sobol needs 2.00 times fewer samples than independent {place}; {unknown}.\n")
        );
        // Where one sample is already better, and where all errors are zero.
        let best = curve(Sampler::Sobol, 1000.0, 1.0, &same);
        assert_eq!(
            verdicts(&[best, independent()], false),
            format!(
                "sobol is not compared with independent {place}: sobol already has a smaller error with 1 sample per pixel.\n"
            )
        );
        let exact = [Sampler::Sobol, Sampler::Independent].map(|s| curve(s, f64::INFINITY, 1.0, &same));
        assert!(verdicts(&exact, false).contains("do not give its number of samples"));
        assert_eq!(verdicts(&[independent()], false), "");
        assert_eq!(verdicts(&[], false), "");
    }

    #[test]
    fn a_reciprocal_has_the_error_of_its_figure() {
        let of = |value, deviation| describe_ratio(Estimate { value, deviation }.reciprocal());
        assert_eq!(of(0.65, Some(0.02)), "1.54 ± 0.05");
        assert_eq!(of(0.5, None), "2.00");
    }
}
