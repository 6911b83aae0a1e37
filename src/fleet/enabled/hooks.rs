//! Faults on request of environment variables, so that tests can see them found. Only in builds for tests.

use super::Stop;
use std::path::Path;

#[cfg(any(debug_assertions, feature = "broken-material"))]
mod on {
    use crate::film::file::START_BYTES;
    use sha2::{Digest, Sha256};
    use std::path::Path;

    /// The value of the fact `program` in place of the true one.
    pub(super) fn other_program() -> Option<String> {
        std::env::var("STRIDE_TEST_FLEET_PROGRAM").ok()
    }

    /// Whether a fault of this name is requested.
    pub(super) fn is_requested(fault: &str) -> bool {
        std::env::var_os(format!("STRIDE_TEST_FLEET_{fault}")).is_some()
    }

    /// Waits for a file.
    pub(super) fn hold(point: &str) {
        let Some(path) = std::env::var_os(format!("STRIDE_TEST_FLEET_HOLD_{point}")) else { return };
        eprintln!("holding");
        while !std::path::Path::new(&path).exists() {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        if is_requested("DIE") {
            std::process::exit(9);
        }
    }

    /// Whether this worker spoils the sums of a film.
    pub(super) fn spoils() -> bool {
        is_requested("FLIP")
    }

    /// Flips the lowest bit of the first pixel's red sum, and makes the checksum fit.
    pub(super) fn flip(film: &Path) -> std::io::Result<()> {
        let mut bytes = std::fs::read(film)?;
        let text = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
        bytes[START_BYTES as usize + text] ^= 1;
        let end = bytes.len() - 32;
        let digest = Sha256::digest(&bytes[..end]);
        bytes[end..].copy_from_slice(&digest);
        std::fs::write(film, bytes)
    }
}

/// Another value of a fact.
pub(super) fn other_program(_fact: &str) -> Option<String> {
    #[cfg(any(debug_assertions, feature = "broken-material"))]
    if _fact == "program" {
        return on::other_program();
    }
    None
}

/// Waits until a unit is to be stopped, if that is requested. Returns whether it was.
pub(super) fn hang(_stop: &Stop) -> bool {
    #[cfg(any(debug_assertions, feature = "broken-material"))]
    if on::is_requested("HANG") {
        eprintln!("hanging");
        let _ = _stop.recv();
        return true;
    }
    false
}

/// Ends the program between the parts of a film and its announcement, if that is requested.
pub(super) fn die_before_announcement() {
    #[cfg(any(debug_assertions, feature = "broken-material"))]
    if on::is_requested("MUTE") {
        std::process::exit(9);
    }
}

/// Waits until a file exists whose path is requested for this point, and then ends the program if that is requested.
pub(super) fn hold(_point: &str) {
    #[cfg(any(debug_assertions, feature = "broken-material"))]
    on::hold(_point);
}

/// Spoils a film, if that is requested.
pub(super) fn spoil(_film: &Path) -> std::io::Result<()> {
    #[cfg(any(debug_assertions, feature = "broken-material"))]
    if on::spoils() {
        return on::flip(_film);
    }
    Ok(())
}
