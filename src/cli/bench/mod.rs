//! `stride bench`: the report's measurements (§6.1), as tables, CSV and charts.

mod depth;
mod measurement;
mod noise;
mod reference;
mod statistics;
mod table;
mod threads;
mod verdict;

use super::failure::Failure;

#[derive(Debug, clap::Args)]
pub(super) struct BenchArguments {
    #[command(subcommand)]
    what: BenchCommand,
}

#[derive(Debug, clap::Subcommand)]
enum BenchCommand {
    /// Time against the number of threads (report table 6.1)
    Threads(threads::ThreadsArguments),
    /// Time against the number of bounces (report table 6.2)
    Depth(depth::DepthArguments),
    /// Error against samples per pixel, with the slope on logarithmic axes
    Noise(noise::NoiseArguments),
}

pub(super) fn run(arguments: &BenchArguments) -> Result<(), Failure> {
    match &arguments.what {
        BenchCommand::Threads(arguments) => threads::run(arguments),
        BenchCommand::Depth(arguments) => depth::run(arguments),
        BenchCommand::Noise(arguments) => noise::run(arguments),
    }
}
