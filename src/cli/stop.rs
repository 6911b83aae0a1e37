//! Ctrl-C.

use crossbeam_channel::{Receiver, Sender, bounded};
use std::convert::Infallible;
use std::io::Write;
use std::time::{Duration, Instant};

/// Requests that follow the first one as fast as this are the same one: some who end a program tell it and its
/// process group, which are two signals.
const SAME_REQUEST: Duration = Duration::from_millis(500);

/// A channel that closes with the first Ctrl-C (or request to terminate); the second one ends the program
/// at once.
pub(super) fn on_interrupt() -> Result<Receiver<Infallible>, ctrlc::Error> {
    let (sender, receiver) = bounded::<Infallible>(0);
    let mut open: Option<Sender<Infallible>> = Some(sender);
    let mut first = None;
    ctrlc::set_handler(move || {
        let since = first.get_or_insert_with(Instant::now).elapsed();
        if open.take().is_none() && since > SAME_REQUEST {
            let _ = writeln!(std::io::stderr(), "stopped at once; nothing more is written");
            // The exit code of a shell's command that SIGINT ended.
            std::process::exit(130);
        }
    })?;
    Ok(receiver)
}
