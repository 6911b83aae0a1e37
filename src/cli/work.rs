//! `stride work`: renders units of the jobs on a NATS server.

use super::arguments::duration;
use super::broker::{BrokerArguments, Notices, default_cache};
use super::failure::Failure;
use super::render::device;
use super::stop;
use crate::fleet::{self, WorkerSettings};
use crate::session::{DeviceChoice, MOST_THREADS};
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub(super) struct WorkArguments {
    #[command(flatten)]
    broker: BrokerArguments,
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)),
        help = format!("Rendering threads, 1 to {MOST_THREADS} [default: one per core]"))]
    threads: Option<u16>,
    /// Devices that this worker offers: cpu, gpu, or all for both. A job says which of them it needs
    #[arg(long, value_name = "DEVICE", value_parser = device, default_value = "cpu")]
    device: DeviceChoice,
    /// Name of this worker, unique among the workers of the server [default: the machine's name and a random part]
    #[arg(long, value_name = "NAME", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    name: Option<String>,
    /// Folder with the files of scenes [default: stride in the user's cache folder]
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,
    /// Size of this folder, and of the files of one scene at most, in GiB
    #[arg(long, value_name = "GIB", default_value_t = 16)]
    cache_size: u32,
    /// Time to finish a unit when the worker is asked to end; a longer one is handed back
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = duration, default_value = "20s")]
    grace: Duration,
    /// End when no job is open
    #[arg(long)]
    until_idle: bool,
    /// Print only errors and warnings
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(arguments: &WorkArguments) -> Result<(), Failure> {
    let settings = WorkerSettings {
        name: arguments.name.clone(),
        threads: arguments.threads.map(usize::from),
        device: arguments.device.clone(),
        cache: arguments.cache.clone().unwrap_or_else(default_cache),
        cache_bytes: u64::from(arguments.cache_size) << 30,
        grace: arguments.grace,
        ends_when_idle: arguments.until_idle,
    };
    let stop = stop::handler()?;
    let mut notices = Notices::new(arguments.quiet);
    Ok(fleet::work(&arguments.broker.server(), &settings, &stop, &mut |notice| notices.tell(notice))?)
}
