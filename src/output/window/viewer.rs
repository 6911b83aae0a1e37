//! What the window shows and how keys change it; knows nothing of the system's windows.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::view::{draw_owners, draw_picture};
use super::{Closed, WindowOptions};
use crate::film::{Snapshot, ToneMap};
use crate::output::overlay::{palette, workers};
use crate::output::{human, progress::Progress};

/// Half a stop a key press.
const EXPOSURE_STEP: f64 = 0.5;
/// Beyond this many stops either way there is nothing to see.
const MOST_EXPOSURE: f64 = 30.0;
/// How long a note stands in the title bar.
const NOTE_TIME: Duration = Duration::from_secs(4);

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Leave.
    Close,
    /// Write the outputs now.
    Save,
    /// Half a stop brighter.
    Brighter,
    /// Half a stop darker.
    Darker,
    /// Show the owner overlay, or the picture again.
    Overlay,
}

impl Action {
    /// What a typed character asks for; keys that type none are the window's business.
    pub fn of(typed: char) -> Option<Self> {
        match typed {
            // The key of + types = without shift, on many keyboards.
            '+' | '=' => Some(Self::Brighter),
            '-' | '_' => Some(Self::Darker),
            _ => None,
        }
    }
}

/// The window's state.
#[derive(Debug)]
pub struct Viewer {
    options: WindowOptions,
    exposure: f64,
    overlay: bool,
    tone: ToneMap,
    palette: Vec<[u8; 3]>,
    snapshot: Option<Arc<Snapshot>>,
    note: Option<(String, Instant)>,
    /// The picture on the screen is not what it should be.
    stale: bool,
}

impl Viewer {
    /// A viewer without a picture as yet.
    pub fn new(options: &WindowOptions) -> Self {
        Self {
            options: options.clone(),
            exposure: options.exposure,
            overlay: options.overlay,
            tone: ToneMap::new(options.exposure),
            palette: palette(1),
            snapshot: None,
            note: None,
            stale: true,
        }
    }

    /// The picture on the screen, if there is one yet.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.snapshot.clone()
    }

    /// Takes a newer picture.
    pub fn show(&mut self, snapshot: Arc<Snapshot>) {
        let seen = self.snapshot.as_ref().is_some_and(|old| Arc::ptr_eq(&old.owners, &snapshot.owners));
        if !seen {
            // Counted only when they change: it looks at every pixel of the film.
            self.palette = palette(workers(&snapshot.owners));
        }
        self.snapshot = Some(snapshot);
        self.stale = true;
    }

    /// Puts a line into the title bar for a while.
    pub fn note(&mut self, text: String, now: Instant) {
        self.note = Some((text, now));
    }

    /// Changes what is shown; [`Action::Close`] and [`Action::Save`] change nothing.
    pub fn act(&mut self, action: Action) {
        let step = match action {
            Action::Brighter => EXPOSURE_STEP,
            Action::Darker => -EXPOSURE_STEP,
            Action::Overlay => {
                self.overlay = !self.overlay;
                self.stale = true;
                return;
            }
            Action::Close | Action::Save => return,
        };
        self.exposure = (self.exposure + step).clamp(-MOST_EXPOSURE, MOST_EXPOSURE);
        self.tone = ToneMap::new(self.exposure);
        self.stale = true;
    }

    /// The exposure on the screen, in stops.
    pub fn exposure(&self) -> f64 {
        self.exposure
    }

    /// The final picture is here.
    pub fn finished(&self) -> bool {
        self.snapshot.as_ref().is_some_and(|snapshot| snapshot.finished)
    }

    /// How the window is being left.
    pub fn closed(&self, by_user: bool) -> Closed {
        Closed { exposure: self.exposure, by_user }
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
                draw_owners(&snapshot.owners, film, &self.palette, size, buffer);
            }
            Some(snapshot) => draw_picture(&snapshot.picture, &self.tone, size, buffer),
        }
    }

    /// The title bar: `cover.toml — 128/500 spp, 7.9 Msamples/s, 41 s left — +1.5 EV`.
    pub fn title(&self, now: Instant) -> String {
        // A title ends at a NUL, for most systems.
        let mut parts = vec![self.options.name.replace('\0', "")];
        parts.push(match &self.snapshot {
            None => "starting".into(),
            Some(snapshot) => {
                let progress = Progress::of(snapshot, self.options.time_limit);
                if snapshot.finished { format!("done: {}", progress.summary()) } else { progress.to_string() }
            }
        });
        if self.exposure != 0.0 {
            parts.push(human::exposure(self.exposure));
        }
        if self.overlay {
            parts.push("owners".into());
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
    use crate::film::Picture;

    fn options() -> WindowOptions {
        WindowOptions {
            name: "cover.toml".into(),
            width: 2,
            height: 1,
            exposure: 0.0,
            overlay: false,
            time_limit: None,
        }
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
        viewer.show(snapshot(100.0, false));
        assert_eq!(viewer.title(now), "cover.toml — 100/500 spp, 10 Msamples/s, 40 s left");
        for _ in 0..3 {
            viewer.act(Action::Brighter);
        }
        assert_eq!(viewer.title(now), "cover.toml — 100/500 spp, 10 Msamples/s, 40 s left — +1.5 EV");
        viewer.act(Action::Overlay);
        viewer.show(snapshot(500.0, true));
        assert!(viewer.finished());
        assert_eq!(viewer.title(now), "cover.toml — done: 500 spp in 50 s, 10 Msamples/s — +1.5 EV — owners");
    }

    #[test]
    fn a_time_limit_counts_for_the_time_left() {
        let mut viewer = Viewer::new(&WindowOptions { time_limit: Some(30.0), ..options() });
        viewer.show(snapshot(100.0, false));
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
        viewer.show(snapshot(1.0, false));
        let plain = drawn(&mut viewer);
        viewer.act(Action::Brighter);
        viewer.act(Action::Brighter);
        assert_eq!(viewer.exposure(), 1.0);
        let brighter = drawn(&mut viewer);
        // A stop makes 0.25 what 0.5 was.
        assert_eq!(brighter[0], plain[1]);
        assert_ne!(brighter[0], plain[0]);
        viewer.act(Action::Darker);
        viewer.act(Action::Darker);
        assert_eq!(drawn(&mut viewer), plain);
        for _ in 0..1000 {
            viewer.act(Action::Darker);
        }
        assert_eq!(viewer.exposure(), -MOST_EXPOSURE);
    }

    #[test]
    fn the_overlay_shows_owners_and_goes_again() {
        let mut viewer = Viewer::new(&options());
        viewer.show(snapshot(1.0, false));
        let plain = drawn(&mut viewer);
        viewer.act(Action::Overlay);
        let expected: Vec<u32> =
            palette(2).iter().map(|&[r, g, b]| u32::from_be_bytes([0, r, g, b])).collect();
        assert_eq!(drawn(&mut viewer), expected);
        viewer.act(Action::Overlay);
        assert_eq!(drawn(&mut viewer), plain);
    }

    #[test]
    fn only_changes_make_it_stale() {
        let mut viewer = Viewer::new(&options());
        assert!(viewer.is_stale());
        assert_eq!(drawn(&mut viewer), [0, 0]);
        assert!(!viewer.is_stale());
        viewer.act(Action::Save);
        viewer.act(Action::Close);
        viewer.note("a note".into(), Instant::now());
        assert!(!viewer.is_stale());
        for change in [Action::Brighter, Action::Darker, Action::Overlay] {
            viewer.act(change);
            assert!(viewer.is_stale(), "{change:?}");
            drawn(&mut viewer);
        }
        viewer.show(snapshot(1.0, false));
        assert!(viewer.is_stale());
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
