//! The files that a scene refers to, and the folders in which they are searched for.

use crate::scene::spelling::quote;
use std::path::{Path, PathBuf};

/// The folders that files of a scene may be in.
#[derive(Debug)]
pub(super) struct Files {
    /// The scene's folder, with symbolic links resolved; none if it does not exist, and then no file may be read.
    root: Option<PathBuf>,
    allow_outside: bool,
}

impl Files {
    /// The folders of the scene file at a path.
    pub(super) fn of(scene: &Path, allow_outside: bool) -> Files {
        let folder = scene.parent().filter(|folder| !folder.as_os_str().is_empty());
        Files { root: folder.unwrap_or(Path::new(".")).canonicalize().ok(), allow_outside }
    }

    /// The path of the file `name`, from the first of the folders that contains it; otherwise a message and a remedy.
    pub(super) fn find(&self, name: &str, folders: &[PathBuf]) -> Result<PathBuf, (String, Option<String>)> {
        let mut candidates = folders.iter().map(|folder| folder.join(name));
        let found = candidates.find_map(|path| {
            let real = path.canonicalize().ok()?;
            Some((path, real))
        });
        let Some((path, real)) = found else {
            let message =
                format!("there is no file {} in the scene's folder, nor where <path> points", quote(name));
            return Err((message, None));
        };
        let is_inside = self.root.as_ref().is_some_and(|root| real.starts_with(root));
        if !is_inside && !self.allow_outside {
            let message = format!("{} is outside the scene's folder", quote(name));
            return Err((message, Some("use --allow-outside to read it".into())));
        }
        Ok(path)
    }
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
        let folders = [inner.join("meshes"), inner.clone()];
        let files = Files::of(&inner.join("a.xml"), false);
        assert_eq!(files.find("a.ply", &folders), Ok(inner.join("meshes/a.ply")));
        assert_eq!(files.find("../a.ply", &folders), Ok(inner.join("meshes/../a.ply")));
        let message = |files: &Files, name: &str| files.find(name, &folders).unwrap_err().0;
        let missing = "there is no file \"b.ply\" in the scene's folder, nor where <path> points";
        assert_eq!(message(&files, "b.ply"), missing);
        let outside = "\"../secret.ply\" is outside the scene's folder";
        assert_eq!(message(&files, "../secret.ply"), outside);
        let absolute = outer.path().join("secret.ply");
        assert!(files.find(absolute.to_str().unwrap(), &folders).is_err());
        let files = Files::of(&inner.join("a.xml"), true);
        assert!(files.find("../secret.ply", &folders).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_outside_is_outside() {
        let outer = tempfile::tempdir().expect("a folder");
        let inner = outer.path().join("scene");
        std::fs::create_dir(&inner).expect("made");
        std::fs::write(outer.path().join("secret.ply"), "").expect("written");
        std::os::unix::fs::symlink(outer.path().join("secret.ply"), inner.join("a.ply")).expect("linked");
        let found = Files::of(&inner.join("a.xml"), false).find("a.ply", &[inner]);
        assert_eq!(found.unwrap_err().0, "\"a.ply\" is outside the scene's folder");
    }
}
