//! The files of a scene: their list, and the cache in which they are kept.
//!
//! A scene is laid out below one folder, as it was on the machine that submitted it, so that relative paths stay valid. A
//! worker does not trust it: paths are plain names, contents match their hashes, sizes are limited, and the readers of the
//! scene are confined to the folder.

use super::broker::Broker;
use super::job::{Job, Manifest, SceneFile, unique};
use super::uploads::Linked;
use crate::fleet::FleetError;
use crate::scene::{LoadOptions, Loaded, load_with};
use crate::texture::access;
use data_encoding::HEXLOWER;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Component, Path, PathBuf};

/// The most files of a scene.
const MOST_FILES: usize = 20_000;

/// The longest path of a file in bytes, and the most folders in it.
const LONGEST_PATH: usize = 1000;

/// Loads a scene and lists its files.
///
/// # Errors
///
/// If it cannot be read, or names files by absolute paths, even if these are in its folder: workers have other folders.
pub(super) fn load_with_files(
    scene: &Path,
    options: &LoadOptions,
) -> Result<(Loaded, Vec<PathBuf>), FleetError> {
    let failed = |reason| FleetError::File { path: scene.to_path_buf(), reason };
    let load = || load_with(scene, options, &mut |_, _, _| {});
    let (loaded, files) = access::watched(None, load).map_err(failed)?;
    let loaded = loaded?;
    match files.absolute.first() {
        None => Ok((loaded, files.opened)),
        Some(name) => Err(FleetError::Job(format!(
            "the scene names {name:?} by an absolute path, which other machines do not have: use a path relative to the scene file"
        ))),
    }
}

/// The manifest of a scene's files, and the path of each on this machine.
pub(super) fn manifest(scene: &Path, files: &[PathBuf]) -> Result<(Manifest, Vec<PathBuf>), FleetError> {
    let own = absolute(scene)?;
    let mut all = Vec::new();
    for file in files {
        all.push((absolute(file)?, file.clone()));
    }
    if !all.iter().any(|(plain, _)| *plain == own) {
        all.push((own.clone(), scene.to_path_buf()));
    }
    all.sort();
    all.dedup_by(|a, b| a.0 == b.0);
    let root = common_folder(&all, &own);
    let mut manifest = Manifest::default();
    for (plain, path) in &all {
        let names = plain.strip_prefix(&root).unwrap_or(plain).components();
        let names = names.map(|name| name.as_os_str().to_str()).collect::<Option<Vec<_>>>();
        let names = names.ok_or_else(|| {
            FleetError::Job(format!(
                "the name of {path:?} is not UTF-8, which not all machines allow: rename it"
            ))
        })?;
        if *plain == own {
            manifest.scene = manifest.files.len();
        }
        let (sha256, bytes) = hash(path)?;
        manifest.files.push(SceneFile { path: names.join("/"), sha256, bytes });
    }
    check(&manifest, u64::MAX)?;
    Ok((manifest, all.into_iter().map(|(_, path)| path).collect()))
}

/// A path without `.` and `..`, from the root on. Links are kept: the files are laid out as the scene names them.
fn absolute(path: &Path) -> Result<PathBuf, FleetError> {
    let failed = |reason| FleetError::File { path: path.to_path_buf(), reason };
    let mut plain = PathBuf::new();
    for part in std::path::absolute(path).map_err(failed)?.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            other => plain.push(other),
        }
    }
    Ok(plain)
}

fn common_folder(files: &[(PathBuf, PathBuf)], scene: &Path) -> PathBuf {
    let mut root = scene.parent().unwrap_or(Path::new("/")).to_path_buf();
    while !files.iter().all(|(plain, _)| plain.starts_with(&root)) && root.pop() {}
    root
}

fn hash(path: &Path) -> Result<(String, u64), FleetError> {
    let failed = |reason| FleetError::File { path: path.to_path_buf(), reason };
    let (mut digest, mut bytes) = (Sha256::new(), 0);
    let mut file = File::open(path).map_err(failed)?;
    let mut piece = vec![0; 1 << 16];
    loop {
        let read = file.read(&mut piece).map_err(failed)?;
        if read == 0 {
            return Ok((HEXLOWER.encode(&digest.finalize()), bytes));
        }
        digest.update(&piece[..read]);
        bytes += read as u64;
    }
}

/// Refuses manifests that lead out of their folder, or are too large.
fn check(manifest: &Manifest, most_bytes: u64) -> Result<(), FleetError> {
    let refuse = |why: String| Err(FleetError::Refused(format!("the files of the scene are refused: {why}")));
    let files = &manifest.files;
    if files.len() > MOST_FILES || manifest.scene >= files.len() {
        return refuse(format!("there are {} of them, and at most {MOST_FILES} are allowed", files.len()));
    }
    let bytes = files.iter().fold(0_u64, |sum, file| sum.saturating_add(file.bytes));
    if bytes > most_bytes {
        return refuse(format!("they have {bytes} bytes, and {most_bytes} are allowed (--cache-size)"));
    }
    for file in files {
        let path = Path::new(&file.path);
        let is_plain = path.components().all(|part| matches!(part, Component::Normal(_)))
            && file.path.split('/').all(|name| !name.is_empty() && name != "." && name != "..")
            && !file.path.contains(['\\', ':', '\0'])
            && file.path.len() <= LONGEST_PATH;
        if !is_plain {
            return refuse(format!("{:?} is not a plain path", file.path));
        }
        let is_hash = file.sha256.len() == 64
            && file.sha256.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
        if !is_hash {
            return refuse(format!("the hash of {:?} is not one", file.path));
        }
    }
    Ok(())
}

/// The files of scenes on this machine.
pub(super) struct Cache {
    folder: PathBuf,
    most_bytes: u64,
}

impl Cache {
    pub(super) fn open(folder: &Path, most_bytes: u64) -> Result<Cache, FleetError> {
        for name in ["files", "jobs"] {
            let path = folder.join(name);
            fs::create_dir_all(&path).map_err(|reason| FleetError::File { path, reason })?;
        }
        Ok(Cache { folder: folder.to_path_buf(), most_bytes })
    }

    /// Loads the scene of a job, confined to its files. Other programs do not remove them meanwhile.
    pub(super) fn load(&self, broker: &Broker, job: &Job) -> Result<Loaded, FleetError> {
        check(&job.scene, self.most_bytes)?;
        let path = self.folder.join("lock");
        let lock = File::options().create(true).truncate(false).write(true).open(&path);
        let lock = lock.map_err(|reason| FleetError::File { path, reason })?;
        match lock.try_lock() {
            // Another program loads a scene: the cache becomes larger for a while.
            Err(TryLockError::WouldBlock) => {}
            // A file system without locks is taken to have one user.
            Ok(()) | Err(TryLockError::Error(_)) => self.make_room(job)?,
        }
        // In place of the other lock. It ends with the file.
        let _ = lock.unlock();
        let _ = lock.lock_shared();
        let root = self.folder.join("jobs").join(&job.id);
        for file in &job.scene.files {
            let kept = self.fetch(broker, file)?;
            let place = root.join(&file.path);
            let failed = |reason| FleetError::File { path: place.clone(), reason };
            if place.metadata().is_ok_and(|metadata| metadata.len() == file.bytes) {
                continue;
            }
            fs::create_dir_all(place.parent().unwrap_or(&root)).map_err(failed)?;
            // A link where the file system allows it.
            if fs::hard_link(&kept, &place).is_err() {
                let half = root.join(unique("half"));
                fs::copy(&kept, &half).and_then(|_| fs::rename(&half, &place)).map_err(failed)?;
            }
        }
        let scene = root.join(&job.scene.files[job.scene.scene].path);
        let failed = |reason| FleetError::File { path: root.clone(), reason };
        // The scene is confined to the folder of all its files, which may be above its own.
        let options = job.settings.reading(false, true);
        let load = || load_with(&scene, &options, &mut |_, _, _| {});
        let (loaded, _) = access::watched(Some(&root), load).map_err(failed)?;
        Ok(loaded?)
    }

    /// A file of a scene, fetched if it is not here.
    fn fetch(&self, broker: &Broker, file: &SceneFile) -> Result<PathBuf, FleetError> {
        let place = self.folder.join("files").join(&file.sha256);
        if place.metadata().is_ok_and(|metadata| metadata.len() == file.bytes) {
            return Ok(place);
        }
        let refuse = |why: &str| FleetError::Refused(format!("{:?} of the scene {why}", file.path));
        let half = self.folder.join("files").join(unique("half"));
        let failed = |reason: io::Error| FleetError::File { path: half.clone(), reason };
        let missing = || {
            FleetError::Incomplete(format!(
                "{:?} of the scene is missing on the server; submit the job again",
                file.path
            ))
        };
        let linked = Linked::find(broker, &file.sha256)?.ok_or_else(missing)?;
        let mut out = File::create(&half).map_err(failed)?;
        let (mut digest, mut bytes, mut part) = (Sha256::new(), 0, 0);
        let fetched = loop {
            if bytes == file.bytes && part > 0 {
                break Ok(());
            }
            let piece = match linked.part(broker, part) {
                Ok(Some(piece)) => piece,
                Ok(None) => break Err(missing()),
                Err(error) => break Err(error),
            };
            bytes += piece.len() as u64;
            if bytes > file.bytes || (piece.is_empty() && file.bytes > 0) {
                break Err(refuse("has another length on the server than the job says"));
            }
            digest.update(&piece);
            if let Err(error) = out.write_all(&piece) {
                break Err(failed(error));
            }
            part += 1;
        };
        let fetched = fetched.and_then(|()| match HEXLOWER.encode(&digest.finalize()) == file.sha256 {
            // On the disk first: only lengths are compared later.
            true => out.sync_all().and_then(|()| fs::rename(&half, &place)).map_err(failed),
            false => Err(refuse("has other contents on the server than the job says; submit the job again")),
        });
        if fetched.is_err() {
            let _ = fs::remove_file(&half);
        }
        fetched.map(|()| place)
    }

    /// Removes the files of other jobs when the cache is too large for another one. No program may use it meanwhile.
    fn make_room(&self, job: &Job) -> Result<(), FleetError> {
        let files = self.folder.join("files");
        let failed = |reason| FleetError::File { path: files.clone(), reason };
        let mut needed: BTreeMap<&str, u64> =
            job.scene.files.iter().map(|file| (&*file.sha256, file.bytes)).collect();
        let (mut kept, mut total) = (Vec::new(), 0_u64);
        for entry in fs::read_dir(&files).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            // Another worker may have renamed or removed it.
            let Ok(metadata) = entry.metadata() else { continue };
            total += metadata.len();
            match entry.file_name().to_str().and_then(|name| needed.remove(name)) {
                Some(bytes) if bytes == metadata.len() => {}
                _ => kept.push((metadata.modified().ok(), entry.path(), metadata.len())),
            }
        }
        let needed: u64 = needed.values().sum();
        if total.saturating_add(needed) <= self.most_bytes {
            return Ok(());
        }
        // Layouts hold links to the same contents.
        for entry in fs::read_dir(self.folder.join("jobs")).map_err(failed)?.flatten() {
            let _ = fs::remove_dir_all(entry.path());
        }
        kept.sort();
        let mut room = self.most_bytes.saturating_sub(total);
        for (_, path, bytes) in kept {
            if room >= needed {
                break;
            }
            match fs::remove_file(&path) {
                Ok(()) => room += bytes,
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(reason) => return Err(FleetError::File { path, reason }),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_laid_out_below_their_common_folder() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["scenes", "textures"] {
            fs::create_dir(path(name)).unwrap();
        }
        fs::write(path("scenes/a.toml"), "x").unwrap();
        fs::write(path("textures/t.png"), "yy").unwrap();
        let files = [path("scenes/a.toml"), path("scenes/../textures/t.png")];
        let (manifest, paths) = manifest(&path("scenes/a.toml"), &files).unwrap();
        let names: Vec<_> = manifest.files.iter().map(|file| &file.path[..]).collect();
        assert_eq!((names, manifest.scene), (vec!["scenes/a.toml", "textures/t.png"], 0));
        assert_eq!((manifest.files[1].bytes, paths.len()), (2, 2));
    }

    #[test]
    fn absolute_names_are_refused_by_every_reader() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let write = |name: &str, text: &str| fs::write(path(name), text).unwrap();
        fs::create_dir(path("meshes")).unwrap();
        let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
        write("m.obj", obj);
        write("meshes/n.obj", obj);
        write("red.mtl", "newmtl red\nKd 1 0 0\n");
        image::RgbImage::new(1, 1).save(path("p.png")).unwrap();
        write("inner.xml", "<scene version=\"3.0.0\"/>");
        let own = |file: &str| {
            format!(
                "materials.m = {{ type = \"matte\", reflectance = [0.5, 0.5, 0.5] }}\n[[entities]]\nshape = {{ type = \"mesh\", {file} }}\nmaterial = \"m\"\n"
            )
        };
        let xml =
            |body: String| format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{body}</scene>");
        let shape =
            |file: &str| format!("<shape type=\"obj\"><string name=\"filename\" value=\"{file}\"/></shape>");
        let picture = |file: &str| format!("[environment]\nfile = \"{file}\"\n");
        let library = |file: &str| {
            write("library.obj", &format!("mtllib {file}\n{obj}"));
            own("file = \"library.obj\", materials = \"file\"")
        };
        type Scene<'a> = &'a dyn Fn(&str) -> String;
        let scenes: [(&str, &str, Scene<'_>); 6] = [
            ("a.toml", "m.obj", &|file| own(&format!("file = \"{file}\""))),
            ("a.toml", "p.png", &picture),
            ("a.toml", "red.mtl", &library),
            ("a.xml", "m.obj", &|file| xml(shape(file))),
            ("a.xml", "inner.xml", &|file| xml(format!("<include filename=\"{file}\"/>"))),
            ("a.xml", "meshes", &|file| xml(format!("<path value=\"{file}\"/>{}", shape("n.obj")))),
        ];
        for (scene, name, text) in scenes {
            // Negative control: the name alone.
            write(scene, &text(name));
            let load = || load_with_files(Path::new(&path(scene)), &LoadOptions::default());
            let (_, files) = load().unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(files.len() > 1 && manifest(Path::new(&path(scene)), &files).is_ok(), "{files:?}");
            write(scene, &text(&path(name)));
            let error = load().map(drop).unwrap_err().to_string();
            assert!(error.contains("absolute path") && error.contains(name), "{error}");
        }
        // A folder from which no file comes.
        write("a.xml", &xml(format!("<path value=\"{}\"/>{}", path("meshes"), shape("m.obj"))));
        assert!(load_with_files(Path::new(&path("a.xml")), &LoadOptions::default()).is_ok());
    }

    #[test]
    fn manifests_that_lead_elsewhere_are_refused() {
        let file = |path: &str| SceneFile { path: path.into(), sha256: "0".repeat(64), bytes: 5 };
        let is_good = |files: Vec<SceneFile>, most: u64| check(&Manifest { scene: 0, files }, most).is_ok();
        assert!(is_good(vec![file("a/b.toml")], 5));
        assert!(!is_good(vec![file("a/b.toml")], 4) && !is_good(vec![], 5));
        for path in ["/etc/passwd", "../a", "a/../../b", "", "a//b", "a/", "c:\\x", "./a", "a\\..\\b"] {
            assert!(!is_good(vec![file(path)], 5), "{path}");
        }
        let wrong = SceneFile { sha256: "../x".into(), ..file("a") };
        assert!(!is_good(vec![wrong], 5));
    }
}
