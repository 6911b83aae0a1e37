//! A single worker between its channels.

use super::*;

fn lone_worker(integrator: &dyn Integrator) -> Worker<'_> {
    let (level, region) = (level(), WHOLE);
    Worker { index: 0, integrator, level, region, sends_samples: false, splatter: None, layers: layers() }
}

#[test]
fn closing_the_batches_stops_a_worker_that_has_more_to_do() {
    let integrator = common::integrator(&scene());
    let (orders_out, orders) = bounded(100);
    for first in 0..100 {
        orders_out
            .send(Order { stride: Stride::ALL, first: first * 256, end: first * 256 + 256 }.into())
            .unwrap();
    }
    let (batches_out, batches) = bounded::<SampleBatch>(1);
    std::thread::scope(|scope| {
        let running = scope.spawn(|| lone_worker(&*integrator).run(&orders, &batches_out));
        let first = batches.recv().unwrap();
        assert!(first.paths > 0);
        drop(batches);
        running.join().unwrap();
    });
    // Most orders remain: it stopped when the receiver was gone.
    assert!(orders.len() > 50, "{} left", orders.len());
}

#[test]
fn closing_the_orders_ends_a_worker_after_the_last_of_them() {
    let integrator = common::integrator(&scene());
    let (orders_out, orders) = bounded(2);
    let (batches_out, batches) = bounded::<SampleBatch>(100);
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 1 }.into()).unwrap();
    orders_out.send(Order { stride: Stride::ALL, first: 1, end: 3 }.into()).unwrap();
    drop(orders_out);
    lone_worker(&*integrator).run(&orders, &batches_out);
    drop(batches_out);
    let all: Vec<SampleBatch> = batches.iter().collect();
    assert_eq!(all.iter().map(|b| b.paths).sum::<u64>(), 3 * 1200);
    assert_eq!(all.iter().filter_map(|b| b.completes).collect::<Vec<_>>(), [1, 3]);
}

/// Makes the same sample everywhere.
struct Quick(Box<dyn Integrator>);

impl Integrator for Quick {
    fn trace_until(&self, _: Level, paths: &Paths<'_>, _: &dyn Fn() -> bool, out: &mut Found) -> Option<u64> {
        for (slot, pixel) in (0..).zip(paths.pixels) {
            let (x, y) = (pixel.x as f32 + 0.5, pixel.y as f32 + 0.5);
            let of = |sample| Sample { pixel: pixel.index, sample, x, y, radiance: [1.0; 3] };
            let samples = paths.first_sample..paths.first_sample + paths.samples;
            out.finished.extend(samples.map(|sample| Finished { slot, sample: of(sample) }));
        }
        Some(paths.len() as u64)
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        self.0.first_hits(level, paths, out);
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        self.0.seen_by(camera)
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        self.0.explain(pixel, sample)
    }
}

// A worker has three batches at a time: one that it fills, and two in the channel. With the clock alone a fast
// one would fill much larger batches: without the bounds on slots and samples the largest exceeds 34 MB.
#[test]
fn batches_of_a_fast_worker_take_16_mib_at_most() {
    let region = Region::whole(3000, 800);
    let integrator = Quick(common::integrator(&scene()));
    let mitchell = Weights::new(Filter::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 });
    let splatter = Splatter::new(mitchell, [0, 0]);
    let spreading = splatter.clone().with_spreads(true);
    let splatters = [None, Some(&splatter), Some(&spreading)];
    for (splatter, sends_samples) in splatters.into_iter().flat_map(|it| [(it, false), (it, true)]) {
        let worker = Worker { region, sends_samples, splatter, ..lone_worker(&integrator) };
        let (orders_out, orders) = bounded(1);
        let (batches_out, batches) = bounded::<SampleBatch>(1);
        orders_out.send(Order { stride: Stride::ALL, first: 0, end: 2 }.into()).unwrap();
        drop(orders_out);
        let (mut largest, mut paths, mut sent) = (0, 0, 0);
        std::thread::scope(|scope| {
            scope.spawn(move || worker.run(&orders, &batches_out));
            for batch in batches {
                let of_payload = match &batch.payload {
                    Payload::Samples(samples) => size_of_val(&samples[..]),
                    Payload::Sums { sums, .. } => size_of_val(&sums[..]),
                    Payload::Splats { made, band, .. } => size_of_val(&made[..]) + band.bytes(),
                };
                largest =
                    largest.max(of_payload + size_of_val(&batch.samples[..]) + batch.first_hits.sums.bytes());
                paths += batch.paths;
                sent += batch.samples.len() as u64;
            }
        });
        let all = u64::from(region.len()) * 2;
        assert_eq!((paths, sent), (all, if sends_samples { all } else { 0 }));
        println!("splats {}, samples {sends_samples}: {largest} bytes", splatter.is_some());
        // A batch continues to the end of its last block.
        assert!(
            3 * largest <= (16 << 20) + 3 * 4096 * (68 + layers().pixel_bytes() as usize),
            "{largest} bytes"
        );
    }
}

#[test]
fn a_worker_sends_at_least_every_tenth_of_a_second() {
    // A block of 256 paths takes 15 ms, for which it is neither halved nor doubled.
    const BLOCK: Duration = Duration::from_millis(15);
    let (blocks, start) = (AtomicU32::new(0), Instant::now());
    let integrator = hooked(|_| {
        blocks.fetch_add(1, Ordering::Relaxed);
    });
    let clock = || start + BLOCK * blocks.load(Ordering::Relaxed);
    let (orders_out, orders) = bounded(1);
    let (batches_out, batches) = bounded::<SampleBatch>(100);
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 8 }.into()).unwrap();
    drop(orders_out);
    lone_worker(&integrator).run_by(&clock, &orders, &never(), &batches_out);
    drop(batches_out);
    // 1200 pixels · 8 samples are 38 blocks. After the fourth of a batch 60 ms have passed: it is sent and does not
    // wait for a fifth, although that would be in time, because the next block may take longer.
    let paths: Vec<u64> = batches.iter().map(|batch| batch.paths).collect();
    assert_eq!(paths, [&[4 * 256; 9][..], &[1200 * 8 - 9 * 4 * 256]].concat());
    assert_eq!(blocks.load(Ordering::Relaxed), 38);
}
