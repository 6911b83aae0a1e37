//! Which files the readers of a scene open, and which they may open.
//!
//! A caller that sends a scene elsewhere needs the list of its files, and must know whether it names some by absolute
//! paths. A caller that loads a scene that it does not trust confines the readers to a folder. All readers get paths from
//! `named`, and call `opening` first. They run on the caller's thread, so that one load does not affect another.

use std::cell::RefCell;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

/// What is known of the load in progress.
#[derive(Default)]
struct Load {
    /// The folder outside of which no file may be opened; canonical.
    root: Option<PathBuf>,
    files: Files,
}

/// The files of a scene.
#[derive(Debug, Default)]
pub struct Files {
    /// The files that were opened, each once, by the paths that were used.
    pub opened: Vec<PathBuf>,
    /// The absolute paths among the names in the scene, which other machines do not have.
    pub absolute: Vec<String>,
}

thread_local! {
    static LOAD: RefCell<Option<Load>> = const { RefCell::new(None) };
}

/// Runs a function that loads a scene. Returns its result and the scene's files. If a folder is given, which must exist,
/// files outside of it are refused.
pub fn watched<T>(root: Option<&Path>, load: impl FnOnce() -> T) -> io::Result<(T, Files)> {
    let root = root.map(Path::canonicalize).transpose()?;
    let before = LOAD.replace(Some(Load { root, files: Files::default() }));
    let loaded = load();
    let mut files = LOAD.replace(before).unwrap_or_default().files;
    files.opened.sort();
    files.opened.dedup();
    files.absolute.sort();
    files.absolute.dedup();
    Ok((loaded, files))
}

/// The path of a file or folder by its name in a scene, which is relative to `folder` or absolute.
pub(crate) fn named(folder: &Path, name: &str) -> PathBuf {
    let is_relative =
        !matches!(Path::new(name).components().next(), Some(Component::Prefix(_) | Component::RootDir));
    LOAD.with_borrow_mut(|load| {
        if let Some(load) = load.as_mut().filter(|_| !is_relative) {
            load.files.absolute.push(name.to_owned());
        }
    });
    folder.join(name)
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
        load.files.opened.push(path.to_path_buf());
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
        let (may, files) = watched(None, || [&a, &b, &a].map(|path| opening(path).is_ok())).unwrap();
        assert_eq!((may, files.opened), ([true; 3], vec![a.clone(), b]));
        assert!(opening(&a).is_ok());
        assert!(watched(None, || ()).unwrap().1.opened.is_empty());
    }

    #[test]
    fn absolute_names_are_listed_even_inside_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("a.ply").to_str().unwrap().to_owned();
        let names = ["a.ply", "../a.ply", &inside, &inside];
        let (paths, files) = watched(None, || names.map(|name| named(folder.path(), name))).unwrap();
        assert_eq!(files.absolute, [inside]);
        assert!(paths[0] == paths[2] && files.opened.is_empty());
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
