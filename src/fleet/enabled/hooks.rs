//! Faults on request of environment variables, so that tests can see them found. Only in builds for tests.

use std::path::Path;

#[cfg(any(debug_assertions, feature = "broken-material"))]
mod on {
    use sha2::{Digest, Sha256};
    use std::path::Path;

    /// The value of the fact `program` in place of the true one.
    pub(super) fn other_program() -> Option<String> {
        std::env::var("STRIDE_TEST_FLEET_PROGRAM").ok()
    }

    /// Whether this worker spoils the sums of a film.
    pub(super) fn spoils() -> bool {
        std::env::var_os("STRIDE_TEST_FLEET_FLIP").is_some()
    }

    /// Flips the lowest bit of the first pixel's red sum, and makes the checksum fit.
    pub(super) fn flip(film: &Path) -> std::io::Result<()> {
        let mut bytes = std::fs::read(film)?;
        let text = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
        bytes[52 + text] ^= 1;
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

/// Spoils a film, if that is requested.
pub(super) fn spoil(_film: &Path) -> std::io::Result<()> {
    #[cfg(any(debug_assertions, feature = "broken-material"))]
    if on::spoils() {
        return on::flip(_film);
    }
    Ok(())
}
