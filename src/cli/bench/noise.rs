//! `stride bench noise`: error against samples per pixel.
//!
//! With independent samples the error falls as 1/√n: a line of slope −½ on logarithmic axes. With `sobol` it falls
//! faster where radiance is smooth. The error is the root of the mean squared difference from a reference that is
//! rendered with another seed and many more samples, so that the two are independent. A reference of R samples has an
//! error of its own: the measured error at n independent samples is √(1 + n/R) times the true error, at most 1.6% too
//! large at the default R of 32 n.

use super::measurement::{Bench, CommonArguments, Verbosity, counted, threads_or_cores};
use super::table::{Cell, Table, significant};
use crate::cli::failure::{Failure, usage};
use crate::film::compare::{mean_without_worst, squared_errors};
use crate::film::noise::WORST;
use crate::output::plot::{Axis, Chart, Point, Scale, Series, Style};
use crate::session::MOST_THREADS;

#[derive(Debug, clap::Args)]
pub(super) struct NoiseArguments {
    #[command(flatten)]
    common: CommonArguments,
    /// Samples per pixel of the reference [default: 32 times the largest measured number]
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 30))]
    reference_spp: Option<u32>,
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)),
        help = format!("Rendering threads, 1 to {MOST_THREADS} [default: one per core]"))]
    threads: Option<u16>,
    /// Seeds over which squared errors are averaged
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeat: u16,
}

/// Samples of the reference per sample of the largest measured picture.
const REFERENCE_FACTOR: u32 = 32;
/// Added to the scene's seed for the reference. The measured pictures count up from the scene's seed. It has no power of
/// two as a factor: samplers hash seeds, and seeds that differ in the highest bit alone give correlated numbers.
const REFERENCE_SEED: u32 = 0x9e37_79b9;

/// One row of the table: root-mean-square errors of radiance.
#[derive(Clone, Copy, Debug)]
struct Measured {
    spp: u32,
    rms: f64,
    without_worst: f64,
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
    let bench = Bench::open(&arguments.common)?;
    let rows = measure(&bench, arguments, &steps, reference_spp)?;

    let mut circumstances = vec![bench.depth(), format!("reference of {reference_spp} samples per pixel")];
    if arguments.repeat > 1 {
        circumstances.push(format!("{} seeds", arguments.repeat));
    }
    let circumstances = bench.circumstances(&circumstances);
    let all = fit(rows.iter().map(|row| (row.spp.into(), row.rms)));
    let rest = fit(rows.iter().map(|row| (row.spp.into(), row.without_worst)));
    let remarks = format!(
        "\nSlope on logarithmic axes: {}; {WITHOUT_WORST}: {}\n",
        describe_fit(all),
        describe_fit(rest)
    );
    let chart = chart(&rows, [all, rest], &circumstances);
    bench.publish(&circumstances, &table(&rows), &remarks, &chart)
}

const WITHOUT_WORST: &str = "without the worst 0.5% of pixels";

/// Renders the reference and then the pictures, until all are done or Ctrl-C is pressed. Each picture is a separate
/// render: it equals the picture of a longer one at that point, and all together take as long as one more.
fn measure(
    bench: &Bench,
    arguments: &NoiseArguments,
    steps: &[u32],
    reference_spp: u32,
) -> Result<Vec<Measured>, Failure> {
    let threads = threads_or_cores(arguments.threads);
    let render = |seed: u32, spp: u32, loudness: Verbosity| {
        let mut scene = bench.scene.clone();
        scene.render.seed = scene.render.seed.wrapping_add(seed);
        bench.render(scene, spp, threads, loudness)
    };
    bench.print_progress(&format!("rendering the reference, {reference_spp} samples per pixel"));
    let Some(reference) = render(REFERENCE_SEED, reference_spp, Verbosity::Progress)? else {
        return Ok(Vec::new());
    };
    let mut rows = Vec::new();
    'steps: for &spp in steps {
        let (mut all, mut rest) = (0.0, 0.0);
        for replicate in 0..arguments.repeat {
            let Some(report) = render(replicate.into(), spp, Verbosity::Quiet)? else { break 'steps };
            let errors = squared_errors(&report.picture, &reference.picture);
            all += mean_without_worst(&errors, 0.0);
            rest += mean_without_worst(&errors, WORST);
        }
        let root = |sum: f64| (sum / f64::from(arguments.repeat)).sqrt();
        let row = Measured { spp, rms: root(all), without_worst: root(rest) };
        let samples = counted(spp.into(), "sample per pixel", "samples per pixel");
        bench.print_progress(&format!("{samples}: RMS error {}", significant(row.rms, 4)));
        rows.push(row);
    }
    Ok(rows)
}

fn table(rows: &[Measured]) -> Table {
    let mut table = Table::new(&[
        ("Samples", "spp"),
        ("RMS error", "rms_error"),
        ("Error × √samples", "rms_error_times_root_spp"),
        ("Without worst 0.5%", "rms_error_without_worst"),
        ("Error × √samples", "rms_error_without_worst_times_root_spp"),
    ]);
    for row in rows {
        let root = f64::from(row.spp).sqrt();
        let cell = |value: f64| Cell::new(significant(value, 4), value);
        table.push(vec![
            Cell::count(row.spp),
            cell(row.rms),
            cell(row.rms * root),
            cell(row.without_worst),
            cell(row.without_worst * root),
        ]);
    }
    table
}

/// A straight line through the logarithms of points.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fit {
    slope: f64,
    /// Standard error of the slope.
    deviation: f64,
    /// The coefficient of determination R², 0 to 1.
    explained: f64,
}

/// Least squares; `None` for fewer than three points, because any line fits two, or if an ordinate has no logarithm.
fn fit(points: impl Iterator<Item = (f64, f64)>) -> Option<Fit> {
    let points: Vec<(f64, f64)> = points.map(|(x, y)| (x.ln(), y.ln())).collect();
    if points.len() < 3 || points.iter().any(|(x, y)| !x.is_finite() || !y.is_finite()) {
        return None;
    }
    let count = points.len() as f64;
    let (mean_x, mean_y) =
        points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / count, y + point.1 / count));
    let sum = |term: &dyn Fn(f64, f64) -> f64| -> f64 {
        points.iter().map(|(x, y)| term(x - mean_x, y - mean_y)).sum()
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    let slope = xy / xx;
    let residual = sum(&|x, y| (y - slope * x).powi(2));
    let deviation = (residual / (count - 2.0) / xx).sqrt();
    let explained = if yy > 0.0 { 1.0 - residual / yy } else { 1.0 };
    Some(Fit { slope, deviation, explained })
}

/// "−0.501 ± 0.002 (R² 0.9998)".
fn describe_fit(fit: Option<Fit>) -> String {
    fit.map_or_else(
        || "none: fewer than three errors are above zero".to_owned(),
        |Fit { slope, deviation, explained }| {
            format!("{slope:.3} ± {deviation:.3} (R² {explained:.4})").replace('-', "−")
        },
    )
}

fn chart(rows: &[Measured], fits: [Option<Fit>; 2], circumstances: &str) -> Chart {
    let named = |name: &str, fit: Option<Fit>| match fit {
        Some(fit) => format!("{name}: slope {:.3}", fit.slope).replace('-', "−"),
        None => name.to_owned(),
    };
    let curve = |label: String, error: fn(&Measured) -> f64| {
        let points = rows.iter().map(|row| Point::at(row.spp.into(), error(row))).collect();
        Series { label, points, style: Style::Measured }
    };
    let mut series = vec![
        curve(named("all pixels", fits[0]), |row| row.rms),
        curve(named("without the worst 0.5%", fits[1]), |row| row.without_worst),
    ];
    if let (Some(first), Some(last)) = (rows.first(), rows.last()) {
        let at = |spp: u32| f64::from(spp).sqrt().recip();
        // Beside the curve, so that neither hides the other, and across the whole chart. Its height is the
        // curve's mean on these axes, so that neither end appears as the reference.
        let logarithms: f64 = rows.iter().map(|row| (row.rms * f64::from(row.spp).sqrt()).ln()).sum();
        let level = 1.15 * (logarithms / rows.len() as f64).exp();
        let ends = [
            (f64::from(first.spp) / 4.0, 2.0 * at(first.spp)),
            (f64::from(last.spp) * 4.0, at(last.spp) / 2.0),
        ];
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_fits_exactly_and_a_bent_one_has_a_deviation() {
        let line = |n: i32| (f64::from(1 << n), 3.0 * f64::from(1 << n).powf(-0.5));
        let found = fit((0..6).map(line)).unwrap();
        assert!((found.slope + 0.5).abs() < 1e-12 && found.deviation < 1e-9 && found.explained > 1.0 - 1e-12);
        // Logarithms 0, 0, −1 at 0, 1, 2: slope −½, residuals 1/6, −1/3, 1/6.
        let bent = [(1.0, 1.0), (1f64.exp(), 1.0), (2f64.exp(), (-1f64).exp())];
        let found = fit(bent.into_iter()).unwrap();
        assert!((found.slope + 0.5).abs() < 1e-12);
        assert!((found.deviation - (1.0f64 / 6.0 / 2.0).sqrt()).abs() < 1e-12);
        assert!((found.explained - 0.75).abs() < 1e-12);
    }

    #[test]
    fn too_few_points_or_no_error_have_no_slope() {
        assert_eq!(fit([(1.0, 1.0), (2.0, 0.5)].into_iter()), None);
        assert_eq!(fit([(1.0, 0.0), (2.0, 0.0), (4.0, 0.0)].into_iter()), None);
    }
}
