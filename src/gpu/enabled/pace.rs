//! The amount of work per dispatch.
//!
//! Long dispatches freeze the display and may trigger the system's watchdog, which resets the device. Short dispatches
//! leave the device idle. The size of dispatches never affects the image.

use crate::film::sums::MAX_COUNT;
use crate::render::{Order, Stride};
use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

/// The target duration of a dispatch: one frame. It is far above the launch overhead of some tens of microseconds, and
/// far below the watchdog limit of two seconds of the strictest drivers.
const TARGET: Duration = Duration::from_millis(20);

/// The number of paths in the first dispatch: a few milliseconds on a slow device.
const FIRST_PATHS: f64 = 4096.0;

/// The minimum number of paths in a dispatch.
const FEWEST_PATHS: f64 = 256.0;

/// The maximum number of slots in a dispatch: 16 MiB of sums, and at most 102 MiB of sums of first hits where layers
/// are requested.
pub(super) const MOST_SLOTS: u32 = 1 << 18;

/// The maximum number of samples that a dispatch returns individually: 7 MB.
pub(super) const MOST_SAMPLES: u32 = 1 << 18;

/// The maximum number of samples per dispatch that may be too bright for a band of sums. These are returned
/// individually: 2 MB.
pub(super) const MOST_BRIGHT: u32 = 1 << 16;

/// The initial capacity for such samples: 7 kB, transferred with every dispatch whether used or not.
pub(super) const FIRST_BRIGHT: u32 = 1 << 8;

/// Each visit to a slot costs the transfer of its sums, so it should add a few samples.
const SAMPLES_A_VISIT: f64 = 8.0;

/// The same with bands, where a visit also costs the rows within the filter's reach.
const SAMPLES_A_VISIT_OF_SPLATS: f64 = 32.0;

/// The work of one dispatch: a range of samples, for each of some slots of a stride.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Task {
    pub(super) stride: Stride,
    pub(super) first_slot: u32,
    pub(super) slots: u32,
    pub(super) first_sample: u32,
    pub(super) samples: u32,
    /// The order that this task completes, if it is the last of an order.
    pub(super) completes: Option<u32>,
}

impl Task {
    pub(super) fn paths(&self) -> u64 {
        u64::from(self.slots) * u64::from(self.samples)
    }

    /// Splits this task in two if it exceeds the pace; the first part is within the pace.
    fn split(self, pace: &Pace) -> (Task, Option<Task>) {
        let paths = pace.most_paths;
        let samples = pace.most_samples.min((paths / self.slots).max(1));
        let slots = pace.most_slots.min(paths);
        if self.samples > samples {
            let (first_sample, rest) = (self.first_sample + samples, self.samples - samples);
            let rest = Task { first_sample, samples: rest, ..self };
            (Task { samples, completes: None, ..self }, Some(rest))
        } else if self.slots > slots {
            let rest = Task { first_slot: self.first_slot + slots, slots: self.slots - slots, ..self };
            (Task { slots, completes: None, ..self }, Some(rest))
        } else {
            (self, None)
        }
    }
}

/// Takes as many of the pending tasks as the pace allows.
pub(super) fn next_part(tasks: &mut VecDeque<Task>, pace: &Pace) -> Option<Task> {
    let mut part = tasks.pop_front()?;
    loop {
        let (smaller, rest) = part.split(pace);
        let Some(rest) = rest else { return Some(smaller) };
        tasks.push_front(rest);
        part = smaller;
    }
}

/// The number of paths that take the target time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    paths: f64,
    /// The maximum number of paths for which the results fit.
    most_paths: u32,
    samples_a_visit: f64,
    /// The maximum number of samples per slot, and of slots per invocation, that the driver lets run to the end.
    most_samples: u32,
    most_slots: u32,
}

impl Pace {
    pub(super) fn new(sends_samples: bool) -> Pace {
        let most_paths = if sends_samples { MOST_SAMPLES } else { u32::MAX };
        Pace {
            paths: FIRST_PATHS,
            most_paths,
            samples_a_visit: SAMPLES_A_VISIT,
            most_samples: MAX_COUNT,
            most_slots: MOST_SLOTS,
        }
    }

    /// The initial pace for samples that are added to bands.
    pub(super) fn of_splats() -> Pace {
        Pace { samples_a_visit: SAMPLES_A_VISIT_OF_SPLATS, ..Pace::new(false) }
    }

    /// After a task with more bright samples than fit: aims at half as many as fit if they are evenly distributed. As
    /// many paths as the capacity always fit.
    pub(super) fn leave_room(&mut self, task: &Task, bright: u32, room: u32) {
        let even = task.paths() * u64::from(room) / u64::from(bright.max(1)) / 2;
        self.most_paths = even.clamp(room.into(), self.most_paths.max(room).into()) as u32;
    }

    /// After a task that the driver ended early: reduces the work per invocation of the next tasks. Returns whether
    /// that was possible.
    pub(super) fn ask_less(&mut self, task: &Task, invocations: u32) -> bool {
        if task.samples > 1 {
            self.most_samples = self.most_samples.min(task.samples / 2);
        } else if task.slots > invocations {
            self.most_slots = self.most_slots.min(invocations);
        } else {
            return false;
        }
        true
    }

    /// Adjusts to the duration of a dispatch. Growth is limited per step, as the first dispatches include start-up.
    pub(super) fn learn(&mut self, paths: u64, took: Duration) {
        let fitting = paths as f64 * TARGET.as_secs_f64() / took.as_secs_f64().max(1e-6);
        self.paths = fitting.clamp(self.paths * 0.25, self.paths * 2.0).max(FEWEST_PATHS);
    }

    /// Adjusts to a dispatch that took at most this time, and possibly much less.
    pub(super) fn learn_at_most(&mut self, paths: u64, took: Duration) {
        if took < TARGET {
            self.learn(paths, took);
        }
    }

    /// The slots and samples of a dispatch, given those that remain.
    fn tile(&self, slots: u32, samples: u32) -> (u32, u32) {
        let most = self.paths.min(f64::from(self.most_paths));
        let wanted = most / f64::from(samples.min(self.most_samples)).min(self.samples_a_visit);
        let slots = (wanted.max(1.0) as u32).min(slots).min(self.most_slots);
        let fitting = (most / f64::from(slots)).max(1.0) as u32;
        (slots, fitting.min(samples).min(self.most_samples))
    }
}

/// A run of slots that get the same samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) slots: Range<u32>,
    pub(super) samples: Range<u32>,
}

/// The remaining work of an order: all samples of a few slots, then of the next.
#[derive(Clone, Debug)]
pub(super) struct Remaining {
    order: Order,
    /// The runs; none is empty.
    runs: VecDeque<Run>,
    /// The number of slots in the current group; zero before it is chosen.
    slots: u32,
    sample: u32,
}

impl Remaining {
    /// An order over some slots, each of which gets all of its samples.
    pub(super) fn new(order: Order, all_slots: u32) -> Remaining {
        Remaining::of(order, [Run { slots: 0..all_slots, samples: order.first..order.end }])
    }

    /// The remaining work of an order for slots that have some of its samples.
    pub(super) fn of(order: Order, runs: impl IntoIterator<Item = Run>) -> Remaining {
        let runs = runs.into_iter().filter(|run| !run.slots.is_empty() && !run.samples.is_empty()).collect();
        Remaining { order, runs, slots: 0, sample: 0 }
    }

    /// Whether nothing remains.
    pub(super) fn is_done(&self) -> bool {
        self.runs.is_empty()
    }

    /// The next task, or `None` when the order is complete. `reach` returns the maximum number of pixels of a task from
    /// a pixel of the region.
    pub(super) fn next(&mut self, pace: &Pace, reach: impl Fn(u32) -> u32) -> Option<Task> {
        let run = self.runs.front_mut()?;
        if self.slots == 0 {
            self.sample = run.samples.start;
            let Order { stride, .. } = self.order;
            let place = stride.place(run.slots.start);
            // The number of a stride's pixels before a pixel is the slot of the first pixel from there.
            let within = stride.len(place.saturating_add(reach(place))) - run.slots.start;
            self.slots = pace.tile(within.min(run.slots.len() as u32), run.samples.len() as u32).0;
        }
        let (_, samples) = pace.tile(self.slots, run.samples.end - self.sample);
        let mut task = Task {
            stride: self.order.stride,
            first_slot: run.slots.start,
            slots: self.slots,
            first_sample: self.sample,
            samples,
            completes: None,
        };
        self.sample += samples;
        if self.sample == run.samples.end {
            run.slots.start += self.slots;
            self.slots = 0;
            if run.slots.is_empty() {
                self.runs.pop_front();
            }
            task.completes = self.runs.is_empty().then_some(self.order.end);
        }
        Some(task)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tasks(order: Order, slots: u32, pace: &mut Pace, took: Duration) -> Vec<Task> {
        let mut remaining = Remaining::new(order, slots);
        let mut tasks = Vec::new();
        while let Some(task) = remaining.next(pace, |_| u32::MAX) {
            pace.learn(task.paths(), took);
            tasks.push(task);
        }
        tasks
    }

    #[test]
    fn tasks_cover_every_sample_of_every_slot_once_at_any_pace() {
        for took in [Duration::ZERO, Duration::from_millis(30), Duration::from_secs(9)] {
            for (first, end, slots) in [(0, 1, 70_000), (3, 259, 1000), (0, 256, 3), (0, 2000, 1)] {
                let tasks =
                    tasks(Order { stride: Stride::ALL, first, end }, slots, &mut Pace::new(false), took);
                let mut seen = vec![0_u64; slots as usize];
                for task in &tasks {
                    assert!(task.samples <= MAX_COUNT && task.slots <= MOST_SLOTS);
                    for slot in task.first_slot..task.first_slot + task.slots {
                        // Samples of a slot come in order.
                        assert_eq!(u64::from(task.first_sample - first), seen[slot as usize]);
                        seen[slot as usize] += u64::from(task.samples);
                    }
                }
                assert!(seen.iter().all(|&n| n == u64::from(end - first)));
                let completing = tasks.iter().filter(|task| task.completes == Some(end)).count();
                assert_eq!((completing, tasks.last().unwrap().completes), (1, Some(end)));
            }
        }
    }

    #[test]
    fn runs_get_their_own_samples_and_the_last_completes_the_order() {
        let run = |slots, samples| Run { slots, samples };
        let runs = [run(0..5, 3..3), run(5..300, 3..9), run(300..300, 0..9), run(300..1000, 7..9)];
        let order = Order { stride: Stride::ALL, first: 3, end: 9 };
        let mut remaining = Remaining::of(order, runs.clone());
        let mut seen = vec![Vec::new(); 1000];
        let mut completes = Vec::new();
        while let Some(task) = remaining.next(&Pace { paths: 700.0, ..Pace::new(false) }, |_| u32::MAX) {
            for slot in task.first_slot..task.first_slot + task.slots {
                seen[slot as usize].extend(task.first_sample..task.first_sample + task.samples);
            }
            completes.push(task.completes);
        }
        for run in runs {
            assert!(
                run.slots.clone().all(|slot| seen[slot as usize] == run.samples.clone().collect::<Vec<_>>())
            );
        }
        assert_eq!(completes.pop(), Some(Some(9)));
        assert!(completes.iter().all(Option::is_none));
        assert!(
            Remaining::of(order, [run(0..5, 9..9)]).is_done()
                && !Remaining::of(order, [run(0..5, 8..9)]).is_done()
        );
    }

    #[test]
    fn dispatches_grow_to_the_target_time_and_samples_stay_bounded() {
        let mut pace = Pace::new(false);
        let rate = 1e9;
        for _ in 0..40 {
            let (slots, samples) = pace.tile(1 << 20, 256);
            let paths = u64::from(slots) * u64::from(samples);
            pace.learn(paths, Duration::from_secs_f64(paths as f64 / rate));
        }
        let (slots, samples) = pace.tile(1 << 20, 256);
        let seconds = f64::from(slots) * f64::from(samples) / rate;
        assert!((0.01..0.03).contains(&seconds), "{slots} slots × {samples} samples take {seconds} s");
        let (slots, samples) = Pace { most_paths: MOST_SAMPLES, ..pace }.tile(1 << 20, 256);
        assert!(slots * samples <= MOST_SAMPLES);
    }

    #[test]
    fn oversized_tasks_are_split() {
        let mut pace = Pace::new(false);
        let whole = Task {
            stride: Stride::ALL,
            first_slot: 5,
            slots: 100,
            first_sample: 7,
            samples: 21,
            completes: Some(28),
        };
        assert_eq!(next_part(&mut VecDeque::from([whole]), &pace), Some(whole));
        assert!(pace.ask_less(&whole, 32) && pace.ask_less(&Task { samples: 11, ..whole }, 32));
        assert!(pace.tile(1000, 1000).1 <= 5);
        assert!(pace.ask_less(&Task { samples: 1, ..whole }, 32) && pace.tile(1000, 1000).0 <= 32);
        // Neither fewer samples nor fewer slots per invocation are possible.
        assert!(!pace.ask_less(&Task { samples: 1, slots: 32, ..whole }, 32));
        let (mut left, mut seen) = (VecDeque::from([whole]), vec![0; 105 * 28]);
        while let Some(part) = next_part(&mut left, &pace) {
            assert!(part.slots <= 32 && part.samples <= 5);
            assert_eq!(part.completes, left.is_empty().then_some(28));
            for slot in part.first_slot..part.first_slot + part.slots {
                for sample in part.first_sample..part.first_sample + part.samples {
                    seen[(slot * 28 + sample) as usize] += 1;
                }
            }
        }
        assert_eq!(seen.iter().sum::<u32>(), 2100);
        assert!(seen.iter().all(|&times| times <= 1));
    }

    #[test]
    fn a_task_stays_within_reach() {
        let stride = Stride { first: 30, step: 100, run: 40 };
        let order = Order { stride, first: 2, end: 9 };
        // Rows of 90 pixels; two rows share a band.
        let reach = |place: u32| 180 - place % 90;
        for pace in [Pace::new(false), Pace { paths: 300.0, ..Pace::new(false) }] {
            let mut remaining = Remaining::new(order, stride.len(1000));
            let mut seen = vec![0; stride.len(1000) as usize];
            while let Some(task) = remaining.next(&pace, reach) {
                let [first, last] = [0, task.slots - 1].map(|slot| stride.place(task.first_slot + slot) / 90);
                assert!(last <= first + 1, "{task:?}");
                (task.first_slot..task.first_slot + task.slots)
                    .for_each(|slot| seen[slot as usize] += task.samples);
            }
            assert!(seen.iter().all(|&samples| samples == 7));
        }
    }

    #[test]
    fn tasks_shrink_when_bright_samples_overflow() {
        let mut pace = Pace::new(false);
        let task = Task {
            stride: Stride::ALL,
            first_slot: 0,
            slots: 1000,
            first_sample: 0,
            samples: 50,
            completes: Some(50),
        };
        pace.leave_room(&task, 400, 100);
        assert_eq!(pace.most_paths, 6250);
        let mut left = VecDeque::from([task]);
        let mut paths = 0;
        while let Some(part) = next_part(&mut left, &pace) {
            assert!(part.paths() <= 6250);
            paths += part.paths();
        }
        assert_eq!(paths, 50_000);
        // As many as the capacity, of any brightness, and never more than before.
        pace.leave_room(&Task { slots: 100, ..task }, 5000, 100);
        assert_eq!(pace.most_paths, 100);
        let (slots, samples) = Pace { paths: 1e9, ..pace }.tile(1 << 20, 256);
        assert!(slots * samples <= 100);
        let part = next_part(&mut VecDeque::from([task]), &pace).unwrap();
        assert_eq!((part.slots, part.samples), (100, 1));
        pace.leave_room(&Task { slots: 100, samples: 1, ..task }, 101, 100);
        assert_eq!(pace.most_paths, 100);
    }

    #[test]
    fn slow_devices_get_small_dispatches() {
        let mut pace = Pace::new(false);
        for _ in 0..20 {
            pace.learn(4096, Duration::from_secs(1));
        }
        let (slots, samples) = pace.tile(1 << 20, 256);
        assert!(slots * samples <= 256, "{slots} × {samples}");
    }
}
