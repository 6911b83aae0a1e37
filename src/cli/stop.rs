//! Handles Ctrl-C.

use crate::output::remove_unfinished;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::convert::Infallible;
use std::io::Write;
use std::time::{Duration, Instant};

/// A request within this time after the first is the same one: some programs signal both a process and its process
/// group.
const SAME_REQUEST: Duration = Duration::from_millis(500);

/// Returns a channel that closes at the first Ctrl-C (or request to terminate). The second one ends the program
/// at once, without leaving a partial file.
fn on_interrupt() -> Result<Receiver<Infallible>, ctrlc::Error> {
    on_interrupts_apart(SAME_REQUEST)
}

/// [`on_interrupt`] with an error for the user.
pub(super) fn handler() -> anyhow::Result<Receiver<Infallible>> {
    on_interrupt().map_err(|error| anyhow::anyhow!("the handler of Ctrl-C cannot be installed: {error}"))
}

/// The same, where requests within the time `apart` after the first are the same one.
fn on_interrupts_apart(apart: Duration) -> Result<Receiver<Infallible>, ctrlc::Error> {
    let (sender, receiver) = bounded::<Infallible>(0);
    let mut requests = Requests { open: Some(sender), first: None, apart };
    ctrlc::set_handler(move || {
        if requests.take(Instant::now()) {
            // While the guard exists no other file is begun. If it cannot be obtained in time, the program ends anyway.
            let _none_begins = remove_unfinished();
            let _ = writeln!(std::io::stderr(), "stopped at once; no further files are written");
            // The exit code that a shell reports for a command ended by SIGINT.
            std::process::exit(130);
        }
    })?;
    Ok(receiver)
}

/// The requests to stop so far.
struct Requests {
    /// Closes at the first request.
    open: Option<Sender<Infallible>>,
    first: Option<Instant>,
    /// Requests within this time after the first are the same one.
    apart: Duration,
}

impl Requests {
    /// Records a request at a moment. Returns whether the program is to end at once.
    fn take(&mut self, now: Instant) -> bool {
        let first = *self.first.get_or_insert(now);
        self.open.take().is_none() && now.duration_since(first) > self.apart
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::output::atomic;
    use crossbeam_channel::TryRecvError;
    use std::io::{BufRead, BufReader};
    use std::path::{Path, PathBuf};
    use std::process::{Child, Command, Stdio};

    #[test]
    fn the_first_request_stops_and_only_a_later_one_ends_at_once() {
        let (sender, receiver) = bounded::<Infallible>(0);
        let mut requests = Requests { open: Some(sender), first: None, apart: SAME_REQUEST };
        assert_eq!(receiver.try_recv(), Err(TryRecvError::Empty));
        let first = Instant::now();
        assert!(!requests.take(first));
        assert_eq!(receiver.try_recv(), Err(TryRecvError::Disconnected));
        assert!(!requests.take(first));
        assert!(!requests.take(first + SAME_REQUEST));
        assert!(requests.take(first + SAME_REQUEST + Duration::from_nanos(1)));
    }

    /// The folder of the interrupted program's file: set only in that program.
    const FOLDER: &str = "STRIDE_TEST_INTERRUPTED_IN";

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// The interrupted program: it waits forever in the middle of a file.
    fn be_interrupted(folder: &Path) {
        let stop = on_interrupts_apart(Duration::ZERO).unwrap();
        let _ = atomic::write_atomically(&folder.join("a.png"), |out| {
            out.write_all(b"half")?;
            let _ = writeln!(std::io::stderr(), "writing");
            // The channel closes at the first request.
            let _ = stop.recv();
            let _ = writeln!(std::io::stderr(), "asked to stop");
            let (_open, never) = bounded::<Infallible>(0);
            let _ = never.recv();
            Ok(())
        });
    }

    fn interrupt(child: &Child) {
        let kill = format!("kill -INT {}", child.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    }

    #[test]
    fn a_second_request_leaves_no_partial_file() {
        if let Some(folder) = std::env::var_os(FOLDER) {
            return be_interrupted(&PathBuf::from(folder));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = concat!(module_path!(), "::a_second_request_leaves_no_partial_file");
        let (_, name) = path.split_once("::").unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([name, "--exact", "--nocapture"])
            .env(FOLDER, folder.path())
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let mut wait_for =
            |said: &str| assert!(lines.any(|line| line.unwrap() == said), "never said: {said}");
        wait_for("writing");
        let half = names(folder.path());
        assert!(half.len() == 1 && half[0] != "a.png", "{half:?}");
        interrupt(&child);
        wait_for("asked to stop");
        interrupt(&child);
        wait_for("stopped at once; no further files are written");
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert_eq!(names(folder.path()), Vec::<String>::new());
    }
}
