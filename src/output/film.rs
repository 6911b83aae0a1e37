//! Film files on disk: checkpoints during a render, the whole film at its end, and reading.

use std::fs::File;
use std::io::{BufReader, BufWriter, ErrorKind, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use crossbeam_channel::Receiver;
use thiserror::Error;

use super::atomic::{self, Draft};
use super::error::OutputError;
use crate::film::file::{self, FilmFileError, FilmReader, FilmWriter, Piece};
use crate::film::head::Head;
use crate::film::{Film, Milestone, SampleRanges};

/// A film file cannot be read.
#[derive(Debug, Error)]
#[error("cannot read {path:?}: {}", describe(.reason))]
pub struct FilmError {
    /// The requested file.
    pub path: PathBuf,
    /// The error.
    pub reason: FilmFileError,
}

fn describe(reason: &FilmFileError) -> String {
    match reason {
        FilmFileError::Io(error) if error.kind() == ErrorKind::NotFound => {
            "there is no such file; `film` creates one".to_owned()
        }
        FilmFileError::Io(error) if error.kind() == ErrorKind::IsADirectory => "it is a folder".to_owned(),
        other => other.to_string(),
    }
}

/// A film file whose pixels have not been read.
pub type FilmFile = FilmReader<BufReader<File>>;

/// Opens a film file and reads everything except its pixels.
pub fn open_film(path: &Path) -> Result<FilmFile, FilmError> {
    let open = || -> Result<FilmFile, FilmFileError> {
        let file = File::open(path)?;
        FilmReader::open(BufReader::with_capacity(1 << 16, file))
    };
    open().map_err(|reason| FilmError { path: path.to_path_buf(), reason })
}

/// Checks before a render that a film can be written to `path`. Leaves no file behind.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    if !extension.eq_ignore_ascii_case("film") {
        let (path, extension) = (path.to_path_buf(), extension.to_string());
        return Err(OutputError::UnknownFormat { path, extension, known: ".film".into() });
    }
    atomic::check_place(path)
}

/// Writes a film file, completely or not at all.
pub fn write_film(
    path: &Path,
    head: &Head,
    film: &Film,
    sample_ranges: &SampleRanges,
    milestone: Option<&Milestone>,
) -> Result<(), OutputError> {
    write_film_if(path, head, film, sample_ranges, milestone, || Ok::<_, OutputError>(()))
}

/// The same, unless `may` fails. It is called when the file exists under its temporary name. A program that takes the
/// file over first makes `may` fail, then calls [`discard_drafts`](atomic::discard_drafts): nothing replaces its file.
pub(crate) fn write_film_if<E: From<OutputError>>(
    path: &Path,
    head: &Head,
    film: &Film,
    sample_ranges: &SampleRanges,
    milestone: Option<&Milestone>,
    may: impl FnOnce() -> Result<(), E>,
) -> Result<(), E> {
    let draft = Draft::begin(path)?;
    may()?;
    let write = |out: File| {
        let out = BufWriter::with_capacity(1 << 20, out);
        file::write(out, head, film, sample_ranges, milestone)?.flush()
    };
    draft.file().and_then(write).map_err(|error| OutputError::from_io(path, error))?;
    Ok(draft.commit()?)
}

/// The sink for a film file, which is rewritten at intervals.
#[derive(Clone, Debug)]
pub struct FilmSink {
    /// The path of the file.
    pub path: PathBuf,
    /// The header.
    pub head: Head,
    /// The requested range of samples of every pixel.
    pub range: Range<u32>,
}

impl FilmSink {
    /// Writes the film to a path.
    pub fn write(&self, path: &Path, film: &Film, milestone: Option<&Milestone>) -> Result<(), OutputError> {
        write_film(path, &self.head, film, &self.sample_ranges(film.seen_range()), milestone)
    }

    fn sample_ranges(&self, [least, most]: [u64; 2]) -> SampleRanges {
        SampleRanges::prefix(self.range.clone(), least, most)
    }

    /// Writes films whose pixels arrive in pieces, one film after the other, until the channel closes. Pieces of one
    /// film may be from different times: each pixel has its own count of samples. A write error is reported and the
    /// film abandoned; the next one is another attempt.
    pub fn write_checkpoints(&self, pieces: &Receiver<Piece>, report: impl Fn(String)) {
        let (mut draft, mut failing) = (None, false);
        for piece in pieces {
            let step = match (piece, draft.take()) {
                (Piece::Start(milestone), _) => self.begin(milestone).map(Some),
                (Piece::Pixels(pixels), Some(checkpoint)) => self.add(checkpoint, &pixels),
                // The film was abandoned: its other pieces are skipped.
                (Piece::Pixels(_), None) => continue,
            };
            match step {
                Ok(under_way @ Some(_)) => draft = under_way,
                Ok(None) => {
                    if std::mem::take(&mut failing) {
                        report(format!("{:?} is written again", self.path));
                    }
                }
                Err(error) => {
                    failing = true;
                    report(format!("{error}; the render continues and will retry the film"));
                }
            }
        }
    }

    fn begin(&self, milestone: Option<Milestone>) -> Result<Checkpoint, OutputError> {
        let draft = Draft::begin(&self.path)?;
        let out = draft.file().map(|file| BufWriter::with_capacity(1 << 20, file));
        let writer = out.and_then(|out| FilmWriter::new(out, &self.head));
        let writer = writer.map_err(|error| OutputError::from_io(&self.path, error))?;
        Ok(Checkpoint { draft, writer, milestone })
    }

    /// Adds pixels; returns `None` when the checkpoint is complete.
    fn add(&self, mut checkpoint: Checkpoint, pixels: &[u8]) -> Result<Option<Checkpoint>, OutputError> {
        let wrong = |error| OutputError::from_io(&self.path, error);
        if !checkpoint.writer.pixels(pixels).map_err(wrong)? {
            return Ok(Some(checkpoint));
        }
        let Checkpoint { draft, writer, milestone } = checkpoint;
        let sample_ranges = self.sample_ranges(writer.seen());
        writer.finish(&sample_ranges, milestone.as_ref()).and_then(|mut out| out.flush()).map_err(wrong)?;
        draft.commit().map(|()| None)
    }
}

/// A checkpoint in progress.
struct Checkpoint {
    draft: Draft,
    writer: FilmWriter<BufWriter<File>>,
    milestone: Option<Milestone>,
}
