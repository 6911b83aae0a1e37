use super::*;
use crate::film::{Identity, MAX_RADIANCE, PixelSums};
use crate::film::{Splatter, Weights};
use crate::sampling::{Contribution, Sample};
use crate::scene::Filter;
use std::io::Cursor;

mod layers;

fn head(width: u32, height: u32) -> Head {
    let identity = Identity::default().with("scene", "5eed").with("seed", 7);
    let notes = Identity::default().with("exposure", 1.5).with("asked", "10..20");
    Head { layout: Layout::plain(width, height), identity, notes }
}

/// A film whose pixels have between `least` and `most` samples, bright and rejected ones among them.
fn film(width: u32, height: u32, least: u32, most: u32) -> Film {
    let mut film = Film::new(width, height).unwrap();
    for pixel in 0..(width * height) as usize {
        for i in 0..least + (pixel as u32) % (most - least + 1) {
            let x = (i + 1) as f32;
            let radiance = match i % 4 {
                0 => [x, 0.1 / x, 1e-9],
                1 => [MAX_RADIANCE, x * 1e6, 0.0],
                2 => [-1.0, 0.0, 0.0],
                _ => [f32::MIN_POSITIVE; 3],
            };
            let _ = film.add_sample(pixel, radiance);
        }
    }
    film
}

fn file(head: &Head, film: &Film) -> Vec<u8> {
    let [least, most] = film.seen_range();
    write(Vec::new(), head, film, &SampleRanges::prefix(10..20, least, most), None).unwrap()
}

fn read(bytes: &[u8]) -> Result<(Head, SampleRanges, Film), FilmFileError> {
    let reader = FilmReader::open(Cursor::new(bytes))?;
    let (head, sample_ranges) = (reader.head().clone(), reader.sample_ranges().clone());
    Ok((head, sample_ranges, reader.read()?))
}

#[test]
fn a_film_is_read_back() {
    for (width, height, least, most) in [(1, 1, 0, 0), (3, 2, 4, 4), (7, 5, 2, 9), (300, 200, 1, 3)] {
        let (head, film) = (head(width, height), film(width, height, least, most));
        let (read_head, sample_ranges, read_film) = read(&file(&head, &film)).unwrap();
        assert!(read_head == head && read_film == film);
        assert_eq!(sample_ranges, SampleRanges::prefix(10..20, least.into(), film.seen_range()[1]));
        assert_eq!(read_head.asked(), Some(10..20));
    }
}

#[test]
fn weighted_films_and_their_shown_parts_are_read_back() {
    let shown = Rectangle { x: 1, y: 0, width: 2, height: 2 };
    let layout = Layout { weighted: true, shown, ..Layout::plain(4, 3) };
    let head = Head { layout, ..head(4, 3) };
    let mut film = Film::with_layout(layout).unwrap();
    let splatter = Splatter::new(Weights::new(Filter::Lanczos { radius: 3.0 }), [0, 0]);
    for (i, x) in (0..12).zip([0.5, 3.7, 1.0, 2.2].into_iter().cycle()) {
        let radiance = [MAX_RADIANCE, x, 1e-9];
        let sample = Sample { pixel: i, sample: 0, x, y: 1.6, radiance };
        film.splat(&splatter, i as usize, &sample).unwrap();
    }
    let bytes = file(&head, &film);
    let (read_head, _, read_film) = read(&bytes).unwrap();
    assert!(read_head == head && read_film == film);
    let picture = film.picture();
    assert_eq!([picture.width, picture.height, picture.rgb.len() as u32], [2, 2, 4]);
    assert_eq!(picture.rgb[3], film.mean(6));
    // The same sums mean another picture if samples have no weights, and none if the part lies outside the film.
    let mut other = Film::new(4, 3).unwrap();
    assert!(matches!(
        FilmReader::open(Cursor::new(&bytes)).unwrap().add_to(&mut other),
        Err(FilmFileError::Contradiction(_))
    ));
    for (at, bad) in [(24, 2), (24, 6), (25, 16), (28, 3), (36, 0), (36, 9), (40, 4), (44, 1), (48, 1)] {
        let mut bytes = bytes.clone();
        bytes[at] = bad;
        assert!(matches!(read(&bytes), Err(FilmFileError::Damaged)), "{bad} at {at}");
    }
}

#[test]
fn films_with_a_variance_are_read_back_and_can_be_added_to_films_without() {
    let layout = Layout { weighted: true, spreads: true, ..Layout::plain(4, 3) };
    let of = |seed: u32| {
        let mut film = Film::with_layout(layout).unwrap();
        let splatter = Splatter::new(Weights::new(Filter::Tent { radius: 1.0 }), [0, 0]).with_spreads(true);
        for i in 0..12 {
            let (x, y) = ((i % 4) as f32 + 0.3, (i / 4) as f32 + 0.6);
            let sample = Sample { pixel: i, sample: 0, x, y, radiance: [3.0, (i + seed) as f32, 1e-5] };
            film.splat(&splatter, i as usize, &sample).unwrap();
        }
        film
    };
    let (head, one, other) = (Head { layout, ..head(4, 3) }, of(0), of(5));
    let bytes = file(&head, &one);
    assert_eq!((bytes[8], bytes[24]), (4, 3));
    let (read_head, _, read_film) = read(&bytes).unwrap();
    assert!(read_head == head && read_film == one);
    let (pixel, text) = (one.bytes(5..6), START_BYTES as usize + head.text().len());
    assert_eq!(pixel.len(), 128);
    assert_eq!(bytes[text + 5 * 128..text + 6 * 128], pixel);
    let seen = FilmReader::open(Cursor::new(&bytes)).unwrap();
    let mut both = other.clone();
    seen.add_to(&mut both).unwrap();
    let mut expected = one.clone();
    FilmReader::open(Cursor::new(&file(&head, &other))).unwrap().add_to(&mut expected).unwrap();
    assert!(both == expected && both != one && both.variance(5) > 0.0);
    // A film without sums for a variance takes the rest; a film with them rejects a file without.
    let mut plain = Film::with_layout(layout.without_spreads()).unwrap();
    FilmReader::open(Cursor::new(&bytes)).unwrap().add_to(&mut plain).unwrap();
    assert!(plain.picture() == one.picture() && plain.variance(5) == 0.0);
    let plain_file = file(&Head { layout: plain.layout(), ..head.clone() }, &plain);
    assert_eq!((plain_file[8], plain_file[24], bytes.len() - plain_file.len()), (4, 1, 12 * 64));
    assert!(matches!(
        FilmReader::open(Cursor::new(&plain_file)).unwrap().add_to(&mut both),
        Err(FilmFileError::Contradiction(_))
    ));
    for (at, bad) in [(24, 1), (24, 2), (24, 0)] {
        let mut bytes = bytes.clone();
        bytes[at] = bad;
        assert!(matches!(read(&bytes), Err(FilmFileError::Damaged | FilmFileError::Length { .. })), "{at}");
    }
    let mut flipped = bytes.clone();
    flipped[text + 5 * 128 + 70] ^= 4;
    assert!(matches!(read(&flipped), Err(FilmFileError::Damaged)));
}

#[test]
fn the_layout_is_the_documented_one() {
    let (head, mut film) = (head(2, 1), Film::new(2, 1).unwrap());
    film.add_sample(1, [2.0, 0.5, 1.0]).unwrap();
    film.add_sample(1, [f32::NAN, 0.0, 0.0]).unwrap_err();
    let file = file(&head, &film);
    let text = "scene: 5eed\nseed: 7\n\nexposure: 1.5\nasked: 10..20\n";
    let mut expected = b"\x89FILM\r\n\x1a".to_vec();
    // The version, bytes of text, the size, no weights, the shown part, and no light image.
    for word in [4, text.len() as u32, 2, 1, 0, 0, 0, 2, 1, 0, 0] {
        expected.extend(word.to_le_bytes());
    }
    expected.extend(text.as_bytes());
    expected.extend([0; 64]);
    let squares = (4.0 + 0.25 + 1.0) * 4_294_967_296.0;
    for word in [2 << 32, 1 << 31, 1 << 32, squares as u64, 0, 1_u64] {
        expected.extend(word.to_le_bytes());
    }
    expected.extend([0; 12]);
    // Rejected samples; then no whole range, the open one, and no milestone.
    for word in [1_u32, 0, 10, 20, 0] {
        expected.extend(word.to_le_bytes());
    }
    expected.extend((-1.0_f64).to_le_bytes());
    assert_eq!(file[..file.len() - 32], expected);
    assert_eq!(file[file.len() - 32..], Sha256::digest(&expected)[..]);
}

#[test]
fn light_images_are_read_back_in_the_documented_layout_and_added_up() {
    let weights = Weights::new(Filter::Box { radius: 0.5 });
    let layout = Layout { light: Some(LightScale::new(20, &weights)), ..Layout::plain(2, 1) };
    let (head, splatter) = (Head { layout, ..head(2, 1) }, Splatter::new(weights, [0, 0]));
    let of = |radiance: f32| {
        let mut film = Film::with_layout(layout).unwrap();
        film.add_sample(0, [1.0; 3]).unwrap();
        film.add_sample(1, [1.0; 3]).unwrap();
        let all = [(1.5, [radiance, 0.25, 0.0]), (7.0, [1.0; 3]), (1.5, [1.0, -1.0, 0.0])];
        for (x, radiance) in all {
            let contribution = Contribution { pixel: 0, sample: 0, x, y: 0.5, radiance };
            let _ = film.contribute(&splatter, 0, &contribution);
        }
        film
    };
    let (one, other) = (of(2.0), of(7.0));
    let bytes = file(&head, &one);
    assert_eq!((bytes[8], bytes[24], &bytes[44..52]), (4, 4, &[20, 0, 0, 0, 0, 0, 0, 128][..]));
    let (read_head, _, read_film) = read(&bytes).unwrap();
    assert!(read_head == head && read_film == one);
    // After the words of each pixel: three sums, then rejected contributions and those that reach no pixel.
    let first = START_BYTES as usize + head.text().len();
    let light = |pixel: usize| &bytes[first + 128 * pixel + 64..][..64];
    assert_eq!(light(0), [[0; 48].as_slice(), &[1, 0, 0, 0, 0, 0, 0, 0], &[1, 0, 0, 0, 0, 0, 0, 0]].concat());
    let sums = [2_i128 << 48, 1 << 46, 0].map(i128::to_le_bytes);
    assert_eq!(light(1), [sums.as_flattened(), &[0; 16]].concat());
    let mut both = other.clone();
    FilmReader::open(Cursor::new(&bytes)).unwrap().add_to(&mut both).unwrap();
    let mut expected = one.clone();
    FilmReader::open(Cursor::new(&file(&head, &other))).unwrap().add_to(&mut expected).unwrap();
    assert!(both == expected && both.lost_contributions() == [2, 2] && both.rejected() == 2);
    // Four samples of a film of twenty pixels: a factor of nine times five.
    assert_eq!((both.picture().rgb[1], both.picture().rgb[0]), ([46.0, 3.5, 1.0], [1.0; 3]));
    let mut plain = Film::new(2, 1).unwrap();
    let added = FilmReader::open(Cursor::new(&bytes)).unwrap().add_to(&mut plain);
    assert!(matches!(added, Err(FilmFileError::Contradiction(_))));
    // Fewer pixels than the film has, an integral of zero, and no light image despite a light scale.
    for (at, bad) in [(44, 1), (51, 0), (24, 0)] {
        let mut bytes = bytes.clone();
        bytes[at] = bad;
        assert!(matches!(read(&bytes), Err(FilmFileError::Damaged)), "{bad} at {at}");
    }
    let mut bad = bytes.clone();
    for bit in 8 * first..8 * bytes.len() {
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&bad).is_err(), "bit {bit} of {}", 8 * bytes.len());
        bad[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn any_flipped_bit_is_refused() {
    let good = file(&head(3, 2), &film(3, 2, 3, 6));
    assert!(read(&good).is_ok());
    let mut bad = good.clone();
    for bit in 0..8 * good.len() {
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&bad).is_err(), "bit {bit} of {}", 8 * good.len());
        bad[bit / 8] ^= 1 << (bit % 8);
    }
    assert_eq!(bad, good);
}

#[test]
fn milestones_are_read_back_and_covered_by_the_digest() {
    let (head, film) = (head(3, 2), film(3, 2, 9, 12));
    for error in [None, Some(0.125)] {
        let picture = Arc::new(Picture { rgb: vec![[1.0, -0.0, 1e-30]; 6], ..film.picture() });
        let milestone = Milestone { samples: 8, error, picture, plan: None };
        let sample_ranges = SampleRanges::prefix(0..20, 9, 12);
        let good = write(Vec::new(), &head, &film, &sample_ranges, Some(&milestone)).unwrap();
        let reader = FilmReader::open(Cursor::new(&good)).unwrap();
        assert_eq!(reader.milestone(), Some(&milestone));
        assert!(reader.read().unwrap() == film);
        let mut bad = good.clone();
        for bit in 8 * (good.len() - 32 - 72 - 8 - 24)..8 * good.len() {
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(read(&bad).is_err(), "bit {bit} of {}", 8 * good.len());
            bad[bit / 8] ^= 1 << (bit % 8);
        }
        assert!(read(&good[..good.len() - 12]).is_err());
        // A picture of another size does not belong to this film.
        let strange = Milestone {
            picture: Arc::new(Picture { width: 1, height: 1, rgb: vec![[0.0; 3]] }),
            ..milestone
        };
        assert!(write(Vec::new(), &head, &film, &sample_ranges, Some(&strange)).is_err());
    }
}

#[test]
fn plans_are_read_back_and_covered_by_the_digest() {
    let film = film(3, 2, 9, 12);
    let plain = head(3, 2);
    let planned = Head { identity: plain.identity.clone().with("adaptive", "noise 0.01"), ..plain.clone() };
    let milestone = |plan: Option<AdaptivePlan>| {
        let plan = plan.map(Arc::new);
        Milestone { samples: 8, error: Some(0.5), picture: Arc::new(film.picture()), plan }
    };
    let plan = AdaptivePlan { ends: vec![8, 16, 8, 16, 16, 4], stopped: 0.375 };
    let sample_ranges = SampleRanges::prefix(0..20, 9, 12);
    let with_plan = milestone(Some(plan.clone()));
    let good = write(Vec::new(), &planned, &film, &sample_ranges, Some(&with_plan)).unwrap();
    let reader = FilmReader::open(Cursor::new(&good)).unwrap();
    assert_eq!(reader.milestone(), Some(&with_plan));
    assert!(reader.read().unwrap() == film);
    let mut bad = good.clone();
    for bit in 8 * (good.len() - 32 - 24 - 8)..8 * good.len() {
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&bad).is_err(), "bit {bit} of {}", 8 * good.len());
        bad[bit / 8] ^= 1 << (bit % 8);
    }
    for length in good.len() - 80..good.len() {
        assert!(read(&good[..length]).is_err());
    }
    // A plan where none belongs, none where one belongs, and a plan of another size.
    let short = AdaptivePlan { ends: vec![8; 5], ..plan.clone() };
    for (head, plan) in [(&plain, Some(plan)), (&planned, None), (&planned, Some(short))] {
        assert!(write(Vec::new(), head, &film, &sample_ranges, Some(&milestone(plan))).is_err());
    }
    // A plan covers every pixel of a film that is shown as a whole.
    let mut part = write(Vec::new(), &planned, &film, &sample_ranges, Some(&with_plan)).unwrap();
    part[36..40].copy_from_slice(&u32::to_le_bytes(1));
    let error = FilmReader::open(Cursor::new(&sealed(part))).map(|_| ()).unwrap_err();
    assert!(matches!(error, FilmFileError::Contradiction(_)), "{error}");
    // The first milestone has no error estimate and no plan.
    let first = Milestone { error: None, ..milestone(None) };
    let good = write(Vec::new(), &planned, &film, &sample_ranges, Some(&first)).unwrap();
    assert_eq!(FilmReader::open(Cursor::new(&good)).unwrap().milestone(), Some(&first));
}

#[test]
fn any_other_length_is_refused() {
    let good = file(&head(3, 2), &film(3, 2, 3, 6));
    for length in 0..good.len() {
        let error = read(&good[..length]).err().unwrap_or_else(|| panic!("{length} bytes are accepted"));
        let known = matches!(error, FilmFileError::NotAFilm | FilmFileError::Length { .. });
        assert!(known, "{length} bytes: {error}");
    }
    for more in [1, 8, 1000] {
        let long = [&good[..], &vec![0; more]].concat();
        assert!(matches!(read(&long), Err(FilmFileError::Length { .. })), "{more} bytes more");
    }
}

/// The bytes with a valid digest.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 32;
    let digest = Sha256::digest(&bytes[..end]);
    bytes[end..].copy_from_slice(&digest);
    bytes
}

#[test]
fn impossible_sizes_are_refused_before_memory_is_allocated() {
    let good = file(&head(3, 2), &film(3, 2, 1, 1));
    for (width, height) in [(u32::MAX, u32::MAX), (1 << 31, 2), (65_536, 65_536)] {
        let mut large = good.clone();
        large[16..20].copy_from_slice(&u32::to_le_bytes(width));
        large[20..24].copy_from_slice(&u32::to_le_bytes(height));
        assert!(matches!(read(&sealed(large)), Err(FilmFileError::Length { .. })));
    }
    let mut many_ranges = good.clone();
    let at = good.len() - 32 - 8 - 24;
    many_ranges[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(read(&sealed(many_ranges)), Err(FilmFileError::Length { .. })));
    let mut long_text = good.clone();
    long_text[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(read(&sealed(long_text)).is_err());
}

#[test]
fn files_of_other_programs_and_versions_are_recognised() {
    let good = file(&head(3, 2), &film(3, 2, 1, 1));
    for (version, reason) in
        [(2, "finish it with the version of stride that began it"), (3, "light image"), (5, "newer")]
    {
        let mut other = good.clone();
        other[8] = version;
        let said = read(&sealed(other)).unwrap_err().to_string();
        assert!(said.contains(&format!("version {version}")) && said.contains("only version 4"), "{said}");
        assert!(said.contains(reason), "{said}");
    }
    assert!(matches!(read(b"\x89PNG\r\n\x1a\n and so on"), Err(FilmFileError::NotAFilm)));
    // A valid digest over a wrong count.
    let mut liar = good.clone();
    let count = good.len() - 32 - 8 - 24 - 64 + 40;
    liar[count] += 1;
    assert!(matches!(read(&sealed(liar)), Err(FilmFileError::Contradiction(_))));
    assert!(read(&sealed(good)).is_ok());
}

#[test]
fn films_of_disjoint_samples_add_up_to_the_whole() {
    let size = (7, 5);
    let parts: Vec<Film> = (0..5).map(|i| film(size.0, size.1, i, i + 3)).collect();
    let mut whole = Film::new(size.0, size.1).unwrap();
    for pixel in 0..35 {
        // Added separately, as an independent copy of `film`.
        for i in 0..5_u32 {
            for n in 0..i + pixel % 4 {
                let x = (n + 1) as f32;
                let _ = whole.add_sample(
                    pixel as usize,
                    match n % 4 {
                        0 => [x, 0.1 / x, 1e-9],
                        1 => [MAX_RADIANCE, x * 1e6, 0.0],
                        2 => [-1.0, 0.0, 0.0],
                        _ => [f32::MIN_POSITIVE; 3],
                    },
                );
            }
        }
    }
    for turn in 0..5 {
        let mut sum = Film::new(size.0, size.1).unwrap();
        for part in parts.iter().cycle().skip(turn).take(5) {
            let bytes = file(&head(size.0, size.1), part);
            FilmReader::open(Cursor::new(bytes)).unwrap().add_to(&mut sum).unwrap();
        }
        assert!(sum == whole);
    }
    let mut other = Film::new(5, 7).unwrap();
    let reader = FilmReader::open(Cursor::new(file(&head(7, 5), &parts[0]))).unwrap();
    assert!(matches!(reader.add_to(&mut other), Err(FilmFileError::Size { .. })));
}

#[test]
fn sums_below_zero_and_beyond_64_bits_are_read_back() {
    let mut film = Film::new(1, 1).unwrap();
    let sums = PixelSums { rgb: [-5, i64::MIN, i64::MAX], squares: i64::MAX, count: 3, rejected: 0 };
    (0..4).for_each(|_| film.add_sums(0, &sums));
    let mut twice = film.clone();
    (0..4).for_each(|_| twice.add_sums(0, &sums));
    let bytes = write(Vec::new(), &head(1, 1), &film, &SampleRanges::prefix(0..12, 12, 12), None).unwrap();
    assert!(read(&bytes).unwrap().2 == film);
    FilmReader::open(Cursor::new(bytes)).unwrap().add_to(&mut film).unwrap();
    assert!(film == twice);
}

#[test]
fn a_contradictory_film_is_not_written() {
    let film = film(3, 2, 1, 4);
    assert!(write(Vec::new(), &head(3, 2), &film, &SampleRanges::prefix(0..9, 4, 4), None).is_err());
    let mut writer = FilmWriter::new(Vec::new(), &head(3, 2)).unwrap();
    assert!(!writer.pixels(&film.bytes(0..5)).unwrap());
    let sample_ranges = SampleRanges::prefix(0..9, 1, 4);
    assert!(writer.pixels(&film.bytes(0..2)).is_err(), "one pixel too many");
    assert!(writer.finish(&sample_ranges, None).is_err());
}

/// A reader would report it as damaged.
#[test]
fn a_film_with_more_text_than_readers_accept_is_not_written() {
    let (head, film) = (head(2, 2), film(2, 2, 1, 1));
    let with = |length: usize| {
        let notes = Identity::default().with("parts", "a".repeat(length));
        Head { notes, ..head.clone() }
    };
    let rest = with(0).text().len();
    let longest = with(LONGEST_TEXT as usize - rest);
    assert!(read(&file(&longest, &film)).unwrap().0 == longest);
    let longer = with(LONGEST_TEXT as usize - rest + 1);
    let mut out = Vec::new();
    let error = write(&mut out, &longer, &film, &SampleRanges::prefix(10..20, 1, 1), None).unwrap_err();
    assert!(error.to_string().ends_with("at most 16777216"), "{error}");
    assert!(out.is_empty());
    // The message names the layers whose names take the space.
    let named = |names: &[&str]| {
        let notes = names.iter().fold(longer.notes.clone(), |notes, name| notes.with(name, "[]"));
        Head { notes, ..head.clone() }.check().unwrap_err().to_string()
    };
    assert!(
        named(&["materials"]).ends_with("; leave out the layer crypto-material, whose names take most of it")
    );
    assert!(
        named(&["entities", "materials"])
            .contains("; leave out the layers crypto-entity and crypto-material,")
    );
}

#[test]
fn a_film_has_at_most_64_facts_and_64_notes() {
    let (head, film) = (head(2, 2), film(2, 2, 1, 1));
    let lines = |count: usize| {
        let line = |lines: Identity, i| lines.with(&format!("name {i}"), i);
        (0..count).fold(Identity::default(), line)
    };
    let with = |facts, notes| Head { identity: lines(facts), notes: lines(notes), ..head.clone() };
    assert!(read(&file(&with(64, 64), &film)).unwrap().0 == with(64, 64));
    for more in [with(65, 64), with(64, 65)] {
        assert!(matches!(read(&file(&more, &film)), Err(FilmFileError::Damaged)));
    }
}
