//! The film file: exact sums, the samples in them, and the facts that identify the render, byte by byte.
//!
//! `docs/film-format.md` defines the format. Files are written and read from start to end in pieces, so that neither
//! needs memory for a second film. A file ends with a digest of all bytes before it: a file with any byte missing or
//! changed is rejected.

use super::adaptive::AdaptivePlan;
use super::head::{Head, LONGEST_TEXT};
use super::layer_set::LayerSet;
use super::layout::Layout;
use super::light_image::LightScale;
use super::noise::Milestone;
use super::picture::Picture;
use super::sample_ranges::SampleRanges;
use super::sums::{Film, MemoryError};
use crate::sampling::Rectangle;
use sha2::{Digest, Sha256};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::sync::Arc;

/// The first bytes of every film file. Programs that convert line ends damage them.
const MAGIC: [u8; 8] = *b"\x89FILM\r\n\x1a";
/// The only version of the format that is written and read.
pub const VERSION: u32 = 4;
/// Bytes before the text: magic, version, text length, width, height, kinds of words, the shown part, and the light
/// scale.
pub(crate) const START_BYTES: u64 = 52;
/// The kinds of words: bits for weighted samples, the extra sums for a variance and a light image, and above these the
/// bits of the layers.
const WEIGHTED: u32 = 1;
const SPREADS: u32 = 2;
const LIGHT: u32 = 4;
const LAYERS_FROM: u32 = 3;
/// Bytes after the pixels, before the ranges: the number of ranges, the open range, and the milestone's samples and
/// error.
const TAIL_BYTES: u64 = 24;
/// Bytes per pixel of the milestone's picture.
const MILESTONE_BYTES: u64 = 12;
/// Bytes per pixel of the milestone's plan, and bytes before these.
const PLAN_BYTES: [u64; 2] = [4, 8];
/// Bytes of the digest.
const DIGEST_BYTES: u64 = 32;
/// Pixels that are read or written at a time: 1 MiB of plain ones, less than 10 MiB with all sums.
const PIECE: usize = 1 << 14;

/// The reason why a film file is rejected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FilmFileError {
    /// The magic bytes are missing.
    #[error("it is not a film")]
    NotAFilm,
    /// The version of the format is not supported.
    #[error("it is a film of version {version}, and this program reads only version {VERSION}: {why}", version = .0, why = other_version(*.0))]
    Version(u32),
    /// The length of the file does not match its header.
    #[error("it has {found} bytes, and its header says {expected}: it is truncated, or bytes were appended")]
    Length {
        /// Bytes in the file.
        found: u64,
        /// Bytes according to the header.
        expected: u64,
    },
    /// The digest does not match the bytes.
    #[error("it is damaged: its checksum does not match")]
    Damaged,
    /// The digest matches, but the contents are impossible.
    #[error("it contradicts itself ({0}): this is a bug in the program that wrote it")]
    Contradiction(&'static str),
    /// The size differs from the film that it is to be added to.
    #[error("it has {}×{} pixels, not {}×{}", .found[0], .found[1], .expected[0], .expected[1])]
    Size {
        /// Width and height in the file.
        found: [u32; 2],
        /// Width and height of the other film.
        expected: [u32; 2],
    },
    /// There is not enough memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
}

/// Why films of another version are not read, and the remedy.
fn other_version(version: u32) -> &'static str {
    if version < VERSION {
        "older films cannot store a light image; finish it with the version of stride that began it"
    } else {
        "a newer version of stride wrote it"
    }
}

/// Part of a film that is sent to a file writer.
#[derive(Clone, Debug)]
pub enum Piece {
    /// Begins a film, with the last milestone that it has passed. The previous film is abandoned if it is incomplete.
    Start(Option<Milestone>),
    /// The next pixels, as [`Film::bytes`] returns them.
    Pixels(Vec<u8>),
}

/// Writes a film file piece by piece.
pub struct FilmWriter<W> {
    out: W,
    digest: Sha256,
    len: u64,
    shown: u64,
    pixels_left: u64,
    pixel_bytes: u64,
    plans: bool,
    seen: [u64; 2],
}

impl<W: Write> FilmWriter<W> {
    /// Writes the header of a film.
    pub fn new(out: W, head: &Head) -> io::Result<FilmWriter<W>> {
        head.check()?;
        let text = head.text();
        let Layout { width, height, weighted, spreads, light, layers, shown } = head.layout;
        let (seen, pixel_bytes) = ([u64::MAX, 0], head.layout.pixel_bytes());
        let bit = |is_there: bool, bit: u32| if is_there { bit } else { 0 };
        let words = bit(weighted, WEIGHTED) | bit(spreads, SPREADS) | bit(light.is_some(), LIGHT);
        let words = words | layers.code() << LAYERS_FROM;
        let scale = light.map_or([0; 2], |LightScale { pixels, integral }| [pixels, integral]);
        let (pixels_left, shown_len) = (head.layout.len(), head.layout.shown_len());
        let (digest, plans) = (Sha256::new(), head.plans());
        let len = pixels_left;
        let mut writer =
            FilmWriter { out, digest, len, shown: shown_len, pixels_left, pixel_bytes, plans, seen };
        writer.put(&MAGIC)?;
        let part = [shown.x, shown.y, shown.width, shown.height];
        let start = [VERSION, text.len() as u32, width, height, words];
        for word in start.into_iter().chain(part).chain(scale) {
            writer.put(&word.to_le_bytes())?;
        }
        writer.put(text.as_bytes())?;
        Ok(writer)
    }

    /// Writes the next pixels, as [`Film::bytes`] returns them. Returns whether these were the last.
    pub fn pixels(&mut self, bytes: &[u8]) -> io::Result<bool> {
        for pixel in bytes.chunks_exact(self.pixel_bytes as usize) {
            let seen = seen(pixel);
            self.seen = [self.seen[0].min(seen), self.seen[1].max(seen)];
        }
        self.pixels_left = self
            .pixels_left
            .checked_sub(bytes.len() as u64 / self.pixel_bytes)
            .ok_or_else(|| io::Error::other("there are more pixels than the film has"))?;
        self.put(bytes)?;
        Ok(self.pixels_left == 0)
    }

    /// The minimum and the maximum number of samples made for a pixel so far.
    pub fn seen(&self) -> [u64; 2] {
        self.seen
    }

    /// Completes the film after its last pixel, and returns the writer.
    pub fn finish(mut self, sample_ranges: &SampleRanges, milestone: Option<&Milestone>) -> io::Result<W> {
        let fits = |m: &Milestone| {
            let planned = m.plan.as_ref().map(|plan| plan.ends().len() as u64);
            let plans = (self.plans && m.error.is_some()).then_some(self.shown);
            let whole = planned.is_none_or(|planned| planned == self.len);
            m.samples > 0 && m.picture.rgb.len() as u64 == self.shown && planned == plans && whole
        };
        if self.pixels_left > 0 || !sample_ranges.allows(self.seen) || !milestone.is_none_or(fits) {
            return Err(io::Error::other("the film contradicts itself"));
        }
        let open = sample_ranges.open().cloned().unwrap_or(0..0);
        let samples = milestone.map_or(0, |milestone| milestone.samples);
        for word in [sample_ranges.whole().len() as u32, open.start, open.end, samples] {
            self.put(&word.to_le_bytes())?;
        }
        let error = milestone.and_then(|milestone| milestone.error).unwrap_or(-1.0);
        self.put(&error.to_le_bytes())?;
        for range in sample_ranges.whole() {
            self.put(&range.start.to_le_bytes())?;
            self.put(&range.end.to_le_bytes())?;
        }
        for row in milestone.iter().flat_map(|milestone| milestone.picture.rgb.chunks(PIECE)) {
            let bytes: Vec<u8> = row.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
            self.put(&bytes)?;
        }
        if let Some(plan) = milestone.and_then(|milestone| milestone.plan.as_deref()) {
            self.put(&plan.stopped.to_le_bytes())?;
            for row in plan.ends.chunks(PIECE) {
                let bytes: Vec<u8> = row.iter().flat_map(|end| end.to_le_bytes()).collect();
                self.put(&bytes)?;
            }
        }
        let digest = std::mem::take(&mut self.digest).finalize();
        self.out.write_all(&digest)?;
        Ok(self.out)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.digest.update(bytes);
        self.out.write_all(bytes)
    }
}

/// Samples made for a pixel, from its bytes: added and rejected.
fn seen(pixel: &[u8]) -> u64 {
    let word = |at: usize, len: usize| {
        pixel[at..at + len].iter().rev().fold(0_u64, |word, &byte| word << 8 | u64::from(byte))
    };
    word(40, 8).saturating_add(word(60, 4))
}

/// Writes a whole film at once.
pub fn write<W: Write>(
    out: W,
    head: &Head,
    film: &Film,
    sample_ranges: &SampleRanges,
    milestone: Option<&Milestone>,
) -> io::Result<W> {
    let mut writer = FilmWriter::new(out, head)?;
    let len = head.layout.len() as usize;
    for first in (0..len).step_by(PIECE) {
        writer.pixels(&film.bytes(first..len.min(first + PIECE)))?;
    }
    writer.finish(sample_ranges, milestone)
}

/// A film file that has been read except for its pixels. Its contents are verified only when [`FilmReader::add_to`]
/// has read the rest.
pub struct FilmReader<R> {
    input: R,
    head: Head,
    sample_ranges: SampleRanges,
    /// The digest of the bytes before the pixels.
    digest: Sha256,
    /// The bytes after them: ranges, milestone, digest.
    tail: Vec<u8>,
    milestone: Option<Milestone>,
}

impl<R: Read + Seek> FilmReader<R> {
    /// Reads everything except the pixels.
    pub fn open(mut input: R) -> Result<FilmReader<R>, FilmFileError> {
        let found = input.seek(SeekFrom::End(0))?;
        input.rewind()?;
        let mut start = [0; START_BYTES as usize];
        read_exactly(&mut input, &mut start[..8], found)?;
        if start[..8] != MAGIC {
            return Err(FilmFileError::NotAFilm);
        }
        read_exactly(&mut input, &mut start[8..12], found)?;
        let version = word(&start, 8);
        if version != VERSION {
            return Err(FilmFileError::Version(version));
        }
        read_exactly(&mut input, &mut start[12..], found)?;
        let [text_length, width, height, words] = [12, 16, 20, 24].map(|at| word(&start, at));
        let part = [28, 32, 36, 40].map(|at| word(&start, at));
        let shown = Rectangle { x: part[0], y: part[1], width: part[2], height: part[3] };
        let [weighted, spreads, has_light] = [WEIGHTED, SPREADS, LIGHT].map(|bit| words & bit != 0);
        let layers = LayerSet::from_code(words >> LAYERS_FROM).ok_or(FilmFileError::Damaged)?;
        let is_known = weighted || !spreads;
        let scale = LightScale { pixels: word(&start, 44), integral: word(&start, 48) };
        let light = has_light.then_some(scale);
        let layout = Layout { width, height, weighted, spreads, light, layers, shown };
        let is_scaled = match has_light {
            true => scale.is_possible(layout.len()),
            false => scale == LightScale { pixels: 0, integral: 0 },
        };
        if text_length > LONGEST_TEXT || !is_known || !is_scaled || !shown.fits(width, height) {
            return Err(FilmFileError::Damaged);
        }
        // No memory is allocated before the length of the file is known to match.
        let pixels = layout.len().saturating_mul(layout.pixel_bytes());
        let before_tail = pixels.saturating_add(START_BYTES + u64::from(text_length));
        let length = |more: u64| before_tail.saturating_add(TAIL_BYTES + DIGEST_BYTES).saturating_add(more);
        if found < length(0) {
            return Err(FilmFileError::Length { found, expected: length(0) });
        }
        let mut text = vec![0; text_length as usize];
        input.read_exact(&mut text)?;
        let head = Head::parse(layout, &text).ok_or(FilmFileError::Damaged)?;
        input.seek(SeekFrom::Start(before_tail))?;
        let mut tail = vec![0; TAIL_BYTES as usize];
        input.read_exact(&mut tail)?;
        let (ranges, samples) = (u64::from(word(&tail, 0)), word(&tail, 12));
        let error = f64::from_bits(u64::from(word(&tail, 20)) << 32 | u64::from(word(&tail, 16)));
        let error = (error >= 0.0).then_some(error);
        let plane = if samples > 0 { layout.shown_len() * MILESTONE_BYTES } else { 0 };
        let planned = head.plans() && samples > 0 && error.is_some();
        if planned && layout.shown_len() != layout.len() {
            return Err(FilmFileError::Contradiction("its plan covers pixels that are not shown"));
        }
        let plan = if planned { layout.len() * PLAN_BYTES[0] + PLAN_BYTES[1] } else { 0 };
        let more = 8 * ranges + plane + plan;
        if found != length(more) {
            return Err(FilmFileError::Length { found, expected: length(more) });
        }
        input.by_ref().take(more + DIGEST_BYTES).read_to_end(&mut tail)?;
        input.seek(SeekFrom::Start(START_BYTES + u64::from(text_length)))?;

        let open = word(&tail, 4)..word(&tail, 8);
        let (listed, behind) = tail[TAIL_BYTES as usize..].split_at(8 * ranges as usize);
        let whole = listed.chunks_exact(8).map(|range| word(range, 0)..word(range, 4));
        let sample_ranges = SampleRanges::new(whole.collect(), (open != (0..0)).then_some(open))
            .ok_or(FilmFileError::Contradiction("its sample ranges are out of order"))?;
        let milestone = (samples > 0).then(|| {
            let float = |pixel: &[u8], at| f32::from_bits(word(pixel, at));
            let rgb = behind[..plane as usize].chunks_exact(MILESTONE_BYTES as usize);
            let rgb = rgb.map(|pixel| [0, 4, 8].map(|at| float(pixel, at))).collect();
            let picture = Arc::new(Picture { width: shown.width, height: shown.height, rgb });
            let plan = planned.then(|| {
                let (stopped, ends) = behind[plane as usize..].split_at(PLAN_BYTES[1] as usize);
                let stopped = f64::from_bits(u64::from(word(stopped, 4)) << 32 | u64::from(word(stopped, 0)));
                let ends = ends[..ends.len() - DIGEST_BYTES as usize].chunks_exact(PLAN_BYTES[0] as usize);
                Arc::new(AdaptivePlan { ends: ends.map(|end| word(end, 0)).collect(), stopped })
            });
            Milestone { samples, error, picture, plan }
        });
        let mut digest = Sha256::new();
        digest.update(start);
        digest.update(&text);
        Ok(FilmReader { input, head, sample_ranges, digest, tail, milestone })
    }

    /// The header: layout, facts and notes.
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// The samples in the film.
    pub fn sample_ranges(&self) -> &SampleRanges {
        &self.sample_ranges
    }

    /// The last milestone that the render had passed, if it was to stop at a given error.
    pub fn milestone(&self) -> Option<&Milestone> {
        self.milestone.as_ref()
    }

    /// Reads the whole film.
    pub fn read(self) -> Result<Film, FilmFileError> {
        let mut film = Film::with_layout(self.head.layout)?;
        self.add_to(&mut film)?;
        Ok(film)
    }

    /// Adds the pixels to a film, a piece at a time. Sums for a variance are skipped if the film does not store them.
    /// After an error the contents of the film are unspecified.
    pub fn add_to(mut self, film: &mut Film) -> Result<(), FilmFileError> {
        let (ours, theirs) = (self.head.layout, film.layout());
        let known = if theirs.spreads { ours } else { ours.without_spreads() };
        if known != theirs {
            let size = |layout: Layout| [layout.width, layout.height];
            return Err(match size(ours) != size(theirs) {
                true => FilmFileError::Size { found: size(ours), expected: size(theirs) },
                false => FilmFileError::Contradiction("its facts call for another kind of sums"),
            });
        }
        let len = self.head.layout.len() as usize;
        let pixel_bytes = ours.pixel_bytes() as usize;
        let mut piece = vec![0; len.min(PIECE) * pixel_bytes];
        let (mut range, mut layers_agree) = ([u64::MAX, 0], true);
        let first_samples = self.sample_ranges.first_samples();
        for first in (0..len).step_by(PIECE) {
            let piece = &mut piece[..(len - first).min(PIECE) * pixel_bytes];
            self.input.read_exact(piece)?;
            self.digest.update(&piece);
            film.add_bytes(first, piece, &ours, |seen, samples| {
                range = [range[0].min(seen), range[1].max(seen)];
                layers_agree &=
                    samples.is_none_or(|[traced, met]| traced == first_samples(seen) && met & !traced == 0);
            });
        }
        let (ranges, digest) = self.tail.split_at(self.tail.len() - DIGEST_BYTES as usize);
        self.digest.update(ranges);
        if self.digest.finalize()[..] != *digest {
            return Err(FilmFileError::Damaged);
        }
        if !self.sample_ranges.allows(range) {
            return Err(FilmFileError::Contradiction(
                "the sample counts of its pixels do not match its sample ranges",
            ));
        }
        if !layers_agree {
            return Err(FilmFileError::Contradiction(
                "the samples of its layers do not match those of its pixels",
            ));
        }
        Ok(())
    }
}

/// Reads the first bytes of a file, which may be shorter.
fn read_exactly(input: &mut impl Read, bytes: &mut [u8], found: u64) -> Result<(), FilmFileError> {
    input.read_exact(bytes).map_err(|error| match error.kind() {
        ErrorKind::UnexpectedEof if found < 8 => FilmFileError::NotAFilm,
        ErrorKind::UnexpectedEof => {
            FilmFileError::Length { found, expected: START_BYTES + TAIL_BYTES + DIGEST_BYTES }
        }
        _ => error.into(),
    })
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[cfg(test)]
mod tests;
