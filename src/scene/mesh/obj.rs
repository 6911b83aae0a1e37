//! Wavefront OBJ: vertices, uv, normals, faces, and the names of groups and materials.

use super::parts::Parts;
use super::polygon::triangulate;
use super::source::{LONGEST_LINE, Read_, Source, number, shown, words};
use std::collections::HashMap;
use std::io::BufRead;

/// The columns of an OBJ file, each numbered by itself.
#[derive(Default)]
struct Columns {
    positions: Vec<[f32; 3]>,
    uv: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// Of each position, the vertex that was made of it last, from 1.
    last: Vec<u32>,
    /// By position, part, uv and normal: the numbers of the vertices for which their position's chain was too long.
    others: HashMap<[u32; 4], u32>,
}

/// A corner of a face: a position and, counted from 1 so that 0 is none, a uv and a normal.
type Corner = (u32, u32, u32);

/// A vertex of a part, made of a corner.
struct Vertex {
    part: u32,
    uv: u32,
    normal: u32,
    /// Its number in the part.
    number: u32,
    /// The vertex that was made of the same position before, from 1.
    before: u32,
}

/// The most vertices in the chain of a position.
const LONGEST_CHAIN: usize = 64;

/// The most vertices, of all parts.
const MOST_VERTICES: usize = 1 << 30;

/// Reads an OBJ file into its parts, and gives the names of its material libraries.
pub(super) fn read<R: BufRead>(source: &mut Source<'_, R>, parts: &mut Parts<'_>) -> Read_<Vec<String>> {
    let mut columns = Columns::default();
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut libraries = Vec::new();
    let (mut line, mut more) = (Vec::new(), Vec::new());
    let mut corners = Vec::new();
    let (mut group, mut material) = (String::new(), String::new());
    let mut part = None;
    while source.next_line(&mut line)? {
        // A line that ends in a backslash goes on.
        while line.last() == Some(&b'\\') {
            line.pop();
            line.push(b' ');
            if !source.next_line(&mut more)? {
                break;
            }
            if line.len() + more.len() > LONGEST_LINE {
                return Err(source.too_long());
            }
            line.extend_from_slice(&more);
        }
        let mut given = words(&line);
        match given.next() {
            Some(b"v") => {
                columns.positions.push(numbers(source, given)?);
                columns.last.push(0);
            }
            Some(b"vn") => columns.normals.push(numbers(source, given)?),
            Some(b"vt") => {
                // The second is optional.
                let u = numbers::<_, 1>(source, given.clone())?;
                let v = given.nth(1).and_then(number).unwrap_or(0.0);
                columns.uv.push([u[0], v]);
            }
            Some(b"f") => {
                let part = *part.get_or_insert_with(|| parts.of(&group, &material));
                corners.clear();
                for word in given {
                    let corner = corner(source, &columns, word)?;
                    corners.push(columns.vertex(&mut vertices, parts, part, corner));
                }
                if vertices.len() + columns.others.len() > MOST_VERTICES {
                    return Err(source.on_line("more vertices than stride can number (2³⁰)"));
                }
                let mesh = parts.mesh(part);
                match corners[..] {
                    [] | [_] | [_, _] => return Err(source.on_line("a face of fewer than three corners")),
                    [a, b, c] => mesh.triangles.push([a, b, c]),
                    ref polygon => triangulate(polygon, &mesh.positions, &mut mesh.triangles),
                }
            }
            Some(b"g" | b"o") => (group, part) = (name_after(&line), None),
            Some(b"usemtl") => (material, part) = (name_after(&line), None),
            Some(b"mtllib") => libraries.push(name_after(&line)),
            // Smoothing, curves, comments.
            _ => {}
        }
    }
    Ok(libraries)
}

impl Columns {
    /// The number, in a part, of the vertex that is made of a corner; one is added where there is none yet.
    fn vertex(&mut self, all: &mut Vec<Vertex>, parts: &mut Parts<'_>, part: usize, corner: Corner) -> u32 {
        let (position, uv, normal) = corner;
        let last = &mut self.last[position as usize];
        let mut at = *last;
        let mut length = 0;
        // A position has few vertices as a rule: as many as faces that disagree about it.
        while let Some(vertex) = all.get(at.wrapping_sub(1) as usize) {
            if (vertex.part, vertex.uv, vertex.normal) == (part as u32, uv, normal) {
                return vertex.number;
            }
            at = vertex.before;
            length += 1;
        }
        let key = [position, part as u32, uv, normal];
        if length >= LONGEST_CHAIN
            && let Some(&number) = self.others.get(&key)
        {
            return number;
        }
        let given_uv = uv.checked_sub(1).map(|i| self.uv[i as usize]);
        let given_normal = normal.checked_sub(1).map(|i| self.normals[i as usize]);
        let number = parts.vertex(part, self.positions[position as usize], given_normal, given_uv);
        // A chain that grew on would take time by the square of its length.
        if length >= LONGEST_CHAIN {
            self.others.insert(key, number);
        } else {
            all.push(Vertex { part: part as u32, uv, normal, number, before: *last });
            *last = all.len() as u32;
        }
        number
    }
}

/// What follows the first word of a line: a name may have blanks in it.
pub(super) fn name_after(line: &[u8]) -> String {
    let line = line.trim_ascii();
    let first = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    String::from_utf8_lossy(line[first..].trim_ascii()).into_owned()
}

/// The first `N` words as numbers.
pub(super) fn numbers<'w, R: BufRead, const N: usize>(
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
        let from_one = if given < 0 { (len as i64 + 1).saturating_add(given) } else { given };
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
