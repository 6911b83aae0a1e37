//! The files of scenes on the server: each once, by its content.
//!
//! A submitter sends the parts of a file on subjects of its own, an *upload*. When all of them are stored, it stores the
//! *link*, a message that names the upload; the server keeps the first one. An upload does not change, and only its
//! submitter removes it before it is linked: submitters at the same time cannot spoil each other's files, even if one of
//! them dies.

use super::broker::{Answer, Broker, FILES};
use super::hooks;
use super::job::{Job, Manifest, SceneFile, now, unique};
use super::mail::Changed;
use super::{Stop, is_asked_to_stop};
use crate::fleet::{FleetError, JobState};
use data_encoding::HEXLOWER;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The number of times that a file is sent or looked for. It takes two, and more if others remove it meanwhile.
const MOST_TURNS: u32 = 10;

/// The seconds after which an upload without a link belongs to a submitter that has died.
const ABANDONED: u64 = 24 * 3600;

/// The message that names the upload of a file.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Link {
    /// One token of a subject: the time in seconds, and a unique name.
    upload: String,
    parts: u64,
}

/// A complete file on the server.
pub(super) struct Linked {
    link: Link,
    /// The number of the message of the link.
    number: u64,
    sha256: String,
}

impl Linked {
    /// The file with these contents, if the server has its link.
    pub(super) fn find(broker: &Broker, sha256: &str) -> Result<Option<Linked>, FleetError> {
        let Some(stored) = broker.last(FILES, &link_subject(sha256))? else { return Ok(None) };
        // A malformed link is one without parts, which the next submitter replaces.
        let link = serde_json::from_slice(&stored.payload).ok().filter(Link::is_valid);
        let link = link.unwrap_or_else(|| Link { upload: "0".to_owned(), parts: u64::MAX });
        Ok(Some(Linked { link, number: stored.sequence, sha256: sha256.to_owned() }))
    }

    /// The contents of a part, counted from 0.
    pub(super) fn part(&self, broker: &Broker, part: u64) -> Result<Option<Vec<u8>>, FleetError> {
        let stored = broker.last(FILES, &part_subject(&self.sha256, &self.link.upload, part))?;
        Ok(stored.map(|stored| stored.payload))
    }

    /// Whether all parts are there: a server that was cut off from power may have lost some.
    fn is_complete(&self, broker: &Broker) -> Result<bool, FleetError> {
        let parts = broker.subjects(FILES, &part_filter(&self.sha256, &self.link.upload))?;
        Ok(parts.len() as u64 == self.link.parts)
    }

    fn unlink(&self, broker: &Broker) -> Result<(), FleetError> {
        broker.remove(FILES, self.number)
    }
}

impl Link {
    fn is_valid(&self) -> bool {
        (1..64).contains(&self.upload.len())
            && self.upload.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-')
    }

    fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }
}

fn link_subject(sha256: &str) -> String {
    format!("stride.file.{sha256}.link")
}

fn part_subject(sha256: &str, upload: &str, part: u64) -> String {
    format!("stride.file.{sha256}.{upload}.{part}")
}

fn part_filter(sha256: &str, upload: &str) -> String {
    format!("stride.file.{sha256}.{upload}.*")
}

/// Sends the files that the server does not have yet.
pub(super) fn send(
    broker: &Broker,
    manifest: &Manifest,
    paths: &[PathBuf],
    stop: &Stop,
) -> Result<(), FleetError> {
    manifest.files.iter().zip(paths).try_for_each(|(file, path)| send_file(broker, file, path, stop))
}

fn send_file(broker: &Broker, file: &SceneFile, path: &Path, stop: &Stop) -> Result<(), FleetError> {
    discard_abandoned(broker, &file.sha256)?;
    for _ in 0..MOST_TURNS {
        match Linked::find(broker, &file.sha256)? {
            Some(linked) if linked.is_complete(broker)? => return Ok(()),
            Some(linked) => {
                linked.unlink(broker)?;
                broker.remove_all(FILES, &part_filter(&file.sha256, &linked.link.upload))?;
            }
            None => upload(broker, file, path, stop)?,
        }
    }
    Err(FleetError::Job(format!("{path:?} is removed from the server again and again; submit again")))
}

/// Sends a file, and links it unless another submitter was faster.
fn upload(broker: &Broker, file: &SceneFile, path: &Path, stop: &Stop) -> Result<(), FleetError> {
    hooks::hold("UPLOAD");
    let upload = format!("{}-{}", now(), unique("u"));
    let parts = part_filter(&file.sha256, &upload);
    let link = send_parts(broker, file, path, &upload, stop).inspect_err(|_| {
        // Otherwise they are removed when they are old.
        let _ = broker.remove_all(FILES, &parts);
    })?;
    hooks::hold("LINK");
    match broker.store(link_subject(&file.sha256), link.to_bytes(), None)? {
        Answer::Stored(_) => Ok(()),
        Answer::Exists | Answer::Conflict => broker.remove_all(FILES, &parts),
    }
}

/// Sends the parts of a file. Returns the link to them.
fn send_parts(
    broker: &Broker,
    file: &SceneFile,
    path: &Path,
    upload: &str,
    stop: &Stop,
) -> Result<Link, FleetError> {
    let failed = |reason| FleetError::File { path: path.to_path_buf(), reason };
    let mut input = File::open(path).map_err(failed)?;
    let (mut digest, mut bytes, mut parts) = (Sha256::new(), 0, 0);
    loop {
        let mut piece = Vec::new();
        Read::by_ref(&mut input).take(broker.part_bytes() as u64).read_to_end(&mut piece).map_err(failed)?;
        // An empty file has one part.
        if piece.is_empty() && parts > 0 || bytes > file.bytes {
            break;
        }
        if is_asked_to_stop(stop) {
            return Err(FleetError::Job("stopped before the scene was on the server".to_owned()));
        }
        digest.update(&piece);
        bytes += piece.len() as u64;
        broker.store(part_subject(&file.sha256, upload, parts), piece, None)?;
        parts += 1;
    }
    if bytes != file.bytes || HEXLOWER.encode(&digest.finalize()) != file.sha256 {
        return Err(FleetError::Job(format!("{path:?} was changed while it was sent; submit again")));
    }
    Ok(Link { upload: upload.to_owned(), parts })
}

/// Removes the uploads of a file whose submitters have died.
fn discard_abandoned(broker: &Broker, sha256: &str) -> Result<(), FleetError> {
    let own = format!("stride.file.{sha256}.");
    let subjects = broker.subjects(FILES, &format!("{own}*.*"))?;
    let uploads = subjects.iter().filter_map(|subject| Some(subject.strip_prefix(&own)?.split_once('.')?.0));
    let uploads: BTreeSet<&str> = uploads.filter(|upload| is_old(upload, now())).collect();
    if uploads.is_empty() {
        return Ok(());
    }
    let linked = Linked::find(broker, sha256)?;
    for upload in uploads {
        if linked.as_ref().is_none_or(|linked| linked.link.upload != upload) {
            broker.remove_all(FILES, &part_filter(sha256, upload))?;
        }
    }
    Ok(())
}

fn is_old(upload: &str, now: u64) -> bool {
    let begun: Option<u64> = upload.split('-').next().and_then(|time| time.parse().ok());
    begun.is_none_or(|begun| begun.saturating_add(ABANDONED) < now)
}

/// Removes the files of a job that is over, except those that other jobs need.
///
/// The links come first. Thus a job that is submitted meanwhile is either seen here, or its submitter sees that the link
/// is missing after it has stored the job, and sends the file again. Files are unlinked one at a time, and linked again
/// before the next one, so that an interruption leaves at most one without the link that another job needs. An error
/// does not end the removal of the other files, unless the server does not answer; the first one is returned.
pub(super) fn forget(broker: &Broker, job: &Job) -> Result<(), FleetError> {
    let own: BTreeSet<&str> = job.scene.files.iter().map(|file| &*file.sha256).collect();
    let mut others = Changed::default();
    others.read(broker, |other| is_other(other, job))?;
    let (mut unlinked, mut outcome) = (Vec::new(), Ok(()));
    for sha256 in own {
        if is_needed(&others, sha256) {
            continue;
        }
        match unlink(broker, job, &mut others, sha256) {
            Ok(linked) => unlinked.extend(linked),
            Err(error) => {
                // Each further request would wait for an answer, too. The files that follow stay linked.
                let is_last = matches!(error, FleetError::Unreachable(_));
                outcome = outcome.and(Err(error));
                if is_last {
                    break;
                }
            }
        }
    }
    for Linked { link, sha256, .. } in unlinked {
        let removed = broker.remove_all(FILES, &part_filter(&sha256, &link.upload));
        let is_last = matches!(removed, Err(FleetError::Unreachable(_)));
        outcome = outcome.and(removed);
        if is_last {
            break;
        }
    }
    outcome
}

/// Unlinks a file, and links it again if another job that needs it has been submitted meanwhile. Returns it if its parts
/// are to be removed.
fn unlink(
    broker: &Broker,
    job: &Job,
    others: &mut Changed,
    sha256: &str,
) -> Result<Option<Linked>, FleetError> {
    discard_abandoned(broker, sha256)?;
    let Some(linked) = Linked::find(broker, sha256)? else { return Ok(None) };
    linked.unlink(broker)?;
    let seen = others.read(broker, |other| is_other(other, job));
    // A file of which this is not known is kept.
    let is_kept = seen.is_err() || is_needed(others, sha256);
    let relinked = match is_kept {
        true => broker.store(link_subject(sha256), linked.link.to_bytes(), None),
        false => Ok(Answer::Exists),
    };
    seen?;
    // If this fails, the parts stay: the link may have been stored.
    match relinked? {
        Answer::Stored(_) => Ok(None),
        // No other job needs it, or another submitter has linked an upload of its own.
        Answer::Exists | Answer::Conflict => Ok(Some(linked)),
    }
}

/// Whether a job is another one that may need its files. Jobs that are done can be extended.
fn is_other(other: &Job, job: &Job) -> bool {
    other.id != job.id && other.state != JobState::Cancelled
}

fn is_needed(others: &Changed, sha256: &str) -> bool {
    others.jobs.iter().any(|other| other.scene.files.iter().any(|file| file.sha256 == sha256))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uploads_are_abandoned_after_a_day() {
        let of = |begun: u64| format!("{begun}-{}", unique("u"));
        assert!(!is_old(&of(1000), 1000 + ABANDONED) && is_old(&of(1000), 1001 + ABANDONED));
        // That of another program, and one of a clock that is ahead.
        assert!(is_old("u1", 0) && !is_old(&of(u64::MAX), 1000));
    }

    #[test]
    fn links_are_one_token_of_a_subject() {
        let is_valid = |upload: &str| Link { upload: upload.to_owned(), parts: 1 }.is_valid();
        assert!(is_valid(&format!("{}-{}", now(), unique("u"))));
        for wrong in ["", "*", ">", "a.b", "a b", &"a".repeat(64)] {
            assert!(!is_valid(wrong), "{wrong}");
        }
    }
}
