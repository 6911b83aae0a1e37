//! A pool with workers that fail.

use super::super::identity;
use super::super::sample_counts;
use super::super::settings::{Devices, Outputs, RenderJob, Stopping, ViewerSettings};
use super::super::wiring::{InitialFilm, Rendered, Task, Viewer, render};
use super::*;
use crate::camera::CameraSettings;
use crate::film::{Film, Layer, LayerSet};
use crate::integrator::{self, FirstHit, Found, Paths};
use crate::math::lanes::Level;
use crate::output::window::orbit::Orbit;
use crate::output::window::{ExitReason, Feed, Request};
use crate::sampling::{Pixel, Sample};
use crate::scene::parse;
use crossbeam_channel::{bounded, never, select};
use std::num::NonZeroUsize;
use std::path::Path;
use std::time::Duration;

fn settings(device: DeviceChoice) -> RenderSettings {
    let text = "film = { width = 8, height = 8 }\n[camera]\neye = [0, 0, 0]\nforward = [1, 0, 0]\n";
    let scene = Arc::new(parse(text, Path::new("empty.toml")).unwrap().scene);
    let threads = NonZeroUsize::new(2).unwrap();
    RenderSettings {
        job: RenderJob::new(scene, Region::whole(8, 8)),
        stopping: Stopping::at(1),
        devices: Devices { choice: device, ..Devices::cpu(threads, Level::SCALAR) },
        outputs: Outputs::default(),
        view: ViewerSettings::default(),
    }
}

/// A channel for events without a receiver.
fn unheard() -> Sender<Event> {
    bounded(0).0
}

fn new(settings: &RenderSettings) -> WorkerPool {
    WorkerPool::new(settings, &unheard(), &never()).unwrap()
}

/// The number of workers that continue a film of a device, and their description.
fn of_film(device: DeviceChoice, begun: &str) -> (usize, String) {
    let settings = settings(device);
    let threads = new(&self::settings(DeviceChoice::Cpu));
    let pool =
        WorkerPool::resuming(&settings, threads.integrator().as_ref(), begun, &unheard(), &never()).unwrap();
    (pool.workers(), pool.description())
}

#[test]
fn a_film_gets_samples_only_of_the_device_it_was_begun_on() {
    let threads = || (2, "cpu".to_owned());
    // A GPU that has appeared, one that has gone, and a different one.
    assert_eq!(of_film(DeviceChoice::All(None), "cpu"), threads());
    let gone = DeviceChoice::All(Some("no GPU is called this".to_owned()));
    assert_eq!(of_film(gone, "all: cpu and some GPU"), threads());
    assert_eq!(of_film(DeviceChoice::All(None), "all: cpu and some GPU"), threads());
    // Negative control: the same GPU.
    let all = new(&settings(DeviceChoice::All(None)));
    if all.gpu.is_none() {
        assert!(std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"), "no GPU");
        println!("skipped: no GPU");
        return;
    }
    assert_eq!(of_film(DeviceChoice::All(None), &all.description()), (3, all.description()));
    // There is no worker left.
    let other =
        WorkerPool::resuming(&settings(DeviceChoice::Gpu(None)), None, "gpu: some GPU", &unheard(), &never());
    let told = other.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(told.contains("begun on gpu: some GPU"), "{told}");
}

/// An integrator that hangs from a certain sample on, after sending a message.
struct Hanging {
    inner: Arc<dyn Integrator>,
    hung: Sender<()>,
    released: Receiver<()>,
}

impl Integrator for Hanging {
    fn trace_until(
        &self,
        level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Found,
    ) -> Option<u64> {
        if paths.first_sample > 0 && paths.pixels.iter().any(|pixel| pixel.index == 19) {
            let _ = self.hung.try_send(());
            let _ = self.released.recv();
        }
        self.inner.trace_until(level, paths, stop, out)
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        self.inner.first_hits(level, paths, out);
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        self.inner.seen_by(camera)
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<integrator::Event>) {
        self.inner.explain(pixel, sample)
    }
}

/// A viewer that is left as soon as a worker hangs, because the camera moves or returns.
struct Leaving {
    hung: Receiver<()>,
    exit_reason: ExitReason,
}

impl Viewer for Leaving {
    fn show(&mut self, feed: &Feed, _requests: &Sender<Request>, _is_moved: bool) -> ExitReason {
        // Snapshots are received until then.
        loop {
            select! {
                recv(feed.snapshots) -> _ => {}
                recv(self.hung) -> _ => break,
            }
        }
        // The other workers run out of work without the hanging one, so that no further batch makes the accumulator
        // notice that the viewer was left.
        while feed.snapshots.recv_timeout(Duration::from_millis(500)).is_ok() {}
        self.exit_reason.clone()
    }
}

/// Renders with a worker that hangs. Then the end of the render is requested, or a viewer is left.
fn render_hanging(settings: &RenderSettings, exit_reason: Option<ExitReason>) -> Rendered {
    let mut pool = new(settings);
    let (hung_out, hung) = bounded(1);
    let (release, released) = bounded(0);
    let inner = pool.integrator().unwrap();
    pool.integrator = Some(Arc::new(Hanging { inner, hung: hung_out, released }));
    let head = identity::head(settings, &pool.description());
    let film = Film::with_layout(head.layout).unwrap();
    let initial = InitialFilm { film, milestone: None, spent: Duration::ZERO };
    let task = Task { settings, pool, head: &head, initial, dump: None, samples: None, tev: None };
    let (stop_out, stop) = bounded(0);
    let rendered = match exit_reason {
        Some(exit_reason) => {
            let rendered = render(task, Some(&mut Leaving { hung, exit_reason }), &unheard(), &stop);
            drop(stop_out);
            rendered
        }
        None => {
            let asks = std::thread::spawn(move || {
                hung.recv().unwrap();
                drop(stop_out);
            });
            let rendered = render(task, None, &unheard(), &stop);
            asks.join().unwrap();
            rendered
        }
    };
    drop(release);
    rendered.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_render_ends_without_a_hanging_worker_and_reports_its_order() {
    let moved = Orbit::new(&CameraSettings::default(), 1.0).viewpoint();
    for exit_reason in [None, Some(ExitReason::Moved(moved.clone())), Some(ExitReason::SceneCamera)] {
        let folder = tempfile::tempdir().unwrap();
        let [picture, layered] = ["a.png", "a.exr"].map(|name| folder.path().join(name));
        let outputs = Outputs {
            pictures: vec![picture.clone(), layered.clone()],
            layers: vec![Layer::Depth],
            ..Outputs::default()
        };
        let stopping = Stopping::at(1_000_000);
        let settings = settings(DeviceChoice::Cpu);
        let job = RenderJob { layers: LayerSet::new(&[Layer::Depth], 0, 0), ..settings.job };
        let settings = RenderSettings { job, stopping, outputs, ..settings };
        let Rendered { outcome, problem, is_suspended, is_written, .. } =
            render_hanging(&settings, exit_reason);
        let said = problem.as_ref().map(ToString::to_string).unwrap_or_default();
        assert!(matches!(problem, Some(SessionError::Unanswered(..))), "{said}");
        // The other worker may have rendered its half by then, or none of it.
        let counts = sample_counts(outcome.film.seen_range());
        // Pixel 19 is in the odd half.
        for part in [
            "worker 1 did not stop within 1 s",
            " of 32 pixels with i = 0 to 31",
            "at column 0 + p mod 8 and row 0 + p div 8 for p = 1 + 2·i",
            "stride trace SCENE --pixel 1,0 --sample 1",
            "has been written: ",
            &counts,
        ] {
            assert!(said.contains(part), "no {part:?} in: {said}");
        }
        assert!(!is_suspended && is_written && picture.exists() && layered.exists());
    }
}

#[test]
fn a_gpu_is_measured_beside_a_hanging_worker() {
    let settings = settings(DeviceChoice::All(None));
    let mut pool = new(&settings);
    let Some(gpu) = pool.gpu.take() else {
        assert!(std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"), "no GPU");
        println!("skipped: no GPU");
        return;
    };
    let (hung_out, hung) = bounded(1);
    let (release, released) = bounded(0);
    let inner = pool.integrator().unwrap();
    pool.integrator = Some(Arc::new(Hanging { inner, hung: hung_out, released }));
    pool.measured_with(&settings, gpu, &never()).unwrap_or_else(|error| panic!("{error}"));
    assert!(pool.gpu.is_some() && hung.try_recv().is_ok(), "no worker hung");
    drop(release);
}
