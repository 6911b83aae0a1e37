//! Renders of the cameras that the user moves to in the window.

use super::crew::Crew;
use super::error::SessionError;
use super::event::{Conclusion, Event, tell};
use super::identity;
use super::settings::{Job, Outputs, Settings};
use super::wiring::{Begun, Rendered, Task, render};
use crate::film::Film;
use crate::film::head::Head;
use crate::integrator::Integrator;
use crate::output::suffixed_path;
use crate::output::window::{Left, Window};
use crate::scene::{Scene, Viewpoint};
use crossbeam_channel::{Receiver, Sender};
use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// The suspended render of the scene's own camera.
pub(super) struct Home<'a> {
    pub(super) settings: &'a Settings,
    pub(super) head: &'a Head,
    /// The description of the devices that it was begun on.
    pub(super) device: &'a str,
    /// The integrator of the CPU threads, if there are any.
    pub(super) integrator: Option<&'a Arc<dyn Integrator>>,
    pub(super) events: &'a Sender<Event>,
    pub(super) stop: &'a Receiver<Infallible>,
}

impl Home<'_> {
    /// Renders the cameras that the user moves to, until the window is closed. `own` is the suspended render of the
    /// scene's own camera. It is resumed whenever the user returns to that camera.
    pub(super) fn tour(&self, own: &mut Rendered, window: &mut Window) -> Result<(), SessionError> {
        let mut left = own.left.take();
        loop {
            left = match left {
                None | Some(Left::Closed | Left::Over) => return Ok(()),
                Some(Left::Moved(camera)) => self.look_from(camera, window)?,
                Some(Left::Home) => self.go_home(own, window)?,
            };
            if own.problem.is_some() {
                return Ok(());
            }
        }
    }

    /// Renders another camera from the first sample on. Returns the reason why the window left it.
    fn look_from(&self, camera: Viewpoint, window: &mut Window) -> Result<Option<Left>, SessionError> {
        let settings = moved(self.settings, camera)?;
        let crew = Crew::again(&settings, self.integrator, self.events, self.stop)?;
        let head = identity::head(&settings, &crew.description());
        let film = Film::with_layout(head.layout)?;
        let begun = Begun { film, milestone: None, spent: Duration::ZERO };
        let task =
            Task { settings: &settings, crew, head: &head, begun, dump: None, samples: None, tev: None };
        let view = render(task, Some(window), self.events, self.stop)?;
        if !view.is_aside {
            conclude(&settings, &view, self.events);
        }
        view.problem.map_or(Ok(view.left), Err)
    }

    /// Resumes the scene's own camera. Returns the reason why the window left it.
    fn go_home(&self, own: &mut Rendered, window: &mut Window) -> Result<Option<Left>, SessionError> {
        let crew = Crew::of_film(self.settings, self.integrator, self.device, self.events, self.stop)?;
        let film = std::mem::replace(&mut own.outcome.film, Film::new(1, 1)?);
        // The resumed render writes its files from here on, even if it fails.
        own.is_aside = false;
        let milestone = own.outcome.milestone.take();
        let begun = Begun { film, milestone, spent: own.outcome.totals.elapsed };
        let task = Task {
            settings: self.settings,
            crew,
            head: self.head,
            begun,
            dump: None,
            samples: None,
            tev: own.tev.take(),
        };
        let mut further = render(task, Some(window), self.events, self.stop)?;
        further.outcome.follow(&own.outcome);
        *own = further;
        Ok(own.left.take())
    }
}

/// Sends the conclusion of a render, which may have failed.
pub(super) fn conclude(settings: &Settings, rendered: &Rendered, events: &Sender<Event>) -> Conclusion {
    let conclusion = Conclusion::of(settings, &rendered.outcome, rendered.is_written);
    tell(events, Event::Concluded(Box::new(conclusion.clone())));
    conclusion
}

/// The settings for a moved camera: pictures get new names, and no other files are written.
fn moved(settings: &Settings, viewpoint: Viewpoint) -> Result<Settings, SessionError> {
    // The window allows only possible cameras.
    let camera = viewpoint.settings().ok_or(SessionError::MovedCamera)?;
    let scene = Scene { camera, ..(*settings.job.scene).clone() };
    let names = |view: u32| {
        let name = |path: &PathBuf| suffixed_path(path, &format!("view-{view}"));
        settings.outputs.pictures.iter().map(name).collect::<Vec<_>>()
    };
    let free = (1..).map(names).find(|names| !names.iter().any(|path| path.exists()));
    let job = Job { scene: Arc::new(scene), moved: Some(viewpoint), ..settings.job.clone() };
    let outputs = &settings.outputs;
    let outputs = Outputs { pictures: free.unwrap_or_default(), film: None, resume: None, ..outputs.clone() };
    Ok(Settings { job, outputs, ..settings.clone() })
}
