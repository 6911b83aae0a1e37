//! The window's contents after keys, mouse and time.

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
fn the_title_shows_the_state() {
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
fn a_time_limit_determines_the_time_left() {
    let mut viewer = Viewer::new(&WindowOptions { time_limit: Some(30.0), ..options() });
    viewer.show(snapshot(100.0, false), Instant::now());
    assert!(viewer.title(Instant::now()).ends_with("20 s left"));
}

#[test]
fn notes_appear_and_expire() {
    let now = Instant::now();
    let mut viewer = Viewer::new(&options());
    viewer.note("saved\0cover.png\n".into(), now);
    assert_eq!(viewer.title(now), "cover.toml — starting — saved cover.png ");
    assert_eq!(viewer.title(now + NOTE_TIME), "cover.toml — starting");
}

#[test]
fn exposure_changes_by_half_stops_within_limits() {
    let mut viewer = Viewer::new(&options());
    viewer.show(snapshot(1.0, false), Instant::now());
    let plain = drawn(&mut viewer);
    viewer.act(Action::Brighter, Instant::now());
    viewer.act(Action::Brighter, Instant::now());
    assert_eq!(viewer.view().exposure, 1.0);
    let brighter = drawn(&mut viewer);
    // One stop maps 0.25 to the value of 0.5.
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
fn the_overlay_is_toggled() {
    let mut viewer = Viewer::new(&options());
    viewer.show(snapshot(1.0, false), Instant::now());
    let plain = drawn(&mut viewer);
    viewer.act(Action::Overlay, Instant::now());
    let expected: Vec<u32> = palette(2).iter().map(|&[r, g, b]| u32::from_be_bytes([0, r, g, b])).collect();
    assert_eq!(drawn(&mut viewer), expected);
    viewer.act(Action::Overlay, Instant::now());
    assert_eq!(drawn(&mut viewer), plain);
}

#[test]
fn only_changes_require_a_redraw() {
    let mut viewer = Viewer::new(&options());
    assert!(viewer.is_stale());
    assert_eq!(drawn(&mut viewer), [0, 0]);
    assert!(!viewer.is_stale());
    viewer.act(Action::Save, Instant::now());
    viewer.act(Action::Close, Instant::now());
    viewer.act(Action::Print, Instant::now());
    viewer.act(Action::SceneCamera, Instant::now());
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
fn tone_curves_cycle() {
    let mut viewer = Viewer::new(&options());
    viewer.show(snapshot(1.0, false), Instant::now());
    let codes = |viewer: &mut Viewer| drawn(viewer)[1] & 0xff;
    // 0.5 is 188 as sRGB and 128 without a curve; the film curve, at 0.3 of its scale, maps it to 0.438, which is 177.
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
fn layers_follow_error_and_samples() {
    let now = Instant::now();
    let mut viewer = Viewer::new(&options());
    viewer.show(snapshot(1.0, false), now);
    let picture = drawn(&mut viewer);
    let next = |viewer: &mut Viewer| {
        viewer.act(Action::Layer, now);
        (viewer.title(now).rsplit(" — ").next().unwrap_or_default().to_owned(), drawn(viewer))
    };
    // An error of 0.1 in 0.25·√3 is 23%; the other pixel has none.
    let part = 0.1 / (0.25 * 3.0_f64.sqrt()) / 0.25;
    let code = (part * 255.0).round() as u32;
    assert_eq!(next(&mut viewer), ("error".to_owned(), vec![code * 0x01_01_01, 0]));
    assert_eq!(next(&mut viewer), ("samples".to_owned(), vec![0x00ff_ffff, 0x0080_8080]));
    assert_eq!(next(&mut viewer).1, picture, "no layers yet");
    let values = vec![0.0, srgb_to_linear(0.2) as f32];
    viewer.take_layers(&[Channel { name: "albedo.R".into(), values }]);
    next(&mut viewer);
    next(&mut viewer);
    assert_eq!(next(&mut viewer), ("albedo".to_owned(), vec![0, 51 << 16]));
    assert_eq!(next(&mut viewer).1, picture);
}

#[test]
fn the_probe_describes_the_pixel_under_the_pointer() {
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
fn help_covers_the_picture_and_lists_every_key() {
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
fn dragging_pans_and_the_wheel_zooms() {
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
fn the_mouse_moves_the_camera_only_in_camera_mode() {
    let now = Instant::now();
    let size = (200, 100);
    let mut viewer = Viewer::new(&options());
    viewer.show(snapshot(3.0, false), now);
    let own = viewer.camera();
    drag([50.0, 50.0], [60.0, 50.0], false).into_iter().for_each(|pointer| viewer.point(pointer, size));
    assert_eq!((viewer.camera_to_render(now), viewer.camera()), (None, own.clone()));
    viewer.act(Action::Camera, now);
    assert!(viewer.title(now).ends_with("mouse moves camera"));
    // Moving without a button is not a drag, and neither is moving to where it is pressed.
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

    // The previous picture stays until there is a new one.
    viewer.begin(true, now);
    assert_eq!(viewer.camera_to_render(now), None);
    assert!(viewer.snapshot().is_none() && !viewer.finished());
    let part = snapshot(0.5, false);
    viewer.show(Arc::clone(&part), now);
    assert!(viewer.snapshot().is_none());
    viewer.show(Arc::clone(&part), now + HOLD);
    assert!(Arc::ptr_eq(&viewer.snapshot().expect("a partial picture"), &part));
    viewer.begin(true, now);
    viewer.show(snapshot(1.0, false), now);
    assert!(viewer.snapshot().is_some());
    // Return to the scene's camera.
    viewer.begin(false, now);
    assert!(viewer.camera() == own && !viewer.is_away());
}

#[test]
fn a_fixed_camera_shows_the_reason() {
    let now = Instant::now();
    let why = "the camera stays".to_owned();
    let mut viewer = Viewer::new(&WindowOptions { camera: Err(why.clone()), ..options() });
    viewer.show(snapshot(3.0, false), now);
    viewer.act(Action::Camera, now);
    assert!(viewer.title(now).ends_with(&why));
    drag([0.0, 0.0], [60.0, 50.0], false).into_iter().for_each(|pointer| viewer.point(pointer, (200, 100)));
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
