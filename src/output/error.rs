//! Errors of writing files, with the location and a remedy.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A file could not be written. An existing file is unchanged.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The extension is missing or unknown.
    #[error("cannot write {path:?}: {}; use {known}", unknown(.extension))]
    UnknownFormat {
        /// The requested file.
        path: PathBuf,
        /// Its extension, without the dot; empty if it has none.
        extension: String,
        /// The known extensions, for the message.
        known: String,
    },
    /// The folder of the file does not exist.
    #[error("cannot write {path:?}: there is no folder {folder:?}; create it first")]
    NoFolder {
        /// The requested file.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// The folder of the file is itself a file.
    #[error("cannot write {path:?}: {folder:?} is a file, not a folder; choose another place")]
    NotAFolder {
        /// The requested file.
        path: PathBuf,
        /// The file in place of the folder.
        folder: PathBuf,
    },
    /// A folder has the name of the file.
    #[error("cannot write {path:?}: a folder has that name; choose another name")]
    IsFolder {
        /// The requested file.
        path: PathBuf,
    },
    /// A device, pipe or socket has the name of the file.
    #[error("cannot write {path:?}: it is a device, a pipe or a socket; choose the name of an ordinary file")]
    NotAFile {
        /// The requested file.
        path: PathBuf,
    },
    /// The existing file is marked read-only.
    #[error("cannot write {path:?}: the file is marked read-only; make it writable or choose another name")]
    Protected {
        /// The requested file.
        path: PathBuf,
    },
    /// Creating files in the folder is not permitted.
    #[error(
        "cannot write {path:?}: no permission to create files in {folder:?}; choose another folder or change \
         its permissions"
    )]
    Denied {
        /// The requested file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// The disk, or the user's quota on it, is full.
    #[error("cannot write {path:?}: the disk is full; free some space or choose another disk")]
    DiskFull {
        /// The requested file.
        path: PathBuf,
    },
    /// Another error of the operating system or of the format's encoder.
    #[error("cannot write {path:?}: {reason}")]
    Io {
        /// The requested file.
        path: PathBuf,
        /// The error.
        reason: io::Error,
    },
}

fn unknown(extension: &str) -> String {
    if extension.is_empty() {
        "its name has no extension to determine the format".into()
    } else {
        format!("the extension .{extension} is not known")
    }
}

impl OutputError {
    /// Interprets an error of the operating system for the file at `path`.
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

/// The folder of a file; the current one for a bare name.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}
