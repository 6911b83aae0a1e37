//! A simulation of a fleet in virtual time: a thousand workers, lost and doubled messages, a server that fails, and
//! collectors that are killed; with the real collector.

use super::collector::{Collector, Step};
use super::gathering::Gathering;
use super::job::{Job, JobDevice, Lease, Manifest, facts};
use super::mail::{Mail, NextResult};
use super::plan::Plan;
use super::unit::{Posted, Unit};
use crate::api::Render;
use crate::film::file::{VERSION, write};
use crate::film::{Film, SampleRanges};
use crate::fleet::{FleetError, JobSettings, JobState};
use crate::sampling::Stream;
use crate::scene::Scene;
use crate::session::{RenderSettings, film_head};
use data_encoding::HEXLOWER;
use rand::RngExt;
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, VecDeque};
use std::io::Write;
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

mod full;
mod strays;

/// A server in memory.
struct Server {
    job: RefCell<(Job, u64)>,
    queue: RefCell<VecDeque<Unit>>,
    /// Units in the hands of workers.
    in_hand: Cell<u64>,
    results: RefCell<BTreeMap<u64, (Posted, Vec<u8>)>>,
    last: Cell<u64>,
    is_down: Cell<bool>,
    /// Parts of results that were never announced.
    parts: RefCell<BTreeMap<String, u64>>,
}

impl Server {
    fn new(job: Job) -> Server {
        Server {
            job: RefCell::new((job, 1)),
            queue: RefCell::default(),
            in_hand: Cell::new(0),
            results: RefCell::default(),
            last: Cell::new(0),
            is_down: Cell::new(false),
            parts: RefCell::default(),
        }
    }

    fn answers(&self) -> Result<(), FleetError> {
        if self.is_down.get() { Err(FleetError::Unreachable("virtually".to_owned())) } else { Ok(()) }
    }

    fn post(&self, posted: Posted, film: Vec<u8>) {
        self.last.set(self.last.get() + 1);
        self.results.borrow_mut().insert(self.last.get(), (posted, film));
    }
}

impl Mail for Server {
    fn job(&self) -> Result<(Job, u64), FleetError> {
        self.answers()?;
        Ok(self.job.borrow().clone())
    }

    fn replace(&self, job: &Job, number: u64) -> Result<Option<u64>, FleetError> {
        self.answers()?;
        let mut kept = self.job.borrow_mut();
        if kept.1 != number {
            return Ok(None);
        }
        *kept = (job.clone(), number + 1);
        Ok(Some(number + 1))
    }

    fn issue(&self, unit: &Unit) -> Result<(), FleetError> {
        self.answers()?;
        let mut queue = self.queue.borrow_mut();
        if !queue.iter().rev().take(4000).any(|waiting| waiting.subject() == unit.subject()) {
            queue.push_back(unit.clone());
        }
        Ok(())
    }

    fn withdraw(&self, unit: &Unit) -> Result<(), FleetError> {
        self.answers()?;
        self.queue.borrow_mut().retain(|waiting| waiting.subject() != unit.subject());
        Ok(())
    }

    fn queued(&self) -> Result<[u64; 2], FleetError> {
        self.answers()?;
        Ok([self.queue.borrow().len() as u64, self.in_hand.get()])
    }

    fn next_result(&self, after: u64) -> NextResult {
        self.answers()?;
        let results = self.results.borrow();
        Ok(results.range(after + 1..).next().map(|(number, (posted, _))| (*number, Ok(posted.clone()))))
    }

    fn film(&self, posted: &Posted, out: &mut dyn Write) -> Result<Vec<u64>, FleetError> {
        self.answers()?;
        let results = self.results.borrow();
        let found = results.values().find(|(other, _)| other.nonce == posted.nonce);
        let (_, film) = found.ok_or_else(|| FleetError::Incomplete("it is missing".to_owned()))?;
        out.write_all(film).map_err(|error| FleetError::Refused(error.to_string()))?;
        Ok(Vec::new())
    }

    fn discard(&self, posted: &Posted) -> Result<(), FleetError> {
        self.answers()?;
        self.results.borrow_mut().retain(|_, (other, _)| other.nonce != posted.nonce);
        Ok(())
    }

    fn discard_unit(&self, range: &Range<u32>, _: &[u64]) -> Result<(), FleetError> {
        self.answers()?;
        self.results.borrow_mut().retain(|_, (other, _)| other.unit.range() != *range);
        Ok(())
    }

    fn unannounced(&self) -> Result<BTreeMap<String, u64>, FleetError> {
        self.answers()?;
        Ok(self.parts.borrow().clone())
    }

    fn discard_parts(&self, place: &str) -> Result<(), FleetError> {
        self.answers()?;
        self.parts.borrow_mut().remove(place);
        Ok(())
    }
}

/// A worker, and what it does.
struct Worker {
    name: String,
    /// Seconds for one sample.
    pace: f64,
    /// The unit, and when it is rendered.
    busy: Option<(Unit, f64)>,
    /// Whether its results are wrong.
    lies: bool,
}

fn settings(samples: u32, film: &Path) -> RenderSettings {
    Render::new(&Scene::default()).size((2, 1)).samples(samples).film(film).settings().unwrap()
}

/// The film of a range of made-up samples, whose sums are exact.
fn film_of(settings: &RenderSettings, range: &Range<u32>, is_wrong: bool) -> Vec<u8> {
    let mut settings = settings.clone();
    (settings.job.first, settings.stopping.spp) = (range.start, range.end - range.start);
    let head = film_head(&settings, "cpu");
    let mut film = Film::with_layout(head.layout).unwrap();
    for sample in range.clone() {
        for pixel in 0..head.layout.len() as usize {
            let value = (sample % 251) as f32 * 0.37 + pixel as f32 + f32::from(u8::from(is_wrong));
            film.add_sample(pixel, [value, value * 0.5, 1.0]).unwrap();
        }
    }
    let len = u64::from(range.end - range.start);
    write(Vec::new(), &head, &film, &SampleRanges::prefix(range.clone(), len, len), None).unwrap()
}

fn job(settings: &RenderSettings, verify: f64) -> Job {
    Job {
        id: "j1".to_owned(),
        name: String::new(),
        created: 0,
        scene: Manifest::default(),
        settings: JobSettings::default(),
        facts: facts(settings).to_string(),
        film_format: VERSION,
        device: JobDevice::Cpu,
        priority: 0,
        state: JobState::Open,
        target: settings.stopping.spp,
        noise: None,
        verify,
        patience: 30_000,
        unit: 10_000,
        plan: Plan::default(),
        held: 0,
        collector: None,
        barred: Vec::new(),
    }
}

/// What goes wrong.
#[derive(Clone, Copy)]
struct Faults {
    /// The probability that a worker vanishes with its unit.
    lost: f64,
    /// The probability that a result is delivered twice.
    doubled: f64,
    /// Seconds from one death of the collector to the next.
    killed_every: f64,
    /// Seconds from one failure of the server to the next, each of which lasts three.
    down_every: f64,
    liars: usize,
    verify: f64,
}

/// The result of a unit.
fn posted(unit: &Unit, worker: &str, nonce: usize, film: &[u8], seconds: f64) -> Posted {
    Posted {
        unit: unit.clone(),
        worker: worker.to_owned(),
        nonce: format!("n{nonce}"),
        parts: 1,
        bytes: film.len() as u64,
        digest: HEXLOWER.encode(&film[film.len() - 32..]),
        seconds,
    }
}

/// The end of a simulation.
struct Outcome {
    film: Vec<u8>,
    notes: Vec<String>,
    seconds: f64,
    units: usize,
    made: usize,
    kills: usize,
}

fn simulate(workers: usize, samples: u32, faults: &Faults) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(samples, &path);
    let server = Server::new(job(&settings, faults.verify));
    let stream = &mut Stream::new(7, 7, 7);
    let mut workers: Vec<Worker> = (0..workers)
        .map(|i| Worker {
            name: format!("w{i}"),
            pace: 0.5 + 2.0 * stream.random::<f64>(),
            busy: None,
            lies: i < faults.liars,
        })
        .collect();
    let (mut returns, mut notes): (Vec<(f64, Unit)>, Vec<String>) = (Vec::new(), Vec::new());
    let (mut now, mut made, mut kills) = (0.0, 0, 0);
    let truth = settings.clone();
    loop {
        let owner = format!("c{kills}");
        server.job.borrow_mut().0.collector = Some(Lease { owner: owner.clone(), renewed: 0 });
        server.is_down.set(false);
        let mut judge = |unit: &Unit| {
            let film = film_of(&truth, &unit.range(), false);
            Ok(Some(HEXLOWER.encode(&film[film.len() - 32..])))
        };
        let gathering = Gathering::open(settings.clone(), JobDevice::Cpu, &path).unwrap();
        let place = (folder.path(), Duration::from_secs(5));
        let mut collector = Collector::new(&server, owner, gathering, place, &mut judge).unwrap();
        let dies = now + faults.killed_every;
        let complete = loop {
            now += 0.25;
            server.is_down.set(now % faults.down_every > faults.down_every - 3.0);
            if !server.is_down.get() {
                returns.retain(|(due, unit)| {
                    if *due <= now {
                        server.queue.borrow_mut().push_front(unit.clone());
                        server.in_hand.set(server.in_hand.get() - 1);
                    }
                    *due > now
                });
                for worker in &mut workers {
                    turn(worker, &server, &settings, faults, now, stream, &mut returns, &mut made);
                }
            }
            let step = collector.step(Duration::from_secs_f64(now));
            notes.extend(collector.take_notes());
            match step {
                Ok(Step::Complete) => break true,
                Ok(Step::Busy | Step::Waits) => {}
                Ok(Step::Cancelled) => panic!("nobody cancels"),
                Err(error) => assert!(error.is_temporary(), "{error}"),
            }
            assert!(now < 1e5, "it does not end: {:?}", collector.gathering().held());
            if now > dies {
                break false;
            }
        };
        if complete {
            let units = collector.job().plan.units().count();
            assert!(collector.gathering().write(|| Ok(())).unwrap());
            return Outcome { film: std::fs::read(&path).unwrap(), notes, seconds: now, units, made, kills };
        }
        kills += 1;
    }
}

#[allow(clippy::too_many_arguments, reason = "the state of the simulation, by its parts")]
fn turn(
    worker: &mut Worker,
    server: &Server,
    settings: &RenderSettings,
    faults: &Faults,
    now: f64,
    stream: &mut Stream,
    returns: &mut Vec<(f64, Unit)>,
    made: &mut usize,
) {
    if let Some((unit, _)) = worker.busy.take_if(|(_, due)| *due <= now) {
        let film = film_of(settings, &unit.range(), worker.lies);
        let copies = 1 + usize::from(stream.random::<f64>() < faults.doubled);
        for _ in 0..copies {
            *made += 1;
            let seconds = worker.pace * f64::from(unit.end - unit.first);
            server.post(posted(&unit, &worker.name, *made, &film, seconds), film.clone());
        }
        server.in_hand.set(server.in_hand.get() - 1);
    }
    if worker.busy.is_some() || server.job.borrow().0.barred.contains(&worker.name) {
        return;
    }
    let Some(unit) = server.queue.borrow_mut().pop_front() else { return };
    if unit.not.contains(&worker.name) {
        server.queue.borrow_mut().push_back(unit);
        return;
    }
    server.in_hand.set(server.in_hand.get() + 1);
    if stream.random::<f64>() < faults.lost {
        // It says nothing more; the server gives the unit to another worker.
        returns.push((now + 30.0, unit));
        return;
    }
    let due = now + worker.pace * f64::from(unit.end - unit.first);
    worker.busy = Some((unit, due));
}

const NONE: Faults =
    Faults { lost: 0.0, doubled: 0.0, killed_every: 1e9, down_every: 1e9, liars: 0, verify: 0.0 };

fn whole(samples: u32) -> Vec<u8> {
    film_of(&settings(samples, Path::new("x.film")), &(0..samples), false)
}

#[test]
fn a_thousand_workers_with_losses_make_the_film_of_one_machine() {
    let samples = 20_000;
    let faults = Faults { lost: 0.03, doubled: 0.05, killed_every: 7.0, down_every: 11.0, ..NONE };
    let start = Instant::now();
    let outcome = simulate(1000, samples, &faults);
    let Outcome { seconds, units, made, kills, .. } = outcome;
    println!(
        "{units} units, {made} results, {kills} collectors killed, {seconds:.0} virtual seconds in {:.1} s",
        start.elapsed().as_secs_f64()
    );
    assert!(kills > 1 && made > units && units > 2000);
    assert!(outcome.film == whole(samples), "another film");
    // Negative control: a sample more is another film.
    assert!(outcome.film != whole(samples + 1));
}

#[test]
fn wrong_results_are_found_by_checks() {
    let faults = Faults { liars: 1, verify: 1.0, ..NONE };
    let outcome = simulate(6, 60, &faults);
    assert!(outcome.film == whole(60), "a wrong result is in the film");
    let named = |worker: &str| {
        outcome.notes.iter().filter(|note| note.contains(&format!("the result of {worker} is wrong"))).count()
    };
    assert!(named("w0") >= 1 && (1..6).all(|i| named(&format!("w{i}")) == 0), "{:?}", outcome.notes);
    // The collector replaces a second worker that does not come.
    assert!(simulate(1, 6, &Faults { liars: 0, ..faults }).film == whole(6));
    // Negative control: without checks the wrong results are in the film.
    assert!(simulate(6, 60, &Faults { verify: 0.0, ..faults }).film != whole(60));
}
