//! The window, by minifb: X11 (loaded when it is opened, not linked), Windows, macOS.

use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TryRecvError, TrySendError, bounded};
use minifb::{InputCallback, Key, MouseButton, MouseMode, ScaleMode};

use super::keys::Action;
use super::view::first_size;
use super::viewer::{Pointer, Viewer};
use super::{ExitReason, Feed, Request, WindowError, WindowOptions};

/// The minimum interval between redraws, and between polls of the keys: 30 per second.
const TICK: Duration = Duration::from_millis(34);
/// The minimum interval between changes of the title: window managers redraw a frame for each.
const TITLE_TICK: Duration = Duration::from_millis(200);
/// The interval at which the same contents are presented again, because minifb does not report when the system has lost
/// them: the window was covered, or did not exist yet when it was first drawn.
const REFRESH: Duration = Duration::from_millis(500);

/// An open window.
#[derive(Debug)]
pub struct Window {
    window: minifb::Window,
    key_events: Receiver<KeyEvent>,
    /// Keys that are down, to detect repeated presses.
    held: Vec<Key>,
    viewer: Viewer,
    buffer: Vec<u32>,
    /// The buffer's size and whether the window had the focus when it was last presented.
    drawn: Option<((u32, u32), bool, Instant)>,
    title: String,
    titled: Instant,
    replies: (Sender<String>, Receiver<String>),
}

/// Opens the window, initially black.
pub fn open(options: &WindowOptions) -> Result<Window, WindowError> {
    let display = find_display()?;
    let viewer = Viewer::new(options);
    let title = viewer.title(Instant::now());
    let (width, height) = first_size((options.width, options.height), display.largest);
    let settings = minifb::WindowOptions {
        resize: true,
        // The buffer always has the window's size, so that no scaling is needed.
        scale_mode: ScaleMode::UpperLeft,
        ..minifb::WindowOptions::default()
    };
    let mut window =
        minifb::Window::new(&title, width as usize, height as usize, settings).map_err(|error| {
            WindowError::Failed(match error {
                minifb::Error::WindowCreate(reason) => reason,
                other => other.to_string(),
            })
        })?;
    drop(display);
    // The loop below limits the rate itself.
    window.set_target_fps(0);
    let (sender, key_events) = bounded(256);
    window.set_input_callback(Box::new(Keyboard(sender)));
    Ok(Window {
        window,
        key_events,
        held: Vec::new(),
        viewer,
        buffer: Vec::new(),
        drawn: None,
        title,
        titled: Instant::now(),
        replies: bounded(1),
    })
}

#[cfg(all(unix, not(target_os = "macos")))]
use super::x11::find as find_display;

/// The properties of the display, known before a window is open.
#[cfg(not(all(unix, not(target_os = "macos"))))]
struct Display {
    /// The maximum initial size of a window in pixels.
    largest: (u32, u32),
}

/// The display of a small laptop.
#[cfg(not(all(unix, not(target_os = "macos"))))]
fn find_display() -> Result<Display, WindowError> {
    Ok(Display { largest: (1280, 800) })
}

enum KeyEvent {
    Typed(char),
    Down(Key),
    Up(Key),
}

/// Records key events. minifb's own list of pressed keys misses keys that are released within a tick.
struct Keyboard(Sender<KeyEvent>);

impl InputCallback for Keyboard {
    fn add_char(&mut self, code: u32) {
        if let Some(typed) = char::from_u32(code) {
            // The receiver exists as long as the window that calls this.
            let _ = self.0.try_send(KeyEvent::Typed(typed));
        }
    }

    fn set_key_state(&mut self, key: Key, down: bool) {
        let _ = self.0.try_send(if down { KeyEvent::Down(key) } else { KeyEvent::Up(key) });
    }
}

impl Window {
    /// Shows snapshots and sends requests until the user closes the window or moves the camera, `stop` closes, or
    /// the snapshots end without a finished one. After a finished one it stays open. `away` is set if the render
    /// belongs to a moved camera.
    pub fn run(&mut self, feed: &Feed, requests: &Sender<Request>, away: bool) -> ExitReason {
        self.viewer.begin(away, Instant::now());
        loop {
            let tick = Instant::now();
            match feed.snapshots.try_recv() {
                Ok(snapshot) => self.viewer.show(snapshot, tick),
                Err(TryRecvError::Disconnected) if !self.viewer.finished() => return ExitReason::Ended,
                Err(_) => {}
            }
            if let Ok(channels) = feed.layers.try_recv() {
                self.viewer.take_layers(&channels);
            }
            if let Ok(reply) = self.replies.1.try_recv() {
                self.viewer.note(reply, tick);
            }
            self.present(tick);
            self.retitle(tick);
            while let Some(action) = self.next_action() {
                match action {
                    Action::Close => return ExitReason::Closed,
                    Action::SceneCamera if self.viewer.is_away() => return ExitReason::SceneCamera,
                    Action::Save => self.save(requests, tick),
                    Action::Print => self.print_camera(requests, tick),
                    other => self.viewer.act(other, tick),
                }
            }
            if !self.window.is_open() {
                return ExitReason::Closed;
            }
            self.follow_mouse();
            if let Some(camera) = self.viewer.camera_to_render(tick) {
                return ExitReason::Moved(camera);
            }
            let wait = TICK.saturating_sub(tick.elapsed());
            if let Err(RecvTimeoutError::Disconnected) = feed.stop.recv_timeout(wait) {
                return ExitReason::Ended;
            }
        }
    }

    fn follow_mouse(&mut self) {
        let down = |button| self.window.get_mouse_down(button);
        let shifted = self.window.is_key_down(Key::LeftShift) || self.window.is_key_down(Key::RightShift);
        let left = down(MouseButton::Left);
        let other = down(MouseButton::Right) || down(MouseButton::Middle) || (left && shifted);
        let left = left && !other;
        // A drag may leave the window.
        let mode = if left || other { MouseMode::Pass } else { MouseMode::Discard };
        let at = self.window.get_unscaled_mouse_pos(mode).map(|(x, y)| [f64::from(x), f64::from(y)]);
        let (_, turned) = self.window.get_scroll_wheel().unwrap_or_default();
        // Systems have different units for a notch: each event counts as at least one.
        let wheel =
            if turned == 0.0 { 0 } else { turned.abs().round().clamp(1.0, 8.0).copysign(turned) as i32 };
        let (width, height) = self.window.get_size();
        self.viewer.point(Pointer { at, left, other, wheel }, (width as u32, height as u32));
    }

    fn print_camera(&mut self, requests: &Sender<Request>, now: Instant) {
        let Some(camera) = self.viewer.camera() else { return };
        self.request(Request::PrintCamera(camera), "the camera was printed", requests, now);
    }

    /// Processes the system's events, after presenting the picture if that is due.
    fn present(&mut self, now: Instant) {
        let (width, height) = self.window.get_size();
        let size = (width as u32, height as u32);
        let active = self.window.is_active();
        if !active && self.drawn.is_some_and(|(_, was_active, _)| was_active) {
            // The release of keys is not reported while another window has the focus.
            self.held.clear();
        }
        let due = self.drawn.is_none_or(|(old_size, was_active, at)| {
            old_size != size || was_active != active || now.duration_since(at) >= REFRESH
        });
        if !due && !self.viewer.is_stale() {
            self.window.update();
            return;
        }
        if self.viewer.is_stale() || self.drawn.is_none_or(|(old_size, ..)| old_size != size) {
            self.viewer.draw(size, &mut self.buffer);
        }
        // It fails only for a buffer of the wrong size; the next tick has one of the right size.
        let _ = self.window.update_with_buffer(&self.buffer, width, height);
        self.drawn = Some((size, active, now));
    }

    fn retitle(&mut self, now: Instant) {
        if now.duration_since(self.titled) < TITLE_TICK {
            return;
        }
        let title = self.viewer.title(now);
        if title != self.title {
            self.window.set_title(&title);
            self.title = title;
            self.titled = now;
        }
    }

    fn next_action(&mut self) -> Option<Action> {
        loop {
            match self.key_events.try_recv().ok()? {
                // A key that is held down repeats its character: the exposure then changes continuously, as intended.
                KeyEvent::Typed(typed) => {
                    if let Some(action) = Action::of(typed) {
                        return Some(action);
                    }
                }
                KeyEvent::Up(key) => self.held.retain(|&held| held != key),
                KeyEvent::Down(key) if self.held.contains(&key) => {}
                KeyEvent::Down(key) => {
                    self.held.push(key);
                    match key {
                        Key::Escape => return Some(Action::Close),
                        Key::S => return Some(Action::Save),
                        Key::O => return Some(Action::Overlay),
                        Key::H => return Some(Action::Help),
                        Key::P => return Some(Action::Probe),
                        Key::T => return Some(Action::Tone),
                        Key::L => return Some(Action::Layer),
                        Key::F => return Some(Action::Fit),
                        Key::C => return Some(Action::Camera),
                        Key::K => return Some(Action::Print),
                        Key::R => return Some(Action::SceneCamera),
                        _ => {}
                    }
                }
            }
        }
    }

    fn save(&mut self, requests: &Sender<Request>, now: Instant) {
        let Some(snapshot) = self.viewer.snapshot() else { return };
        let request = Request::Save { snapshot, view: self.viewer.view(), reply: self.replies.0.clone() };
        self.request(request, "saving", requests, now);
    }

    /// Sends a request, and shows `done` or the reason why it cannot be sent.
    fn request(&mut self, request: Request, done: &str, requests: &Sender<Request>, now: Instant) {
        let note = match requests.try_send(request) {
            Ok(()) => done,
            Err(TrySendError::Full(_)) => "the previous save is still in progress",
            Err(TrySendError::Disconnected(_)) => "the render has ended",
        };
        self.viewer.note(note.into(), now);
    }
}
