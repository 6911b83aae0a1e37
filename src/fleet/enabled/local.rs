//! A server and workers on this machine, to try a fleet in one command.

use super::collect::OnStop;
use super::notes::plain;
use super::submit::submit_with;
use super::{Stop, Tell};
use crate::fleet::{FleetError, LocalFleet, Notice, Server};
use crossbeam_channel::{RecvTimeoutError, bounded};
use std::convert::Infallible;
use std::ffi::{OsStr, OsString};
use std::io::ErrorKind;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The time within which the server must have started.
const START: Duration = Duration::from_secs(30);

/// The pause before it is asked for again.
const PAUSE: Duration = Duration::from_millis(20);

/// The interval at which a keeper looks at its program.
const LOOK: Duration = Duration::from_millis(100);

/// Keepers of programs. They end, and end their programs, with this value and with this program, however it ends.
struct Keepers(Vec<Child>);

impl Drop for Keepers {
    fn drop(&mut self) {
        // All of them first, so that they end together.
        self.0.iter_mut().for_each(|keeper| drop(keeper.stdin.take()));
        for keeper in &mut self.0 {
            let _ = keeper.wait();
        }
    }
}

impl Keepers {
    /// Starts a program.
    fn start(&mut self, program: &OsStr, arguments: &[&OsStr]) -> Result<(), FleetError> {
        let failed = |error| FleetError::Server(format!("{program:?} cannot be started: {error}"));
        let mut command = Command::new(std::env::current_exe().map_err(failed)?);
        command.args(["fleet", "keep", "--"]).arg(program).args(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::null());
        // Ctrl-C is for this program alone, which still needs the others for its end.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        self.0.push(command.spawn().map_err(failed)?);
        Ok(())
    }
}

/// Runs a program until it ends, or standard input is closed: programs of a fleet on this machine end with it.
pub fn keep(program: &OsStr, arguments: &[OsString]) -> Result<(), FleetError> {
    let child = Command::new(program).args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    let mut child = child.map_err(|error| match error.kind() {
        ErrorKind::NotFound => FleetError::Server(format!("there is no {program:?} on the path")),
        _ => FleetError::Server(format!("{program:?} cannot be started: {error}")),
    })?;
    let (closed_out, closed) = bounded::<Infallible>(0);
    std::thread::spawn(move || {
        // Nothing is written to it: it ends when the other program does.
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        drop(closed_out);
    });
    while matches!(closed.recv_timeout(LOOK), Err(RecvTimeoutError::Timeout)) {
        if matches!(child.try_wait(), Ok(Some(_))) {
            return Ok(());
        }
    }
    let _ = child.kill();
    let _ = child.wait();
    Ok(())
}

/// Starts a server and workers on this machine, renders a scene with them, and ends them.
pub fn local(fleet: &LocalFleet, stop: &Stop, tell: Tell<'_>) -> Result<(), FleetError> {
    let folder = TempDir::new().map_err(|reason| FleetError::File { path: std::env::temp_dir(), reason })?;
    let mut keepers = Keepers(Vec::new());
    let url = start_server(folder.path(), &mut keepers, stop)?;
    let own = std::env::current_exe()
        .map_err(|error| FleetError::Server(format!("workers cannot be started: {error}")))?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (cores / fleet.workers.max(1)).max(1).to_string();
    for worker in 1..=fleet.workers {
        let (name, cache) = (format!("local-{worker}"), folder.path().join(format!("cache-{worker}")));
        let fixed = ["work", "--quiet", "--broker", &url, "--threads", &threads, "--name", &name, "--cache"];
        let arguments: Vec<&OsStr> = fixed.iter().map(OsStr::new).chain([cache.as_os_str()]).collect();
        keepers.start(own.as_os_str(), &arguments)?;
    }
    tell(Notice::Line(format!("{} workers with --threads {threads}, server {url}", fleet.workers)));
    let server = Server { url, ..Server::default() };
    submit_with(&server, &fleet.submission, OnStop::End, stop, tell).map(drop)
}

/// Starts a server on a free port. Returns its address.
fn start_server(folder: &Path, keepers: &mut Keepers, stop: &Stop) -> Result<String, FleetError> {
    let found =
        Command::new("nats-server").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if let Err(error) = found {
        return Err(FleetError::Server(match error.kind() {
            ErrorKind::NotFound => {
                "there is no nats-server on the path; install it (on Debian and Ubuntu the package nats-server)".to_owned()
            }
            _ => format!("nats-server cannot be started: {error}"),
        }));
    }
    let (store, log) = (folder.join("store"), folder.join("server.log"));
    let fixed = ["-a", "127.0.0.1", "-p", "-1", "-js", "-sd"].map(OsStr::new);
    let [ports_option, log_option] = ["--ports_file_dir", "-l"].map(OsStr::new);
    let more = [store.as_os_str(), ports_option, folder.as_os_str(), log_option, log.as_os_str()];
    keepers.start(OsStr::new("nats-server"), &[&fixed[..], &more[..]].concat())?;
    let start = Instant::now();
    while start.elapsed() < START {
        if let Some(url) = address(folder) {
            return Ok(url);
        }
        if keepers.0.last_mut().is_some_and(|keeper| matches!(keeper.try_wait(), Ok(Some(_)))) {
            let said = std::fs::read_to_string(&log).unwrap_or_default();
            let last = plain(said.lines().last().unwrap_or_default());
            return Err(FleetError::Server(format!("nats-server ended at once: {last}")));
        }
        if !matches!(stop.recv_timeout(PAUSE), Err(RecvTimeoutError::Timeout)) {
            return Err(FleetError::Job("stopped before the server had started".to_owned()));
        }
    }
    Err(FleetError::Server(format!("nats-server did not start within {} s", START.as_secs())))
}

/// The address of the server, once it has written the file of its ports.
fn address(folder: &Path) -> Option<String> {
    let mut entries = std::fs::read_dir(folder).ok()?.flatten();
    let ports = entries.find(|entry| entry.path().extension().is_some_and(|end| end == "ports"))?;
    // The file may be half written.
    let ports: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(ports.path()).ok()?).ok()?;
    Some(ports["nats"][0].as_str()?.to_owned())
}
