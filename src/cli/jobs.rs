//! `stride jobs`: lists and changes the jobs on a NATS server, and collects one.

use super::broker::{BrokerArguments, Notices};
use super::failure::{Failure, usage};
use super::print::print;
use super::stop;
use super::submit::OutputArguments;
use crate::fleet::{self, JobSummary, Notice};
use clap::Subcommand;

#[derive(Debug, clap::Args)]
pub(super) struct JobsArguments {
    #[command(subcommand)]
    command: JobsCommand,
}

#[derive(Debug, Subcommand)]
enum JobsCommand {
    /// List the jobs, those that are rendered first at the top
    List {
        #[command(flatten)]
        broker: BrokerArguments,
    },
    /// Show the progress of a job until it is over
    Watch {
        /// Job
        job: String,
        #[command(flatten)]
        broker: BrokerArguments,
    },
    /// Cancel a job; its collector writes the samples so far
    Cancel {
        /// Job
        job: String,
        #[command(flatten)]
        broker: BrokerArguments,
    },
    /// Remove a job that is done or cancelled from the server, with its files
    Remove {
        /// Job
        job: String,
        #[command(flatten)]
        broker: BrokerArguments,
    },
    /// Collect the results of a job, and write its outputs
    Collect {
        /// Job
        job: String,
        #[command(flatten)]
        outputs: Box<OutputArguments>,
        #[command(flatten)]
        broker: BrokerArguments,
        /// Print only errors and warnings about the result
        #[arg(short, long)]
        quiet: bool,
    },
    /// Request more samples; a job that is done continues with the next collect
    Extend {
        /// Job
        job: String,
        /// Samples per pixel
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
        spp: u32,
        #[command(flatten)]
        broker: BrokerArguments,
    },
    /// Change the priority of a job
    Priority {
        /// Job
        job: String,
        /// Priority: jobs with a higher number are rendered first
        #[arg(allow_negative_numbers = true)]
        priority: i32,
        #[command(flatten)]
        broker: BrokerArguments,
    },
}

pub(super) fn run(arguments: &JobsArguments) -> Result<(), Failure> {
    match &arguments.command {
        JobsCommand::List { broker } => {
            let jobs = fleet::list(&broker.server())?;
            print(&jobs.iter().map(line).collect::<String>())?;
        }
        JobsCommand::Watch { job, broker } => {
            let (stop, mut notices) = (stop::handler()?, Notices::new(false));
            fleet::watch(&broker.server(), job, &stop, &mut |notice| notices.tell(notice))?;
        }
        JobsCommand::Cancel { job, broker } => {
            if let Some(collector) = fleet::cancel(&broker.server(), job)? {
                Notices::new(false).tell(Notice::Line(format!(
                    "the collector {collector} writes the samples so far; if it has died, remove the job with stride jobs remove {job}"
                )));
            }
        }
        JobsCommand::Remove { job, broker } => fleet::remove(&broker.server(), job)?,
        JobsCommand::Collect { job, outputs, broker, quiet } => {
            let collecting = outputs.collecting(None);
            if collecting.pictures.is_empty() && collecting.film.is_none() {
                return Err(usage("name a file to write: -o FILE or --film FILE.film"));
            }
            let (stop, mut notices) = (stop::handler()?, Notices::new(*quiet));
            fleet::collect(&broker.server(), job, &collecting, &stop, &mut |notice| notices.tell(notice))?;
        }
        JobsCommand::Extend { job, spp, broker } => fleet::extend(&broker.server(), job, *spp)?,
        JobsCommand::Priority { job, priority, broker } => {
            fleet::prioritise(&broker.server(), job, *priority)?;
        }
    }
    Ok(())
}

/// A job on one line.
fn line(job: &JobSummary) -> String {
    let JobSummary { id, name, state, priority, samples: [held, target], noise, collector } = job;
    let target = if *target == u32::MAX { String::new() } else { format!(" of {target}") };
    let noise = noise.map_or(String::new(), |noise| format!(", until the error is {noise}"));
    let collector = collector.as_ref().map_or(String::new(), |owner| format!(", collected by {owner}"));
    format!(
        "{id}  {state}  priority {priority}  {name}: {held}{target} samples per pixel{noise}{collector}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::JobState;

    #[test]
    fn jobs_are_listed_on_a_line() {
        let job = JobSummary {
            id: "j1".into(),
            name: "cover.toml".into(),
            state: JobState::Open,
            priority: 2,
            samples: [16, 64],
            noise: None,
            collector: Some("host-c1".into()),
        };
        let text = "j1  open  priority 2  cover.toml: 16 of 64 samples per pixel, collected by host-c1\n";
        assert_eq!(line(&job), text);
        let endless = JobSummary { samples: [16, u32::MAX], noise: Some(0.01), collector: None, ..job };
        assert!(line(&endless).ends_with("cover.toml: 16 samples per pixel, until the error is 0.01\n"));
    }
}
