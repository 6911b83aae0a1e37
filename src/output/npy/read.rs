//! Reads sample dumps: those of this program, also after a kill, and those that NumPy has saved since.

use super::{DESCRIPTION, RECORD_BYTES};
use crate::film::Identity;
use crate::sampling::Sample;
use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The longest header that is accepted: the limit of NumPy.
const LONGEST_HEADER: usize = super::LONGEST_HEADER;

/// A sample dump cannot be read.
#[derive(Debug, Error)]
#[error("cannot read {path:?}: {reason}")]
pub struct DumpError {
    /// The requested file.
    pub path: PathBuf,
    /// The error.
    pub reason: DumpFault,
}

/// The reason why a file is rejected as a sample dump.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DumpFault {
    /// The magic bytes are missing.
    #[error("it is not a NumPy file")]
    NotNumpy,
    /// The array has another type.
    #[error("it is not an array of samples, which has the type {DESCRIPTION} and one dimension")]
    NotSamples,
    /// The file is shorter than its header says.
    #[error("it has {found} samples, but its header says {expected}: it is truncated")]
    Length {
        /// Samples in the file.
        found: u64,
        /// Samples according to the header.
        expected: u64,
    },
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
}

/// A dump whose header has been read.
#[derive(Debug)]
pub struct DumpReader<R> {
    input: R,
    facts: Option<Identity>,
    count: u64,
    left: u64,
}

/// Opens a dump.
pub fn open_dump(path: &Path) -> Result<DumpReader<BufReader<File>>, DumpError> {
    let open = || {
        let file = File::open(path)?;
        let bytes = file.metadata()?.len();
        DumpReader::new(BufReader::with_capacity(1 << 20, file), bytes)
    };
    open().map_err(|reason| DumpError { path: path.to_path_buf(), reason })
}

impl<R: Read> DumpReader<R> {
    /// Reads the header of a dump of this many bytes.
    pub fn new(mut input: R, bytes: u64) -> Result<DumpReader<R>, DumpFault> {
        let short = |error: io::Error| match error.kind() {
            ErrorKind::UnexpectedEof => DumpFault::NotNumpy,
            _ => error.into(),
        };
        let mut start = [0; 8];
        input.read_exact(&mut start).map_err(short)?;
        if start[..6] != *b"\x93NUMPY" {
            return Err(DumpFault::NotNumpy);
        }
        // Version 1 stores the header's length in two bytes, later versions in four.
        let mut length = [0; 4];
        let digits = if start[6] == 1 { 2 } else { 4 };
        input.read_exact(&mut length[..digits]).map_err(short)?;
        let length = u32::from_le_bytes(length) as usize;
        if length > LONGEST_HEADER {
            return Err(DumpFault::NotSamples);
        }
        let mut text = vec![0; length];
        input.read_exact(&mut text).map_err(short)?;
        let text = std::str::from_utf8(&text).map_err(|_| DumpFault::NotSamples)?;
        let (count, facts) = parse(text).ok_or(DumpFault::NotSamples)?;
        let found = bytes.saturating_sub((8 + digits + length) as u64) / RECORD_BYTES as u64;
        if found < count {
            return Err(DumpFault::Length { found, expected: count });
        }
        Ok(DumpReader { input, facts, count, left: count })
    }

    /// The metadata, if the file has any: facts and notes as in a film file.
    pub fn facts(&self) -> Option<&Identity> {
        self.facts.as_ref()
    }

    /// Samples in the file.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The next samples, at most `most`; empty at the end.
    pub fn next(&mut self, most: usize) -> Result<Vec<Sample>, DumpFault> {
        let len = self.left.min(most as u64) as usize;
        let mut bytes = vec![0; len * RECORD_BYTES];
        self.input.read_exact(&mut bytes)?;
        self.left -= len as u64;
        let (records, _) = bytes.as_chunks::<RECORD_BYTES>();
        Ok(records.iter().map(sample).collect())
    }
}

/// The number of records in a header, and the metadata.
fn parse(text: &str) -> Option<(u64, Option<Identity>)> {
    // The dictionary contains no braces.
    let (dictionary, behind) = text.trim_start().strip_prefix('{')?.split_once('}')?;
    let packed: String = dictionary.chars().filter(|c| !c.is_whitespace()).collect();
    let description: String = DESCRIPTION.chars().filter(|c| !c.is_whitespace()).collect();
    if !packed.contains(&format!("'descr':{description}")) || !packed.contains("'fortran_order':False") {
        return None;
    }
    let (count, _) = packed.split_once("'shape':(")?.1.split_once(",)")?;
    let facts = behind.trim().strip_prefix('#').and_then(|text| {
        let facts: Vec<(String, String)> = serde_json::from_str(text.trim()).ok()?;
        Some(facts.iter().fold(Identity::default(), |facts, (name, value)| facts.with(name, value)))
    });
    Some((count.parse().ok()?, facts))
}

fn sample(record: &[u8; RECORD_BYTES]) -> Sample {
    let (words, _) = record.as_chunks::<4>();
    let float = |i: usize| f32::from_le_bytes(words[i]);
    let [pixel, sample] = [0, 1].map(|i| u32::from_le_bytes(words[i]));
    Sample { pixel, sample, x: float(2), y: float(3), radiance: [float(4), float(5), float(6)] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::SampleDump;

    fn samples(count: u32) -> Vec<Sample> {
        let one = |i| Sample { pixel: i, sample: i + 1, x: i as f32, y: 0.5, radiance: [0.1, -0.0, 1e30] };
        (0..count).map(one).collect()
    }

    fn facts() -> Identity {
        Identity::default().with("scene", "a # {of} \"odd' names").with("asked", "0..4")
    }

    #[test]
    fn a_dump_is_read_back_in_pieces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let foreign = facts().with("device", "gpu: Größe ⅔ 🎞");
        for facts in [facts(), foreign, Identity::default()] {
            let mut dump = SampleDump::create(&path, &facts).unwrap();
            dump.write(&samples(1000)).unwrap();
            dump.finish().unwrap();
            let mut reader = open_dump(&path).unwrap();
            assert_eq!(reader.facts().cloned().unwrap_or_default(), facts);
            assert_eq!(reader.count(), 1000);
            let mut read = Vec::new();
            loop {
                let more = reader.next(300).unwrap();
                if more.is_empty() {
                    break;
                }
                read.extend(more);
            }
            assert!(read == samples(1000));
        }
    }

    #[test]
    fn other_files_and_truncated_dumps_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let mut dump = SampleDump::create(&path, &facts()).unwrap();
        dump.write(&samples(10)).unwrap();
        dump.finish().unwrap();
        let good = std::fs::read(&path).unwrap();
        let open = |bytes: &[u8]| DumpReader::new(bytes, bytes.len() as u64).map(|reader| reader.count());
        assert!(matches!(open(&good), Ok(10)));
        // A killed run leaves records that its header does not count.
        assert!(matches!(open(&[&good[..], b"more"].concat()), Ok(10)));
        let cut = &good[..good.len() - 1];
        assert!(matches!(open(cut), Err(DumpFault::Length { found: 9, expected: 10 })));
        for cut in [0, 5, 9, 50] {
            assert!(matches!(open(&good[..cut]), Err(DumpFault::NotNumpy)), "{cut}");
        }
        let text = String::from_utf8_lossy(&good[10..200]).into_owned();
        let other = |from: &str, to: &str| {
            assert!(text.contains(from), "{text}");
            let at = 10 + text.find(from).unwrap();
            let mut bytes = good.clone();
            bytes[at..at + from.len()].copy_from_slice(to.as_bytes());
            open(&bytes)
        };
        assert!(matches!(other("'<u4'), ('sample'", "'>u4'), ('sample'"), Err(DumpFault::NotSamples)));
        assert!(matches!(other("False", "True "), Err(DumpFault::NotSamples)));
        assert!(matches!(other("(10,)", "(1,1)"), Err(DumpFault::NotSamples)));
        assert!(matches!(other("(10,)", "(99,)"), Err(DumpFault::Length { expected: 99, .. })));
        assert!(matches!(other("{'descr'", "['descr'"), Err(DumpFault::NotSamples)));
        let mut long = good.clone();
        long[8..10].copy_from_slice(&65_535_u16.to_le_bytes());
        assert!(open(&long).is_err());
    }
}
