//! The mesh files of a scene, each of which is read once.

use super::{MeshFile, MeshFileError, Split};
use crate::scene::fingerprint::Sources;
use crate::texture::access;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A progress callback: the file, the bytes read so far, and the file's length.
pub type Watch<'a> = &'a mut dyn FnMut(&Path, u64, u64);

/// Mesh files by path and by split. Entities of one file share its meshes.
pub struct MeshCache<'w> {
    /// The folder that names are relative to.
    folder: PathBuf,
    /// Files, each with the first name by which it was read. Names that differ in spelling, such as `a.ply` and
    /// `./a.ply`, are equal as paths.
    read: HashMap<(PathBuf, Split), (String, Arc<MeshFile>)>,
    /// Unreadable files.
    unreadable: HashSet<PathBuf>,
    /// Notes that were returned already: a file that is split in two ways yields most of its notes twice.
    noted: HashSet<(PathBuf, String)>,
    watch: Option<Watch<'w>>,
}

/// A mesh file, with its new notes.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// What is in the file.
    pub file: Arc<MeshFile>,
    /// Omissions, repairs and approximations, with the path of the file; only those not returned before.
    pub notes: Vec<String>,
}

/// A mesh file that cannot be read.
#[derive(Debug)]
pub enum Unreadable {
    /// The reason, at the first attempt.
    First(MeshFileError),
    /// The same reason, which has been reported.
    Again,
}

impl<'w> MeshCache<'w> {
    /// An empty cache for names relative to `folder`.
    pub fn new(folder: &Path, watch: Option<Watch<'w>>) -> Self {
        Self {
            folder: folder.into(),
            read: HashMap::new(),
            unreadable: HashSet::new(),
            noted: HashSet::new(),
            watch,
        }
    }

    /// The contents of a mesh file, which is read once for each way to split it.
    pub fn get(&mut self, file: &str, split: Split) -> Result<Found, Unreadable> {
        let name = file;
        let path = &access::named(&self.folder, name);
        // Paths ignore `.` except at the beginning, where it is if the scene is in the current folder.
        let key = (path.strip_prefix(".").unwrap_or(path).to_path_buf(), split);
        if let Some((_, file)) = self.read.get(&key) {
            return Ok(Found { file: Arc::clone(file), notes: Vec::new() });
        }
        let (plain, split) = &key;
        // A file that is unreadable as a whole is unreadable in parts, too.
        if self.unreadable.contains(plain) {
            return Err(Unreadable::Again);
        }
        let mut unheard = |_: &Path, _, _| {};
        let watch: Watch<'_> = match &mut self.watch {
            Some(watch) => *watch,
            None => &mut unheard,
        };
        let file = match super::read(path, split, &mut |bytes, of| watch(path, bytes, of)) {
            Ok(file) => Arc::new(file),
            Err(error) => {
                self.unreadable.insert(plain.clone());
                return Err(Unreadable::First(error));
            }
        };
        // With other splits, the file's materials are unused.
        let uses_materials = *split == Split::Materials;
        let notes = file.notes.iter().filter(|note| uses_materials || !note.is_of_material);
        let new = notes.filter(|note| self.noted.insert((plain.clone(), note.message.clone())));
        let notes = new.map(|note| format!("{}: {note}", path.display())).collect();
        self.read.insert(key, (name.to_owned(), Arc::clone(&file)));
        Ok(Found { file, notes })
    }

    /// The meshes that were read, with their sources: names do not depend on the path of the scene.
    pub fn sources(&self) -> Sources {
        let mut sources = Vec::new();
        for (name, file) in self.read.values() {
            for (part, mesh) in &file.parts {
                let separator = if part.is_empty() { "" } else { ": " };
                sources.push((format!("{name}{separator}{part}"), Arc::clone(mesh)));
            }
        }
        sources.sort_by(|a, b| a.0.cmp(&b.0));
        Sources(sources)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_and_its_notes_are_returned_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\ng wall\nf 1 2 3\nf 1 2\n";
        std::fs::write(folder.path().join("wall.obj"), text).expect("written");
        let mut cache = MeshCache::new(folder.path(), None);
        let first = cache.get("wall.obj", Split::Whole).expect("a mesh");
        assert_eq!(first.notes.len(), 1, "{:?}", first.notes);
        let again = cache.get("wall.obj", Split::Whole).expect("a mesh");
        assert!(Arc::ptr_eq(&first.file, &again.file) && again.notes.is_empty());
        let parts = cache.get("wall.obj", Split::Named(vec!["wall".into()])).expect("a mesh");
        assert!(!Arc::ptr_eq(&first.file, &parts.file) && parts.notes.is_empty());
        let names: Vec<_> = cache.sources().0.into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["wall.obj", "wall.obj: wall"]);
    }

    #[test]
    fn names_that_are_equal_as_paths_are_one_file() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
        let mut cache = MeshCache::new(folder.path(), None);
        let first = cache.get("a.obj", Split::Whole).expect("a mesh");
        let again = cache.get("./a.obj", Split::Whole).expect("a mesh");
        assert!(Arc::ptr_eq(&first.file, &again.file));
        let names: Vec<_> = cache.sources().0.into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["a.obj"]);
        // The path of a scene in the current folder may have no folder.
        let mut cache = MeshCache::new(Path::new(""), None);
        assert!(matches!(cache.get("nowhere.ply", Split::Whole), Err(Unreadable::First(_))));
        assert!(matches!(cache.get("./nowhere.ply", Split::Whole), Err(Unreadable::Again)));
    }

    #[test]
    fn an_unreadable_file_is_reported_once() {
        let mut cache = MeshCache::new(Path::new("/nowhere"), None);
        assert!(matches!(cache.get("a.ply", Split::Whole), Err(Unreadable::First(_))));
        assert!(matches!(cache.get("a.ply", Split::Whole), Err(Unreadable::Again)));
        assert!(matches!(cache.get("a.ply", Split::Materials), Err(Unreadable::Again)));
        assert!(cache.sources().0.is_empty());
    }
}
