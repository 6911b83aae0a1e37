//! Samples that contribute to any pixel, as light paths and Markov chains do: the film's light image.

use super::*;
use stride::film::Ranges;

/// The full film, and a part of it that a checkpoint sends in two pieces.
const FULL: [u32; 2] = [300, 200];
const CROP: Region = Region { film_width: FULL[0], x: 20, y: 15, width: 256, height: 160 };

/// An integrator whose samples contribute to any pixel and beyond the film.
struct Scatterer<C> {
    inner: Box<dyn Integrator>,
    /// The position of a sample, in pixels from its pixel's corner.
    wanders: f32,
    /// Its contributions.
    contributes: C,
    /// The number of samples after which it requests the end.
    stops_after: AtomicU32,
    stop: Mutex<Option<Sender<Infallible>>>,
}

impl<C: Fn(&mut Stream, Pixel, u32, &mut Vec<Contribution>) + Send + Sync> Integrator for Scatterer<C> {
    fn trace_until(
        &self,
        _: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Found,
    ) -> Option<u64> {
        for (slot, &pixel) in (0..).zip(paths.pixels) {
            for sample in paths.first_sample..paths.first_sample + paths.samples {
                let stream = &mut Stream::new(5, pixel.index, sample);
                let mut at = |corner: u32| {
                    corner as f32 + stream.random_range(-self.wanders..self.wanders + 1.0) // Mostly elsewhere.
                };
                let [x, y] = [pixel.x, pixel.y].map(&mut at);
                let radiance = if stream.random_range(0..50) == 0 { f32::NAN } else { stream.random() };
                let sample = Sample { pixel: pixel.index, sample, x, y, radiance: [radiance; 3] };
                out.finished.push(Finished { slot, sample });
                (self.contributes)(stream, pixel, sample.sample, &mut out.contributions);
            }
            if stop() {
                return None;
            }
            // Wraps if no end is requested.
            if self.stops_after.fetch_sub(paths.samples, Ordering::Relaxed) < paths.samples {
                *self.stop.lock().unwrap() = None;
            }
        }
        Some(paths.len() as u64)
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        self.inner.first_hits(level, paths, out);
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        self.inner.seen_by(camera)
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        self.inner.explain(pixel, sample)
    }
}

fn scatterer<C>(wanders: f32, contributes: C) -> Scatterer<C>
where
    C: Fn(&mut Stream, Pixel, u32, &mut Vec<Contribution>) + Send + Sync,
{
    let (stops_after, stop) = (AtomicU32::new(u32::MAX), Mutex::new(None));
    Scatterer { inner: common::integrator(&scene()), wanders, contributes, stops_after, stop }
}

/// Up to four contributions of all magnitudes, some of them invalid for a film.
fn anything(stream: &mut Stream, pixel: Pixel, sample: u32, out: &mut Vec<Contribution>) {
    for _ in 0..stream.random_range(0..5) {
        let [width, height] = FULL.map(|side| side as f32);
        let [x, y] =
            [stream.random_range(-20.0..width + 20.0), stream.random_range(-20.0..height + 20.0_f32)];
        let faint = stream.random_range(-30.0..12.0_f32).exp2();
        let radiance = match stream.random_range(0..100) {
            0 => [1.0, f32::NAN, 1.0],
            1 => [-1.0, 0.0, 0.0],
            2 => [0.0, f32::INFINITY, 0.0],
            _ => [1.0, faint, stream.random()],
        };
        let x = if stream.random_range(0..100) == 0 { f32::NAN } else { x };
        out.push(Contribution { pixel: pixel.index, sample, x, y, radiance });
    }
}

/// A film and its splatters for samples and contributions.
#[derive(Clone)]
struct Kind {
    region: Region,
    layout: Layout,
    splatter: Option<Arc<Splatter>>,
    light: Arc<Splatter>,
}

impl Kind {
    fn new(region: Region, weighted: bool, filter: Filter) -> Kind {
        let splatter = Arc::new(Splatter::new(Weights::new(filter), [region.x, region.y]));
        let light = Some(LightScale::new(FULL[0] * FULL[1], splatter.weights()));
        let layout =
            Layout { weighted, light, layers: layers(), ..Layout::plain(region.width, region.height) };
        Kind { region, layout, splatter: weighted.then(|| Arc::clone(&splatter)), light: splatter }
    }

    fn all() -> [Kind; 2] {
        let mitchell = Filter::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 };
        [Kind::new(CROP, false, Filter::Tent { radius: 1.0 }), Kind::new(CROP, true, mitchell)]
    }

    fn film(&self) -> Film {
        Film::with_layout(self.layout).unwrap()
    }

    fn wiring(&self, workers: usize, spp: u32) -> Wiring {
        let (splatter, light) = (self.splatter.clone(), Some(Arc::clone(&self.light)));
        Wiring {
            region: self.region,
            workers,
            spp,
            film: Some(self.film()),
            splatter,
            light,
            ..Wiring::default()
        }
    }

    /// The film of the samples of each place from one on, `count` of them each, computed without processes.
    fn plain(&self, integrator: &dyn Integrator, first_sample: u32, count: impl Fn(u32) -> u32) -> Film {
        let (mut film, mut found) = (self.film(), Found::default());
        for place in 0..self.region.len() {
            found.clear();
            let paths = Paths { pixels: &[self.region.pixel(place)], first_sample, samples: count(place) };
            integrator.trace_until(level(), &paths, &|| false, &mut found).unwrap();
            for Finished { sample, .. } in &found.finished {
                // The film counts the samples that it rejects.
                let _ = match &self.splatter {
                    Some(splatter) => film.splat(splatter, place as usize, sample),
                    None => film.add_sample(place as usize, sample.radiance),
                };
            }
            for contribution in &found.contributions {
                let _ = film.contribute(&self.light, place as usize, contribution);
            }
            add_first_hits(&mut film, integrator, place, &paths);
        }
        film
    }

    fn sink(&self, folder: &tempfile::TempDir, name: &str, range: std::ops::Range<u32>) -> FilmSink {
        let identity = Identity::default().with("scene", "none");
        let head = Head { layout: self.layout, identity, notes: Identity::default() };
        FilmSink { path: folder.path().join(name), head, range }
    }
}

#[test]
fn the_film_is_the_same_for_any_number_of_threads() {
    for kind in Kind::all() {
        let integrator = scatterer(if kind.layout.weighted { 30.0 } else { 0.0 }, anything);
        let expected = kind.plain(&integrator, 0, |_| 4);
        for workers in 1..=7 {
            let Rendered { outcome, barriers, snapshots, .. } =
                Wiring { dump_at: vec![1, 3], ..kind.wiring(workers, 4) }.render(&integrator);
            assert!(outcome.film == expected && outcome.whole, "{workers} workers");
            let [lost, outside] = expected.lost_contributions();
            assert!(lost > 1000 && outside > 1000 && outcome.totals.rejected == expected.rejected());
            assert!(!outcome.rejects.is_empty() && outcome.reject_counts.nowhere > 0);
            let counts = outcome.reject_counts;
            let counted = counts.not_a_number + counts.too_bright + counts.negative + counts.nowhere;
            assert_eq!(counted, outcome.totals.rejected);
            assert!(snapshots.last().unwrap().picture == expected.picture());
            // A picture at a barrier waits for all samples that may contribute to it.
            assert_eq!(barriers.iter().map(|barrier| barrier.end).collect::<Vec<_>>(), [1, 3]);
            for barrier in barriers.iter().filter(|_| workers % 3 == 0) {
                assert!(barrier.picture == kind.plain(&integrator, 0, |_| barrier.end).picture());
            }
        }
        // Negative controls: another sample, and one contribution fewer.
        assert!(kind.plain(&integrator, 1, |_| 4) != expected);
        let fewer =
            scatterer(integrator.wanders, |stream: &mut Stream, pixel: Pixel, sample, out: &mut Vec<_>| {
                let from = out.len();
                anything(stream, pixel, sample, out);
                if (pixel.x, pixel.y, sample) == (100, 100, 2) && out.len() > from {
                    out.truncate(out.len() - 1);
                }
            });
        assert!(kind.plain(&fewer, 0, |_| 4) != expected);
    }
}

// A checkpoint has all contributions of a sample or none.
#[test]
fn a_film_killed_at_any_checkpoint_is_resumed_to_the_same_film() {
    const SPP: u32 = 16;
    let stream = &mut Stream::new(11, 0, 0);
    for kind in Kind::all() {
        let folder = tempfile::tempdir().unwrap();
        let mut integrator = scatterer(if kind.layout.weighted { 3.0 } else { 0.0 }, anything);
        let expected = kind.plain(&integrator, 0, |_| SPP);
        let (mut film, mut kills, mut kept_films) = (None, 0, 0);
        loop {
            let (stop_out, stop) = bounded(0);
            let least = if kills < 6 { CROP.len() / 4 } else { u32::MAX - 1 };
            integrator.stops_after = AtomicU32::new(stream.random_range(least..=least.saturating_mul(4)));
            integrator.stop = Mutex::new(Some(stop_out));
            let sink = kind.sink(&folder, "a.film", 0..SPP);
            let wiring = kind.wiring(stream.random_range(1..=7), SPP);
            let film_so_far = Some(film.take().unwrap_or_else(|| kind.film()));
            let wiring = Wiring { film: film_so_far, keeper: Some(sink.clone()), stop: Some(stop), ..wiring };
            let Rendered { outcome, .. } = wiring.render(&integrator);
            if outcome.whole && outcome.totals.spp == SPP {
                assert!(outcome.film == expected, "after {kills} kills");
                break;
            }
            // The state of the process is lost: it continues with the last film that was written.
            kills += 1;
            integrator.stops_after = AtomicU32::new(u32::MAX);
            if sink.path.exists() {
                let kept = open_film(&sink.path).unwrap().read().unwrap();
                let plain = kind.plain(&integrator, 0, |place| kept.seen(place as usize) as u32);
                assert!(kept == plain, "a part of a sample after {kills} kills");
                film = Some(kept);
                kept_films += 1;
            }
        }
        assert!(kills >= 3 && kept_films >= 2, "{kills} kills, {kept_films} films");
    }
}

#[test]
fn shards_of_ranges_add_up_in_any_order() {
    let ranges = [0..3, 3..4, 4..9];
    for kind in Kind::all() {
        let folder = tempfile::tempdir().unwrap();
        let integrator = scatterer(0.0, anything);
        let expected = kind.plain(&integrator, 0, |_| 9);
        let mut paths = Vec::new();
        for (workers, range) in (2..).zip(ranges.clone()) {
            let spp = range.end - range.start;
            let wiring = Wiring { first: range.start, ..kind.wiring(workers, spp) };
            let sink = kind.sink(&folder, &format!("{}.film", Ranges(std::slice::from_ref(&range))), range);
            sink.write(&sink.path, &wiring.render(&integrator).outcome.film, None).unwrap();
            paths.push(sink.path);
        }
        for turn in 0..3 {
            let mut sum = kind.film();
            for path in paths.iter().cycle().skip(turn).take(3) {
                open_film(path).unwrap().add_to(&mut sum).unwrap();
            }
            assert!(sum == expected && sum.picture() == expected.picture());
        }
    }
}

/// Contributions of one half on average, twice as many as samples, over the full film, with a density that increases to
/// the right: with one sample per pixel of the film, their picture is 2x ⁄ width.
fn ramp(stream: &mut Stream, pixel: Pixel, sample: u32, out: &mut Vec<Contribution>) {
    for _ in 0..stream.random_range(0..5) {
        let [width, height] = FULL.map(|side| side as f32);
        let (x, y) = (width * stream.random::<f32>().sqrt(), height * stream.random::<f32>());
        out.push(Contribution { pixel: pixel.index, sample, x, y, radiance: [0.5; 3] });
    }
}

/// The deviation of a picture from the ramp: of its sum in standard errors, and of the sum of squared errors of its
/// columns from the expectation, also in standard errors. `contributions` is their number.
fn off_the_ramp(light: &[f64], contributions: f64) -> [f64; 2] {
    let (mut sum, mut whole, mut squares) = (0.0, 0.0, 0.0);
    for column in 0..CROP.width {
        let seen: f64 = (0..CROP.height).map(|row| light[(row * CROP.width + column) as usize]).sum();
        let x = f64::from(CROP.x + column) + 0.5;
        let expected = 2.0 * x / f64::from(FULL[0]) * f64::from(CROP.height);
        // Each contribution in a column adds the same value; their number is nearly a Poisson variable.
        let one = f64::from(FULL[0] * FULL[1]) / contributions;
        squares += (seen - expected).powi(2) / (expected * one);
        (sum, whole) = (sum + (seen - expected) / one, whole + expected / one);
    }
    let columns = f64::from(CROP.width);
    [sum / whole.sqrt(), (squares - columns) / (2.0 * columns).sqrt()]
}

// A correct film fails with probability 10⁻⁵, where a standard normal number exceeds 4.4.
#[test]
fn a_crop_shows_light_of_a_known_distribution_correctly() {
    const SPP: u32 = 16;
    let kind = Kind::new(CROP, false, Filter::Box { radius: 0.5 });
    let film = kind.wiring(3, SPP).render(&scatterer(0.0, ramp)).outcome.film;
    let own = |place: usize| film.mean(place).map(f64::from);
    let picture = film.picture();
    let light: Vec<f64> =
        picture.rgb.iter().enumerate().map(|(place, rgb)| f64::from(rgb[0]) - own(place)[0]).collect();
    let contributions = 2.0 * f64::from(SPP * CROP.len());
    let off = off_the_ramp(&light, contributions);
    println!("off by {off:.2?}");
    assert!(off.iter().all(|off| off.abs() < 4.4), "{off:?}");
    // Negative controls: normalised by the crop's pixels instead of the film's; by samples without rejected ones; and
    // too bright by a hundredth.
    let left_out = film.rejected() as f64 / f64::from(SPP * CROP.len());
    assert!(left_out > 0.01);
    let crop = f64::from(CROP.len()) / f64::from(FULL[0] * FULL[1]);
    for wrong in [crop, 1.0 / (1.0 - left_out), 1.01] {
        let wrong_light: Vec<f64> = light.iter().map(|c| c * wrong).collect();
        let off = off_the_ramp(&wrong_light, contributions);
        assert!(off[0].abs() > 4.4, "{wrong} passes: {off:?}");
    }
    // And columns in reverse order.
    let mirrored = |place: usize| light[place - place % 256 + 255 - place % 256];
    let mirrored: Vec<f64> = (0..light.len()).map(mirrored).collect();
    assert!(off_the_ramp(&mirrored, contributions)[1] > 4.4);
}
