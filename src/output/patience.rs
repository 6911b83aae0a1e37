//! Files that must not be lost: written again after a failure, and in the end somewhere else.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::error::OutputError;

/// How long files are tried again after a first failure. Disks that come back come back in seconds.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long to wait between two attempts.
const PAUSE: Duration = Duration::from_millis(500);

/// Writes files that take long to make again. They share one patience: ten files on a disk that is gone
/// are not waited for ten times.
#[derive(Debug)]
pub struct Patience {
    patience: Duration,
    deadline: Option<Instant>,
}

impl Default for Patience {
    fn default() -> Patience {
        Patience { patience: PATIENCE, deadline: None }
    }
}

impl Patience {
    /// Goes elsewhere at once.
    pub fn none() -> Patience {
        Patience { patience: Duration::ZERO, deadline: None }
    }

    /// Writes a file by `write`, which gets the path. After an error it says so and tries again for a while;
    /// then the file goes to the current folder or the one for temporary files, and it says where. The error
    /// is that of the first attempt.
    pub fn write(
        &mut self,
        path: &Path,
        tell: &dyn Fn(String),
        write: impl Fn(&Path) -> Result<(), OutputError>,
    ) -> Result<(), OutputError> {
        let Err(error) = write(path) else { return Ok(()) };
        if matches!(error, OutputError::UnknownFormat { .. }) {
            return Err(error);
        }
        let patience = self.patience;
        let deadline = *self.deadline.get_or_insert_with(|| Instant::now() + patience);
        if Instant::now() < deadline {
            tell(format!("{error}; trying again for {} s", patience.as_secs()));
        }
        while Instant::now() < deadline {
            std::thread::sleep(PAUSE);
            if write(path).is_ok() {
                tell(format!("{path:?} is written after all"));
                return Ok(());
            }
        }
        for folder in [PathBuf::from("."), std::env::temp_dir()] {
            let Some(instead) = free_name(&folder, path) else { continue };
            if write(&instead).is_ok() {
                tell(format!("what should be {path:?} is {instead:?} instead"));
                return Err(error);
            }
        }
        Err(error)
    }
}

/// A name like that of `path` in another folder, that nothing has yet.
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

    fn impatient() -> Patience {
        Patience { patience: Duration::from_millis(700), deadline: None }
    }

    fn write(path: &Path) -> Result<(), OutputError> {
        fs::write(path, "x").map_err(|error| OutputError::from_io(path, error))
    }

    #[test]
    fn what_works_is_written_once_and_in_silence() {
        let folder = tempfile::tempdir().unwrap();
        let times = Cell::new(0);
        let tell = |said| panic!("{said}");
        let count = |path: &Path| {
            times.set(times.get() + 1);
            write(path)
        };
        impatient().write(&folder.path().join("a.png"), &tell, count).unwrap();
        assert_eq!(times.get(), 1);
    }

    #[test]
    fn a_folder_that_comes_back_gets_its_file() {
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
        impatient().write(&path, &|line| said.borrow_mut().push(line), later).unwrap();
        assert!(path.exists());
        assert!(said.borrow()[0].contains("trying again"), "{said:?}");
    }

    #[test]
    fn what_can_not_be_written_there_is_written_elsewhere_and_told_of() {
        let folder = tempfile::tempdir().unwrap();
        let name = format!("patience-{}.png", std::process::id());
        let lost = folder.path().join("gone").join(&name);
        let start = Instant::now();
        let mut patience = impatient();
        let mut found = Vec::new();
        for _ in 0..3 {
            let said = RefCell::new(Vec::new());
            let error = patience.write(&lost, &|line| said.borrow_mut().push(line), write).unwrap_err();
            assert!(matches!(&error, OutputError::Io { path, .. } if *path == lost), "{error}");
            let last = said.borrow().last().cloned().unwrap();
            let instead = last.split('"').nth(3).unwrap_or_else(|| panic!("{last}"));
            assert_eq!(fs::read(instead).unwrap(), b"x");
            found.push(PathBuf::from(instead));
        }
        // None is written over another, and they are not waited for one by one.
        assert!(found[0] != found[1] && found[1] != found[2]);
        assert!(start.elapsed() < Duration::from_secs(30));
        found.iter().for_each(|path| fs::remove_file(path).unwrap());
        // Where nothing can be written the first error is all there is.
        let error = patience.write(&lost, &|_| {}, |path| {
            Err(OutputError::NoFolder { path: path.into(), folder: path.into() })
        });
        assert!(matches!(error, Err(OutputError::NoFolder { path, .. }) if path == lost));
    }
}
