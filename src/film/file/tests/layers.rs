//! Films with sums of first hits.

use super::*;
use crate::film::cryptomatte::{ENTITIES, MATERIALS, Mattes, Names, id};
use crate::film::{Layer, LayerSums};
use crate::integrator::FirstHit;

fn set() -> LayerSet {
    LayerSet::new(&[Layer::Albedo, Layer::Depth, Layer::CryptoEntity], 300, 1)
}

fn layered(width: u32, height: u32) -> Head {
    let head = head(width, height);
    let notes = head.notes.with("entities", r#"["a","b"]"#);
    Head { layout: Layout { layers: set(), ..head.layout }, notes, ..head }
}

fn hit(depth: f32, entity: u32) -> FirstHit {
    FirstHit { met: true, albedo: [0.5, 0.25, 1.0], depth, entity, ..FirstHit::default() }
}

/// A film of pixels whose samples from 10 on have first hits; one sample of each meets no surface.
fn film_of(head: &Head, counts: &[u32]) -> Film {
    let mut film = Film::with_layout(head.layout).unwrap();
    for (pixel, &count) in counts.iter().enumerate() {
        let mut sums = LayerSums::new(head.layout.layers);
        sums.grow(1);
        for sample in 10..10 + count {
            film.add_sample(pixel, [1.0; 3]).unwrap();
            match sample {
                11 => sums.add(0, sample, &[FirstHit::default()]),
                _ => sums.add(0, sample, &[hit(sample as f32, sample)]),
            }
        }
        film.add_first_hits(pixel, &sums, 0);
    }
    film
}

#[test]
fn layers_are_read_back_in_the_documented_layout_and_added_up() {
    let head = layered(2, 1);
    let film = film_of(&head, &[0, 3]);
    let bytes = file(&head, &film);
    // Albedo, depth, and a matte with two bytes per number.
    let words = 8 + 64 + (2 << 8);
    assert_eq!(bytes[8..12], 4_u32.to_le_bytes());
    assert_eq!(bytes[24..28], u32::to_le_bytes(words));
    let (read_head, _, read_film) = read(&bytes).unwrap();
    assert!(read_head == head && read_film == film);
    assert_eq!(read_head.mattes().unwrap().entities.len(), 2);
    // After the words of radiance: the samples whose first hit was traced, those that met a surface, three sums of 64
    // bits, one of 128, and a number of two bytes for each of 32 samples.
    let (first, pixel_bytes) = (START_BYTES as usize + head.text().len(), 64 + 4 + 4 + 24 + 16 + 64);
    assert_eq!(head.layout.pixel_bytes(), pixel_bytes as u64);
    let layers = |pixel: usize| &bytes[first + pixel * pixel_bytes + 64..][..pixel_bytes - 64];
    assert!(layers(0).iter().all(|&byte| byte == 0));
    let mut expected = [0b1_1100_0000_0000_u32, 0b1_0100_0000_0000].map(u32::to_le_bytes).concat();
    expected.extend([1_u64 << 32, 1 << 31, 2 << 32].map(u64::to_le_bytes).as_flattened());
    expected.extend((22_i128 << 64).to_le_bytes());
    let mut numbers = [0_u16; 32];
    (numbers[10], numbers[12]) = (10, 12);
    expected.extend(numbers.map(u16::to_le_bytes).as_flattened());
    assert_eq!(layers(1), expected);
    // Other samples of the same pixels.
    let mut other = Film::with_layout(head.layout).unwrap();
    let mut sums = LayerSums::new(set());
    sums.grow(1);
    sums.add(0, 5, &[hit(2.0, 299)]);
    other.add_first_hits(1, &sums, 0);
    FilmReader::open(Cursor::new(&bytes)).unwrap().add_to(&mut other).unwrap();
    let depth = other.channels(Layer::Depth, &read_head.mattes().unwrap());
    assert_eq!(depth[0].values[1], 8.0);
    // Four samples, one of which met no surface.
    let name = |number: u32| format!("thing {number}");
    let entities = Names::new(ENTITIES, (0..300).map(name).collect());
    let mattes = Mattes { entities, materials: Names::new(MATERIALS, Vec::new()) };
    let ranks = other.channels(Layer::CryptoEntity, &mattes);
    let mut ids = [10, 12, 299].map(|number| id(&name(number)));
    ids.sort_unstable();
    for (rank, id) in ranks.chunks_exact(2).zip(ids) {
        assert_eq!((rank[0].values[1].to_bits(), rank[1].values[1]), (id, 0.25));
    }
    assert_eq!(ranks[7].values[1], 0.0);
    // A film without layers is not added to one with them, nor the reverse.
    let plain = super::head(2, 1);
    let mut without = Film::with_layout(plain.layout).unwrap();
    let added = FilmReader::open(Cursor::new(&bytes)).unwrap().add_to(&mut without);
    assert!(matches!(added, Err(FilmFileError::Contradiction(_))));
    let bare = file(&plain, &without);
    let added = FilmReader::open(Cursor::new(bare)).unwrap().add_to(&mut other);
    assert!(matches!(added, Err(FilmFileError::Contradiction(_))));
}

#[test]
fn damaged_layers_and_layers_of_other_samples_are_refused() {
    let head = layered(3, 1);
    let film = film_of(&head, &[2, 4, 3]);
    let good = file(&head, &film);
    assert!(read(&good).is_ok());
    let mut bad = good.clone();
    for bit in 0..8 * good.len() {
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&bad).is_err(), "bit {bit} of {}", 8 * good.len());
        bad[bit / 8] ^= 1 << (bit % 8);
    }
    for length in 0..good.len() {
        assert!(matches!(read(&good[..length]), Err(FilmFileError::NotAFilm | FilmFileError::Length { .. })));
    }
    // A valid digest over: samples whose first hit was not traced, samples that are not in the film, and surfaces met
    // by such samples.
    let traced = START_BYTES as usize + head.text().len() + 64;
    let met = traced + 4;
    for (word, pixel, bits) in
        [(traced, 0, 0b1000), (traced, 1, 0b10_0000), (traced, 2, 0b100), (met, 0, 0b1_0000), (met, 2, 0b10)]
    {
        let mut other = good.clone();
        other[word + pixel * head.layout.pixel_bytes() as usize + 1] ^= bits;
        let error = read(&sealed(other)).unwrap_err();
        assert!(error.to_string().contains("the samples of its layers do not match"), "{error}");
    }
    let lists = |list: &str| Head { notes: Identity::default().with("entities", list), ..head.clone() };
    assert!(lists(r#"["a"]"#).mattes().is_some() && lists("a").mattes().is_none());
}

#[test]
fn films_with_other_layers_or_other_names_belong_to_other_renders() {
    let head = layered(2, 1);
    let said = |other: &Head| head.difference(other).map(|difference| difference.to_string());
    assert_eq!(said(&head), None);
    let other = super::head(2, 1);
    assert_eq!(said(&other).unwrap(), "its set of layers is none, not albedo,depth,crypto-entity");
    let other = Head { notes: head.notes.clone().with("tone", "srgb"), ..head.clone() };
    assert_eq!(said(&other), None);
    let notes = super::head(2, 1).notes.with("entities", r#"["a","c"]"#);
    let other = Head { notes, ..head.clone() };
    assert_eq!(
        said(&other).unwrap(),
        "its scene differs in the names of entities, which its mattes refer to"
    );
}
