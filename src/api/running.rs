//! Blocking renders.

use super::builder::Render;
use super::error::{Error, SettingsError};
use crate::sampling::Sample;
use crate::session::{self, Event, RenderSettings, Report, SessionError, WindowChoice};
use crossbeam_channel::{Receiver, Sender, bounded, never};
use std::convert::Infallible;

/// The number of buffered messages of samples.
const MOST_WAITING: usize = 4;

impl Render {
    /// Renders, and returns the picture, its layers and statistics.
    ///
    /// # Errors
    ///
    /// If a setting is invalid, a file cannot be written, or a device fails. A failure after the first sample is an
    /// [`Error::Incomplete`] with the picture of the samples made by then.
    pub fn run(&self) -> Result<Report, Error> {
        render(&self.settings()?, silent(), None, &never())
    }

    /// Renders, and passes every sample to `take` on this thread: each (pixel, sample) of this run once, in any order.
    /// The render waits for the callback.
    ///
    /// ```
    /// # use stride::{Render, Scene};
    /// let mut brightest = 0.0_f32;
    /// let render = Render::new(&Scene::default()).size((4, 3)).samples(2);
    /// render.run_with_samples(|samples| {
    ///     for sample in samples {
    ///         brightest = sample.radiance.into_iter().fold(brightest, f32::max);
    ///     }
    /// })?;
    /// assert_eq!(brightest, 0.0); // an empty scene is black
    /// # Ok::<(), stride::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// As [`Render::run`].
    pub fn run_with_samples(&self, mut take: impl FnMut(&[Sample])) -> Result<Report, Error> {
        let mut settings = self.background_settings()?;
        settings.outputs.sends_samples = true;
        std::thread::scope(|scope| {
            // If `take` panics this channel closes, and the render ends.
            let (samples_out, samples) = bounded::<Vec<Sample>>(MOST_WAITING);
            let renderer = scope.spawn(|| render(&settings, silent(), Some(samples_out), &never()));
            samples.iter().for_each(|samples| take(&samples));
            renderer.join().unwrap_or_else(|_| Err(failed()))
        })
    }

    /// The checked settings of a render that will not run on this thread.
    pub(super) fn background_settings(&self) -> Result<RenderSettings, Error> {
        let settings = self.settings()?;
        match settings.view.window {
            WindowChoice::None => Ok(settings),
            WindowChoice::IfPossible | WindowChoice::Required => Err(SettingsError::WindowElsewhere.into()),
        }
    }
}

/// Runs a render.
pub(super) fn render(
    settings: &RenderSettings,
    events: Sender<Event>,
    samples: Option<Sender<Vec<Sample>>>,
    stop: &Receiver<Infallible>,
) -> Result<Report, Error> {
    let prepared = session::prepare(settings, events)?;
    let prepared = match samples {
        Some(samples) => prepared.sending(samples),
        None => prepared,
    };
    let mut report = prepared.run(stop)?;
    match report.problem.take() {
        Some(reason) => Err(Error::Incomplete { reason, report: Box::new(report) }),
        None => Ok(report),
    }
}

/// A channel for events without a receiver.
fn silent() -> Sender<Event> {
    bounded(0).0
}

/// The error for a thread that panicked.
pub(super) fn failed() -> Error {
    SessionError::Process("renderer").into()
}
