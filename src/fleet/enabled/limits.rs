//! Measures what a unit costs a worker and the collector:
//! `cargo test --release --features fleet --lib limits -- --ignored --nocapture`.

use super::pack::{pack, unpack};
use crate::film::file::{START_BYTES, write};
use crate::film::head::Head;
use crate::film::{Film, Identity, Layout, SampleRanges};
use crate::output::open_film;
use crate::sampling::Stream;
use rand::RngExt;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::time::Instant;

#[test]
#[ignore = "a measurement"]
fn the_time_of_a_unit() {
    println!("size, film MB, packed MB, pack s, unpack s, digest s, add s, workers at 10, 30, 60 s a unit");
    for (width, height) in [(1920, 1080), (3840, 2160)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("unit.film");
        let mut film = Film::new(width, height).unwrap();
        let stream = &mut Stream::new(1, 1, 1);
        for pixel in 0..(width * height) as usize {
            for _ in 0..8 {
                film.add_sample(pixel, [0.9, 0.6, 0.3].map(|c| c * stream.random::<f32>())).unwrap();
            }
        }
        let identity = Identity::default().with("scene", "a measurement");
        let head = Head { layout: Layout::plain(width, height), identity, notes: Identity::default() };
        let ranges = SampleRanges::prefix(0..8, 8, 8);
        let out = BufWriter::with_capacity(1 << 20, File::create(&path).unwrap());
        write(out, &head, &film, &ranges, None).unwrap().flush().unwrap();
        let bytes = path.metadata().unwrap().len();
        let timed = |work: &mut dyn FnMut()| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        };
        let text = head.identity.to_string().len() + 1;
        let mut packed = Vec::new();
        let packing = timed(&mut || {
            packed.clear();
            let film = BufReader::with_capacity(1 << 20, File::open(&path).unwrap());
            pack(film, START_BYTES as usize + text, 64, &mut packed).unwrap();
        });
        let mut restored = Vec::new();
        let unpacking = timed(&mut || unpack(&packed[..], bytes, &mut restored).unwrap());
        assert!(restored == std::fs::read(&path).unwrap());
        let digest = timed(&mut || {
            std::hint::black_box(Sha256::digest(&restored));
        });
        let mut sum = Film::new(width, height).unwrap();
        let adding = timed(&mut || open_film(&path).unwrap().add_to(&mut sum).unwrap());
        let cost = unpacking + digest + adding;
        let workers = [10.0, 30.0, 60.0].map(|unit| (unit / cost) as u32);
        let [film_mb, packed_mb] = [bytes, packed.len() as u64].map(|bytes| bytes as f64 / 1e6);
        println!(
            "{width}×{height}, {film_mb:.0}, {packed_mb:.0}, {packing:.2}, {unpacking:.2}, {digest:.2}, {adding:.2}, {workers:?}"
        );
    }
}
