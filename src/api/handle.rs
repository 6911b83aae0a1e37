//! A render that runs beside the caller.

use super::builder::Render;
use super::error::Error;
use super::running::{failed, render};
use crate::session::{Event, Report};
use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use std::convert::Infallible;
use std::thread::JoinHandle;

/// Events that may wait before news of progress are left out.
const MOST_WAITING: usize = 16;

/// A render that runs beside the caller, on threads of its own.
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
    /// Closes when the end is asked for.
    stop: Option<Sender<Infallible>>,
    /// There until it is waited for.
    thread: Option<JoinHandle<Result<Report, Error>>>,
}

impl Render {
    /// Begins the render and returns at once. What is wrong with settings or places of files is told here, all else by
    /// [`RenderHandle::join`].
    pub fn start(&self) -> Result<RenderHandle, Error> {
        let settings = self.elsewhere()?;
        let (stop_out, stop) = bounded(0);
        let (events_out, events) = unbounded();
        let thread = std::thread::spawn(move || {
            let (told_out, told) = bounded(MOST_WAITING);
            std::thread::scope(|scope| {
                scope.spawn(move || relay(&told, &events_out));
                render(&settings, told_out, None, &stop)
            })
        });
        Ok(RenderHandle { events, stop: Some(stop_out), thread: Some(thread) })
    }
}

/// Passes events on without waiting for the caller, until both channels have closed.
fn relay(told: &Receiver<Event>, events: &Sender<Event>) {
    for event in told {
        let may_be_left_out = matches!(event, Event::Progress(_));
        if may_be_left_out && events.len() >= MOST_WAITING {
            continue;
        }
        // A caller that does not listen any more need not be told.
        let _ = events.send(event);
    }
}

impl RenderHandle {
    /// What the render tells, until it has ended. They need not be taken: the render does not wait, and where they are
    /// taken slowly some of the progress is left out. Of several iterators each gets a part of them.
    pub fn events(&self) -> Events {
        Events(self.events.clone())
    }

    /// Asks the render to end with what there is, and returns at once. Before the scene is compiled it is not heard yet.
    pub fn stop(&mut self) {
        self.stop = None;
    }

    /// Whether the render has ended.
    pub fn is_finished(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the end of the render.
    pub fn join(mut self) -> Result<Report, Error> {
        let thread = self.thread.take().ok_or_else(failed)?;
        thread.join().unwrap_or_else(|_| Err(failed()))
    }
}

impl Drop for RenderHandle {
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = self.thread.take() {
            // The report is dropped.
            let _ = thread.join();
        }
    }
}

/// What a render tells, in order: an iterator that waits for the next event, and ends with the render.
#[derive(Clone, Debug)]
pub struct Events(Receiver<Event>);

impl Events {
    /// The next event, if it is there already.
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
