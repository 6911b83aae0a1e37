//! A server without room.

use super::{Server, film_of, job, posted, settings, whole};
use crate::fleet::enabled::collector::{Collector, Step};
use crate::fleet::enabled::gathering::Gathering;
use crate::fleet::enabled::job::{JobDevice, Lease};
use crate::fleet::enabled::unit::{Beat, Unit};
use std::time::Duration;

/// The results for which there is room.
const ROOM: usize = 3;

const SAMPLES: u32 = 12;

/// Four workers whose results are all checked, and a server with little room, some of which is taken by parts of a worker
/// that has died. Returns the film if it is complete at the end.
fn simulate(say_that_they_wait: bool) -> Option<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(SAMPLES, &path);
    let server = Server::new(job(&settings, 1.0));
    server.job.borrow_mut().0.collector = Some(Lease { owner: "c".into(), renewed: 0 });
    server.parts.borrow_mut().insert("0.1.dead".into(), 5);
    let mut judge = |_: &Unit| panic!("nothing is to be judged");
    let gathering = Gathering::open(settings.clone(), JobDevice::Cpu, &path).unwrap();
    let place = (folder.path(), Duration::from_secs(5));
    let mut collector = Collector::new(&server, "c".into(), gathering, place, &mut judge).unwrap();
    let mut workers: [Option<(Unit, f64)>; 4] = [const { None }; 4];
    let (mut now, mut made) = (0.0, 0);
    while now < 3000.0 {
        now += 0.25;
        for (worker, name) in workers.iter_mut().zip(["a", "b", "c", "d"]) {
            let Some((unit, due)) = worker else {
                let mut queue = server.queue.borrow_mut();
                let next = queue.iter().position(|unit| !unit.not.contains(&name.to_owned()));
                *worker = next.and_then(|next| queue.remove(next)).map(|unit| (unit, now + 1.0));
                server.in_hand.set(server.in_hand.get() + u64::from(worker.is_some()));
                continue;
            };
            if *due > now {
                continue;
            }
            let parts = server.parts.borrow().len();
            if server.results.borrow().len() + parts < ROOM {
                made += 1;
                let film = film_of(&settings, &unit.range(), false);
                server.post(posted(unit, name, made, &film, 1.0), film);
                server.in_hand.set(server.in_hand.get() - 1);
                *worker = None;
            } else if say_that_they_wait {
                let beat = Beat { worker: name.to_owned(), done: 0.0, waits: true };
                collector.hear(beat, Duration::from_secs_f64(now));
            }
        }
        if collector.step(Duration::from_secs_f64(now)).unwrap() == Step::Complete {
            assert!(collector.gathering().write(|| Ok(())).unwrap());
            return Some(std::fs::read(&path).unwrap());
        }
    }
    None
}

#[test]
fn workers_that_wait_for_room_do_not_wait_forever() {
    assert!(simulate(true).is_some_and(|film| film == whole(SAMPLES)));
    // Negative control: the room is too small unless it is cleared for those who wait.
    assert!(simulate(false).is_none());
}
