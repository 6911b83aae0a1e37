//! A render in the background.

use super::builder::Render;
use super::error::Error;
use super::running::{failed, render};
use crate::session::{Event, Report};
use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use std::convert::Infallible;
use std::thread::JoinHandle;

/// The number of buffered events after which progress is dropped.
const MOST_WAITING: usize = 16;

/// A render on background threads.
///
/// Dropping it stops the render and waits for its end: its files are written as after [`RenderHandle::stop`].
///
/// ```
/// # use stride::{Event, Render, Scene};
/// let handle = Render::new(&Scene::default()).size((4, 3)).samples(1).start()?;
/// for event in handle.events() {
///     if let Event::Progress(progress) = event {
///         println!("{progress}");
///     }
/// }
/// let report = handle.join()?;
/// assert_eq!(report.totals.spp, 1);
/// # Ok::<(), stride::Error>(())
/// ```
#[derive(Debug)]
pub struct RenderHandle {
    events: Receiver<Event>,
    /// Closes to request the end.
    stop: Option<Sender<Infallible>>,
    /// `None` once it has been joined.
    thread: Option<JoinHandle<Result<Report, Error>>>,
}

impl Render {
    /// Starts the render and returns at once.
    ///
    /// # Errors
    ///
    /// If a setting is invalid, or an output file cannot be written. [`RenderHandle::join`] returns all other errors.
    pub fn start(&self) -> Result<RenderHandle, Error> {
        let settings = self.background_settings()?;
        let (stop_out, stop) = bounded(0);
        let (events_out, events) = unbounded();
        let thread = std::thread::spawn(move || {
            let (rendered_events_out, rendered_events) = bounded(MOST_WAITING);
            std::thread::scope(|scope| {
                scope.spawn(move || relay(&rendered_events, &events_out));
                render(&settings, rendered_events_out, None, &stop)
            })
        });
        Ok(RenderHandle { events, stop: Some(stop_out), thread: Some(thread) })
    }
}

/// Forwards events without waiting for the caller, until both channels have closed.
fn relay(rendered_events: &Receiver<Event>, events: &Sender<Event>) {
    for event in rendered_events {
        let may_be_left_out = matches!(event, Event::Progress(_));
        if may_be_left_out && events.len() >= MOST_WAITING {
            continue;
        }
        // The caller may have dropped its receiver.
        let _ = events.send(event);
    }
}

impl RenderHandle {
    /// The events of the render, until it has ended. The caller need not receive them: the render does not wait, and
    /// drops progress if they are received slowly. Each event goes to only one of several iterators.
    pub fn events(&self) -> Events {
        Events(self.events.clone())
    }

    /// Requests the end of the render, with the samples made so far, and returns at once. The request takes effect once
    /// the scene is compiled.
    pub fn stop(&mut self) {
        self.stop = None;
    }

    /// Whether the render has ended.
    pub fn is_finished(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the end of the render, and returns its result: see [`Render::run`].
    pub fn join(mut self) -> Result<Report, Error> {
        let thread = self.thread.take().ok_or_else(failed)?;
        thread.join().unwrap_or_else(|_| Err(failed()))
    }
}

impl Drop for RenderHandle {
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = self.thread.take() {
            // The report is discarded.
            let _ = thread.join();
        }
    }
}

/// The events of a render, in order: an iterator that waits for the next event, and ends with the render.
#[derive(Clone, Debug)]
pub struct Events(Receiver<Event>);

impl Events {
    /// The next event, if it is available.
    pub fn try_next(&mut self) -> Option<Event> {
        self.0.try_recv().ok()
    }
}

impl Iterator for Events {
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        self.0.recv().ok()
    }
}
