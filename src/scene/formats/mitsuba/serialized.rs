//! Serialized meshes, versions 3 and 4: the format of Mitsuba's own exporters.
//!
//! A file is one mesh after another, each behind the bytes 1c 04 and the version, compressed with zlib by itself; at the end
//! are the places of all and their number. A mesh is flags, from version 4 on a name, the numbers of vertices and
//! triangles, and columns of positions, normals, uv, colours and corners.

use super::limits::MOST_UNPACKED;
use crate::scene::description::Mesh;
use std::path::Path;

const MAGIC: u16 = 0x041c;
const HAS_NORMALS: u32 = 1;
const HAS_UV: u32 = 2;
const HAS_COLOURS: u32 = 8;
const DOUBLE: u32 = 0x2000;

/// No byte of deflated data becomes more than this.
const MOST_EXPANSION: u64 = 1032;

/// The bytes of a mesh, which are read from front to back.
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

/// Reads a mesh of a file by its number, from 0.
pub(super) fn read(path: &Path, number: usize) -> Result<Mesh, String> {
    if !path.is_file() {
        return Err("this is not a file".into());
    }
    let bytes = std::fs::read(path).map_err(|error| format!("cannot be read: {error}"))?;
    parse(&bytes, number)
}

/// The mesh of a number in a file's bytes.
pub fn parse(file: &[u8], number: usize) -> Result<Mesh, String> {
    let version = match (u16_at(file, 0), u16_at(file, 2)) {
        (Some(MAGIC), Some(version @ (3 | 4))) => version,
        (Some(MAGIC), Some(version)) => return Err(format!("version {version} is not read, only 3 and 4")),
        _ => return Err("this is not a serialized mesh".into()),
    };
    let start = if number == 0 { 0 } else { offset(file, version, number)? };
    let packed = start.checked_add(4).and_then(|start| file.get(start..));
    let packed = packed.ok_or("the place of a mesh is not in the file")?;
    let most = (packed.len() as u64 * MOST_EXPANSION).min(MOST_UNPACKED);
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let unpacked = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(packed, most);
    mesh(&unpacked.map_err(|error| format!("it cannot be unpacked: {error}"))?, version)
}

fn u16_at(file: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(file.get(at..at.checked_add(2)?)?.try_into().ok()?))
}

/// The place of a mesh, from the list at the end of the file.
fn offset(file: &[u8], version: u16, number: usize) -> Result<usize, String> {
    let cut = || "the list of meshes at its end is cut off".to_owned();
    let mut end = Bytes(file.get(file.len().saturating_sub(4)..).unwrap_or_default());
    let count = u32::from_le_bytes(end.array().map_err(|_| cut())?) as usize;
    if number >= count {
        return Err(format!("it has {count} meshes, and number {number} is asked for (counted from 0)"));
    }
    let size = if version == 3 { 4 } else { 8 };
    let back = (count - number).checked_mul(size).and_then(|back| back.checked_add(4));
    let at = back.and_then(|back| file.len().checked_sub(back)).ok_or_else(cut)?;
    let mut entry = Bytes(&file[at..]);
    let offset = match version {
        3 => u64::from(u32::from_le_bytes(entry.array()?)),
        _ => u64::from_le_bytes(entry.array()?),
    };
    usize::try_from(offset).map_err(|_| cut())
}

fn mesh(bytes: &[u8], version: u16) -> Result<Mesh, String> {
    let mut bytes = Bytes(bytes);
    let flags = u32::from_le_bytes(bytes.array()?);
    if version >= 4 {
        let end = bytes.0.iter().position(|&byte| byte == 0).ok_or("its name does not end")?;
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
        return Err("all of its triangles are without area: there is nothing to see".into());
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

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
                let message = "it has 2 meshes, and number 2 is asked for (counted from 0)";
                assert_eq!(parse(&file, 2), Err(message.into()));
            }
        }
    }

    #[test]
    fn spoiled_files_are_refused() {
        let whole = file(4, &[plain(4, 0)]);
        assert_eq!(parse(b"", 0), Err("this is not a serialized mesh".into()));
        assert_eq!(parse(b"\x1c\x04\x05\0", 0), Err("version 5 is not read, only 3 and 4".into()));
        assert!(parse(&whole[..20], 0).unwrap_err().starts_with("it cannot be unpacked"));
        assert!(parse(&whole, usize::MAX).is_err());
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
