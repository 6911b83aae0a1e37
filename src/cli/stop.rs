//! Ctrl-C.

use crossbeam_channel::{Receiver, Sender, bounded};
use std::convert::Infallible;
use std::io::Write;

/// A channel that closes with the first Ctrl-C (or request to terminate); the second one ends the program
/// at once.
pub(super) fn on_interrupt() -> Result<Receiver<Infallible>, ctrlc::Error> {
    let (sender, receiver) = bounded::<Infallible>(0);
    let mut open: Option<Sender<Infallible>> = Some(sender);
    ctrlc::set_handler(move || {
        if open.take().is_none() {
            let _ = writeln!(std::io::stderr(), "stopped at once; nothing more is written");
            // The exit code of a shell's command that SIGINT ended.
            std::process::exit(130);
        }
    })?;
    Ok(receiver)
}
