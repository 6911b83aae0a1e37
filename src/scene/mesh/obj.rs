//! Wavefront OBJ: vertices, uv, normals and faces. Groups and materials are passed over: a mesh has the material
//! of its entity.

use super::Mesh;
use super::polygon::triangulate;
use super::source::{Read_, Source, number, shown, words};
use std::collections::HashMap;
use std::io::BufRead;

/// The columns of an OBJ file, each numbered by itself.
#[derive(Default)]
struct Columns {
    positions: Vec<[f32; 3]>,
    uv: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
}

/// A corner of a face: a position and, counted from 1 so that 0 is none, a uv and a normal.
type Corner = (u32, u32, u32);

/// Reads an OBJ file.
pub(super) fn read<R: BufRead>(source: &mut Source<'_, R>) -> Read_<Mesh> {
    let mut columns = Columns::default();
    let mut mesh = Mesh::default();
    let mut vertices: HashMap<Corner, u32> = HashMap::new();
    let (mut line, mut more) = (Vec::new(), Vec::new());
    let mut corners = Vec::new();
    let (mut with_uv, mut with_normals, mut all) = (0_usize, 0_usize, 0_usize);
    while source.next_line(&mut line)? {
        // A line that ends in a backslash goes on.
        while line.last() == Some(&b'\\') {
            line.pop();
            line.push(b' ');
            if !source.next_line(&mut more)? || line.len() + more.len() > 1 << 20 {
                break;
            }
            line.extend_from_slice(&more);
        }
        let mut parts = words(&line);
        match parts.next() {
            Some(b"v") => columns.positions.push(numbers(source, parts)?),
            Some(b"vn") => columns.normals.push(numbers(source, parts)?),
            Some(b"vt") => {
                // The second is optional.
                let u = numbers::<_, 1>(source, parts.clone())?;
                let v = parts.nth(1).and_then(number).unwrap_or(0.0);
                columns.uv.push([u[0], v]);
            }
            Some(b"f") => {
                corners.clear();
                for word in parts {
                    let corner = corner(source, &columns, word)?;
                    all += 1;
                    with_uv += usize::from(corner.1 > 0);
                    with_normals += usize::from(corner.2 > 0);
                    let next = mesh.positions.len() as u32;
                    let vertex = *vertices.entry(corner).or_insert(next);
                    if vertex == next {
                        mesh.positions.push(columns.positions[corner.0 as usize]);
                        let uv = corner.1.checked_sub(1).map_or([0.0; 2], |i| columns.uv[i as usize]);
                        let n = corner.2.checked_sub(1).map_or([0.0; 3], |i| columns.normals[i as usize]);
                        mesh.uv.push(uv);
                        mesh.normals.push(n);
                    }
                    corners.push(vertex);
                }
                match corners[..] {
                    [] | [_] | [_, _] => return Err(source.on_line("a face of fewer than three corners")),
                    [a, b, c] => mesh.triangles.push([a, b, c]),
                    ref polygon => triangulate(polygon, &mesh.positions, &mut mesh.triangles),
                }
            }
            // Groups, materials, smoothing, curves, comments.
            _ => {}
        }
    }
    // Where only some corners have them, the others' are none: zero normals shade flat.
    if with_normals == 0 {
        mesh.normals = Vec::new();
    }
    if with_uv < all || with_uv == 0 {
        mesh.uv = Vec::new();
    }
    Ok(mesh)
}

/// The first `N` words as numbers.
fn numbers<'w, R: BufRead, const N: usize>(
    source: &Source<'_, R>,
    mut words: impl Iterator<Item = &'w [u8]>,
) -> Read_<[f32; N]> {
    let mut numbers = [0.0; N];
    for x in &mut numbers {
        let Some(word) = words.next() else {
            return Err(source.on_line(format!("fewer than {N} numbers")));
        };
        *x = number(word).ok_or_else(|| source.on_line(format!("{} is no number", shown(word))))?;
    }
    Ok(numbers)
}

/// `7`, `7/2`, `7//3` or `7/2/3`; negative ones count back from the last so far.
fn corner<R: BufRead>(source: &Source<'_, R>, columns: &Columns, word: &[u8]) -> Read_<Corner> {
    let lengths = [columns.positions.len(), columns.uv.len(), columns.normals.len()];
    let mut indices = [0_u32; 3];
    let mut parts = word.split(|&b| b == b'/');
    for (i, (index, len)) in indices.iter_mut().zip(lengths).enumerate() {
        let part = parts.next().unwrap_or_default();
        if part.is_empty() && i > 0 {
            continue;
        }
        let wrong = || source.on_line(format!("{} is no corner of a face", shown(word)));
        let given: i64 = number(part).ok_or_else(wrong)?;
        let from_one = if given < 0 { len as i64 + 1 + given } else { given };
        if from_one < 1 || from_one > len as i64 {
            let what = ["vertices", "texture vertices", "normals"][i];
            return Err(
                source.on_line(format!("{} names number {given} of {len} {what} so far", shown(word)))
            );
        }
        *index = from_one as u32;
    }
    if parts.next().is_some() {
        return Err(source.on_line(format!("{} is no corner of a face", shown(word))));
    }
    Ok((indices[0] - 1, indices[1], indices[2]))
}
