//! The files that a scene refers to, and the folders in which they are searched for.

use crate::scene::spelling::{quote, shorten};
use crate::texture::access;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The folders in which files are searched for, in order. Lists share their ends, because a million elements may
/// include a file.
#[derive(Clone, Debug)]
pub(super) struct Folders(Arc<List>);

#[derive(Debug)]
struct List {
    /// Relative to the scene's folder, or absolute if the scene names it so.
    name: PathBuf,
    rest: Option<Folders>,
    length: usize,
}

impl Folders {
    /// The number of folders.
    pub(super) fn count(&self) -> usize {
        self.0.length
    }

    fn address(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    /// The names of the folders.
    fn iter(&self) -> impl Iterator<Item = &Path> {
        let lists = std::iter::successors(Some(self), |list| list.0.rest.as_ref());
        lists.map(|list| list.0.name.as_path())
    }
}

/// A message and a remedy.
type Refusal = (String, Option<String>);

/// The result of a search for a file.
type Found = Result<Arc<Path>, Refusal>;

/// The folders that files of a scene may be in, and the files that were found.
#[derive(Debug)]
pub(super) struct Files {
    /// The scene's folder.
    folder: PathBuf,
    /// The same with symbolic links resolved; none if it does not exist, and then no file may be read.
    root: Option<PathBuf>,
    allow_outside: bool,
    /// Each list, by the name of its first folder and the address of the rest. Equal lists have the same address.
    lists: RefCell<HashMap<(PathBuf, usize), Folders>>,
    /// The result of searching for a name in a list of folders.
    found: RefCell<HashMap<(usize, String), Found>>,
    /// The first path by which a file was found, by its resolved path and the name in the scene.
    paths: RefCell<HashMap<(PathBuf, OsString), Arc<Path>>>,
    /// The names of these paths.
    names: RefCell<HashMap<Arc<Path>, PathBuf>>,
}

impl Files {
    /// The folders of the scene file at a path, and the list with its folder.
    pub(super) fn of(scene: &Path, allow_outside: bool) -> (Files, Folders) {
        let folder = scene.parent().unwrap_or(Path::new("")).to_path_buf();
        let real = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
        let root = real.canonicalize().ok();
        let (lists, found, paths, names) = Default::default();
        let files = Files { folder, root, allow_outside, lists, found, paths, names };
        let own = files.list(PathBuf::new(), None);
        (files, own)
    }

    /// The scene's folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The name of a file that was found, or of the scene itself: relative to the scene's folder, or absolute if the
    /// scene names the file or its folder so. It does not depend on the path of the scene.
    pub(super) fn name(&self, path: &Path) -> PathBuf {
        let known = self.names.borrow().get(path).cloned();
        known.unwrap_or_else(|| path.strip_prefix(&self.folder).unwrap_or(path).to_path_buf())
    }

    /// The list with one more folder before it, which is named relative to the scene's folder, or absolutely.
    pub(super) fn before(&self, name: PathBuf, rest: &Folders) -> Folders {
        if rest.0.name == name { rest.clone() } else { self.list(name, Some(rest)) }
    }

    fn list(&self, name: PathBuf, rest: Option<&Folders>) -> Folders {
        let length = rest.map_or(0, Folders::count) + 1;
        let key = (name.clone(), rest.map_or(0, Folders::address));
        let made = || Folders(Arc::new(List { name, rest: rest.cloned(), length }));
        self.lists.borrow_mut().entry(key).or_insert_with(made).clone()
    }

    /// The path of the file `name`, from the first of the folders that contains it. If a file has several paths, the
    /// result is always the same one, so that a path identifies the contents.
    pub(super) fn find(&self, name: &str, folders: &Folders) -> Result<Arc<Path>, Refusal> {
        let key = (folders.address(), name.to_owned());
        if let Some(known) = self.found.borrow().get(&key) {
            return known.clone();
        }
        let found = self.look_for(name, folders);
        self.found.borrow_mut().insert(key, found.clone());
        found
    }

    fn look_for(&self, name: &str, folders: &Folders) -> Result<Arc<Path>, Refusal> {
        let found = folders.iter().find_map(|folder| {
            let path = access::named(&self.folder.join(folder), name);
            let real = path.canonicalize().ok()?;
            Some((path, real, folder))
        });
        let Some((path, real, folder)) = found else {
            let message = format!(
                "there is no file {} in the scene's folder, nor where <path> points",
                quote_end(name)
            );
            return Err((message, None));
        };
        let is_inside = self.root.as_ref().is_some_and(|root| real.starts_with(root));
        if !is_inside && !self.allow_outside {
            let message = format!("{} is outside the scene's folder", quote_end(name));
            return Err((message, Some("use --allow-outside to read it".into())));
        }
        if is_pointer(&real) {
            let message = format!("{} is a pointer of Git LFS, not the file itself", quote_end(name));
            return Err((message, Some("run \"git lfs pull\" in its repository".into())));
        }
        // Records the folder if its name is absolute. Folders from which no file comes need not exist elsewhere.
        if let Some(folder) = folder.to_str() {
            access::named(&self.folder, folder);
        }
        // The extension is that of the link, not of its target.
        let called = path.file_name().unwrap_or_default().to_owned();
        let mut paths = self.paths.borrow_mut();
        let first = paths.entry((real, called)).or_insert_with(|| {
            let path: Arc<Path> = path.into();
            self.names.borrow_mut().insert(Arc::clone(&path), folder.join(name));
            path
        });
        Ok(Arc::clone(first))
    }
}

/// A file's name in quotes. Of a long one the end is shown, by which files of a folder differ.
fn quote_end(name: &str) -> String {
    const LONGEST: usize = 40;
    match name.char_indices().rev().nth(LONGEST - 1) {
        Some((at, _)) if at > 0 => format!("\"…{}\"", shorten(&name[at..])),
        _ => quote(name),
    }
}

/// Whether a file is what a checkout without Git LFS has in place of a large file.
fn is_pointer(path: &Path) -> bool {
    const START: &[u8] = b"version https://git-lfs.github.com/spec/";
    let mut start = [0; START.len()];
    let may_open = path.is_file() && access::opening(path).is_ok();
    let opened = if may_open { File::open(path).ok() } else { None };
    opened.is_some_and(|mut file| file.read_exact(&mut start).is_ok()) && start == START
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_in_folders_in_turn_and_outside_only_if_that_is_allowed() {
        let outer = tempfile::tempdir().expect("a folder");
        let inner = outer.path().join("scene");
        std::fs::create_dir_all(inner.join("meshes")).expect("made");
        for file in ["secret.ply", "scene/meshes/a.ply", "scene/a.ply"] {
            std::fs::write(outer.path().join(file), "").expect("written");
        }
        let (files, own) = Files::of(&inner.join("a.xml"), false);
        let folders = files.before(inner.join("meshes"), &own);
        let found = |name: &str| files.find(name, &folders).map(|path| path.to_path_buf());
        assert_eq!(found("a.ply"), Ok(inner.join("meshes/a.ply")));
        assert_eq!(found("../a.ply"), Ok(inner.join("meshes/../a.ply")));
        let message = |files: &Files, name: &str| files.find(name, &folders).unwrap_err().0;
        let missing = "there is no file \"b.ply\" in the scene's folder, nor where <path> points";
        assert_eq!(message(&files, "b.ply"), missing);
        let long = format!("{}/12345678901234567890/1234567890/12345.ply", "é/".repeat(40));
        let end = "there is no file \"…2345678901234567890/1234567890/12345.ply\" in the scene's folder";
        assert!(message(&files, &long).starts_with(end), "{}", message(&files, &long));
        let outside = "\"../secret.ply\" is outside the scene's folder";
        assert_eq!(message(&files, "../secret.ply"), outside);
        let absolute = outer.path().join("secret.ply");
        assert!(files.find(absolute.to_str().unwrap(), &folders).is_err());
        let (files, own) = Files::of(&inner.join("a.xml"), true);
        assert!(files.find("../secret.ply", &own).is_ok());
    }

    #[test]
    fn lists_and_paths_are_each_there_once() {
        let outer = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(outer.path().join("b")).expect("made");
        std::fs::write(outer.path().join("a.ply"), "").expect("written");
        let (files, own) = Files::of(&outer.path().join("a.xml"), false);
        let below = files.before(outer.path().join("b"), &own);
        assert_eq!((own.count(), below.count()), (1, 2));
        assert_eq!(files.before(outer.path().join("b"), &own).address(), below.address());
        // A folder that is already first is not added again.
        assert_eq!(files.before(outer.path().join("b"), &below).address(), below.address());
        assert_ne!(files.before(outer.path().to_path_buf(), &below).address(), own.address());
        let plain = files.find("a.ply", &own).expect("a file");
        for (name, folders) in
            [("./a.ply", &own), ("b/../a.ply", &own), ("../a.ply", &below), ("a.ply", &below)]
        {
            assert_eq!(files.find(name, folders).as_ref(), Ok(&plain), "{name}");
        }
    }

    #[test]
    fn names_are_those_of_the_scene_for_every_spelling_of_its_path() {
        let outer = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(outer.path().join("b")).expect("made");
        for file in ["a.ply", "c.ply", "b/d.ply", "b/e.ply"] {
            std::fs::write(outer.path().join(file), "").expect("written");
        }
        let (absolute, below) = (outer.path().join("a.ply"), outer.path().join("b"));
        for scene in ["a.xml", "b/../a.xml"] {
            let (files, own) = Files::of(&outer.path().join(scene), false);
            let name = |name: &str, folders: &Folders| {
                let path = files.find(name, folders).expect("a file");
                let found = files.name(&path);
                assert_eq!(files.folder().join(&found), *path);
                found
            };
            assert_eq!(files.name(&outer.path().join(scene)), Path::new("a.xml"));
            assert_eq!(name(absolute.to_str().unwrap(), &own), absolute);
            assert_eq!(name("c.ply", &own), Path::new("c.ply"));
            assert_eq!(name("d.ply", &files.before("b".into(), &own)), Path::new("b/d.ply"));
            assert_eq!(name("e.ply", &files.before(below.clone(), &own)), below.join("e.ply"));
        }
    }

    #[test]
    fn folders_with_absolute_names_are_listed_if_a_file_comes_from_them() {
        let outer = tempfile::tempdir().expect("a folder");
        let below = outer.path().join("b");
        std::fs::create_dir(&below).expect("made");
        for file in ["a.ply", "b/d.ply"] {
            std::fs::write(outer.path().join(file), "").expect("written");
        }
        let (files, own) = Files::of(&outer.path().join("a.xml"), false);
        let folders = files.before(below.clone(), &own);
        let absolute = |name: &str| {
            let (found, files) = access::watched(None, || files.find(name, &folders)).expect("a folder");
            assert!(found.is_ok(), "{name}");
            files.absolute
        };
        assert!(absolute("a.ply").is_empty());
        assert_eq!(absolute("d.ply"), [below.to_str().unwrap()]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_outside_is_outside() {
        let outer = tempfile::tempdir().expect("a folder");
        let inner = outer.path().join("scene");
        std::fs::create_dir(&inner).expect("made");
        std::fs::write(outer.path().join("secret.ply"), "").expect("written");
        std::os::unix::fs::symlink(outer.path().join("secret.ply"), inner.join("a.ply")).expect("linked");
        let (files, own) = Files::of(&inner.join("a.xml"), false);
        assert_eq!(files.find("a.ply", &own).unwrap_err().0, "\"a.ply\" is outside the scene's folder");
    }
}
