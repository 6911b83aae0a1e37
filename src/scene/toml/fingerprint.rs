//! What a scene file says, in 32 bytes: whether two renders are of the same scene.
//!
//! It is a digest of the document's values, not of its text, so that comments, white space and the order of
//! keys don't count; nor do `exposure`, `tone` and `samples`, which change no sample. Of every file that the scene
//! names, by a key `file` anywhere in it, the bytes count.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use ::toml::de::{DeTable, DeValue};
use sha2::{Digest, Sha256};

/// A scene file's values and the files that it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sources {
    /// The scene file itself.
    path: PathBuf,
    values: [u8; 32],
    /// In the order in which the values are digested.
    files: Vec<PathBuf>,
}

impl Sources {
    /// Of a document that was read without errors, from the file at `path`.
    pub(super) fn of(document: &DeTable<'_>, path: &Path) -> Sources {
        let mut digest = Sha256::new();
        let mut files = Vec::new();
        let folder = path.parent().unwrap_or(Path::new(""));
        table(document, "", &mut digest, &mut |name| files.push(folder.join(name)));
        Sources { path: path.to_path_buf(), values: digest.finalize().into(), files }
    }

    /// The digest of it all, in hexadecimal digits. Reads the files that the scene names; fails with the one
    /// that can't be read.
    pub fn fingerprint(&self) -> Result<String, (PathBuf, io::Error)> {
        let mut digest = Sha256::new();
        digest.update(self.values);
        for path in &self.files {
            let read = || -> io::Result<_> {
                let mut inner = Sha256::new();
                io::copy(&mut File::open(path)?, &mut HashWriter(&mut inner))?;
                Ok(inner.finalize())
            };
            digest.update(read().map_err(|error| (path.clone(), error))?);
        }
        Ok(digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

struct HashWriter<'a>(&'a mut Sha256);

impl io::Write for HashWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Keys that change no sample, with the table that they are in.
const WITHOUT_EFFECT: [(&str, &str); 3] = [("film", "exposure"), ("film", "tone"), ("render", "samples")];

/// Digests a table: its keys in alphabetical order, lengths before contents so that no two tables look alike.
fn table(table: &DeTable<'_>, name: &str, digest: &mut Sha256, file: &mut impl FnMut(&str)) {
    let counts = |key: &str| !WITHOUT_EFFECT.contains(&(name, key));
    let mut entries: Vec<_> =
        table.iter().map(|(k, v)| (k.get_ref().as_ref(), v.get_ref())).filter(|(k, _)| counts(k)).collect();
    // An empty table says as much as none.
    entries.retain(|(_, v)| !matches!(v, DeValue::Table(table) if table.is_empty()));
    entries.sort_unstable_by_key(|(key, _)| *key);
    tagged(b't', entries.len(), digest);
    for (key, entry) in entries {
        text(key, digest);
        if let (Some("file"), DeValue::String(path)) = (Some(key), entry) {
            file(path);
        }
        value(entry, key, digest, file);
    }
}

fn value(of: &DeValue<'_>, name: &str, digest: &mut Sha256, file: &mut impl FnMut(&str)) {
    match of {
        DeValue::Table(inner) => table(inner, name, digest, file),
        DeValue::Array(items) => {
            tagged(b'a', items.len(), digest);
            items.iter().for_each(|item| value(item.get_ref(), name, digest, file));
        }
        DeValue::String(string) => text(string, digest),
        DeValue::Boolean(boolean) => tagged(b'b', usize::from(*boolean), digest),
        DeValue::Datetime(date) => text(&date.to_string(), digest),
        // A number counts by its value: 1, 1.0 and 0x1 are the same.
        DeValue::Integer(integer) => {
            let parsed = i64::from_str_radix(integer.as_str(), integer.radix());
            number(parsed.map_err(|_| integer.as_str()).map(|integer| integer as f64), digest);
        }
        DeValue::Float(float) => number(float.as_str().parse().map_err(|_| float.as_str()), digest),
    }
}

fn number(parsed: Result<f64, &str>, digest: &mut Sha256) {
    match parsed {
        Ok(value) => {
            tagged(b'n', 8, digest);
            digest.update((value + 0.0).to_bits().to_le_bytes());
        }
        Err(unread) => text(unread, digest),
    }
}

fn text(text: &str, digest: &mut Sha256) {
    tagged(b's', text.len(), digest);
    digest.update(text);
}

fn tagged(tag: u8, len: usize, digest: &mut Sha256) {
    digest.update([tag]);
    digest.update((len as u64).to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn fingerprint(text: &str, path: &Path) -> String {
        let document = DeTable::parse(text).unwrap();
        Sources::of(document.get_ref(), path).fingerprint().unwrap()
    }

    fn of(text: &str) -> String {
        fingerprint(text, Path::new("a.toml"))
    }

    const SCENE: &str = "
        [film]
        width = 64
        [render]
        seed = 7
        [[entities]]
        name = \"ball\"
        shape = { type = \"sphere\", center = [0, 0.5, 1], radius = 1 }
    ";

    #[test]
    fn what_changes_no_sample_changes_no_fingerprint() {
        for (from, to) in [
            ("width = 64", "width = 64 # pixels"),
            ("width = 64", "width = 0x40\n exposure = 3"),
            ("seed = 7", "samples = 12\n\n seed = 7.0"),
            ("seed = 7", "seed = 7\n [environment]"),
            ("center = [0, 0.5, 1], radius = 1", "radius = 1e0, center = [0.0, 5e-1, 1]"),
        ] {
            assert_eq!(of(&SCENE.replacen(from, to, 1)), of(SCENE), "{to}");
        }
    }

    #[test]
    fn everything_else_does() {
        let mut seen = vec![of(SCENE)];
        for (from, to) in [
            ("width = 64", "width = 65"),
            ("width = 64", "widht = 64"),
            ("seed = 7", "seed = 7\n sampler = \"sobol\""),
            ("seed = 7", "seed = 7\n exposure = 0"),
            ("seed = 7\n", "seed = 7\n [film.samples]\n a = 1\n"),
            ("[0, 0.5, 1]", "[0, 0.5, 1.0000000000000002]"),
            ("[0, 0.5, 1]", "[[0, 0.5], 1]"),
            ("[0, 0.5, 1]", "[0.5, 0, 1]"),
            ("\"ball\"", "\"bal\""),
            ("\"ball\"", "true"),
            ("[[entities]]", "[entities]"),
        ] {
            seen.push(of(&SCENE.replacen(from, to, 1)));
        }
        let len = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), len);
    }

    #[test]
    fn the_files_that_a_scene_names_count_and_their_names_too() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("a.toml");
        let text = "entities = [{ shape = { type = \"mesh\", file = \"a.ply\" } }]";
        let document = DeTable::parse(text).unwrap();
        let (path, _) = Sources::of(document.get_ref(), &scene).fingerprint().unwrap_err();
        assert_eq!(path, folder.path().join("a.ply"));
        fs::write(folder.path().join("a.ply"), "one").unwrap();
        fs::write(folder.path().join("b.ply"), "one").unwrap();
        let one = fingerprint(text, &scene);
        assert_ne!(fingerprint(&text.replace("a.ply", "b.ply"), &scene), one);
        fs::write(folder.path().join("a.ply"), "two").unwrap();
        assert_ne!(fingerprint(text, &scene), one);
        fs::write(folder.path().join("a.ply"), "one").unwrap();
        assert_eq!(fingerprint(text, &scene), one);
    }
}
