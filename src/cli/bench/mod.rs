//! `stride bench`: the report's measurements (§6.1), as tables, CSV and charts.

mod depth;
mod measurement;
mod noise;
mod table;
mod threads;

use super::failure::Failure;

#[derive(Debug, clap::Args)]
pub(super) struct BenchArguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Time against the number of threads (report table 6.1)
    Threads(threads::ThreadsArguments),
    /// Time against the number of bounces (report table 6.2)
    Depth(depth::DepthArguments),
    /// Error against samples per pixel, with the slope on logarithmic axes
    Noise(noise::NoiseArguments),
}

pub(super) fn run(arguments: &BenchArguments) -> Result<(), Failure> {
    match &arguments.what {
        What::Threads(arguments) => threads::run(arguments),
        What::Depth(arguments) => depth::run(arguments),
        What::Noise(arguments) => noise::run(arguments),
    }
}
