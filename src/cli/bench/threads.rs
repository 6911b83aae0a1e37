//! `stride bench threads`: the speed-up with more threads (report table 6.1).

use super::measurement::{Bench, CommonArguments, Times, Verbosity, counted, repeats};
use super::table::{Cell, Table, significant};
use crate::cli::failure::{Failure, usage};
use crate::output::plot::{Axis, Chart, Point, Scale, Series, Style};
use crate::session::MOST_THREADS;
use std::num::NonZeroUsize;

#[derive(Debug, clap::Args)]
pub(super) struct ThreadsArguments {
    #[command(flatten)]
    common: CommonArguments,
    #[arg(long, allow_hyphen_values = true, value_name = "N,N,…", value_delimiter = ',', default_value = "1,2,4,8", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)),
        help = format!("Numbers of threads, each 1 to {MOST_THREADS}"))]
    threads: Vec<u16>,
    /// Runs per setting; the median is reported
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeat: u16,
}

/// One row of the table.
struct Measured {
    threads: u16,
    samples: u64,
    times: Times,
}

pub(super) fn run(arguments: &ThreadsArguments) -> Result<(), Failure> {
    let bench = Bench::open(&arguments.common)?;
    let mut threads = arguments.threads.clone();
    threads.sort_unstable();
    threads.dedup();
    let pixels = u64::from(bench.scene.film.width) * u64::from(bench.scene.film.height);
    if let Some(idle) = threads.iter().find(|&&threads| u64::from(threads) > pixels) {
        return Err(usage(format!(
            "--threads {idle}: the picture has only {pixels} pixels, and each thread needs one"
        )));
    }
    let rows = measure(&bench, &threads, arguments.repeat)?;

    let mut circumstances = vec![bench.depth(), bench.spp()];
    circumstances.extend(repeats(arguments.repeat));
    let circumstances = bench.circumstances(&circumstances);
    let chart = chart(&rows, &circumstances);
    let remarks = match rows.first() {
        Some(first) if first.threads > 1 => {
            format!("\nEfficiency is relative to {} threads.\n", first.threads)
        }
        _ => String::new(),
    };
    bench.publish(&circumstances, &table(&rows), &remarks, &chart)
}

/// Measures until all runs are done or Ctrl-C is pressed. Each round measures every number of threads once, so that a
/// machine that becomes slower as it warms up affects all of them.
fn measure(bench: &Bench, threads: &[u16], repeat: u16) -> Result<Vec<Measured>, Failure> {
    let spp = bench.arguments.spp;
    let size = |threads: u16| NonZeroUsize::new(threads.into()).unwrap_or(NonZeroUsize::MIN);
    bench.warm_up(size(threads.last().copied().unwrap_or(1)))?;
    let mut rows: Vec<Measured> =
        threads.iter().map(|&threads| Measured { threads, samples: 0, times: Times::default() }).collect();
    'rounds: for round in 1..=repeat {
        for row in &mut rows {
            let report = bench.render(bench.scene.clone(), spp, size(row.threads), Verbosity::Quiet)?;
            let Some(report) = report else { break 'rounds };
            let seconds = report.totals.elapsed.as_secs_f64();
            row.samples = report.totals.samples;
            row.times.0.push(seconds);
            let threads = counted(row.threads.into(), "thread", "threads");
            bench.print_progress(&format!(
                "{threads}, run {round} of {repeat}: {} s",
                significant(seconds, 3)
            ));
        }
    }
    rows.retain(|row| !row.times.is_empty());
    Ok(rows)
}

/// The speed relative to one thread, assuming that the first row scales perfectly.
fn speed_up(first: &Measured, seconds: f64) -> f64 {
    f64::from(first.threads) * first.times.median() / seconds
}

fn table(rows: &[Measured]) -> Table {
    let mut table = Table::new(&[
        ("Threads", "threads"),
        ("Time", "seconds"),
        ("Time × threads", "seconds_times_threads"),
        ("Msamples/s", "samples_per_second"),
        ("Efficiency", "efficiency"),
        ("", "fastest_seconds"),
        ("", "slowest_seconds"),
        ("", "runs"),
    ]);
    for row in rows {
        let (threads, seconds) = (f64::from(row.threads), row.times.median());
        let rate = row.samples as f64 / seconds;
        let efficiency = speed_up(&rows[0], seconds) / threads;
        table.push(vec![
            Cell::count(row.threads.into()),
            Cell::seconds(seconds),
            Cell::seconds(seconds * threads),
            Cell::new(significant(rate / 1e6, 3), rate),
            Cell::new(format!("{:.1}%", 100.0 * efficiency), efficiency),
            Cell::seconds(row.times.fastest()),
            Cell::seconds(row.times.slowest()),
            Cell::count(row.times.0.len() as u32),
        ]);
    }
    table
}

fn chart(rows: &[Measured], circumstances: &str) -> Chart {
    let measured = rows.iter().map(|row| {
        let speed_up = |seconds: f64| speed_up(&rows[0], seconds);
        let y = speed_up(row.times.median());
        let range = [speed_up(row.times.slowest()), speed_up(row.times.fastest())];
        let range = (row.times.0.len() > 1).then_some(range);
        Point { x: row.threads.into(), y, range, note: format!("{}×", significant(y, 3)) }
    });
    let most = rows.last().map_or(1.0, |row| f64::from(row.threads));
    let ideal = vec![Point::at(0.0, 0.0), Point::at(most, most)];
    Chart {
        title: "Speed-up with threads".to_owned(),
        subtitle: circumstances.to_owned(),
        x: Axis { label: "Threads".to_owned(), scale: Scale::Whole },
        y: Axis { label: "Speed relative to one thread".to_owned(), scale: Scale::Linear },
        series: vec![
            Series {
                label: "measured".to_owned(),
                points: measured.collect(),
                style: Style::MeasuredNotesBelow,
            },
            Series { label: "ideal: proportional to threads".to_owned(), points: ideal, style: Style::Guide },
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(threads: u16, seconds: &[f64]) -> Measured {
        Measured { threads, samples: 1_000_000, times: Times(seconds.to_vec()) }
    }

    #[test]
    fn the_table_has_the_reports_columns() {
        let rows = [row(1, &[73.0]), row(2, &[37.4]), row(4, &[20.2]), row(8, &[20.0])];
        let text = table(&rows).to_string();
        let lines: Vec<Vec<&str>> =
            text.lines().skip(1).map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[0], ["1", "73.0", "s", "73.0", "s", "0.0137", "100.0%"]);
        assert_eq!(lines[2], ["4", "20.2", "s", "80.8", "s", "0.0495", "90.3%"]);
        assert_eq!(lines[3][3..5], ["160", "s"]);
    }

    #[test]
    fn without_one_thread_the_smallest_number_is_the_reference() {
        let rows = [row(2, &[10.0]), row(4, &[5.0])];
        assert!((speed_up(&rows[0], 5.0) - 4.0).abs() < 1e-12);
    }
}
