//! `stride bench depth`: the cost of additional bounces (report table 6.2).

use super::measurement::{Bench, CommonArguments, Times, Verbosity, repeats, threads_or_cores};
use super::table::{Cell, Table, significant};
use crate::cli::failure::{Failure, usage};
use crate::output::plot::{Axis, Chart, Point, Scale, Series, Style};
use crate::scene::MOST_BOUNCES;
use crate::session::MOST_THREADS;

#[derive(Debug, clap::Args)]
pub(super) struct DepthArguments {
    #[command(flatten)]
    common: CommonArguments,
    /// Maximum numbers of bounces to measure
    #[arg(long, allow_hyphen_values = true, value_name = "N,N,…", value_delimiter = ',', default_value = "2,3,5", value_parser = clap::value_parser!(u32).range(0..=MOST_BOUNCES.into()))]
    depths: Vec<u32>,
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)),
        help = format!("Rendering threads, 1 to {MOST_THREADS} [default: one per core]"))]
    threads: Option<u16>,
    /// Runs per setting; the median is reported
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeat: u16,
}

/// One row of the table.
struct Measured {
    depth: u32,
    samples: u64,
    rays: u64,
    times: Times,
}

pub(super) fn run(arguments: &DepthArguments) -> Result<(), Failure> {
    if arguments.common.scene.max_depth.is_some() {
        return Err(usage("--max-depth has no effect here; set the depths to measure with --depths"));
    }
    let bench = Bench::open(&arguments.common)?;
    let rows = measure(&bench, arguments)?;
    let mut circumstances = vec![bench.spp()];
    circumstances.extend(repeats(arguments.repeat));
    let circumstances = bench.circumstances(&circumstances);
    let chart = chart(&rows, &circumstances);
    bench.publish(&circumstances, &table(&rows), "", &chart)
}

/// Measures until all runs are done or Ctrl-C is pressed; each round measures every depth once.
fn measure(bench: &Bench, arguments: &DepthArguments) -> Result<Vec<Measured>, Failure> {
    let threads = threads_or_cores(arguments.threads);
    let mut depths = arguments.depths.clone();
    depths.sort_unstable();
    depths.dedup();
    bench.warm_up(threads)?;
    let mut rows: Vec<Measured> = depths
        .iter()
        .map(|&depth| Measured { depth, samples: 0, rays: 0, times: Times::default() })
        .collect();
    'rounds: for round in 1..=arguments.repeat {
        for row in &mut rows {
            let mut scene = bench.scene.clone();
            scene.render.max_depth = row.depth;
            let report = bench.render(scene, bench.arguments.spp, threads, Verbosity::Quiet)?;
            let Some(report) = report else { break 'rounds };
            let seconds = report.totals.elapsed.as_secs_f64();
            (row.samples, row.rays) = (report.totals.samples, report.totals.rays);
            row.times.0.push(seconds);
            let (depth, repeat) = (row.depth, arguments.repeat);
            bench.print_progress(&format!(
                "depth {depth}, run {round} of {repeat}: {} s",
                significant(seconds, 3)
            ));
        }
    }
    rows.retain(|row| !row.times.is_empty());
    Ok(rows)
}

fn table(rows: &[Measured]) -> Table {
    let mut table = Table::new(&[
        ("Depth", "depth"),
        ("Time", "seconds"),
        ("Time ÷ depth", "seconds_per_depth"),
        ("Msamples/s", "samples_per_second"),
        ("Rays/sample", "rays_per_sample"),
        ("", "fastest_seconds"),
        ("", "slowest_seconds"),
        ("", "runs"),
    ]);
    for row in rows {
        let seconds = row.times.median();
        let rate = row.samples as f64 / seconds;
        let shares = seconds / f64::from(row.depth);
        table.push(vec![
            Cell::count(row.depth),
            Cell::seconds(seconds),
            if row.depth == 0 { Cell::nothing() } else { Cell::seconds(shares) },
            Cell::new(significant(rate / 1e6, 3), rate),
            Cell::measured(row.rays as f64 / row.samples as f64, ""),
            Cell::seconds(row.times.fastest()),
            Cell::seconds(row.times.slowest()),
            Cell::count(row.times.0.len() as u32),
        ]);
    }
    table
}

fn chart(rows: &[Measured], circumstances: &str) -> Chart {
    let measured = rows.iter().map(|row| {
        let y = row.times.median();
        let range = (row.times.0.len() > 1).then(|| [row.times.fastest(), row.times.slowest()]);
        Point { x: row.depth.into(), y, range, note: format!("{} s", significant(y, 3)) }
    });
    let measured: Vec<Point> = measured.collect();
    let mut series = vec![Series {
        label: "measured".to_owned(),
        points: measured.clone(),
        style: Style::MeasuredNotesBelow,
    }];
    // In a path that meets more mirrors than lamps, each bounce costs the same at any depth.
    let first = measured.iter().find(|point| point.x > 0.0);
    if let (Some(first), Some(last)) = (first, measured.last()) {
        let end = Point::at(last.x, first.y / first.x * last.x);
        let label = format!("proportional to depth, from depth {}", first.x);
        series.push(Series { label, points: vec![Point::at(0.0, 0.0), end], style: Style::Guide });
    }
    Chart {
        title: "Time against depth".to_owned(),
        subtitle: circumstances.to_owned(),
        x: Axis { label: "Maximum number of bounces".to_owned(), scale: Scale::Whole },
        y: Axis { label: "Time (s)".to_owned(), scale: Scale::Linear },
        series,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_the_reports_columns() {
        let row = |depth, seconds| Measured { depth, samples: 1000, rays: 2500, times: Times(vec![seconds]) };
        let text = table(&[row(0, 30.0), row(2, 46.0), row(5, 85.0)]).to_string();
        let lines: Vec<Vec<&str>> =
            text.lines().skip(1).map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[0][3], "–");
        assert_eq!(lines[1][..5], ["2", "46.0", "s", "23.0", "s"]);
        assert_eq!(lines[2][..5], ["5", "85.0", "s", "17.0", "s"]);
        assert_eq!(lines[2][6], "2.50");
    }
}
