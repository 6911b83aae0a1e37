//! Compression of film files.
//!
//! The words of a film are integers whose high bytes are equal in all pixels and whose low bytes are noise. A block of
//! pixels is stored byte by byte of a pixel: a *plane* holds the same byte of all of them. A plane of equal bytes is
//! stored as one, a noisy one as it is, and the others are compressed by Deflate.

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use std::io::{self, ErrorKind, Read, Write};

/// The most bytes of a block.
const BLOCK: usize = 1 << 20;

/// The most bytes of a pixel: with all sums and layers it has fewer.
const LONGEST_RECORD: usize = 1 << 12;

/// Kinds of planes.
const EQUAL: u8 = 0;
const PLAIN: u8 = 1;
const DEFLATED: u8 = 2;

/// Compresses a film file of which the first `head` bytes are no pixels, and each pixel has `record` bytes.
pub(super) fn pack(mut film: impl Read, head: usize, record: usize, mut out: impl Write) -> io::Result<()> {
    let mut block = Vec::new();
    film.by_ref().take(head as u64).read_to_end(&mut block)?;
    for part in block.chunks(BLOCK) {
        pack_block(part, 1, &mut out)?;
    }
    let record = record.clamp(1, LONGEST_RECORD);
    let size = BLOCK / record * record;
    loop {
        block.clear();
        if film.by_ref().take(size as u64).read_to_end(&mut block)? == 0 {
            return Ok(());
        }
        pack_block(&block, record, &mut out)?;
    }
}

fn pack_block(block: &[u8], record: usize, out: &mut impl Write) -> io::Result<()> {
    out.write_all(&(block.len() as u32).to_le_bytes())?;
    out.write_all(&(record as u32).to_le_bytes())?;
    let mut plane = Vec::with_capacity(block.len().div_ceil(record));
    for at in 0..record.min(block.len()) {
        plane.clear();
        plane.extend(block.iter().skip(at).step_by(record));
        if plane.iter().all(|byte| *byte == plane[0]) {
            out.write_all(&[EQUAL, plane[0]])?;
        } else if is_noise(&plane) {
            out.write_all(&[PLAIN])?;
            out.write_all(&plane)?;
        } else {
            let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(&plane)?;
            let deflated = encoder.finish()?;
            out.write_all(&[DEFLATED])?;
            out.write_all(&(deflated.len() as u32).to_le_bytes())?;
            out.write_all(&deflated)?;
        }
    }
    Ok(())
}

/// Whether bytes have more than 7.5 bits each, so that Deflate would only cost time.
fn is_noise(plane: &[u8]) -> bool {
    let mut counts = [0_u32; 256];
    plane.iter().for_each(|byte| counts[usize::from(*byte)] += 1);
    let len = plane.len() as f64;
    let bits = |count: &u32| f64::from(*count) / len * libm::log2(len / f64::from(*count));
    counts.iter().filter(|count| **count > 0).map(bits).sum::<f64>() > 7.5
}

/// Restores a film file of exactly `bytes` bytes. Memory is bounded by a block, whatever is read.
pub(super) fn unpack(mut packed: impl Read, bytes: u64, mut out: impl Write) -> io::Result<()> {
    let wrong =
        |what: &str| io::Error::new(ErrorKind::InvalidData, format!("a compressed film is damaged: {what}"));
    let mut left = bytes;
    while left > 0 {
        let [len, record] = [read_word(&mut packed)? as usize, read_word(&mut packed)? as usize];
        if !(1..=BLOCK).contains(&len) || !(1..=LONGEST_RECORD).contains(&record) || len as u64 > left {
            return Err(wrong("a block has an impossible size"));
        }
        let mut block = vec![0; len];
        for at in 0..record.min(len) {
            let plane_len = (len - at).div_ceil(record);
            let mut kind = [0];
            packed.read_exact(&mut kind)?;
            let plane = match kind[0] {
                EQUAL => {
                    let mut byte = [0];
                    packed.read_exact(&mut byte)?;
                    vec![byte[0]; plane_len]
                }
                PLAIN => {
                    let mut plane = vec![0; plane_len];
                    packed.read_exact(&mut plane)?;
                    plane
                }
                DEFLATED => {
                    let deflated = u64::from(read_word(&mut packed)?);
                    let mut source = packed.by_ref().take(deflated);
                    let mut plane = Vec::with_capacity(plane_len);
                    DeflateDecoder::new(&mut source).take(plane_len as u64 + 1).read_to_end(&mut plane)?;
                    // The decoder may stop before the end of its bytes.
                    io::copy(&mut source, &mut io::sink())?;
                    plane
                }
                _ => return Err(wrong("a plane has an unknown kind")),
            };
            if plane.len() != plane_len {
                return Err(wrong("a plane has another length"));
            }
            block.iter_mut().skip(at).step_by(record).zip(plane).for_each(|(to, byte)| *to = byte);
        }
        out.write_all(&block)?;
        left -= len as u64;
    }
    match packed.read(&mut [0])? {
        0 => Ok(()),
        _ => Err(wrong("bytes follow it")),
    }
}

fn read_word(from: &mut impl Read) -> io::Result<u32> {
    let mut bytes = [0; 4];
    from.read_exact(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use rand::RngExt;

    /// Records of 64 bytes: some equal, some few, some noise.
    fn film(pixels: usize) -> Vec<u8> {
        let stream = &mut Stream::new(1, 2, 3);
        let mut bytes = vec![7; 100];
        for _ in 0..pixels {
            bytes.extend((0..64).map(|at| match at {
                0..20 => stream.random::<u8>(),
                20..30 => stream.random::<u8>() / 64,
                _ => 0,
            }));
        }
        bytes.extend([1, 2, 3]);
        bytes
    }

    #[test]
    fn films_are_restored_and_smaller() {
        for pixels in [0, 1, 5000, 40_000] {
            let film = film(pixels);
            let mut packed = Vec::new();
            pack(&film[..], 100, 64, &mut packed).unwrap();
            let mut out = Vec::new();
            unpack(&packed[..], film.len() as u64, &mut out).unwrap();
            assert!(out == film, "{pixels}");
            if pixels > 1000 {
                assert!(packed.len() * 5 < film.len() * 2, "{} of {}", packed.len(), film.len());
            }
        }
    }

    #[test]
    fn damage_is_an_error() {
        let film = film(300);
        let mut packed = Vec::new();
        pack(&film[..], 100, 64, &mut packed).unwrap();
        let fails = |packed: &[u8], bytes: u64| unpack(packed, bytes, io::sink()).is_err();
        let bytes = film.len() as u64;
        assert!(fails(&packed, bytes + 1) && fails(&packed, bytes - 1));
        assert!(fails(&packed[..packed.len() - 1], bytes) && fails(&[&packed[..], b"x"].concat(), bytes));
        for place in 0..40 {
            let mut spoiled = packed.clone();
            spoiled[place] ^= 0x55;
            // Whatever is read, it ends and stays within its limits.
            let mut out = Vec::new();
            let _ = unpack(&spoiled[..], bytes, &mut out);
            assert!(out.len() <= film.len());
        }
    }
}
