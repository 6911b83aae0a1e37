//! `stride fleet local`: a NATS server and workers on this machine, for trying.

use super::broker::Notices;
use super::failure::Failure;
use super::stop;
use super::submit::JobArguments;
use crate::fleet::{self, LocalFleet};
use clap::Subcommand;
use std::ffi::OsString;

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
    /// Run a program until standard input is closed
    #[command(hide = true)]
    Keep {
        /// Program and its arguments
        #[arg(last = true, required = true)]
        command: Vec<OsString>,
    },
}

pub(super) fn run(arguments: &FleetArguments) -> Result<(), Failure> {
    let (job, workers) = match &arguments.command {
        FleetCommand::Local { job, workers } => (job, workers),
        FleetCommand::Keep { command } => {
            let [program, arguments @ ..] = &command[..] else { return Ok(()) };
            return Ok(fleet::keep(program, arguments)?);
        }
    };
    let fleet = LocalFleet { workers: usize::from(*workers), submission: job.submission(false)? };
    let stop = stop::handler()?;
    let mut notices = Notices::new(job.quiet());
    Ok(fleet::local(&fleet, &stop, &mut |notice| notices.tell(notice))?)
}
