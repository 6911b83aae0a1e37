//! Films of results on the collector's disk, before they are added.

use super::mail::Mail;
use super::unit::Posted;
use crate::film::Layout;
use crate::fleet::FleetError;
use data_encoding::HEXLOWER;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// The most bytes of a film file beside its pixels: facts and names.
const MOST_TEXT: u64 = 32 << 20;

/// Fetches the film file of a result, and compares its checksum. Returns the numbers of its messages.
pub(super) fn fetch(
    mail: &impl Mail,
    posted: &Posted,
    layout: &Layout,
    path: &Path,
) -> Result<Vec<u64>, FleetError> {
    let failed = |reason| FleetError::File { path: path.to_path_buf(), reason };
    let least = layout.len().saturating_mul(layout.pixel_bytes());
    if !(least..=least.saturating_add(MOST_TEXT)).contains(&posted.bytes) {
        return Err(FleetError::Refused(format!(
            "it has {} bytes, which no film of the job has",
            posted.bytes
        )));
    }
    let file = File::create(path).map_err(failed)?;
    let out = BufWriter::with_capacity(1 << 20, file);
    let mut out = Checked { out, digest: Sha256::new(), tail: Vec::new(), failure: None };
    let messages = mail.film(posted, &mut out);
    // A full disk of this machine is no fault of the worker.
    if let Some(reason) = out.failure.take() {
        return Err(failed(reason));
    }
    let messages = messages?;
    out.flush().map_err(failed)?;
    let digest = out.digest.finalize();
    match digest[..] == out.tail[..] && HEXLOWER.encode(&digest) == posted.digest {
        true => Ok(messages),
        false => Err(FleetError::Refused("its checksum does not match".to_owned())),
    }
}

/// Writes a film file, and computes its digest: of all bytes but the last 32, which it keeps.
struct Checked<W> {
    out: W,
    digest: Sha256,
    tail: Vec<u8>,
    /// The error of a write.
    failure: Option<io::Error>,
}

impl<W: Write> Write for Checked<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Err(error) = self.out.write_all(bytes) {
            self.failure = Some(error);
            return Err(io::Error::other("the film cannot be written"));
        }
        self.tail.extend_from_slice(bytes);
        let ready = self.tail.len().saturating_sub(32);
        self.digest.update(&self.tail[..ready]);
        self.tail.drain(..ready);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
