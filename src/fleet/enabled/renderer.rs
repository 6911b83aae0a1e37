//! Renders a unit into a film file.

use super::Stop;
use super::hooks;
use crate::api::Render;
use crate::fleet::FleetError;
use crate::session::{CompiledScene, Event, RenderSettings, prepare, prepare_again};
use crossbeam_channel::bounded;
use data_encoding::HEXLOWER;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Renders units of one job. The scene is compiled once.
pub(super) struct Renderer {
    settings: RenderSettings,
    compiled: Option<CompiledScene>,
    folder: TempDir,
}

/// The film file of a unit.
pub(super) struct UnitFilm {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    /// Bytes before the pixels, and of each pixel.
    pub(super) layout: [usize; 2],
    /// The digest at the end of the file.
    pub(super) digest: String,
    pub(super) took: Duration,
}

impl Renderer {
    /// A renderer for a render whose range is replaced by those of units.
    pub(super) fn new(render: Render) -> Result<Renderer, FleetError> {
        let folder = tempfile::Builder::new().prefix("stride-unit-").tempdir();
        let folder = folder.map_err(|reason| FleetError::File { path: std::env::temp_dir(), reason })?;
        let settings = render.range(0..1).film(folder.path().join("unit.film")).settings()?;
        Ok(Renderer { settings, compiled: None, folder })
    }

    /// The settings, with some range.
    pub(super) fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Renders the samples of a range. Returns nothing if `stop` closed before. Reports samples per pixel so far.
    pub(super) fn render(
        &mut self,
        range: &Range<u32>,
        stop: &Stop,
        report: impl Fn(f64) + Send,
    ) -> Result<Option<UnitFilm>, FleetError> {
        let start = Instant::now();
        let mut settings = self.settings.clone();
        settings.job.first = range.start;
        settings.stopping.spp = range.end - range.start;
        let (events_out, events) = bounded(16);
        let compiled = &mut self.compiled;
        let rendered = std::thread::scope(|scope| {
            scope.spawn(move || {
                for event in events {
                    if let Event::Progress(progress) = event {
                        report(progress.spp_done);
                    }
                }
            });
            let prepared = match &*compiled {
                Some(compiled) => prepare_again(&settings, compiled, events_out)?,
                None => prepare(&settings, events_out)?,
            };
            compiled.get_or_insert_with(|| prepared.compiled());
            prepared.run(stop)
        });
        let mut report = rendered?;
        if let Some(problem) = report.problem.take() {
            return Err(problem.into());
        }
        if report.spp_range[0] < u64::from(range.end - range.start) {
            return Ok(None);
        }
        let path = self.folder.path().join("unit.film");
        let took = start.elapsed();
        let film = |path: &Path| {
            hooks::spoil(path)?;
            let mut file = File::open(path)?;
            let mut start = [0; 16];
            file.read_exact(&mut start)?;
            let mut digest = [0; 32];
            let bytes = file.seek(SeekFrom::End(-32))? + 32;
            file.read_exact(&mut digest)?;
            let text = u32::from_le_bytes([start[12], start[13], start[14], start[15]]) as usize;
            Ok((bytes, crate::film::file::START_BYTES as usize + text, HEXLOWER.encode(&digest)))
        };
        let (bytes, head, digest) =
            film(&path).map_err(|reason| FleetError::File { path: path.clone(), reason })?;
        let layout = [head, settings.job.layout().pixel_bytes() as usize];
        Ok(Some(UnitFilm { path, bytes, layout, digest, took }))
    }
}
