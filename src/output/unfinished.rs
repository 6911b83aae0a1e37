//! The temporary files that are being written, so that a program that ends at once can remove them.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

use tempfile::NamedTempFile;

/// The temporary files that this process is writing. It is the whole process's because a signal is, and all that two
/// renders in one process have in common: each adds and removes what is its own, and waits for the other only while a
/// file is being created. A mutex is right here and a channel is not: nothing may come between the creation of a file and
/// its note, and the program that ends must keep further files from being created until it has ended. No renderer waits
/// for it, only writers.
pub(super) static UNFINISHED: Unfinished = Unfinished(Mutex::new(Vec::new()));

/// The time that a program that is to end at once waits for a file that is being created, as on a network that hangs.
const CREATED_WITHIN: Duration = Duration::from_millis(200);

/// Removes all temporary files that are being written. While the guard lives none is begun: a program that ends before
/// it is dropped leaves nothing behind. Nothing is removed, and there is no guard, if the creation of a file takes too
/// long: a program that is to end at once ends without it.
pub fn remove_unfinished() -> Option<impl Sized> {
    UNFINISHED.remove_all(CREATED_WITHIN)
}

pub(super) struct Unfinished(Mutex<Vec<PathBuf>>);

impl Unfinished {
    fn lock(&self) -> MutexGuard<'_, Vec<PathBuf>> {
        // A list of paths is whole at any time.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Creates a file and takes note of it; nothing can come in between.
    pub(super) fn create(
        &'static self,
        create: impl FnOnce() -> io::Result<NamedTempFile>,
    ) -> io::Result<Temporary> {
        let mut paths = self.lock();
        let file = create()?;
        paths.push(file.path().to_path_buf());
        Ok(Temporary { noted: Noted { path: file.path().to_path_buf(), all: self }, file })
    }

    /// The list, unless another thread holds it for longer than `limit`.
    fn lock_within(&self, limit: Duration) -> Option<MutexGuard<'_, Vec<PathBuf>>> {
        let start = Instant::now();
        loop {
            match self.0.try_lock() {
                Ok(paths) => return Some(paths),
                Err(TryLockError::Poisoned(paths)) => return Some(paths.into_inner()),
                Err(TryLockError::WouldBlock) if start.elapsed() >= limit => return None,
                Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(1)),
            }
        }
    }

    fn remove_all(&self, limit: Duration) -> Option<MutexGuard<'_, Vec<PathBuf>>> {
        let paths = self.lock_within(limit)?;
        for path in &*paths {
            // One that can't be removed stays.
            let _ = fs::remove_file(path);
        }
        Some(paths)
    }
}

/// A note of a temporary file, which goes when the file has gone or has been put in its place.
struct Noted {
    path: PathBuf,
    all: &'static Unfinished,
}

impl Drop for Noted {
    fn drop(&mut self) {
        self.all.lock().retain(|path| *path != self.path);
    }
}

/// A temporary file that is noted. Fields are dropped in their order: the file goes before the note.
pub(super) struct Temporary {
    file: NamedTempFile,
    noted: Noted,
}

impl Temporary {
    /// Renames the file into its place.
    pub(super) fn persist(self, place: &Path) -> io::Result<File> {
        let Temporary { file, noted } = self;
        let placed = file.persist(place).map_err(|failure| failure.error);
        drop(noted);
        placed
    }
}

impl std::ops::Deref for Temporary {
    type Target = NamedTempFile;

    fn deref(&self) -> &NamedTempFile {
        &self.file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_being_created_holds_up_no_end_at_once() {
        let unfinished = Unfinished(Mutex::new(Vec::new()));
        let creating = unfinished.lock();
        assert!(unfinished.remove_all(Duration::ZERO).is_none());
        drop(creating);
        assert!(unfinished.remove_all(Duration::ZERO).is_some());
    }
}
