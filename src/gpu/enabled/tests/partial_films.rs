//! Continuing films whose pixels have different numbers of samples.

use super::{GpuWorker, Prepared, carry_out, device, scenes};
use crate::film::Film;
use crate::render::{Assignment, Order, Payload, SampleBatch, Stride};

fn add(film: &mut Film, batches: &[SampleBatch]) {
    for batch in batches {
        let Payload::Sums { first_slot, sums, wide, .. } = &batch.payload else { panic!("no sums") };
        for (slot, sums) in (*first_slot..).zip(sums) {
            film.add_sums(batch.stride.place(slot) as usize, sums);
        }
        for (slot, sums) in wide {
            film.add_wide(batch.stride.place(*slot) as usize, sums);
        }
    }
}

#[test]
fn pixels_get_their_missing_samples_and_the_film_equals_that_of_one_run() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(40, 30), 0);
    let order = |stride, first, end| Order { stride, first, end };
    let mut worker = GpuWorker::new(&device, &prepared.job()).unwrap();
    let mut whole = Film::new(40, 30).unwrap();
    add(&mut whole, &carry_out(&mut worker, &[order(Stride::ALL, 0, 21)]));

    let mut film = Film::new(40, 30).unwrap();
    let third = Stride::ALL.split(1, 3);
    let (ninth, fifth) = (third.split(2, 3), Stride::every(1, 1000));
    let begun = [order(Stride::ALL, 0, 2), order(third, 2, 9), order(ninth, 9, 21), order(fifth, 2, 2)];
    add(&mut film, &carry_out(&mut worker, &begun));
    assert!(film != whole);
    let orders = [order(ninth, 0, 21), order(Stride::ALL, 2, 11), order(Stride::ALL, 11, 21)];
    let assignments = orders.map(|order| Assignment::of(order, &film, 0, None));
    let batches = carry_out(&mut worker, &assignments);
    assert_eq!(batches.iter().filter_map(|batch| batch.completes).collect::<Vec<_>>(), [21, 11, 21]);
    add(&mut film, &batches);
    assert!(film == whole);
}
