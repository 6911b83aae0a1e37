//! Renders of the cameras that the user moves to in the window.

use super::error::SessionError;
use super::event::{Conclusion, Event, send_event};
use super::identity;
use super::settings::{Outputs, RenderJob, RenderSettings};
use super::wiring::{InitialFilm, Rendered, Task, render};
use super::worker_pool::WorkerPool;
use crate::film::Film;
use crate::film::head::Head;
use crate::integrator::Integrator;
use crate::output::suffixed_path;
use crate::output::window::{ExitReason, Window};
use crate::scene::{Scene, Viewpoint};
use crossbeam_channel::{Receiver, Sender};
use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// The suspended render of the scene's own camera.
pub(super) struct CameraMoves<'a> {
    pub(super) settings: &'a RenderSettings,
    pub(super) head: &'a Head,
    /// The description of the devices that it was begun on.
    pub(super) device: &'a str,
    /// The integrator of the CPU threads, if there are any.
    pub(super) integrator: Option<&'a Arc<dyn Integrator>>,
    pub(super) events: &'a Sender<Event>,
    pub(super) stop: &'a Receiver<Infallible>,
}

impl CameraMoves<'_> {
    /// Renders the cameras that the user moves to, until the window is closed. `own` is the suspended render of the
    /// scene's own camera. It is resumed whenever the user returns to that camera.
    pub(super) fn follow(&self, own: &mut Rendered, window: &mut Window) -> Result<(), SessionError> {
        let mut exit_reason = own.exit_reason.take();
        loop {
            exit_reason = match exit_reason {
                None | Some(ExitReason::Closed | ExitReason::Ended) => return Ok(()),
                Some(ExitReason::Moved(camera)) => self.render_moved_camera(camera, window)?,
                Some(ExitReason::SceneCamera) => self.resume_scene_camera(own, window)?,
            };
            if own.problem.is_some() {
                return Ok(());
            }
        }
    }

    /// Renders another camera from the first sample on. Returns the reason why the window left it.
    fn render_moved_camera(
        &self,
        camera: Viewpoint,
        window: &mut Window,
    ) -> Result<Option<ExitReason>, SessionError> {
        let settings = moved(self.settings, camera)?;
        let pool = WorkerPool::for_other_camera(&settings, self.integrator, self.events, self.stop)?;
        let head = identity::head(&settings, &pool.description());
        let film = Film::with_layout(head.layout)?;
        let initial = InitialFilm { film, milestone: None, spent: Duration::ZERO };
        let task =
            Task { settings: &settings, pool, head: &head, initial, dump: None, samples: None, tev: None };
        let view = render(task, Some(window), self.events, self.stop)?;
        if !view.is_suspended {
            conclude(&settings, &view, self.events);
        }
        view.problem.map_or(Ok(view.exit_reason), Err)
    }

    /// Resumes the scene's own camera. Returns the reason why the window left it.
    fn resume_scene_camera(
        &self,
        own: &mut Rendered,
        window: &mut Window,
    ) -> Result<Option<ExitReason>, SessionError> {
        let pool = WorkerPool::resuming(self.settings, self.integrator, self.device, self.events, self.stop)?;
        let film = std::mem::replace(&mut own.outcome.film, Film::new(1, 1)?);
        // The resumed render writes its files from here on, even if it fails.
        own.is_suspended = false;
        let milestone = own.outcome.milestone.take();
        let initial = InitialFilm { film, milestone, spent: own.outcome.totals.elapsed };
        let task = Task {
            settings: self.settings,
            pool,
            head: self.head,
            initial,
            dump: None,
            samples: None,
            tev: own.tev.take(),
        };
        let mut further = render(task, Some(window), self.events, self.stop)?;
        further.outcome.add_earlier(&own.outcome);
        *own = further;
        Ok(own.exit_reason.take())
    }
}

/// Sends the conclusion of a render, which may have failed.
pub(super) fn conclude(settings: &RenderSettings, rendered: &Rendered, events: &Sender<Event>) -> Conclusion {
    let conclusion = Conclusion::of(settings, &rendered.outcome, rendered.is_written);
    send_event(events, Event::Concluded(Box::new(conclusion.clone())));
    conclusion
}

/// The settings for a moved camera: pictures get new names, and no other files are written.
fn moved(settings: &RenderSettings, viewpoint: Viewpoint) -> Result<RenderSettings, SessionError> {
    // The window allows only possible cameras.
    let camera = viewpoint.settings().ok_or(SessionError::MovedCamera)?;
    let scene = Scene { camera, ..(*settings.job.scene).clone() };
    let names = |view: u32| {
        let name = |path: &PathBuf| suffixed_path(path, &format!("view-{view}"));
        settings.outputs.pictures.iter().map(name).collect::<Vec<_>>()
    };
    let free = (1..).map(names).find(|names| !names.iter().any(|path| path.exists()));
    let job = RenderJob { scene: Arc::new(scene), moved: Some(viewpoint), ..settings.job.clone() };
    let outputs = &settings.outputs;
    let outputs = Outputs { pictures: free.unwrap_or_default(), film: None, resume: None, ..outputs.clone() };
    Ok(RenderSettings { job, outputs, ..settings.clone() })
}
