//! The mesh files of a scene, each of which is read once.

use super::{MeshFile, MeshFileError, Split};
use crate::scene::fingerprint::Sources;
use crate::texture::access;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A progress callback: the file, the bytes read so far, and the file's length.
pub type Watch<'a> = &'a mut dyn FnMut(&Path, u64, u64);

/// Mesh files by name and by split. Entities of one file share its meshes.
pub struct MeshCache<'w> {
    /// The folder that names are relative to.
    folder: PathBuf,
    read: HashMap<(String, Split), Arc<MeshFile>>,
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
        let key = (file.to_owned(), split);
        if let Some(file) = self.read.get(&key) {
            return Ok(Found { file: Arc::clone(file), notes: Vec::new() });
        }
        let (path, split) = (&access::named(&self.folder, file), &key.1);
        // A file that is unreadable as a whole is unreadable in parts, too.
        if self.unreadable.contains(path) {
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
                self.unreadable.insert(path.clone());
                return Err(Unreadable::First(error));
            }
        };
        // With other splits, the file's materials are unused.
        let uses_materials = *split == Split::Materials;
        let notes = file.notes.iter().filter(|note| uses_materials || !note.is_of_material);
        let new = notes.filter(|note| self.noted.insert((path.clone(), note.message.clone())));
        let notes = new.map(|note| format!("{}: {note}", path.display())).collect();
        self.read.insert(key, Arc::clone(&file));
        Ok(Found { file, notes })
    }

    /// The meshes that were read, with their sources: names do not depend on the path of the scene.
    pub fn sources(&self) -> Sources {
        let mut sources = Vec::new();
        for ((name, _), file) in &self.read {
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
    fn an_unreadable_file_is_reported_once() {
        let mut cache = MeshCache::new(Path::new("/nowhere"), None);
        assert!(matches!(cache.get("a.ply", Split::Whole), Err(Unreadable::First(_))));
        assert!(matches!(cache.get("a.ply", Split::Whole), Err(Unreadable::Again)));
        assert!(matches!(cache.get("a.ply", Split::Materials), Err(Unreadable::Again)));
        assert!(cache.sources().0.is_empty());
    }
}
