//! The contents of files that a scene refers to. Each is read once.

use super::input::{limited, too_much_xml};
use super::limits::{LONGEST_SPECTRUM, MOST_SPECTRA};
use super::spectrum::Spectrum;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// The results of reading files, by their paths; also errors.
#[derive(Debug, Default)]
pub(super) struct Contents {
    texts: HashMap<Arc<Path>, Result<Arc<str>, String>>,
    spectra: HashMap<Arc<Path>, Result<Spectrum, String>>,
    /// The total size in bytes of files with spectra.
    bytes_of_spectra: u64,
    /// The number of files that were read.
    #[cfg(test)]
    pub(super) reads: usize,
}

impl Contents {
    /// The text of a file. If it has more than `most` bytes, it has not been read before, because the other files are
    /// counted.
    pub(super) fn text(&mut self, path: &Arc<Path>, most: u64) -> Result<Arc<str>, String> {
        if let Some(known) = self.texts.get(path) {
            return known.clone();
        }
        let text = self.read(path, most, too_much_xml);
        self.texts.insert(Arc::clone(path), text.clone());
        text
    }

    /// The spectrum in a file.
    pub(super) fn spectrum(&mut self, path: &Arc<Path>) -> Result<Spectrum, String> {
        if let Some(known) = self.spectra.get(path) {
            return known.clone();
        }
        let larger = || format!("a file with a spectrum is larger than {} MiB", LONGEST_SPECTRUM >> 20);
        let spectrum = self.read(path, LONGEST_SPECTRUM, larger).and_then(|text| {
            self.bytes_of_spectra += text.len() as u64;
            if self.bytes_of_spectra > MOST_SPECTRA {
                return Err(format!("all files with spectra are larger than {} MiB", MOST_SPECTRA >> 20));
            }
            Spectrum::of_file(&text)
        });
        self.spectra.insert(Arc::clone(path), spectrum.clone());
        spectrum
    }

    fn read(&mut self, path: &Path, most: u64, larger: impl FnOnce() -> String) -> Result<Arc<str>, String> {
        #[cfg(test)]
        {
            self.reads += 1;
        }
        limited(path, most, larger)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contents(files: &[(&str, &str)]) -> (tempfile::TempDir, Vec<Arc<Path>>) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |(name, text): &(&str, &str)| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).expect("written");
            path.into()
        };
        let paths = files.iter().map(path).collect();
        (folder, paths)
    }

    #[test]
    fn files_are_read_once_whether_they_are_right_or_wrong() {
        let (_folder, paths) = contents(&[("a.xml", "<a/>"), ("b.spd", "400 1\n500 2\n"), ("c.spd", "x")]);
        let nowhere: Arc<Path> = Path::new("nowhere").into();
        let mut contents = Contents::default();
        for _ in 0..3 {
            assert_eq!(contents.text(&paths[0], 4).as_deref(), Ok("<a/>"));
            assert_eq!(contents.text(&nowhere, 4), Err("this is not a file".into()));
            assert_eq!(contents.spectrum(&paths[2]), Err("line 1 is not a wavelength and a value".into()));
        }
        let read = |contents: &mut Contents| match contents.spectrum(&paths[1]) {
            Ok(Spectrum::Samples(samples)) => samples,
            other => panic!("{other:?}"),
        };
        let (first, second) = (read(&mut contents), read(&mut contents));
        assert!(Arc::ptr_eq(&first, &second), "a spectrum that is named twice is in memory once");
        assert_eq!(contents.reads, 4);
    }

    #[test]
    fn files_with_spectra_are_limited_in_all() {
        let (_folder, paths) = contents(&[("a.spd", "400 1\n500 2\n")]);
        let mut contents = Contents { bytes_of_spectra: MOST_SPECTRA - 11, ..Contents::default() };
        let message = "all files with spectra are larger than 64 MiB";
        assert_eq!(contents.spectrum(&paths[0]), Err(message.into()));
        let mut contents = Contents { bytes_of_spectra: MOST_SPECTRA - 12, ..Contents::default() };
        assert!(contents.spectrum(&paths[0]).is_ok());
    }
}
