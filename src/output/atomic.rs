//! Files that appear completely or not at all.
//!
//! A file is written under a temporary name beside its path, flushed and synced, and renamed: readers see the old file
//! or the new one, even if the program is killed at any moment. Temporary files of killed programs are removed when the
//! same file is written the next time. The file system decides when the rename itself becomes durable; after a power
//! cut the old file may reappear, but never a partial one.

use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::error::{OutputError, folder_of};
use super::unfinished::{Temporary, UNFINISHED};

/// The maximum number of symbolic links to follow before they are assumed to be circular: the limit of Linux.
const MAX_LINKS: u32 = 40;

/// The location of a file after following symbolic links.
#[derive(Debug)]
struct Destination {
    path: PathBuf,
    folder: PathBuf,
    /// The permissions of the present file, which the new one takes over.
    permissions: Option<Permissions>,
}

/// Checks before a render that `path` can be written. Leaves no file behind.
///
/// A pipe or a device is rejected: renaming a finished file would replace it.
pub fn check_place(path: &Path) -> Result<(), OutputError> {
    let place = Destination::find(path)?;
    // Only creating a file is a reliable test: mode bits do not show root, access lists and read-only mounts.
    temporary(path, &place).map(drop)
}

/// Writes a file completely or not at all: `fill` receives a buffered, seekable writer.
///
/// If anything fails the temporary file is removed and an existing file is unchanged. A
/// symbolic link stays a link: the file it points to is replaced. A new file gets the mode that the umask
/// allows, a replaced one keeps its own.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), OutputError> {
    let draft = Draft::begin(path)?;
    let mut writer = BufWriter::with_capacity(1 << 16, draft.file.as_file());
    fill(&mut writer).and_then(|()| writer.flush()).map_err(|error| OutputError::from_io(path, error))?;
    drop(writer);
    draft.commit()
}

/// A file that is written in steps under a temporary name, and renamed when it is complete. If it is dropped before, it
/// is removed. It is locked while it is open, which distinguishes it from a file whose writer was killed; where files
/// cannot be locked, none is considered abandoned.
pub(super) struct Draft {
    path: PathBuf,
    place: Destination,
    file: Temporary,
}

impl Draft {
    /// Begins a file for `path`, and removes abandoned temporary files for the same path.
    pub(super) fn begin(path: &Path) -> Result<Draft, OutputError> {
        let place = Destination::find(path)?;
        let prefix = place.draft_prefix();
        sweep(&place.folder, &prefix, |file| file.try_lock().is_ok());
        loop {
            let file = temporary_called(&prefix, path, &place)?;
            // Another run may lock it briefly between its creation and this lock, and then remove it.
            let locked = file.as_file().lock().is_ok();
            if !locked || file.path().exists() {
                return Ok(Draft { path: path.to_path_buf(), place, file });
            }
        }
    }

    /// The file to write to.
    pub(super) fn file(&self) -> io::Result<File> {
        self.file.as_file().try_clone()
    }

    /// Syncs the file to disk and renames it.
    pub(super) fn commit(self) -> Result<(), OutputError> {
        let synced = self.file.as_file().sync_all();
        synced.map_err(|error| OutputError::from_io(&self.path, error))?;
        put_in_place(&self.path, &self.place, self.file).map(drop)
    }
}

/// Removes the temporary files for a path, also those that a running program writes: it fails at their end. For files whose
/// owner has changed.
pub fn discard_drafts(path: &Path) -> Result<(), OutputError> {
    let place = Destination::find(path)?;
    sweep(&place.folder, &place.draft_prefix(), |_| true);
    Ok(())
}

/// Removes temporary files that are chosen, such as those that no process has locked. Files that cannot be removed are
/// ignored.
fn sweep(folder: &Path, prefix: &str, is_chosen: impl Fn(&File) -> bool) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(prefix)
            && name.ends_with(SUFFIX)
            && let Ok(file) = File::open(entry.path())
            && is_chosen(&file)
        {
            // The lock is held until the file is removed: see `Draft::begin`.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Creates a file that is written while other programs may read it, with `start` as its first bytes.
///
/// It replaces an older file by renaming: a program that has mapped the old one keeps it.
pub(super) fn create_in_place(path: &Path, start: &[u8]) -> Result<File, OutputError> {
    let place = Destination::find(path)?;
    let file = temporary(path, &place)?;
    file.as_file().write_all(start).map_err(|error| OutputError::from_io(path, error))?;
    put_in_place(path, &place, file)
}

impl Destination {
    fn find(path: &Path) -> Result<Self, OutputError> {
        let wrong = |reason| OutputError::Io { path: path.to_path_buf(), reason };
        let mut target = path.to_path_buf();
        let mut links = 0;
        let found = loop {
            match fs::symlink_metadata(&target) {
                Ok(found) if found.is_symlink() => {
                    links += 1;
                    if links > MAX_LINKS {
                        return Err(wrong(io::Error::other("its symbolic links are circular")));
                    }
                    let next = fs::read_link(&target).map_err(wrong)?;
                    target = folder_of(&target).join(next);
                }
                Ok(found) => break Some(found),
                Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                    break None;
                }
                Err(error) => return Err(OutputError::from_io(path, error)),
            }
        };

        let folder = folder_of(&target);
        let path = path.to_path_buf();
        match fs::metadata(&folder) {
            Ok(found) if found.is_dir() => {}
            Ok(_) => return Err(OutputError::NotAFolder { path, folder }),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(OutputError::NoFolder { path, folder });
            }
            Err(error) if error.kind() == ErrorKind::NotADirectory => {
                return Err(OutputError::NotAFolder { path, folder });
            }
            Err(error) => return Err(OutputError::from_io(&path, error)),
        }
        let permissions = match found {
            None => None,
            Some(found) if found.is_dir() => return Err(OutputError::IsFolder { path }),
            Some(found) if !found.is_file() => return Err(OutputError::NotAFile { path }),
            Some(found) if found.permissions().readonly() => return Err(OutputError::Protected { path }),
            Some(found) => Some(found.permissions()),
        };
        Ok(Self { path: target, folder, permissions })
    }

    /// The start of the names of drafts.
    fn draft_prefix(&self) -> String {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        // As much of the name as leaves room for the rest: names have at most 255 bytes.
        let name: String = name.chars().take(48).collect();
        format!(".stride-{name}-")
    }
}

/// The ending of temporary names.
const SUFFIX: &str = ".tmp";

fn temporary(path: &Path, place: &Destination) -> Result<Temporary, OutputError> {
    temporary_called(".stride-", path, place)
}

fn temporary_called(prefix: &str, path: &Path, place: &Destination) -> Result<Temporary, OutputError> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix).suffix(SUFFIX);
    // The default mode of the crate, readable only by the owner, is for secrets; pictures follow the umask.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let create = || builder.tempfile_in(&place.folder);
    let file = UNFINISHED.create(create).map_err(|error| OutputError::from_io(path, error))?;
    if let Some(permissions) = &place.permissions {
        file.as_file()
            .set_permissions(permissions.clone())
            .map_err(|error| OutputError::from_io(path, error))?;
    }
    Ok(file)
}

fn put_in_place(path: &Path, place: &Destination, file: Temporary) -> Result<File, OutputError> {
    file.persist(&place.path).map_err(|error| OutputError::from_io(path, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn write(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
        write_atomically(path, |out| out.write_all(bytes))
    }

    #[test]
    fn discarded_drafts_do_not_replace_the_file_of_a_new_owner() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        let begin = |text: &[u8]| {
            let draft = Draft::begin(&path).unwrap();
            draft.file().unwrap().write_all(text).unwrap();
            draft
        };
        let earlier = begin(b"old");
        discard_drafts(&path).unwrap();
        begin(b"new").commit().unwrap();
        assert!(earlier.commit().is_err());
        assert_eq!((fs::read(&path).unwrap(), names(folder.path())), (b"new".to_vec(), vec!["a.bin".into()]));
        // Negative control.
        begin(b"late").commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"late");
    }

    #[test]
    fn writes_and_replaces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write(&path, b"first").unwrap();
        write(&path, b"2nd").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"2nd");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_failure_keeps_the_old_file_and_leaves_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write(&path, b"old").unwrap();
        let result = write_atomically(&path, |out| {
            out.write_all(b"part of the new")?;
            Err(io::Error::from(ErrorKind::StorageFull))
        });
        assert!(matches!(result, Err(OutputError::DiskFull { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_panic_keeps_the_old_file_and_leaves_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write(&path, b"old").unwrap();
        let panicked = std::panic::catch_unwind(|| {
            let _ = write_atomically(&path, |_| panic!("on purpose"));
        });
        assert!(panicked.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn checking_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        check_place(&folder.path().join("a.png")).unwrap();
        assert!(names(folder.path()).is_empty());
        fs::write(folder.path().join("b.png"), "old").unwrap();
        check_place(&folder.path().join("b.png")).unwrap();
        assert_eq!(fs::read(folder.path().join("b.png")).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["b.png"]);
    }

    #[test]
    fn abandoned_temporary_files_are_removed_and_locked_ones_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.film");
        // A temporary file of a running writer, and an abandoned one.
        let other = Draft::begin(&path).unwrap();
        let left = folder.path().join(".stride-a.film-dead.tmp");
        fs::write(&left, "half").unwrap();
        let unrelated = folder.path().join(".stride-ab.film-dead.tmp");
        fs::write(&unrelated, "half").unwrap();
        let ours = Draft::begin(&path).unwrap();
        assert!(other.file.path().exists() && ours.file.path().exists() && unrelated.exists());
        assert!(!left.exists());
        other.file().unwrap().write_all(b"theirs").unwrap();
        other.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"theirs");
        ours.file().unwrap().write_all(b"ours").unwrap();
        ours.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"ours");
        assert_eq!(names(folder.path()), [".stride-ab.film-dead.tmp", "a.film"]);
        // The final file is not a temporary one: it is not locked.
        File::open(&path).unwrap().try_lock().unwrap();
    }

    #[test]
    fn concurrent_writers_do_not_remove_each_others_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.film");
        std::thread::scope(|scope| {
            for writer in 0..8 {
                let path = &path;
                scope.spawn(move || {
                    for round in 0..40 {
                        let draft = Draft::begin(path).unwrap();
                        write!(draft.file().unwrap(), "{writer} {round}").unwrap();
                        draft.commit().unwrap();
                    }
                });
            }
        });
        assert_eq!(names(folder.path()), ["a.film"]);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = check_place(&folder.path().join("no/such/a.png")).unwrap_err();
        assert!(matches!(&error, OutputError::NoFolder { folder, .. } if folder.ends_with("no/such")));
        assert!(error.to_string().contains("create it"), "{error}");
        assert!(matches!(write(&folder.path().join("no/a"), b"").unwrap_err(), OutputError::NoFolder { .. }));
    }

    #[test]
    fn a_folder_or_a_file_in_the_way_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("a.png")).unwrap();
        fs::write(folder.path().join("file"), "").unwrap();
        let error = check_place(&folder.path().join("a.png")).unwrap_err();
        assert!(matches!(error, OutputError::IsFolder { .. }), "{error}");
        for inside in ["file/a.png", "file/b/a.png"] {
            let error = check_place(&folder.path().join(inside)).unwrap_err();
            assert!(matches!(error, OutputError::NotAFolder { .. }), "{error}");
        }
    }

    #[test]
    fn a_name_too_long_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("{}.png", "a".repeat(300)));
        assert!(matches!(check_place(&path), Err(OutputError::Io { .. })));
    }

    #[cfg(unix)]
    mod unix {
        use std::os::unix::fs::{PermissionsExt, symlink};
        use std::process::Command;

        use super::*;

        fn mode(path: &Path) -> u32 {
            fs::metadata(path).unwrap().permissions().mode() & 0o777
        }

        #[test]
        fn a_new_file_follows_the_umask_and_a_replaced_one_keeps_its_mode() {
            let folder = tempfile::tempdir().unwrap();
            let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
            fs::write(&plain, "").unwrap();
            write(&ours, b"").unwrap();
            assert_eq!(mode(&ours), mode(&plain));

            fs::set_permissions(&ours, Permissions::from_mode(0o640)).unwrap();
            write(&ours, b"again").unwrap();
            assert_eq!(mode(&ours), 0o640);
        }

        #[test]
        fn a_link_stays_a_link() {
            let folder = tempfile::tempdir().unwrap();
            fs::create_dir(folder.path().join("real")).unwrap();
            let (link, dangling) = (folder.path().join("link"), folder.path().join("dangling"));
            fs::write(folder.path().join("real/a"), "old").unwrap();
            symlink("real/a", &link).unwrap();
            symlink("real/b", &dangling).unwrap();
            write(&link, b"new").unwrap();
            write(&dangling, b"new").unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read(folder.path().join("real/a")).unwrap(), b"new");
            assert_eq!(fs::read(folder.path().join("real/b")).unwrap(), b"new");
        }

        #[test]
        fn links_in_a_circle_are_refused() {
            let folder = tempfile::tempdir().unwrap();
            symlink("b", folder.path().join("a")).unwrap();
            symlink("a", folder.path().join("b")).unwrap();
            let error = check_place(&folder.path().join("a")).unwrap_err();
            assert!(error.to_string().contains("circular"), "{error}");
        }

        #[test]
        fn a_read_only_file_is_refused_even_for_root() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.png");
            fs::write(&path, "keep").unwrap();
            fs::set_permissions(&path, Permissions::from_mode(0o444)).unwrap();
            assert!(matches!(check_place(&path), Err(OutputError::Protected { .. })));
            assert!(matches!(write(&path, b"new"), Err(OutputError::Protected { .. })));
            assert_eq!(fs::read(&path).unwrap(), b"keep");
        }

        #[test]
        fn a_pipe_and_a_device_are_refused() {
            let folder = tempfile::tempdir().unwrap();
            let pipe = folder.path().join("a.png");
            if Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()) {
                assert!(matches!(check_place(&pipe), Err(OutputError::NotAFile { .. })));
            }
            let device = folder.path().join("b.png");
            symlink("/dev/null", &device).unwrap();
            assert!(matches!(check_place(&device), Err(OutputError::NotAFile { .. })));
        }

        #[test]
        fn a_locked_folder_is_refused() {
            let folder = tempfile::tempdir().unwrap();
            fs::set_permissions(folder.path(), Permissions::from_mode(0o555)).unwrap();
            let path = folder.path().join("a.png");
            // Root may write anywhere, so that nothing is rejected.
            if fs::write(folder.path().join("probe"), "").is_ok() {
                println!("skipped: this user may write into a read-only folder");
                return;
            }
            assert!(matches!(check_place(&path), Err(OutputError::Denied { .. })));
        }
    }

    #[test]
    fn system_errors_have_specific_messages() {
        let path = Path::new("sub/a.png");
        let full = OutputError::from_io(path, ErrorKind::StorageFull.into());
        assert_eq!(
            full.to_string(),
            "cannot write \"sub/a.png\": the disk is full; free some space or choose another disk"
        );
        let denied = OutputError::from_io(path, ErrorKind::ReadOnlyFilesystem.into());
        assert!(matches!(&denied, OutputError::Denied { folder, .. } if folder == Path::new("sub")));
    }
}
