//! Serialized meshes, versions 3 and 4: the format of Mitsuba's exporters.
//!
//! A file is a sequence of meshes, a table of their offsets, and their number. Each mesh starts with the bytes 1c 04
//! and the version, followed by a zlib stream. The stream contains flags, a name from version 4 on, the numbers of
//! vertices and triangles, and arrays of positions, normals, uv, colours and corners.

use super::limits::MOST_UNPACKED;
use crate::scene::description::Mesh;
use crate::texture::access;
use miniz_oxide::inflate::stream::{InflateState, inflate};
use miniz_oxide::{DataFormat, MZError, MZFlush, MZStatus};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

const MAGIC: u16 = 0x041c;
const HAS_NORMALS: u32 = 1;
const HAS_UV: u32 = 2;
const HAS_COLOURS: u32 = 8;
const DOUBLE: u32 = 0x2000;

/// The remaining bytes of a mesh.
struct Bytes<'b>(&'b [u8]);

impl<'b> Bytes<'b> {
    fn take(&mut self, count: usize) -> Result<&'b [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("it ends in the middle of its data")?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// `count` rows of `N` numbers.
    fn rows<const N: usize>(&mut self, count: usize, double: bool) -> Result<Vec<[f32; N]>, String> {
        let size = if double { 8 } else { 4 };
        let bytes = self.take(count.checked_mul(N * size).ok_or("it has too many vertices")?)?;
        let number = |bytes: &[u8]| match *bytes {
            [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]) as f32,
            _ => f32::NAN,
        };
        let row = |bytes: &[u8]| {
            let mut row = [0.0; N];
            row.iter_mut().zip(bytes.chunks_exact(size)).for_each(|(x, bytes)| *x = number(bytes));
            row
        };
        Ok(bytes.chunks_exact(N * size).map(row).collect())
    }
}

/// The meshes that were read. Of a file only the bytes of a mesh are read, and each mesh once.
#[derive(Debug, Default)]
pub(super) struct Cache {
    /// The results, by path and offset in the file; also errors.
    meshes: HashMap<(Arc<Path>, u64), Result<Arc<Mesh>, String>>,
    /// The number of meshes that were decompressed.
    #[cfg(test)]
    unpacked: usize,
}

impl Cache {
    /// The mesh of a file with an index, from 0. Its decompressed size is subtracted from `room`.
    pub(super) fn get(
        &mut self,
        path: &Arc<Path>,
        number: usize,
        room: &mut u64,
    ) -> Result<Arc<Mesh>, String> {
        if !path.is_file() {
            return Err("this is not a file".into());
        }
        let opened = access::opening(path).and_then(|()| File::open(path));
        let mut file = BufReader::new(opened.map_err(|error| unreadable(&error))?);
        let (version, place) = place(&mut file, number)?;
        let key = (Arc::clone(path), place);
        if let Some(known) = self.meshes.get(&key) {
            return known.clone();
        }
        #[cfg(test)]
        {
            self.unpacked += 1;
        }
        let unpacked = unpack(&mut file, place, room);
        let mesh = unpacked.and_then(|unpacked| mesh(&unpacked, version)).map(Arc::new);
        self.meshes.insert(key, mesh.clone());
        mesh
    }
}

/// The mesh with an index in the bytes of a file.
pub fn parse(file: &[u8], number: usize) -> Result<Mesh, String> {
    let mut file = Cursor::new(file);
    let (version, place) = place(&mut file, number)?;
    mesh(&unpack(&mut file, place, &mut { MOST_UNPACKED })?, version)
}

fn unreadable(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => "it ends in the middle of its data".into(),
        _ => format!("cannot be read: {error}"),
    }
}

/// The next bytes of a file, if there are enough.
fn next<const N: usize>(file: &mut impl Read) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes).map_err(|error| unreadable(&error))?;
    Ok(bytes)
}

/// The version of a file, and the offset of a mesh in it.
fn place(file: &mut (impl Read + Seek), number: usize) -> Result<(u16, u64), String> {
    let version = match [next(file), next(file)].map(|bytes| bytes.map(u16::from_le_bytes)) {
        [Ok(MAGIC), Ok(version @ (3 | 4))] => version,
        [Ok(MAGIC), Ok(version)] => return Err(format!("version {version} is not read, only 3 and 4")),
        _ => return Err("this is not a serialized mesh".into()),
    };
    if number == 0 {
        return Ok((version, 0));
    }
    let cut = |_| "the list of meshes at its end is cut off".to_owned();
    // From the table at the end of the file.
    file.seek(SeekFrom::End(-4)).map_err(cut)?;
    let count = u32::from_le_bytes(next(file)?);
    let Some(back) = u64::from(count).checked_sub(number as u64).filter(|&back| back > 0) else {
        return Err(format!("it has {count} meshes, and mesh {number} is requested (counted from 0)"));
    };
    let size = if version == 3 { 4 } else { 8 };
    // At most 2³⁵ bytes.
    file.seek(SeekFrom::End(-((back * size + 4) as i64))).map_err(cut)?;
    Ok((
        version,
        if version == 3 { u32::from_le_bytes(next(file)?).into() } else { u64::from_le_bytes(next(file)?) },
    ))
}

/// The decompressed data after the four bytes at an offset. Its size is subtracted from `room`.
fn unpack(file: &mut (impl Read + Seek), place: u64, room: &mut u64) -> Result<Vec<u8>, String> {
    let nowhere = || "the offset of a mesh is not in the file".to_owned();
    let length = file.seek(SeekFrom::End(0)).map_err(|error| unreadable(&error))?;
    let start = place.checked_add(4).filter(|&start| start <= length).ok_or_else(nowhere)?;
    file.seek(SeekFrom::Start(start)).map_err(|error| unreadable(&error))?;
    let mut state = InflateState::new_boxed(DataFormat::Zlib);
    let (mut packed, mut chunk, mut unpacked) = (vec![0; 1 << 16], vec![0; 1 << 16], Vec::new());
    loop {
        let filled = file.read(&mut packed).map_err(|error| unreadable(&error))?;
        let mut rest = &packed[..filled];
        // Until the input is consumed and there is no more output.
        loop {
            let step = inflate(&mut state, rest, &mut chunk, MZFlush::None);
            rest = &rest[step.bytes_consumed..];
            *room = room.checked_sub(step.bytes_written as u64).ok_or_else(|| {
                format!("the meshes of this scene are larger than {} GiB, unpacked", MOST_UNPACKED >> 30)
            })?;
            unpacked.extend_from_slice(&chunk[..step.bytes_written]);
            match step.status {
                Ok(MZStatus::StreamEnd) => return Ok(unpacked),
                Ok(_) | Err(MZError::Buf) if filled > 0 => {}
                Ok(_) | Err(MZError::Buf) => {
                    return Err("it cannot be decompressed: it ends too early".into());
                }
                Err(_) => return Err("it cannot be decompressed: it is no data of zlib".into()),
            }
            let is_still = step.bytes_consumed == 0 && step.bytes_written == 0;
            if is_still || rest.is_empty() && step.bytes_written < chunk.len() {
                break;
            }
        }
    }
}

fn mesh(bytes: &[u8], version: u16) -> Result<Mesh, String> {
    let mut bytes = Bytes(bytes);
    let flags = u32::from_le_bytes(bytes.array()?);
    if version >= 4 {
        let end = bytes.0.iter().position(|&byte| byte == 0).ok_or("its name is not terminated")?;
        bytes.take(end + 1)?;
    }
    let [vertices, triangles] = [bytes.array()?, bytes.array()?].map(u64::from_le_bytes);
    let count = |n: u64| {
        let fits = usize::try_from(n).ok().filter(|&n| n <= crate::shape::MOST_TRIANGLES);
        fits.ok_or_else(|| format!("{n} vertices or triangles are too many"))
    };
    let (vertices, triangles) = (count(vertices)?, count(triangles)?);
    let double = flags & DOUBLE != 0;
    let positions = bytes.rows::<3>(vertices, double)?;
    let normals = if flags & HAS_NORMALS != 0 { bytes.rows::<3>(vertices, double)? } else { Vec::new() };
    let uv = if flags & HAS_UV != 0 { bytes.rows::<2>(vertices, double)? } else { Vec::new() };
    if flags & HAS_COLOURS != 0 {
        bytes.rows::<3>(vertices, double)?;
    }
    let corners = bytes.take(triangles.checked_mul(12).ok_or("it has too many triangles")?)?;
    let corner =
        |bytes: &[u8], i: usize| u32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
    let triangles = corners.chunks_exact(12).map(|row| [0, 4, 8].map(|i| corner(row, i))).collect();
    let mesh = Mesh { positions, normals, uv, triangles, ..Mesh::default() };
    mesh.check().map_err(|error| error.to_string())?;
    if !mesh.has_area() {
        return Err("all of its triangles have zero area".into());
    }
    Ok(mesh)
}

#[cfg(test)]
pub(super) use self::tests::example;

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with two meshes.
    pub(in crate::scene::formats::mitsuba) fn example() -> Vec<u8> {
        file(4, &[plain(4, 0), plain(4, DOUBLE)])
    }

    /// A triangle with uv; of version 4 with a name.
    fn plain(version: u16, flags: u32) -> Vec<u8> {
        let mut bytes = (flags | HAS_UV).to_le_bytes().to_vec();
        if version == 4 {
            bytes.extend(b"name\0");
        }
        bytes.extend([3_u64.to_le_bytes(), 1_u64.to_le_bytes()].concat());
        let mut number = |x: f64| match flags & DOUBLE != 0 {
            true => bytes.extend(x.to_le_bytes()),
            false => bytes.extend((x as f32).to_le_bytes()),
        };
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].into_iter().for_each(&mut number);
        [0.0, 0.25, 1.0, 0.0, 0.0, 1.0].into_iter().for_each(&mut number);
        bytes.extend([0_u32, 1, 2].map(u32::to_le_bytes).concat());
        bytes
    }

    /// A file of several meshes.
    fn file(version: u16, meshes: &[Vec<u8>]) -> Vec<u8> {
        let (mut file, mut places) = (Vec::new(), Vec::new());
        for mesh in meshes {
            places.push(file.len());
            file.extend([MAGIC.to_le_bytes(), version.to_le_bytes()].concat());
            file.extend(miniz_oxide::deflate::compress_to_vec_zlib(mesh, 6));
        }
        for place in places {
            match version {
                3 => file.extend((place as u32).to_le_bytes()),
                _ => file.extend((place as u64).to_le_bytes()),
            }
        }
        file.extend((meshes.len() as u32).to_le_bytes());
        file
    }

    #[test]
    fn meshes_of_both_versions_and_precisions_are_read_by_their_numbers() {
        for version in [3, 4] {
            for flags in [0, DOUBLE] {
                let mut other = plain(version, flags);
                let last = other.len() - 12;
                other[last..].copy_from_slice(&[2_u32, 0, 1].map(u32::to_le_bytes).concat());
                let file = file(version, &[plain(version, flags), other]);
                let first = parse(&file, 0).expect("a mesh");
                assert_eq!((first.uv[0], first.positions[2]), ([0.0, 0.25], [0.0, 1.0, 0.0]));
                assert_eq!(first.triangles, [[0, 1, 2]]);
                assert_eq!(parse(&file, 1).expect("a mesh").triangles, [[2, 0, 1]]);
                let message = "it has 2 meshes, and mesh 2 is requested (counted from 0)";
                assert_eq!(parse(&file, 2), Err(message.into()));
            }
        }
    }

    #[test]
    fn a_mesh_is_unpacked_once_and_takes_from_the_room() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, bytes: Vec<u8>| -> Arc<Path> {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).expect("written");
            path.into()
        };
        let path = write("a.serialized", file(4, &[plain(4, 0), plain(4, DOUBLE)]));
        let size = plain(4, 0).len() as u64;
        let (mut cache, mut room) = (Cache::default(), 10 * size);
        let first = cache.get(&path, 0, &mut room).expect("a mesh");
        assert!(Arc::ptr_eq(&first, &cache.get(&path, 0, &mut room).expect("a mesh")));
        assert_eq!((cache.unpacked, room), (1, 9 * size));
        assert!(!Arc::ptr_eq(&first, &cache.get(&path, 1, &mut room).expect("a mesh")));
        // Errors are found only once, too.
        let mut cut = file(4, &[plain(4, 0)]);
        cut.truncate(cut.len() - 30);
        let cut = write("b.serialized", cut);
        for _ in 0..3 {
            let message = "it cannot be decompressed: it ends too early";
            assert_eq!(cache.get(&cut, 0, &mut room), Err(message.into()));
        }
        assert_eq!(cache.unpacked, 3);
        let message = "the meshes of this scene are larger than 4 GiB, unpacked";
        assert_eq!(Cache::default().get(&path, 0, &mut (size - 1)), Err(message.into()));
        assert!(Cache::default().get(&path, 0, &mut { size }).is_ok());
        assert_eq!(cache.get(&folder.path().into(), 0, &mut room), Err("this is not a file".into()));
    }

    /// Two indices with the same offset are one mesh: a table of a million entries would decompress it a million times.
    #[test]
    fn meshes_of_one_place_are_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut bytes = file(3, &[plain(3, 0), plain(3, 0)]);
        let end = bytes.len();
        bytes[end - 8..end - 4].fill(0);
        let path: Arc<Path> = folder.path().join("a.serialized").into();
        std::fs::write(&path, bytes).expect("written");
        let (mut cache, mut room) = (Cache::default(), MOST_UNPACKED);
        let meshes = [0, 1].map(|number| cache.get(&path, number, &mut room).expect("a mesh"));
        assert!(Arc::ptr_eq(&meshes[0], &meshes[1]) && cache.unpacked == 1);
    }

    /// More compressed and decompressed bytes than a chunk holds.
    #[test]
    fn large_meshes_are_unpacked_in_steps() {
        let count = 30_000_u64;
        let mut bytes = HAS_UV.to_le_bytes().to_vec();
        bytes.extend([count.to_le_bytes(), 1_u64.to_le_bytes()].concat());
        let mut state = 1_u32;
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state as f32 / u32::MAX as f32
        };
        (0..count * 5).for_each(|_| bytes.extend(number().to_le_bytes()));
        bytes.extend([0_u32, 1, 29_999].map(u32::to_le_bytes).concat());
        let file = file(3, &[bytes.clone()]);
        assert!(file.len() > 4 << 16, "{}", file.len());
        let mesh = parse(&file, 0).expect("a mesh");
        let last: Vec<u8> = mesh.uv[29_999].iter().flat_map(|x| x.to_le_bytes()).collect();
        assert_eq!(last[..], bytes[bytes.len() - 20..bytes.len() - 12]);
        let mut other = file;
        let middle = other.len() / 2;
        other[middle] ^= 0xff;
        assert!(parse(&other, 0).is_err());
    }

    #[test]
    fn spoiled_files_are_refused() {
        let whole = file(4, &[plain(4, 0)]);
        assert_eq!(parse(b"", 0), Err("this is not a serialized mesh".into()));
        assert_eq!(parse(b"\x1c\x04\x05\0", 0), Err("version 5 is not read, only 3 and 4".into()));
        assert_eq!(parse(&whole[..20], 0), Err("it cannot be decompressed: it ends too early".into()));
        let message = "it has 1 meshes, and mesh 18446744073709551615 is requested (counted from 0)";
        assert_eq!(parse(&whole, usize::MAX), Err(message.into()));
        let mut other = whole.clone();
        other[4] ^= 0xff;
        assert_eq!(parse(&other, 0), Err("it cannot be decompressed: it is no data of zlib".into()));
        let two = file(4, &[plain(4, 0), plain(4, 0)]);
        let mut count = two.clone();
        let end = count.len();
        count[end - 4..].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(parse(&count, 1), Err("the list of meshes at its end is cut off".into()));
        let mut beyond = two;
        beyond[end - 12..end - 4].copy_from_slice(&u64::MAX.to_le_bytes());
        assert_eq!(parse(&beyond, 1), Err("the offset of a mesh is not in the file".into()));
        let cut = plain(4, 0);
        let cut = file(4, &[cut[..cut.len() - 1].to_vec()]);
        assert_eq!(parse(&cut, 0), Err("it ends in the middle of its data".into()));
        let mut many = plain(4, 0);
        many[9..17].copy_from_slice(&u64::MAX.to_le_bytes());
        let many = parse(&file(4, &[many]), 0).unwrap_err();
        assert_eq!(many, "18446744073709551615 vertices or triangles are too many");
        let mut beyond = plain(4, 0);
        let last = beyond.len() - 1;
        beyond[last] = 1;
        assert!(parse(&file(4, &[beyond]), 0).unwrap_err().contains("there are only 3"));
    }
}
