//! Checkpoints of the film while samples continue to arrive.

use super::*;
use crossbeam_channel::{TryRecvError, never};
use stride::film::file::Piece;

const WIDE: u32 = 256;
/// A checkpoint has four pieces.
const ROWS: u32 = 512;
/// The number of films to check.
const FILMS: usize = 5;

/// Endless batches of a continuous film whose samples each contribute to four pixels, a quarter each: box, of radius 1.
/// None of the four is beyond the film's border.
fn batches(splatter: &Splatter) -> impl Iterator<Item = SampleBatch> {
    let region = Region::whole(WIDE, ROWS);
    let mut stream = Stream::new(6, 0, 0);
    (0..).map(move |i| {
        // At random positions, and every second one across the border of two pieces.
        let row = if i % 2 == 0 { stream.random_range(1..ROWS - 3) } else { 128 * (i / 2 % 3 + 1) - 2 };
        let place = row * WIDE;
        let mut band = splatter.band(place, place + 4 * WIDE - 1, WIDE);
        let mut made = vec![Made::default(); 4 * WIDE as usize];
        let finished: Vec<Finished> = (0..200)
            .map(|sample| {
                let slot = stream.random_range(1..4) * WIDE + stream.random_range(1..WIDE - 1);
                let pixel = region.pixel(place + slot - WIDE);
                let [x, y] = [pixel.x, pixel.y].map(|at| at as f32 + stream.random_range(0.0..1.0_f32));
                let slot = slot - WIDE;
                Finished { slot, sample: Sample { pixel: pixel.index, sample, x, y, radiance: [1.0; 3] } }
            })
            .collect();
        assert!(splatter.add(level(), &finished, &mut band, &mut made).is_empty());
        // The third kind of sums, and samples without any.
        let bright = vec![Sample { radiance: [2000.0; 3], ..finished[0].sample }];
        let stride = Stride { first: place, step: region.len(), run: 4 * WIDE };
        let payload = match i % 5 {
            0 => Payload::Samples(finished.iter().map(|f| f.sample).collect()),
            _ => Payload::Splats { first_slot: 0, made, band, bright },
        };
        SampleBatch { paths: 200, ..SampleBatch::empty(0, stride, payload) }
    })
}

/// The samples of a film by their counts and by their weights, which sum to one per sample: see `docs/film-format.md`.
fn samples(film: &[u8]) -> (u64, f64) {
    let word = |pixel: &[u8], at: usize| u64::from_le_bytes(pixel[at..at + 8].try_into().unwrap());
    let sum = |at: usize| film.chunks_exact(64).map(|pixel| word(pixel, at)).sum::<u64>();
    (sum(40), sum(24) as f64 / f64::from(1 << 28))
}

// A film that is sent in pieces while samples continue to arrive: if a sample contributes to pixels of two pieces, a
// film must have both parts or neither. Without `send_past`, one of the first films has a part of a sample.
#[test]
fn a_checkpoint_has_all_of_a_sample_or_nothing() {
    let splatter = Arc::new(Splatter::new(Weights::new(Filter::Box { radius: 1.0 }), [0, 0]));
    let layout = Layout { weighted: true, ..Layout::plain(WIDE, ROWS) };
    let schedule = Schedule::new(1, WIDE * ROWS, 1000, None, vec![]).in_stripes(WIDE * ROWS, WIDE);
    let (orders_out, _orders) = bounded(2);
    // One piece at a time, so that most samples arrive between two.
    let (film_out, pieces) = bounded(1);
    let film = Film::with_layout(layout).unwrap();
    let accumulator = Accumulator::new(Configuration {
        splatter: Some(Arc::clone(&splatter)),
        checkpoint: Duration::ZERO,
        outbox: Outbox { film: Some(film_out), ..Outbox::default() },
        ..Configuration::new(film, Region::whole(WIDE, ROWS), schedule, vec![Port::new(orders_out)])
    });
    let (batches_out, batches_in) = bounded(0);
    let (_changes_out, changes) = bounded(1);
    let (_stop_out, stop) = bounded(0);
    let (enough_out, enough) = bounded::<Infallible>(0);
    std::thread::scope(|scope| {
        let run =
            scope.spawn(|| accumulator.run(Inbox { batches: batches_in, changes, stop, viewer: never() }));
        let sender = scope.spawn(|| {
            let open = |_: &SampleBatch| enough.try_recv() == Err(TryRecvError::Empty);
            batches(&splatter).take_while(open).for_each(|batch| batches_out.send(batch).unwrap());
            drop(batches_out);
        });
        let (mut film, mut films, mut enough_out) = (Vec::new(), Vec::new(), Some(enough_out));
        for piece in pieces {
            match piece {
                Piece::Start(_) => film.clear(),
                Piece::Pixels(bytes) => film.extend(bytes),
            }
            if film.len() == 64 * (WIDE * ROWS) as usize {
                let (counted, weighed) = samples(&film);
                films.push(counted);
                assert_eq!(counted as f64, weighed, "film {} has a part of a sample", films.len());
                if films.len() == FILMS {
                    enough_out = None;
                }
            }
        }
        drop(enough_out);
        sender.join().unwrap();
        let outcome = run.join().unwrap();
        println!("films of {films:?} samples");
        let (counted, weighed) = samples(&outcome.film.bytes(0..(WIDE * ROWS) as usize));
        assert!(counted as f64 == weighed && counted >= outcome.totals.samples);
        assert!(
            films.len() >= FILMS && films.is_sorted_by(|a, b| a < b),
            "they are all of one moment: {films:?}"
        );
    });
}
