//! Which files the readers of a scene open, and which they may open.
//!
//! A caller that sends a scene elsewhere needs the list of its files. A caller that loads a scene that it does not trust
//! confines the readers to a folder. All readers of files call `opening` first. Readers run on the caller's thread, so
//! that one load does not affect another.

use std::cell::RefCell;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// What is known of the load in progress.
#[derive(Default)]
struct Load {
    /// The folder outside of which no file may be opened; canonical.
    root: Option<PathBuf>,
    opened: Vec<PathBuf>,
}

thread_local! {
    static LOAD: RefCell<Option<Load>> = const { RefCell::new(None) };
}

/// Runs a function that loads a scene. Returns its result and the files that it opened, each once, by the paths that it
/// used. If a folder is given, which must exist, files outside of it are refused.
pub fn watched<T>(root: Option<&Path>, load: impl FnOnce() -> T) -> io::Result<(T, Vec<PathBuf>)> {
    let root = root.map(Path::canonicalize).transpose()?;
    let before = LOAD.replace(Some(Load { root, opened: Vec::new() }));
    let loaded = load();
    let watched = LOAD.replace(before).unwrap_or_default();
    let mut opened = watched.opened;
    opened.sort();
    opened.dedup();
    Ok((loaded, opened))
}

/// Records that a file is about to be opened; fails if it must not be.
pub(crate) fn opening(path: &Path) -> io::Result<()> {
    LOAD.with_borrow_mut(|load| {
        let Some(load) = load else { return Ok(()) };
        if let Some(root) = &load.root {
            // Links are followed: what counts is the file that would be read.
            if !path.canonicalize()?.starts_with(root) {
                let message = "it is outside the folder that this scene is confined to";
                return Err(io::Error::new(ErrorKind::PermissionDenied, message));
            }
        }
        load.opened.push(path.to_path_buf());
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opened_files_are_listed_once_and_only_while_watched() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        let watch = |root| watched(root, || [&a, &b, &a].map(|path| opening(path).is_ok())).unwrap();
        assert_eq!(watch(None), ([true; 3], vec![a.clone(), b.clone()]));
        assert!(opening(&a).is_ok());
        assert!(watched(None, || ()).unwrap().1.is_empty());
    }

    #[test]
    fn files_outside_the_folder_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (inside, outside) = (folder.path().join("in"), folder.path().join("out.txt"));
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(&outside, "secret").unwrap();
        std::fs::write(inside.join("own.txt"), "own").unwrap();
        let ways = [inside.join("own.txt"), outside.clone(), inside.join("../out.txt"), inside.join("none")];
        let (allowed, _) =
            watched(Some(&inside), || ways.each_ref().map(|way| opening(way).is_ok())).unwrap();
        assert_eq!(allowed, [true, false, false, false]);
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&outside, inside.join("link")).unwrap();
            let (allowed, _) = watched(Some(&inside), || opening(&inside.join("link")).is_ok()).unwrap();
            assert!(!allowed);
        }
    }
}
