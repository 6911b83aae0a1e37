//! What the window shows and how keys and mouse change it; knows nothing of the system's windows.

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

/// Half a stop a key press.
const EXPOSURE_STEP: f64 = 0.5;
/// Beyond this many stops either way there is nothing to see.
const MOST_EXPOSURE: f64 = 30.0;
/// How long a note stands in the title bar.
const NOTE_TIME: Duration = Duration::from_secs(4);
/// After the camera has moved, the picture before stands until there is a sample in each pixel of the new one, or
/// for this long: a picture with holes flickers.
const HOLD: Duration = Duration::from_millis(250);

/// The mouse, at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pointer {
    /// Where it is, in pixels from the window's left upper corner; none if it is elsewhere.
    pub at: Option<[f64; 2]>,
    /// The left button is down.
    pub left: bool,
    /// Another button is down, or the left one with Shift.
    pub other: bool,
    /// Notches that the wheel has turned away from the hand since the moment before.
    pub wheel: i32,
}

/// What is shown instead of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Picture,
    Errors,
    Samples,
    Layer(usize),
}

/// The window's state.
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
    /// The mouse moves the camera.
    steers: bool,
    /// The camera as the mouse left it, where it may be moved.
    orbit: Option<Orbit>,
    /// It has moved since the render began.
    moved: bool,
    /// The render is of a camera that was moved.
    away: bool,
    snapshot: Option<Arc<Snapshot>>,
    /// When the render of the camera began, until there is a snapshot of it.
    awaited: Option<Instant>,
    note: Option<(String, Instant)>,
    /// The picture on the screen is not what it should be.
    stale: bool,
}

impl Viewer {
    /// A viewer without a picture as yet.
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

    /// Another render begins: of a camera that was moved, or of the scene's own again. What was shown stands until
    /// there is something to see of it.
    pub fn begin(&mut self, away: bool, now: Instant) {
        if !away {
            self.orbit = self.options.camera.as_ref().ok().cloned();
        }
        (self.away, self.moved, self.awaited) = (away, false, Some(now));
        // They are of the camera before.
        self.layers.clear();
        if matches!(self.shown, Shown::Layer(_)) {
            self.shown = Shown::Picture;
        }
    }

    /// The picture on the screen, if there is one yet.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.snapshot.clone().filter(|_| self.awaited.is_none())
    }

    /// Takes a newer picture.
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
            // Counted only when they change: it looks at every pixel of the film.
            self.palette = palette(workers(&snapshot.owners));
        }
        self.snapshot = Some(snapshot);
        self.stale = true;
    }

    /// Takes the layers of what is seen.
    pub fn take_layers(&mut self, channels: &[Channel]) {
        self.layers = layers::views(channels, self.options.width, self.options.height);
    }

    /// Puts a line into the title bar for a while.
    pub fn note(&mut self, text: String, now: Instant) {
        self.note = Some((text, now));
    }

    /// Changes what is shown. What else a key asks for is the window's to do: [`Action::Close`],
    /// [`Action::Save`], [`Action::Print`], [`Action::Home`].
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
            Action::Close | Action::Save | Action::Print | Action::Home => return,
        }
        self.stale = true;
    }

    fn expose(&mut self, stops: f64) {
        self.view.exposure = (self.view.exposure + stops).clamp(-MOST_EXPOSURE, MOST_EXPOSURE);
        self.tone = ToneMap::new(self.view);
    }

    /// Follows the mouse over a window of `size` pixels.
    pub fn point(&mut self, pointer: Pointer, size: (u32, u32)) {
        let before = std::mem::replace(&mut self.pointer, pointer);
        if self.probe && before.at != pointer.at {
            self.stale = true;
        }
        let Some(at) = pointer.at else { return };
        // A drag goes on with the button with which it began.
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
                match orbit.rendered() {
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

    /// The camera to begin anew with, if it has moved and what it saw before has been shown, or would take too
    /// long.
    pub fn camera_to_render(&self, now: Instant) -> Option<String> {
        let waits = self.awaited.is_some_and(|since| now.duration_since(since) < HOLD);
        self.camera().filter(|_| self.moved && !waits)
    }

    /// The camera as it stands in a scene file.
    pub fn camera(&self) -> Option<String> {
        self.orbit.as_ref().map(Orbit::to_toml)
    }

    /// Whether the render is of a camera that was moved, or is to be.
    pub fn is_away(&self) -> bool {
        self.away || self.moved
    }

    /// How the picture is shown.
    pub fn view(&self) -> ViewTransform {
        self.view
    }

    /// The final picture is here.
    pub fn finished(&self) -> bool {
        self.awaited.is_none() && self.snapshot.as_ref().is_some_and(|snapshot| snapshot.finished)
    }

    /// The picture has changed since it was last drawn.
    pub fn is_stale(&self) -> bool {
        self.stale
    }

    /// Draws what there is for a window of `size` pixels, as 0x00RRGGBB; black before the first picture.
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

    /// What is to be said of the pixel under the pointer.
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
        // A title ends at a NUL, for most systems.
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
            parts.push("the mouse moves the camera".into());
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
mod tests {
    use super::*;
    use crate::camera::CameraSettings;
    use crate::film::tone::srgb_to_linear;
    use crate::film::{Picture, Statistics};

    fn options() -> WindowOptions {
        WindowOptions {
            name: "cover.toml".into(),
            width: 2,
            height: 1,
            film_height: 1,
            corner: (0, 0),
            view: ViewTransform::default(),
            overlay: false,
            time_limit: None,
            camera: Ok(Orbit::new(&camera(), 4.0)),
        }
    }

    fn camera() -> CameraSettings {
        crate::scene::parse("[camera]\neye = [-4, 0, 0]\n", "a.toml".as_ref()).expect("a scene").scene.camera
    }

    fn snapshot(spp_done: f64, finished: bool) -> Arc<Snapshot> {
        Arc::new(Snapshot {
            picture: Picture { width: 2, height: 1, rgb: vec![[0.25; 3], [0.5; 3]] },
            owners: Arc::new(vec![0, 1]),
            spp_done,
            spp_target: Some(500),
            spp_before: 0.0,
            noise: None,
            samples: (spp_done * 1e6) as u64,
            seconds: spp_done / 10.0,
            statistics: Arc::new(Statistics { counts: vec![4, 2], variances: vec![0.01, 0.0] }),
            finished,
        })
    }

    fn drawn(viewer: &mut Viewer) -> Vec<u32> {
        let mut buffer = Vec::new();
        viewer.draw((2, 1), &mut buffer);
        buffer
    }

    #[test]
    fn the_title_tells_the_state() {
        let now = Instant::now();
        let mut viewer = Viewer::new(&options());
        assert_eq!(viewer.title(now), "cover.toml — starting");
        viewer.show(snapshot(100.0, false), Instant::now());
        assert_eq!(viewer.title(now), "cover.toml — 100/500 spp, 10 Msamples/s, 40 s left");
        for _ in 0..3 {
            viewer.act(Action::Brighter, Instant::now());
        }
        assert_eq!(viewer.title(now), "cover.toml — 100/500 spp, 10 Msamples/s, 40 s left — +1.5 EV");
        viewer.act(Action::Overlay, Instant::now());
        viewer.show(snapshot(500.0, true), Instant::now());
        assert!(viewer.finished());
        assert_eq!(viewer.title(now), "cover.toml — done: 500 spp in 50 s, 10 Msamples/s — +1.5 EV — owners");
    }

    #[test]
    fn a_time_limit_counts_for_the_time_left() {
        let mut viewer = Viewer::new(&WindowOptions { time_limit: Some(30.0), ..options() });
        viewer.show(snapshot(100.0, false), Instant::now());
        assert!(viewer.title(Instant::now()).ends_with("20 s left"));
    }

    #[test]
    fn notes_come_and_go() {
        let now = Instant::now();
        let mut viewer = Viewer::new(&options());
        viewer.note("saved\0cover.png\n".into(), now);
        assert_eq!(viewer.title(now), "cover.toml — starting — saved cover.png ");
        assert_eq!(viewer.title(now + NOTE_TIME), "cover.toml — starting");
    }

    #[test]
    fn exposure_changes_the_picture_by_half_stops_and_has_ends() {
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(1.0, false), Instant::now());
        let plain = drawn(&mut viewer);
        viewer.act(Action::Brighter, Instant::now());
        viewer.act(Action::Brighter, Instant::now());
        assert_eq!(viewer.view().exposure, 1.0);
        let brighter = drawn(&mut viewer);
        // A stop makes 0.25 what 0.5 was.
        assert_eq!(brighter[0], plain[1]);
        assert_ne!(brighter[0], plain[0]);
        viewer.act(Action::Darker, Instant::now());
        viewer.act(Action::Darker, Instant::now());
        assert_eq!(drawn(&mut viewer), plain);
        for _ in 0..1000 {
            viewer.act(Action::Darker, Instant::now());
        }
        assert_eq!(viewer.view().exposure, -MOST_EXPOSURE);
    }

    #[test]
    fn the_overlay_shows_owners_and_goes_again() {
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(1.0, false), Instant::now());
        let plain = drawn(&mut viewer);
        viewer.act(Action::Overlay, Instant::now());
        let expected: Vec<u32> =
            palette(2).iter().map(|&[r, g, b]| u32::from_be_bytes([0, r, g, b])).collect();
        assert_eq!(drawn(&mut viewer), expected);
        viewer.act(Action::Overlay, Instant::now());
        assert_eq!(drawn(&mut viewer), plain);
    }

    #[test]
    fn only_changes_make_it_stale() {
        let mut viewer = Viewer::new(&options());
        assert!(viewer.is_stale());
        assert_eq!(drawn(&mut viewer), [0, 0]);
        assert!(!viewer.is_stale());
        viewer.act(Action::Save, Instant::now());
        viewer.act(Action::Close, Instant::now());
        viewer.act(Action::Print, Instant::now());
        viewer.act(Action::Home, Instant::now());
        viewer.note("a note".into(), Instant::now());
        assert!(!viewer.is_stale());
        for change in
            [Action::Brighter, Action::Overlay, Action::Help, Action::Probe, Action::Tone, Action::Layer]
        {
            viewer.act(change, Instant::now());
            assert!(viewer.is_stale(), "{change:?}");
            drawn(&mut viewer);
        }
        viewer.show(snapshot(1.0, false), Instant::now());
        assert!(viewer.is_stale());
    }

    #[test]
    fn tone_curves_go_round() {
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(1.0, false), Instant::now());
        let codes = |viewer: &mut Viewer| drawn(viewer)[1] & 0xff;
        // 0.5 is 188 as sRGB and 128 as it is; the film curve, at 0.3 of its scale, makes it 0.438, which is 177.
        assert_eq!(codes(&mut viewer), 188);
        viewer.act(Action::Tone, Instant::now());
        assert_eq!(codes(&mut viewer), 177);
        assert!(viewer.title(Instant::now()).ends_with("filmic"));
        viewer.act(Action::Tone, Instant::now());
        assert_eq!((codes(&mut viewer), viewer.view().tone), (128, Tone::Linear));
        viewer.act(Action::Tone, Instant::now());
        assert_eq!(codes(&mut viewer), 188);
    }

    #[test]
    fn layers_come_in_turn_after_error_and_samples() {
        let now = Instant::now();
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(1.0, false), now);
        let picture = drawn(&mut viewer);
        let next = |viewer: &mut Viewer| {
            viewer.act(Action::Layer, now);
            (viewer.title(now).rsplit(" — ").next().unwrap_or_default().to_owned(), drawn(viewer))
        };
        // An error of 0.1 in 0.25·√3 is 23%; there is none in the other pixel.
        let part = 0.1 / (0.25 * 3.0_f64.sqrt()) / 0.25;
        let code = (part * 255.0).round() as u32;
        assert_eq!(next(&mut viewer), ("error".to_owned(), vec![code * 0x01_01_01, 0]));
        assert_eq!(next(&mut viewer), ("samples".to_owned(), vec![0x00ff_ffff, 0x0080_8080]));
        assert_eq!(next(&mut viewer).1, picture, "no layers as yet");
        let values = vec![0.0, srgb_to_linear(0.2) as f32];
        viewer.take_layers(&[Channel { name: "albedo.R".into(), values }]);
        next(&mut viewer);
        next(&mut viewer);
        assert_eq!(next(&mut viewer), ("albedo".to_owned(), vec![0, 51 << 16]));
        assert_eq!(next(&mut viewer).1, picture);
    }

    #[test]
    fn the_probe_tells_of_the_pixel_under_the_pointer() {
        let now = Instant::now();
        let mut viewer = Viewer::new(&WindowOptions { corner: (10, 20), ..options() });
        viewer.show(snapshot(1.0, false), now);
        let over = |x: f64| Pointer { at: Some([x, 0.0]), ..Pointer::default() };
        viewer.point(over(0.0), (2, 1));
        assert_eq!(viewer.probed((2, 1)), None);
        viewer.act(Action::Probe, now);
        let said = "10,20  0.2500 0.2500 0.2500 ±0.10 (23%)  4 samples";
        assert_eq!(viewer.probed((2, 1)).as_deref(), Some(said));
        drawn(&mut viewer);
        viewer.point(over(1.0), (2, 1));
        assert!(viewer.is_stale());
        assert_eq!(viewer.probed((2, 1)).as_deref(), Some("11,20  0.5000 0.5000 0.5000 ±0 (0%)  2 samples"));
        viewer.point(Pointer::default(), (2, 1));
        assert_eq!(viewer.probed((2, 1)), None);
        viewer.point(over(0.0), (2, 1));
        viewer.take_layers(&[Channel { name: "depth.Z".into(), values: vec![12.5, 3.0] }]);
        (0..3).for_each(|_| viewer.act(Action::Layer, now));
        assert_eq!(viewer.probed((2, 1)).as_deref(), Some("10,20  depth 12.50"));
    }

    #[test]
    fn help_lies_over_the_picture_and_names_every_key() {
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(1.0, false), Instant::now());
        let size = (600, 300);
        let mut plain = Vec::new();
        viewer.draw(size, &mut plain);
        viewer.act(Action::Help, Instant::now());
        let mut helped = Vec::new();
        viewer.draw(size, &mut helped);
        assert!(plain.iter().zip(&helped).filter(|(a, b)| a != b).count() > 10_000);
        assert_eq!(plain[599], helped[599]);
        for key in "Esc + - S T L O P F C K R H wheel drag".split(' ') {
            assert!(HELP.iter().any(|line| line.split_whitespace().any(|word| word == key)), "{key}");
        }
        let widest = HELP.iter().map(|line| line.len()).max();
        assert!(widest <= Some(38), "it fits into a small window");
    }

    fn drag(from: [f64; 2], to: [f64; 2], other: bool) -> [Pointer; 2] {
        [from, to].map(|at| Pointer { at: Some(at), left: !other, other, wheel: 0 })
    }

    #[test]
    fn dragging_moves_the_picture_and_the_wheel_enlarges_it() {
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(1.0, false), Instant::now());
        let size = (20, 10);
        viewer.point(Pointer { at: Some([0.0, 0.0]), wheel: 2, ..Pointer::default() }, size);
        assert_eq!(viewer.zoom.pixel_at([19.0, 0.0], (2, 1), size), Some((0, 0)));
        drag([19.0, 5.0], [4.0, 5.0], false).into_iter().for_each(|pointer| viewer.point(pointer, size));
        assert_eq!(viewer.zoom.pixel_at([19.0, 0.0], (2, 1), size), Some((1, 0)));
        viewer.act(Action::Fit, Instant::now());
        assert_eq!(viewer.zoom, Zoom::default());
        assert!(viewer.camera_to_render(Instant::now()).is_none() && !viewer.is_away());
    }

    #[test]
    fn the_mouse_moves_the_camera_only_when_it_is_told_to() {
        let now = Instant::now();
        let size = (200, 100);
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(3.0, false), now);
        let own = viewer.camera();
        drag([50.0, 50.0], [60.0, 50.0], false).into_iter().for_each(|pointer| viewer.point(pointer, size));
        assert_eq!((viewer.camera_to_render(now), viewer.camera()), (None, own.clone()));
        viewer.act(Action::Camera, now);
        assert!(viewer.title(now).ends_with("the mouse moves the camera"));
        // Moving without a button is no drag, nor is going where it is pressed.
        viewer.point(Pointer { at: Some([10.0, 10.0]), ..Pointer::default() }, size);
        viewer.point(Pointer { at: Some([50.0, 50.0]), left: true, ..Pointer::default() }, size);
        assert_eq!(viewer.camera_to_render(now), None);
        drag([50.0, 50.0], [60.0, 50.0], false).into_iter().for_each(|pointer| viewer.point(pointer, size));
        let turned = viewer.camera_to_render(now).expect("it moved");
        assert!(viewer.is_away() && Some(&turned) != own.as_ref());
        drag([50.0, 50.0], [60.0, 50.0], true).into_iter().for_each(|pointer| viewer.point(pointer, size));
        let panned = viewer.camera_to_render(now).expect("it moved");
        assert_ne!(panned, turned);
        viewer.point(Pointer { at: Some([50.0, 50.0]), wheel: 1, ..Pointer::default() }, size);
        assert_ne!(viewer.camera_to_render(now), Some(panned));

        // What was there stands until there is something to see.
        viewer.begin(true, now);
        assert_eq!(viewer.camera_to_render(now), None);
        assert!(viewer.snapshot().is_none() && !viewer.finished());
        let part = snapshot(0.5, false);
        viewer.show(Arc::clone(&part), now);
        assert!(viewer.snapshot().is_none());
        viewer.show(Arc::clone(&part), now + HOLD);
        assert!(Arc::ptr_eq(&viewer.snapshot().expect("better than nothing"), &part));
        viewer.begin(true, now);
        viewer.show(snapshot(1.0, false), now);
        assert!(viewer.snapshot().is_some());
        // And back.
        viewer.begin(false, now);
        assert!(viewer.camera() == own && !viewer.is_away());
    }

    #[test]
    fn a_camera_that_must_stay_says_why() {
        let now = Instant::now();
        let why = "the camera stays".to_owned();
        let mut viewer = Viewer::new(&WindowOptions { camera: Err(why.clone()), ..options() });
        viewer.show(snapshot(3.0, false), now);
        viewer.act(Action::Camera, now);
        assert!(viewer.title(now).ends_with(&why));
        drag([0.0, 0.0], [60.0, 50.0], false)
            .into_iter()
            .for_each(|pointer| viewer.point(pointer, (200, 100)));
        assert_eq!(viewer.camera_to_render(now), None);
    }

    #[test]
    fn characters_with_and_without_shift_change_the_exposure() {
        for (typed, action) in [
            ('+', Some(Action::Brighter)),
            ('=', Some(Action::Brighter)),
            ('-', Some(Action::Darker)),
            ('_', Some(Action::Darker)),
            ('x', None),
        ] {
            assert_eq!(Action::of(typed), action);
        }
    }
}
