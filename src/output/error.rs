//! Why a file could not be written: what, where, and what to do about it.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A file that could not be written. Whatever stood in its place before still does.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The name ends in nothing that names a format.
    #[error("cannot write {path:?}: {}; use {known}", unknown(.extension))]
    UnknownFormat {
        /// The file asked for.
        path: PathBuf,
        /// Its extension, without the dot; empty where there is none.
        extension: String,
        /// The extensions that are known, for reading.
        known: String,
    },
    /// The folder it should stand in does not exist.
    #[error("cannot write {path:?}: there is no folder {folder:?}; create it first")]
    NoFolder {
        /// The file asked for.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// What should be the folder is a file.
    #[error("cannot write {path:?}: {folder:?} is a file, not a folder; choose another place")]
    NotAFolder {
        /// The file asked for.
        path: PathBuf,
        /// What is in the way.
        folder: PathBuf,
    },
    /// A folder has the name.
    #[error("cannot write {path:?}: a folder has that name; choose another name")]
    IsFolder {
        /// The file asked for.
        path: PathBuf,
    },
    /// A device, pipe or socket has the name.
    #[error("cannot write {path:?}: it is a device, a pipe or a socket; choose the name of an ordinary file")]
    NotAFile {
        /// The file asked for.
        path: PathBuf,
    },
    /// The file in its place is marked read-only.
    #[error("cannot write {path:?}: the file is marked read-only; make it writable or choose another name")]
    Protected {
        /// The file asked for.
        path: PathBuf,
    },
    /// No files may be created in the folder.
    #[error(
        "cannot write {path:?}: no permission to create files in {folder:?}; choose another folder or change \
         its permissions"
    )]
    Denied {
        /// The file asked for.
        path: PathBuf,
        /// The folder that refuses.
        folder: PathBuf,
    },
    /// The disk, or the user's share of it, is full.
    #[error("cannot write {path:?}: the disk is full; free some space or choose another disk")]
    DiskFull {
        /// The file asked for.
        path: PathBuf,
    },
    /// Anything else that the operating system or the format's encoder refuses.
    #[error("cannot write {path:?}: {reason}")]
    Io {
        /// The file asked for.
        path: PathBuf,
        /// What it said.
        reason: io::Error,
    },
}

fn unknown(extension: &str) -> String {
    if extension.is_empty() {
        "its name has no extension to tell the format by".into()
    } else {
        format!("the extension .{extension} is not known")
    }
}

impl OutputError {
    /// What an error of the operating system means for the file at `path`.
    pub(crate) fn from_io(path: &Path, source: io::Error) -> Self {
        let path = path.to_path_buf();
        match source.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::DiskFull { path },
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                let folder = folder_of(&path);
                Self::Denied { path, folder }
            }
            _ => Self::Io { path, reason: source },
        }
    }
}

/// The folder a file stands in; the current one for a bare name.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}
