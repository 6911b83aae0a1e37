//! Every sample, as a NumPy structured array: `samples = numpy.load("samples.npy")`.
//!
//! A record is 28 bytes, little-endian: `pixel` u4, `sample` u4, `x` f4, `y` f4, `radiance` 3 × f4, as in
//! [`Sample`]. Records come in any order.
//!
//! The header contains metadata after the dictionary, as a comment that Python skips: `#` and a list of names and
//! values in JSON, the facts and notes of a film file (`docs/film-format.md`). [`read`] reads all of it back.
//!
//! The file exists from the start and can be loaded at any time, even after `kill -9`: records
//! are written first, then the count in the header, so that the header never counts missing records. At
//! most [`FLUSH_BYTES`] or [`FLUSH_SECONDS`] of samples are lost with the program. Only
//! [`SampleDump::finish`] syncs the file to disk: until then a power cut, unlike a kill, may lose more.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::atomic;
use super::error::OutputError;
use crate::film::Identity;
use crate::sampling::Sample;

pub mod read;

/// Bytes of one sample.
pub const RECORD_BYTES: usize = 28;
/// Bytes of samples that are buffered before they are written.
pub const FLUSH_BYTES: usize = 1 << 20;
/// The maximum time in seconds that samples are buffered, while others follow.
pub const FLUSH_SECONDS: f64 = 1.0;

/// The longest header that NumPy reads by default.
const LONGEST_HEADER: usize = 10_000;

/// The type of a record in Python notation.
const DESCRIPTION: &str =
    "[('pixel', '<u4'), ('sample', '<u4'), ('x', '<f4'), ('y', '<f4'), ('radiance', '<f4', (3,))]";

/// Checks before a render that samples can be dumped to `path`. Leaves no file behind.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    if !extension.eq_ignore_ascii_case("npy") {
        let (path, extension) = (path.to_path_buf(), extension.to_string());
        // Other programs have an option of this name for the number of samples.
        let number = path.to_str().filter(|name| name.parse::<u32>().is_ok());
        let known = number.map_or(".npy".into(), |n| format!(".npy, or --spp {n} for {n} samples per pixel"));
        return Err(OutputError::UnknownFormat { path, extension, known });
    }
    atomic::check_place(path)
}

/// The sink for every sample.
#[derive(Debug)]
pub struct SampleDump {
    path: PathBuf,
    file: File,
    records: Records,
}

impl SampleDump {
    /// Creates an empty dump with this metadata at `path`, and replaces an existing file.
    pub fn create(path: &Path, facts: &Identity) -> Result<Self, OutputError> {
        check_writable(path)?;
        let records = Records::new(facts);
        let file = atomic::create_in_place(path, &records.header(0))?;
        Ok(Self { path: path.to_path_buf(), file, records })
    }

    /// Adds samples. After an error the file contains the samples flushed before it, and accepts no more.
    pub fn write(&mut self, samples: &[Sample]) -> Result<(), OutputError> {
        self.records.write(samples, &mut self.file).map_err(|error| OutputError::from_io(&self.path, error))
    }

    /// Flushes the samples, syncs the file to disk, and returns the number of samples in it.
    pub fn finish(mut self) -> Result<u64, OutputError> {
        self.records
            .flush(&mut self.file)
            .and_then(|()| self.file.sync_all())
            .map_err(|error| OutputError::from_io(&self.path, error))?;
        Ok(self.records.written)
    }
}

impl Drop for SampleDump {
    fn drop(&mut self) {
        // A run that ends early keeps its samples if possible; only `finish` reports errors.
        let _ = self.records.flush(&mut self.file);
    }
}

/// The buffer of samples before they are written.
#[derive(Debug)]
struct Records {
    /// The text after the dictionary in the header.
    comment: String,
    /// Bytes of the header.
    start: usize,
    kept_back: Vec<u8>,
    written: u64,
    last_flush: Instant,
    failed: bool,
}

impl Records {
    fn new(facts: &Identity) -> Self {
        let kept_back = Vec::with_capacity(FLUSH_BYTES + RECORD_BYTES);
        let facts: Vec<(&str, &str)> = facts.facts().collect();
        let comment = match serde_json::to_string(&facts) {
            Ok(text) if !facts.is_empty() => format!(" # {}", ascii(&text)),
            _ => String::new(),
        };
        // Metadata that make the header too long for NumPy are omitted.
        let comment = if comment.len() < LONGEST_HEADER / 2 { comment } else { String::new() };
        // Room for any count; a multiple of 64, as the format requires.
        let start = (10 + dictionary(u64::MAX).len() + comment.len() + 1).next_multiple_of(64);
        Self { comment, start, kept_back, written: 0, last_flush: Instant::now(), failed: false }
    }

    /// The header of `count` records: magic, version 1.0, length, a Python dictionary, a comment, spaces, a newline.
    fn header(&self, count: u64) -> Vec<u8> {
        let text = dictionary(count) + &self.comment;
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(((self.start - 10) as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.resize(self.start, b' ');
        bytes[self.start - 1] = b'\n';
        bytes
    }

    fn write(&mut self, samples: &[Sample], out: &mut (impl Write + Seek)) -> io::Result<()> {
        for sample in samples {
            self.kept_back.extend_from_slice(&record(sample));
            if self.kept_back.len() >= FLUSH_BYTES {
                self.flush(out)?;
            }
        }
        if self.last_flush.elapsed() >= Duration::from_secs_f64(FLUSH_SECONDS) {
            self.flush(out)?;
        }
        Ok(())
    }

    fn flush(&mut self, out: &mut (impl Write + Seek)) -> io::Result<()> {
        if self.failed {
            return Err(io::Error::other("an earlier write to the file failed"));
        }
        self.last_flush = Instant::now();
        if self.kept_back.is_empty() {
            return Ok(());
        }
        let count = self.written + (self.kept_back.len() / RECORD_BYTES) as u64;
        let result = out
            .seek(SeekFrom::Start(self.start as u64 + self.written * RECORD_BYTES as u64))
            .and_then(|_| out.write_all(&self.kept_back))
            .and_then(|()| out.rewind())
            .and_then(|()| out.write_all(&self.header(count)))
            .and_then(|()| out.flush());
        self.failed = result.is_err();
        if result.is_ok() {
            self.written = count;
            self.kept_back.clear();
        }
        result
    }
}

fn record(sample: &Sample) -> [u8; RECORD_BYTES] {
    let [r, g, b] = sample.radiance.map(f32::to_le_bytes);
    let fields = [
        sample.pixel.to_le_bytes(),
        sample.sample.to_le_bytes(),
        sample.x.to_le_bytes(),
        sample.y.to_le_bytes(),
        r,
        g,
        b,
    ];
    let mut bytes = [0; RECORD_BYTES];
    bytes.copy_from_slice(fields.as_flattened());
    bytes
}

/// Escapes the other characters of JSON, which occur only in strings. Headers are Latin-1.
fn ascii(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        match c.is_ascii() {
            true => text.push(c),
            false => c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| text += &format!("\\u{unit:04x}")),
        }
    }
    text
}

/// The dictionary for `count` records.
fn dictionary(count: u64) -> String {
    format!("{{'descr': {DESCRIPTION}, 'fortran_order': False, 'shape': ({count},), }}")
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Cursor;

    use super::*;

    fn sample(i: u32) -> Sample {
        let f = i as f32;
        Sample { pixel: i * 7, sample: i, x: f + 0.25, y: f * 0.5, radiance: [f, -0.0, 1.0 / (f + 1.0)] }
    }

    fn facts() -> Identity {
        Identity::default().with("scene", "5eed").with("device", "an \"odd' # name}")
    }

    fn samples(range: std::ops::Range<u32>) -> Vec<Sample> {
        range.map(sample).collect()
    }

    /// An independent reader of the format.
    fn load(file: &[u8]) -> Vec<Sample> {
        assert_eq!(&file[..8], b"\x93NUMPY\x01\x00");
        let length = usize::from(u16::from_le_bytes([file[8], file[9]]));
        assert_eq!((10 + length) % 64, 0);
        let text = std::str::from_utf8(&file[10..10 + length]).unwrap();
        assert!(text.ends_with('\n') && text.trim_end().ends_with(['}', ']']));
        let shape = text.split("'shape': (").nth(1).unwrap().split(',').next().unwrap();
        let count: usize = shape.parse().unwrap();
        let word = |record: &[u8], i: usize| [0, 1, 2, 3].map(|byte| record[4 * i + byte]);
        file[10 + length..]
            .chunks_exact(28)
            .take(count)
            .map(|r| Sample {
                pixel: u32::from_le_bytes(word(r, 0)),
                sample: u32::from_le_bytes(word(r, 1)),
                x: f32::from_le_bytes(word(r, 2)),
                y: f32::from_le_bytes(word(r, 3)),
                radiance: [4, 5, 6].map(|i| f32::from_le_bytes(word(r, i))),
            })
            .collect()
    }

    #[test]
    fn written_samples_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let mut dump = SampleDump::create(&path, &facts()).unwrap();
        dump.write(&samples(0..3)).unwrap();
        dump.write(&[]).unwrap();
        dump.write(&samples(3..100_000)).unwrap();
        assert_eq!(dump.finish().unwrap(), 100_000);
        let file = fs::read(&path).unwrap();
        assert_eq!(file.len(), Records::new(&facts()).start + 100_000 * RECORD_BYTES);
        let read = load(&file);
        assert!(read == samples(0..100_000));
        let mut changed = samples(0..100_000);
        changed[99_999].radiance[2] += 1e-7;
        assert!(read != changed);
    }

    #[test]
    fn an_empty_dump_is_an_empty_array() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        assert_eq!(SampleDump::create(&path, &facts()).unwrap().finish().unwrap(), 0);
        assert!(load(&fs::read(&path).unwrap()).is_empty());
    }

    #[test]
    fn the_file_is_whole_at_every_moment() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let mut dump = SampleDump::create(&path, &facts()).unwrap();
        assert!(load(&fs::read(&path).unwrap()).is_empty());
        for round in 0..5 {
            dump.write(&samples(round * 20_000..(round + 1) * 20_000)).unwrap();
            let read = load(&fs::read(&path).unwrap());
            let kept_back = dump.records.kept_back.len() / RECORD_BYTES;
            assert_eq!(read.len() + kept_back, (round as usize + 1) * 20_000);
            assert!(kept_back * RECORD_BYTES < FLUSH_BYTES);
            assert!(read == samples(0..read.len() as u32));
        }
        // Leaked, as by a kill: no destructor runs.
        std::mem::forget(dump);
        let read = load(&fs::read(&path).unwrap());
        assert!(read.len() >= 100_000 - FLUSH_BYTES / RECORD_BYTES - 1);
        assert!(read == samples(0..read.len() as u32));
    }

    #[test]
    fn a_kill_between_the_records_and_the_count_loses_only_those_records() {
        let mut records = Records::new(&facts());
        let mut out = Cursor::new(records.header(0));
        records.write(&samples(0..10), &mut out).unwrap();
        records.flush(&mut out).unwrap();
        let mut file = out.into_inner();
        file.extend_from_slice(&record(&sample(10)));
        file.extend_from_slice(&record(&sample(11))[..9]);
        assert!(load(&file) == samples(0..10));
    }

    #[test]
    fn a_dropped_dump_keeps_its_samples() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let mut dump = SampleDump::create(&path, &facts()).unwrap();
        dump.write(&samples(0..5)).unwrap();
        drop(dump);
        assert!(load(&fs::read(&path).unwrap()) == samples(0..5));
    }

    #[test]
    fn samples_are_buffered_for_a_second_at_most() {
        let mut records = Records::new(&facts());
        let mut out = Cursor::new(records.header(0));
        records.write(&samples(0..1), &mut out).unwrap();
        assert_eq!(records.written, 0);
        records.last_flush -= Duration::from_secs_f64(FLUSH_SECONDS);
        records.write(&samples(1..2), &mut out).unwrap();
        assert_eq!(records.written, 2);
    }

    #[test]
    fn any_count_fits_the_header() {
        for count in [0, 1, 1 << 32, u64::MAX] {
            for facts in [facts(), Identity::default()] {
                let header = Records::new(&facts).header(count);
                let text = String::from_utf8_lossy(&header[10..]).into_owned();
                assert!(text.contains(&format!("'shape': ({count},), }}")), "{text}");
                assert!(header.len().is_multiple_of(64) && text.ends_with('\n'));
            }
        }
    }

    #[test]
    fn a_full_disk_is_an_error_and_stays_one() {
        let Ok(mut full) = File::options().write(true).open("/dev/full") else {
            println!("skipped: no /dev/full");
            return;
        };
        let mut records = Records::new(&facts());
        let error = records.write(&samples(0..50_000), &mut full).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert_eq!(records.written, 0);
        let error = records.flush(&mut full).unwrap_err();
        assert!(error.to_string().contains("earlier"), "{error}");
    }

    #[test]
    fn only_npy_is_accepted() {
        let folder = tempfile::tempdir().unwrap();
        let error = SampleDump::create(&folder.path().join("a.csv"), &facts()).unwrap_err();
        assert!(error.to_string().contains("use .npy"), "{error}");
        assert!(check_writable(&folder.path().join("a.NPY")).is_ok());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    }
}
