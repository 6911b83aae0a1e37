//! Standard output.

use anyhow::Context;
use std::io::Write;

/// Writes to standard output; a closed pipe is an error like any other, not a panic.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).context("standard output cannot be written")
}
