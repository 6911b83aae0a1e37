//! Opens the window.

use super::error::SessionError;
use super::settings::{RenderSettings, WindowChoice};
use crate::film::ViewTransform;
use crate::integrator::{Integrator, Paths};
use crate::output::window::orbit::Orbit;
use crate::output::window::{self, Window, WindowOptions};
use crate::sampling::Region;
use crate::scene::Scene;

/// Opens the window, if one is requested and there is a display. The integrator, if there is one, finds the point that
/// the camera orbits.
pub(super) fn open_window(
    settings: &RenderSettings,
    integrator: Option<&dyn Integrator>,
) -> Result<Option<Window>, SessionError> {
    if settings.view.window == WindowChoice::None {
        return Ok(None);
    }
    let (job, outputs) = (&settings.job, &settings.outputs);
    let camera = if outputs.wants_samples() || !outputs.dump_at.is_empty() {
        Err("the camera cannot move: a sample dump and numbered pictures belong to one render".to_owned())
    } else {
        Ok(Orbit::new(&job.scene.camera, distance(settings, integrator)))
    };
    let (shown, film) = (job.picture_region(), &job.scene.film);
    let options = WindowOptions {
        name: settings.view.name.clone(),
        width: shown.width,
        height: shown.height,
        film_height: film.height,
        corner: (shown.x, shown.y),
        view: ViewTransform::of(film),
        overlay: outputs.overlay,
        time_limit: settings.stopping.time.map(|time| time.as_secs_f64()),
        camera,
    };
    match window::open(&options) {
        Ok(window) => Ok(Some(window)),
        Err(error) if settings.view.window == WindowChoice::Required => Err(error.into()),
        Err(_) => Ok(None),
    }
}

/// The distance from the camera to the point that it orbits: the first surface in the middle of the film, or else the
/// distance of the origin.
fn distance(settings: &RenderSettings, integrator: Option<&dyn Integrator>) -> f64 {
    let Scene { film, camera, .. } = &*settings.job.scene;
    let mut hits = Vec::new();
    if let Some(integrator) = integrator {
        let middle = film.height / 2 * film.width + film.width / 2;
        let pixels = [Region::whole(film.width, film.height).pixel(middle)];
        let paths = Paths { pixels: &pixels, first_sample: settings.job.first, samples: 1 };
        integrator.first_hits(settings.devices.level, &paths, &mut hits);
    }
    let seen = hits.first().filter(|hit| hit.met).map(|hit| f64::from(hit.depth));
    let origin = -camera.eye.dot(camera.forward);
    seen.into_iter().chain([origin]).find(|&distance| distance > 0.0).unwrap_or(1.0)
}
