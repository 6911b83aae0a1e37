//! A server and workers on this machine, to try a fleet in one command.

use super::submit::submit;
use super::{Stop, Tell};
use crate::fleet::{FleetError, LocalFleet, Notice, Server};
use crossbeam_channel::RecvTimeoutError;
use std::io::ErrorKind;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The time within which the server must have started.
const START: Duration = Duration::from_secs(10);

/// The pause before it is asked for again.
const PAUSE: Duration = Duration::from_millis(20);

/// Programs that end with this value.
struct Programs(Vec<Child>);

impl Drop for Programs {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Starts a server and workers on this machine, renders a scene with them, and ends them.
pub fn local(fleet: &LocalFleet, stop: &Stop, tell: Tell<'_>) -> Result<(), FleetError> {
    let folder = TempDir::new().map_err(|reason| FleetError::File { path: std::env::temp_dir(), reason })?;
    let mut programs = Programs(Vec::new());
    let url = start_server(folder.path(), &mut programs, stop)?;
    let own = std::env::current_exe()
        .map_err(|error| FleetError::Server(format!("workers cannot be started: {error}")))?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (cores / fleet.workers.max(1)).max(1).to_string();
    for worker in 1..=fleet.workers {
        let cache = folder.path().join(format!("cache-{worker}"));
        let child = Command::new(&own)
            .args([
                "work",
                "--quiet",
                "--broker",
                &url,
                "--threads",
                &threads,
                "--name",
                &format!("local-{worker}"),
            ])
            .arg("--cache")
            .arg(cache)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .map_err(|error| FleetError::Server(format!("a worker cannot be started: {error}")))?;
        programs.0.push(child);
    }
    tell(Notice::Line(format!("{} workers with {threads} threads each, server {url}", fleet.workers)));
    let server = Server { url, ..Server::default() };
    submit(&server, &fleet.submission, stop, tell).map(drop)
}

/// Starts a server on a free port. Returns its address.
fn start_server(folder: &Path, programs: &mut Programs, stop: &Stop) -> Result<String, FleetError> {
    let started = Command::new("nats-server")
        .args(["-a", "127.0.0.1", "-p", "-1", "-js"])
        .arg("-sd")
        .arg(folder.join("store"))
        .arg("--ports_file_dir")
        .arg(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let child = started.map_err(|error| match error.kind() {
        ErrorKind::NotFound => FleetError::Server(
            "there is no nats-server on the path; install it (on Debian and Ubuntu the package nats-server)"
                .to_owned(),
        ),
        _ => FleetError::Server(format!("nats-server cannot be started: {error}")),
    })?;
    let ports = folder.join(format!("nats-server_{}.ports", child.id()));
    programs.0.push(child);
    let start = Instant::now();
    while start.elapsed() < START {
        // The file may be half written.
        let text = std::fs::read_to_string(&ports).unwrap_or_default();
        let ports = serde_json::from_str::<serde_json::Value>(&text).unwrap_or_default();
        if let Some(url) = ports["nats"][0].as_str() {
            return Ok(url.to_owned());
        }
        if !matches!(stop.recv_timeout(PAUSE), Err(RecvTimeoutError::Timeout)) {
            break;
        }
    }
    Err(FleetError::Server(format!("nats-server did not start within {} s", START.as_secs())))
}
