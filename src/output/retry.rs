//! Files that must not be lost: retried after a failure, and finally written to another folder.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::error::OutputError;

/// How long writes are retried after a first failure. Temporary failures of disks last seconds.
const RETRY_TIME: Duration = Duration::from_secs(10);

/// The interval between two attempts.
const PAUSE: Duration = Duration::from_millis(500);

/// Writes files that are expensive to make again. The time limit covers all of them together: ten files on a missing
/// disk are not retried ten times as long.
#[derive(Debug)]
pub struct RetryPolicy {
    time_limit: Duration,
    deadline: Option<Instant>,
}

impl Default for RetryPolicy {
    fn default() -> RetryPolicy {
        RetryPolicy { time_limit: RETRY_TIME, deadline: None }
    }
}

impl RetryPolicy {
    /// Without retries: writes to another folder at once.
    pub fn none() -> RetryPolicy {
        RetryPolicy { time_limit: Duration::ZERO, deadline: None }
    }

    /// Writes a file by `write`, which receives the path. After an error it reports the error and retries for a while.
    /// Then the file is written to the current folder or the folder for temporary files, which is reported. The result
    /// is that of the first attempt.
    pub fn write(
        &mut self,
        path: &Path,
        report: &dyn Fn(String),
        write: impl Fn(&Path) -> Result<(), OutputError>,
    ) -> Result<(), OutputError> {
        let Err(error) = write(path) else { return Ok(()) };
        if matches!(error, OutputError::UnknownFormat { .. }) {
            return Err(error);
        }
        let time_limit = self.time_limit;
        let deadline = *self.deadline.get_or_insert_with(|| Instant::now() + time_limit);
        if Instant::now() < deadline {
            report(format!("{error}; retrying for {} s", time_limit.as_secs()));
        }
        while Instant::now() < deadline {
            std::thread::sleep(PAUSE);
            if write(path).is_ok() {
                report(format!("{path:?} has been written by a retry"));
                return Ok(());
            }
        }
        for folder in [PathBuf::from("."), std::env::temp_dir()] {
            let Some(instead) = free_name(&folder, path) else { continue };
            if write(&instead).is_ok() {
                report(format!("{path:?} has been written to {instead:?} instead"));
                return Err(error);
            }
        }
        Err(error)
    }
}

/// An unused name like that of `path` in another folder.
fn free_name(folder: &Path, path: &Path) -> Option<PathBuf> {
    let (stem, extension) = (path.file_stem()?, path.extension()?.to_string_lossy());
    let name = |n: u32| match n {
        0 => path.file_name().map(Into::into).unwrap_or_default(),
        n => PathBuf::from(format!("{}-{n}.{extension}", stem.to_string_lossy())),
    };
    (0..1000).map(|n| folder.join(name(n))).find(|path| path.symlink_metadata().is_err())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::{Cell, RefCell};
    use std::fs;

    fn short_retries() -> RetryPolicy {
        RetryPolicy { time_limit: Duration::from_millis(700), deadline: None }
    }

    fn write(path: &Path) -> Result<(), OutputError> {
        fs::write(path, "x").map_err(|error| OutputError::from_io(path, error))
    }

    #[test]
    fn a_successful_write_happens_once_without_messages() {
        let folder = tempfile::tempdir().unwrap();
        let times = Cell::new(0);
        let report = |said| panic!("{said}");
        let count = |path: &Path| {
            times.set(times.get() + 1);
            write(path)
        };
        short_retries().write(&folder.path().join("a.png"), &report, count).unwrap();
        assert_eq!(times.get(), 1);
    }

    #[test]
    fn a_write_succeeds_when_its_folder_returns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("gone/a.png");
        let said = RefCell::new(Vec::new());
        let times = Cell::new(0);
        let later = |path: &Path| {
            times.set(times.get() + 1);
            if times.get() == 2 {
                fs::create_dir(path.parent().unwrap()).unwrap();
            }
            write(path)
        };
        short_retries().write(&path, &|line| said.borrow_mut().push(line), later).unwrap();
        assert!(path.exists());
        assert!(said.borrow()[0].contains("retrying"), "{said:?}");
    }

    #[test]
    fn a_failed_write_goes_to_another_folder_with_a_message() {
        let folder = tempfile::tempdir().unwrap();
        let name = format!("time_limit-{}.png", std::process::id());
        let lost = folder.path().join("gone").join(&name);
        let start = Instant::now();
        let mut time_limit = short_retries();
        let mut found = Vec::new();
        for _ in 0..3 {
            let said = RefCell::new(Vec::new());
            let error = time_limit.write(&lost, &|line| said.borrow_mut().push(line), write).unwrap_err();
            assert!(matches!(&error, OutputError::Io { path, .. } if *path == lost), "{error}");
            let last = said.borrow().last().cloned().unwrap();
            let instead = last.split('"').nth(3).unwrap_or_else(|| panic!("{last}"));
            assert_eq!(fs::read(instead).unwrap(), b"x");
            found.push(PathBuf::from(instead));
        }
        // None overwrites another, and the time limit covers all together.
        assert!(found[0] != found[1] && found[1] != found[2]);
        assert!(start.elapsed() < Duration::from_secs(30));
        found.iter().for_each(|path| fs::remove_file(path).unwrap());
        // If no folder is writable, only the first error is returned.
        let error = time_limit.write(&lost, &|_| {}, |path| {
            Err(OutputError::NoFolder { path: path.into(), folder: path.into() })
        });
        assert!(matches!(error, Err(OutputError::NoFolder { path, .. }) if path == lost));
    }
}
