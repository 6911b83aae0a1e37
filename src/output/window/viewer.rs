//! The state of the window, and its changes by keys and mouse; independent of the windowing system.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::keys::{Action, HELP};
use super::layers::{self, LayerView};
use super::orbit::Orbit;
use super::view::{Zoom, draw_owners, draw_picture};
use super::{WindowOptions, text};
use crate::film::{Channel, Snapshot, ToneMap, ViewTransform};
use crate::output::overlay::{palette, workers};
use crate::output::{human, progress::Progress};
use crate::scene::Tone;
use crate::scene::Viewpoint;

/// The change of exposure per key press, in stops.
const EXPOSURE_STEP: f64 = 0.5;
/// The maximum absolute exposure in stops; beyond it nothing is visible.
const MOST_EXPOSURE: f64 = 30.0;
/// The time that a note is shown in the title bar.
const NOTE_TIME: Duration = Duration::from_secs(4);
/// After the camera has moved, the previous picture is shown until each pixel of the new one has a sample, or
/// for this long: a picture with holes flickers.
const HOLD: Duration = Duration::from_millis(250);

/// The state of the mouse.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pointer {
    /// Its position in pixels from the window's top left corner; `None` outside the window.
    pub at: Option<[f64; 2]>,
    /// Whether the left button is down.
    pub left: bool,
    /// Whether another button is down, or the left one with Shift.
    pub other: bool,
    /// Notches by which the wheel was turned forward since the previous state.
    pub wheel: i32,
}

/// The displayed contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Picture,
    Errors,
    Samples,
    Layer(usize),
}

/// The state of the window.
#[derive(Debug)]
pub struct Viewer {
    options: WindowOptions,
    view: ViewTransform,
    tone: ToneMap,
    overlay: bool,
    palette: Vec<[u8; 3]>,
    zoom: Zoom,
    shown: Shown,
    layers: Vec<LayerView>,
    help: bool,
    probe: bool,
    pointer: Pointer,
    /// Whether the mouse moves the camera.
    steers: bool,
    /// The camera as moved by the mouse, if the user may move it.
    orbit: Option<Orbit>,
    /// Whether it has moved since the render began.
    moved: bool,
    /// Whether the render belongs to a moved camera.
    away: bool,
    snapshot: Option<Arc<Snapshot>>,
    /// The start of the camera's render, until there is a snapshot of it.
    awaited: Option<Instant>,
    note: Option<(String, Instant)>,
    /// Whether the window must be redrawn.
    stale: bool,
}

impl Viewer {
    /// A viewer without a picture.
    pub fn new(options: &WindowOptions) -> Self {
        Self {
            options: options.clone(),
            view: options.view,
            tone: ToneMap::new(options.view),
            overlay: options.overlay,
            palette: palette(1),
            zoom: Zoom::default(),
            shown: Shown::Picture,
            layers: Vec::new(),
            help: false,
            probe: false,
            pointer: Pointer::default(),
            steers: false,
            orbit: options.camera.as_ref().ok().cloned(),
            moved: false,
            away: false,
            snapshot: None,
            awaited: None,
            note: None,
            stale: true,
        }
    }

    /// Starts to show another render: of a moved camera, or of the scene's own again. The previous picture is shown
    /// until there is a new one.
    pub fn begin(&mut self, away: bool, now: Instant) {
        if !away {
            self.orbit = self.options.camera.as_ref().ok().cloned();
        }
        (self.away, self.moved, self.awaited) = (away, false, Some(now));
        // They belong to the previous camera.
        self.layers.clear();
        if matches!(self.shown, Shown::Layer(_)) {
            self.shown = Shown::Picture;
        }
    }

    /// The displayed snapshot, if there is one.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.snapshot.clone().filter(|_| self.awaited.is_none())
    }

    /// Shows a newer snapshot.
    pub fn show(&mut self, snapshot: Arc<Snapshot>, now: Instant) {
        if let Some(since) = self.awaited
            && self.snapshot.is_some()
            && snapshot.spp_done < 1.0
            && !snapshot.finished
            && now.duration_since(since) < HOLD
        {
            return;
        }
        self.awaited = None;
        let seen = self.snapshot.as_ref().is_some_and(|old| Arc::ptr_eq(&old.owners, &snapshot.owners));
        if !seen {
            // Counted only on a change, because it covers every pixel of the film.
            self.palette = palette(workers(&snapshot.owners));
        }
        self.snapshot = Some(snapshot);
        self.stale = true;
    }

    /// Sets the layers of the camera's view.
    pub fn take_layers(&mut self, channels: &[Channel]) {
        self.layers = layers::views(channels, self.options.width, self.options.height);
    }

    /// Shows a note in the title bar for a while.
    pub fn note(&mut self, text: String, now: Instant) {
        self.note = Some((text, now));
    }

    /// Applies an action to the state. The window handles the others: [`Action::Close`],
    /// [`Action::Save`], [`Action::Print`], [`Action::SceneCamera`].
    pub fn act(&mut self, action: Action, now: Instant) {
        match action {
            Action::Brighter => self.expose(EXPOSURE_STEP),
            Action::Darker => self.expose(-EXPOSURE_STEP),
            Action::Overlay => self.overlay = !self.overlay,
            Action::Help => self.help = !self.help,
            Action::Probe => self.probe = !self.probe,
            Action::Tone => {
                let at = Tone::ALL.iter().position(|&tone| tone == self.view.tone).unwrap_or(0);
                self.view.tone = Tone::ALL[(at + 1) % Tone::ALL.len()];
                self.tone = ToneMap::new(self.view);
            }
            Action::Layer => {
                self.shown = match self.shown {
                    Shown::Picture => Shown::Errors,
                    Shown::Errors => Shown::Samples,
                    Shown::Samples if self.layers.is_empty() => Shown::Picture,
                    Shown::Samples => Shown::Layer(0),
                    Shown::Layer(at) if at + 1 < self.layers.len() => Shown::Layer(at + 1),
                    Shown::Layer(_) => Shown::Picture,
                };
            }
            Action::Fit => self.zoom = Zoom::default(),
            Action::Camera => match &self.options.camera {
                Ok(_) => self.steers = !self.steers,
                Err(why) => self.note = Some((why.clone(), now)),
            },
            Action::Close | Action::Save | Action::Print | Action::SceneCamera => return,
        }
        self.stale = true;
    }

    fn expose(&mut self, stops: f64) {
        self.view.exposure = (self.view.exposure + stops).clamp(-MOST_EXPOSURE, MOST_EXPOSURE);
        self.tone = ToneMap::new(self.view);
    }

    /// Processes the state of the mouse over a window of `size` pixels.
    pub fn point(&mut self, pointer: Pointer, size: (u32, u32)) {
        let before = std::mem::replace(&mut self.pointer, pointer);
        if self.probe && before.at != pointer.at {
            self.stale = true;
        }
        let Some(at) = pointer.at else { return };
        // A drag continues with the button with which it began.
        let held = (before.left && pointer.left) || (before.other && pointer.other);
        let by = before.at.filter(|_| held).map_or([0.0; 2], |was| [at[0] - was[0], at[1] - was[1]]);
        let picture = (self.options.width, self.options.height);
        match self.orbit.as_mut().filter(|_| self.steers) {
            Some(orbit) => {
                let stood = orbit.clone();
                let height = self.zoom.scale(picture, size) * f64::from(self.options.film_height);
                let [right, down] = by.map(|length| length / height);
                if by != [0.0; 2] {
                    if pointer.other { orbit.pan(right, down) } else { orbit.turn(right, down) }
                }
                if pointer.wheel != 0 {
                    orbit.dolly(pointer.wheel.into());
                }
                if *orbit == stood {
                    return;
                }
                match orbit.viewpoint().settings() {
                    Some(_) => self.moved = true,
                    None => *orbit = stood,
                }
            }
            None => {
                if by != [0.0; 2] {
                    self.zoom.pan(by, picture, size);
                    self.stale = true;
                }
                if pointer.wheel != 0 {
                    self.zoom.at(at, pointer.wheel, picture, size);
                    self.stale = true;
                }
            }
        }
    }

    /// The camera to render next, if it has moved and the view of the previous one has been shown, or would take too
    /// long.
    pub fn camera_to_render(&self, now: Instant) -> Option<Viewpoint> {
        let waits = self.awaited.is_some_and(|since| now.duration_since(since) < HOLD);
        self.camera().filter(|_| self.moved && !waits)
    }

    /// The camera, if the user may move it.
    pub fn camera(&self) -> Option<Viewpoint> {
        self.orbit.as_ref().map(Orbit::viewpoint)
    }

    /// Whether the render belongs to a moved camera, or will.
    pub fn is_away(&self) -> bool {
        self.away || self.moved
    }

    /// The view transform.
    pub fn view(&self) -> ViewTransform {
        self.view
    }

    /// Whether the final picture is shown.
    pub fn finished(&self) -> bool {
        self.awaited.is_none() && self.snapshot.as_ref().is_some_and(|snapshot| snapshot.finished)
    }

    /// Whether the window must be redrawn.
    pub fn is_stale(&self) -> bool {
        self.stale
    }

    /// Draws the contents for a window of `size` pixels, as 0x00RRGGBB; black before the first picture.
    pub fn draw(&mut self, size: (u32, u32), buffer: &mut Vec<u32>) {
        self.stale = false;
        match &self.snapshot {
            None => {
                buffer.clear();
                buffer.resize(size.0 as usize * size.1 as usize, 0);
            }
            Some(snapshot) if self.overlay => {
                let film = (snapshot.picture.width, snapshot.picture.height);
                draw_owners(&snapshot.owners, film, &self.palette, &self.zoom, size, buffer);
            }
            Some(snapshot) => {
                let plain = ToneMap::new(ViewTransform::default());
                let mut draw =
                    |layer: &LayerView| draw_picture(&layer.picture, &plain, &self.zoom, size, buffer);
                match self.shown {
                    Shown::Picture => draw_picture(&snapshot.picture, &self.tone, &self.zoom, size, buffer),
                    Shown::Errors => draw(&layers::errors(snapshot)),
                    Shown::Samples => draw(&layers::samples(snapshot)),
                    Shown::Layer(at) => draw(&self.layers[at]),
                }
            }
        }
        if self.help {
            let lines: Vec<String> = HELP.iter().map(|&line| line.to_owned()).collect();
            text::draw(&lines, (8, 8), size, buffer);
        }
        if let Some(line) = self.probed(size) {
            let lines = [line];
            let bottom = (size.1 as usize).saturating_sub(text::box_size(&lines).1);
            text::draw(&lines, (0, bottom), size, buffer);
        }
    }

    /// The description of the pixel under the pointer.
    fn probed(&self, size: (u32, u32)) -> Option<String> {
        let (at, snapshot) = (self.pointer.at.filter(|_| self.probe)?, self.snapshot.as_ref()?);
        let picture = &snapshot.picture;
        let (x, y) = self.zoom.pixel_at(at, (picture.width, picture.height), size)?;
        let pixel = y as usize * picture.width as usize + x as usize;
        let [film_x, film_y] = [x + self.options.corner.0, y + self.options.corner.1];
        let number = |value: f32| human::significant(value.into(), 4);
        if let Shown::Layer(layer) = self.shown {
            let layer = &self.layers[layer];
            let values: Vec<String> = layer.values.iter().map(|values| number(values[pixel])).collect();
            return Some(format!("{film_x},{film_y}  {} {}", layer.name, values.join(" ")));
        }
        let [r, g, b] = picture.rgb[pixel].map(number);
        let count = snapshot.statistics.counts.get(pixel).copied().unwrap_or(0);
        let error = layers::error_of(snapshot, pixel).map_or(String::new(), |[error, part]| {
            format!(" ±{} ({}%)", human::significant(error, 2), human::significant(100.0 * part, 2))
        });
        Some(format!("{film_x},{film_y}  {r} {g} {b}{error}  {count} samples"))
    }

    /// The title bar: `cover.toml — 128/500 spp, 7.9 Msamples/s, 41 s left — +1.5 EV`.
    pub fn title(&self, now: Instant) -> String {
        // On most systems a title ends at a NUL.
        let mut parts = vec![self.options.name.replace('\0', "")];
        parts.push(match &self.snapshot {
            None => "starting".into(),
            Some(snapshot) => {
                let progress = Progress::of(snapshot, self.options.time_limit);
                if self.finished() { format!("done: {}", progress.summary()) } else { progress.to_string() }
            }
        });
        if self.view.exposure != 0.0 {
            parts.push(human::exposure(self.view.exposure));
        }
        if self.view.tone != Tone::Srgb {
            parts.push(self.view.tone.name().into());
        }
        match self.shown {
            _ if self.overlay => parts.push("owners".into()),
            Shown::Picture => {}
            Shown::Errors => parts.push("error".into()),
            Shown::Samples => parts.push("samples".into()),
            Shown::Layer(at) => parts.push(self.layers[at].name.clone()),
        }
        if self.steers {
            parts.push("mouse moves camera".into());
        } else if self.is_away() {
            parts.push("moved camera".into());
        }
        if let Some((note, _)) =
            self.note.as_ref().filter(|(_, since)| now.duration_since(*since) < NOTE_TIME)
        {
            parts.push(note.replace(['\0', '\n'], " "));
        }
        parts.join(" — ")
    }
}

#[cfg(test)]
mod tests;
