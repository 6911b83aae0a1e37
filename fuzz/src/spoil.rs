//! Mutations of files.

use rand::{Rng, RngExt};
use rand_pcg::Pcg64;
use std::ops::Range;

/// The maximum length of a file.
pub const LONGEST: usize = 1 << 16;

/// Integers near the limits of their types.
const EDGES: [u64; 12] =
    [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 1 << 60, i64::MAX as u64, u64::MAX];

/// Numbers in text that may break arithmetic.
const NUMBERS: [&str; 20] = [
    "nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "-1",
    "1e39",
    "-1e39",
    "1e-39",
    "1e-45",
    "1e19",
    "3.4e38",
    "1e308",
    "1e999",
    "2147483648",
    "-2147483649",
    "4294967295",
    "4294967296",
    "9223372036854775808",
    "18446744073709551616",
];

/// Floats that may break arithmetic.
const FLOATS: [f64; 11] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, 1e38, -1e38, 1e19, 1e-39, 1e-12, 2_147_483_648.0];

/// Mutates `bytes`, with pieces of `other` and the words of a format.
pub fn spoil(bytes: &mut Vec<u8>, other: &[u8], words: &[&str], random: &mut Pcg64) {
    match random.random_range(0..16) {
        0 if !bytes.is_empty() => {
            let at = random.random_range(0..bytes.len());
            bytes[at] = random.next_u32() as u8;
        }
        1 if !bytes.is_empty() => {
            let at = random.random_range(0..bytes.len());
            bytes[at] ^= 1 << random.random_range(0..8);
        }
        2 => bytes.truncate(place(bytes, random)),
        3 => drop(bytes.drain(range(bytes, random))),
        4 => {
            let copy = bytes[range(bytes, random)].to_vec();
            let at = place(bytes, random);
            bytes.splice(at..at, copy);
        }
        5 => {
            let copy = other[range(other, random)].to_vec();
            let at = range(bytes, random);
            bytes.splice(at, copy);
        }
        6 => {
            let edge = pick(&EDGES, random);
            let size = pick(&[1, 2, 4, 8], random);
            let number =
                if random.random() { edge.to_le_bytes() } else { edge.rotate_right(8 * size).to_be_bytes() };
            overwrite(bytes, &number[..size as usize], random);
        }
        7 => {
            let float = pick(&FLOATS, random);
            match random.random_range(0..4) {
                0 => overwrite(bytes, &(float as f32).to_be_bytes(), random),
                1 => overwrite(bytes, &float.to_le_bytes(), random),
                _ => overwrite(bytes, &(float as f32).to_le_bytes(), random),
            }
        }
        8 | 9 => number(bytes, random),
        10 | 11 => pieces(bytes, lines, random),
        12 => pieces(bytes, brackets, random),
        13 => line_ends(bytes, random),
        14 if !words.is_empty() => {
            let word = pick(words, random);
            let at = place(bytes, random);
            bytes.splice(at..at, word.bytes());
        }
        14 => bytes.extend(std::iter::repeat_n(random.next_u32() as u8, random.random_range(0..64))),
        _ if random.random_range(0..8) == 0 => {
            // Repeated up to the maximum length, which finds readers that take quadratic time.
            let at = range(bytes, random);
            let copy = bytes[at.clone()].to_vec();
            let times = (LONGEST - LONGEST.min(bytes.len())) / copy.len().max(1);
            let repeated = copy.repeat(random.random_range(0..=times));
            bytes.splice(at.end..at.end, repeated);
        }
        _ => {}
    }
    bytes.truncate(LONGEST);
}

fn pick<T: Copy>(of: &[T], random: &mut Pcg64) -> T {
    of[random.random_range(0..of.len())]
}

fn place(bytes: &[u8], random: &mut Pcg64) -> usize {
    random.random_range(0..=bytes.len())
}

fn range(bytes: &[u8], random: &mut Pcg64) -> Range<usize> {
    let from = place(bytes, random);
    let most = if random.random_range(0..4) == 0 { bytes.len() } else { 32 };
    from..(from + random.random_range(0..=most)).min(bytes.len())
}

/// Overwrites bytes with a number, mostly at aligned offsets.
fn overwrite(bytes: &mut Vec<u8>, number: &[u8], random: &mut Pcg64) {
    let at = place(bytes, random);
    let at = if random.random() { at / number.len() * number.len() } else { at };
    let end = (at + number.len()).min(bytes.len());
    bytes.splice(at..end, number.iter().copied());
}

/// Replaces a number in text.
fn number(bytes: &mut Vec<u8>, random: &mut Pcg64) {
    let digits: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
    if digits.is_empty() {
        return;
    }
    let at = pick(&digits, random);
    let is_part = |&i: &usize| bytes[i].is_ascii_digit() || b"+-.eE".contains(&bytes[i]);
    let first = (0..at).rev().take_while(is_part).last().unwrap_or(at);
    let end = at + (at..bytes.len()).take_while(is_part).count();
    let number = match random.random_range(0..5) {
        0 => pick(&EDGES, random).to_string(),
        1 => random.random_range(0..10_u32).to_string(),
        2 => format!("-{}", random.random_range(0..1000_u32)),
        _ => pick(&NUMBERS, random).to_owned(),
    };
    bytes.splice(first..end, number.into_bytes());
}

/// Duplicates, removes or exchanges pieces: lines, or brackets with their contents.
fn pieces(bytes: &mut Vec<u8>, find: fn(&[u8], &mut Pcg64) -> Option<Range<usize>>, random: &mut Pcg64) {
    let (Some(one), Some(two)) = (find(bytes, random), find(bytes, random)) else { return };
    let copy = bytes[one.clone()].to_vec();
    match random.random_range(0..4) {
        0 => drop(bytes.drain(one)),
        1 => drop(bytes.splice(two, copy)),
        2 if one.end <= two.start => {
            let other = bytes[two.clone()].to_vec();
            bytes.splice(two, copy);
            bytes.splice(one, other);
        }
        _ => {
            let separator: &[u8] = if copy.ends_with(b"}") || copy.ends_with(b"]") { b"," } else { b"" };
            let times = 1 << random.random_range(0..7);
            let repeated = [separator, &copy].concat().repeat(times);
            bytes.splice(one.end..one.end, repeated);
        }
    }
}

/// A line with its end.
fn lines(bytes: &[u8], random: &mut Pcg64) -> Option<Range<usize>> {
    let starts: Vec<usize> = (0..bytes.len()).filter(|&i| i == 0 || bytes[i - 1] == b'\n').collect();
    let i = random.random_range(0..starts.len().max(1));
    Some(*starts.get(i)?..starts.get(i + 1).copied().unwrap_or(bytes.len()))
}

/// Brackets with their contents.
fn brackets(bytes: &[u8], random: &mut Pcg64) -> Option<Range<usize>> {
    let opening: Vec<usize> = (0..bytes.len()).filter(|&i| b"{[".contains(&bytes[i])).collect();
    let start = *opening.get(random.random_range(0..opening.len().max(1)))?;
    let mut depth = 0_i32;
    let end = (start..bytes.len()).find(|&i| {
        depth += i32::from(b"{[".contains(&bytes[i])) - i32::from(b"}]".contains(&bytes[i]));
        depth == 0
    })?;
    Some(start..end + 1)
}

/// Changes line ends, or adds a byte-order mark.
fn line_ends(bytes: &mut Vec<u8>, random: &mut Pcg64) {
    let end: &[u8] = match random.random_range(0..4) {
        0 => b"\r",
        1 => b"\r\n",
        2 => b" \\\n",
        _ => {
            bytes.splice(0..0, *b"\xef\xbb\xbf");
            return;
        }
    };
    let all = random.random();
    let mut ended = Vec::with_capacity(bytes.len());
    for &byte in &*bytes {
        if byte == b'\n' && (all || random.random_range(0..4) == 0) {
            ended.extend_from_slice(end);
        } else {
            ended.push(byte);
        }
    }
    *bytes = ended;
}
