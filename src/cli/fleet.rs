//! `stride fleet local`: a NATS server and workers on this machine, for trying.

use super::broker::Notices;
use super::failure::Failure;
use super::stop;
use super::submit::JobArguments;
use crate::fleet::{self, LocalFleet};
use clap::Subcommand;

#[derive(Debug, clap::Args)]
pub(super) struct FleetArguments {
    #[command(subcommand)]
    command: FleetCommand,
}

#[derive(Debug, Subcommand)]
enum FleetCommand {
    /// Start nats-server and workers on this machine, render a scene with them, and end them
    Local {
        #[command(flatten)]
        job: Box<JobArguments>,
        /// Workers, each with its share of the cores
        #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=64))]
        workers: u16,
    },
}

pub(super) fn run(arguments: &FleetArguments) -> Result<(), Failure> {
    let FleetCommand::Local { job, workers } = &arguments.command;
    let fleet = LocalFleet { workers: usize::from(*workers), submission: job.submission(false)? };
    let stop = stop::handler()?;
    let mut notices = Notices::new(job.quiet());
    Ok(fleet::local(&fleet, &stop, &mut |notice| notices.tell(notice))?)
}
