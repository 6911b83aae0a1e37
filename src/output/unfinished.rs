//! The list of temporary files in progress, so that a program that ends at once can remove them.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

use tempfile::NamedTempFile;

/// The temporary files of this process. The list is global because signals are, and it is the only state that two
/// renders in one process share: each adds and removes its own files, and waits for the other only during the creation
/// of a file. This needs a mutex rather than a channel: the creation of a file and its registration must be atomic, and
/// a program that ends must prevent further files until it has ended. Only writers wait for it, never renderers.
pub(super) static UNFINISHED: Unfinished = Unfinished(Mutex::new(Vec::new()));

/// The time that a program waits for a file creation in progress before it ends, as on an unresponsive network drive.
const CREATED_WITHIN: Duration = Duration::from_millis(200);

/// Removes all temporary files in progress. While the guard exists none can be created: a program that ends before
/// dropping it leaves nothing behind. If a file creation in progress takes too long, nothing is removed and there is no
/// guard, so that the program can end anyway.
pub fn remove_unfinished() -> Option<impl Sized> {
    UNFINISHED.remove_all(CREATED_WITHIN)
}

pub(super) struct Unfinished(Mutex<Vec<PathBuf>>);

impl Unfinished {
    fn lock(&self) -> MutexGuard<'_, Vec<PathBuf>> {
        // A list of paths is consistent at any time, even after a panic.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Creates a file and registers it atomically.
    pub(super) fn create(
        &'static self,
        create: impl FnOnce() -> io::Result<NamedTempFile>,
    ) -> io::Result<Temporary> {
        let mut paths = self.lock();
        let file = create()?;
        paths.push(file.path().to_path_buf());
        Ok(Temporary { noted: Noted { path: file.path().to_path_buf(), all: self }, file })
    }

    /// The list, unless another thread locks it for longer than `limit`.
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
            // Files that cannot be removed are ignored.
            let _ = fs::remove_file(path);
        }
        Some(paths)
    }
}

/// The registration of a temporary file, which ends when the file has been removed or renamed.
struct Noted {
    path: PathBuf,
    all: &'static Unfinished,
}

impl Drop for Noted {
    fn drop(&mut self) {
        self.all.lock().retain(|path| *path != self.path);
    }
}

/// A registered temporary file. Fields are dropped in their order: the file before the registration.
pub(super) struct Temporary {
    file: NamedTempFile,
    noted: Noted,
}

impl Temporary {
    /// Renames the file to its final path.
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
    fn a_file_creation_in_progress_does_not_delay_the_end() {
        let unfinished = Unfinished(Mutex::new(Vec::new()));
        let creating = unfinished.lock();
        assert!(unfinished.remove_all(Duration::ZERO).is_none());
        drop(creating);
        assert!(unfinished.remove_all(Duration::ZERO).is_some());
    }
}
