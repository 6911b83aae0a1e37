//! Ctrl-C.

use crate::output::remove_unfinished;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::convert::Infallible;
use std::io::Write;
use std::time::{Duration, Instant};

/// Requests that follow the first one as fast as this are the same one: some who end a program tell it and its
/// process group, which are two signals.
const SAME_REQUEST: Duration = Duration::from_millis(500);

/// A channel that closes with the first Ctrl-C (or request to terminate); the second one ends the program
/// at once, and leaves no half-written file behind.
pub(super) fn on_interrupt() -> Result<Receiver<Infallible>, ctrlc::Error> {
    on_interrupts_apart(SAME_REQUEST)
}

/// The same, where requests that follow the first one within this time are the same one.
fn on_interrupts_apart(apart: Duration) -> Result<Receiver<Infallible>, ctrlc::Error> {
    let (sender, receiver) = bounded::<Infallible>(0);
    let mut requests = Requests { open: Some(sender), first: None, apart };
    ctrlc::set_handler(move || {
        if requests.take(Instant::now()) {
            // While the guard lives no other file is begun. If there is none in time, the program ends all the same.
            let _none_begins = remove_unfinished();
            let _ = writeln!(std::io::stderr(), "stopped at once; nothing more is written");
            // The exit code of a shell's command that SIGINT ended.
            std::process::exit(130);
        }
    })?;
    Ok(receiver)
}

/// The requests to stop so far.
struct Requests {
    /// Closes with the first.
    open: Option<Sender<Infallible>>,
    first: Option<Instant>,
    /// Requests that follow the first one within this time are the same one.
    apart: Duration,
}

impl Requests {
    /// Takes a request that comes at a moment; whether the program is to end at once.
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
    fn the_first_request_stops_its_echoes_do_nothing_and_a_later_one_ends_at_once() {
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

    /// Where the program that is interrupted writes its file: set in that program only.
    const FOLDER: &str = "STRIDE_TEST_INTERRUPTED_IN";

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// The program that is interrupted: in the middle of a file it waits, for ever.
    fn be_interrupted(folder: &Path) {
        let stop = on_interrupts_apart(Duration::ZERO).unwrap();
        let _ = atomic::write_atomically(&folder.join("a.png"), |out| {
            out.write_all(b"half")?;
            let _ = writeln!(std::io::stderr(), "writing");
            // It closes with the first request.
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
    fn a_second_request_leaves_no_half_written_file() {
        if let Some(folder) = std::env::var_os(FOLDER) {
            return be_interrupted(&PathBuf::from(folder));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = concat!(module_path!(), "::a_second_request_leaves_no_half_written_file");
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
        wait_for("stopped at once; nothing more is written");
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert_eq!(names(folder.path()), Vec::<String>::new());
    }
}
