//! PLY (Turk 1994): text, and binary of either byte order.
//!
//! Triangles are read from faces and from triangle strips.

mod header;
mod lines;
mod rows;

use self::header::{Element, Encoding, header};
use self::rows::Rows;
use super::parts::{self, Parts};
use super::polygon;
use super::source::{FilePosition, Read_, Source, shown};
use std::io::BufRead;

/// The maximum number of corners of a face, far beyond that of real files. A strip may be as long as the file.
const MOST_CORNERS: u64 = 1 << 20;

/// The faces that are no triangles, which are stored until all vertices are known.
#[derive(Default)]
struct Polygons {
    corners: Vec<u32>,
    /// For each, its index among all faces, and the end of its corners; faces that are too small have no corners.
    ends: Vec<(u64, usize)>,
    /// The number of faces so far.
    faces: u64,
}

impl Polygons {
    /// The index among all faces of a triangle, given its index among the triangles.
    fn number(&self, triangle: usize) -> u64 {
        self.ends.iter().fold(triangle as u64, |face, (other, _)| face + u64::from(*other <= face))
    }
}

fn face_place(face: u64) -> Option<FilePosition> {
    Some(FilePosition::Item(format!("face {face} (counted from 0)")))
}

/// Reads a PLY file.
pub(super) fn read<R: BufRead>(source: &mut Source<'_, R>, parts: &mut Parts<'_>) -> Read_<()> {
    let (encoding, elements) = header(source, parts)?;
    for element in &elements {
        // Checked before memory is allocated for them.
        let needed = u128::from(element.count) * u128::from(element.least_bytes(encoding));
        // The last line may lack its line feed.
        let needed = if encoding == Encoding::Text { needed.saturating_sub(1) } else { needed };
        if needed > u128::from(source.left()) {
            return Err(source.whole(format!(
                "the header declares {} of element {}, which take at least {needed} bytes, but only {} follow",
                element.count,
                shown(&element.name),
                source.left()
            )));
        }
    }
    note_unknown(parts, &elements);
    let part = parts.of("", "");
    let (mut polygons, mut strips) = (Polygons::default(), Vec::new());
    let mut rows = Rows::new(encoding, &elements);
    for element in &elements {
        match element.name.as_slice() {
            b"vertex" => vertices(source, &mut rows, element, parts, part)?,
            b"face" => faces(source, &mut rows, element, parts, part, &mut polygons)?,
            b"tristrips" => tristrips(source, &mut rows, element, &mut strips)?,
            name => {
                for _ in 0..element.count {
                    rows.next(source, element, None)?;
                }
                let message = match name {
                    b"edge" => "points and lines are left out",
                    _ => "unknown elements are left out",
                };
                parts.note_several(message, element.count, element.place.clone());
            }
        }
    }
    rows.finish(source, parts)?;
    let mesh = parts.mesh(part);
    let flat =
        mesh.triangles.iter().enumerate().filter(|(_, corners)| polygon::is_flat(**corners, &mesh.positions));
    let (first, count) = flat.fold((None, 0), |(first, count), (i, _)| (first.or(Some(i)), count + 1));
    parts.note_several(parts::FLAT, count, first.and_then(|first| face_place(polygons.number(first))));
    let mut first = 0;
    for &(face, end) in &polygons.ends {
        if end > first {
            parts.polygon(part, &polygons.corners[first..end], || face_place(face));
        }
        first = end;
    }
    parts.mesh(part).triangles.append(&mut strips);
    Ok(())
}

/// The maximum number of properties that the note about unknown ones lists.
const MOST_NAMED: usize = 5;

/// Notes unknown properties: those that are neither read nor the subject of another note.
fn note_unknown(parts: &mut Parts<'_>, elements: &[Element]) {
    let mut unknown = Vec::new();
    for element in elements.iter().filter(|element| element.count > 0) {
        for (i, property) in element.properties.iter().enumerate() {
            let name = property.name.as_slice();
            // The first property of a name is read, and the first of several synonyms.
            let is_first = |names: &[&[u8]]| element.find(names) == Some(i);
            let is_known = match element.name.as_slice() {
                b"vertex" => {
                    let single = [b"x", b"y", b"z"].iter().any(|name| is_first(&[&name[..]]));
                    let normal = NORMAL.iter().any(|name| is_first(&[name]));
                    let second_uv = SECOND_UV.iter().any(|name| is_first(&[name]));
                    single || normal || second_uv || is_first(&U) || is_first(&V) || is_colour(name)
                }
                b"face" => is_first(&VERTEX_INDICES) || is_colour(name) || name == b"texcoord",
                b"tristrips" => is_first(&VERTEX_INDICES),
                // There is a note about the element.
                _ => true,
            };
            if !is_known {
                unknown.push(property);
            }
        }
    }
    let Some(first) = unknown.first() else { return };
    let names: Vec<_> = unknown.iter().take(MOST_NAMED).map(|property| shown(&property.name)).collect();
    let more = if unknown.len() > MOST_NAMED { ", …" } else { "" };
    let message = format!("unknown properties are left out ({}{more})", names.join(", "));
    parts.note_several(&message, unknown.len() as u64, first.place.clone());
}

/// The names of a normal's coordinates.
const NORMAL: [&[u8]; 3] = [b"nx", b"ny", b"nz"];

/// The names of the two coordinates of uv.
const U: [&[u8]; 4] = [b"u", b"s", b"texture_u", b"texture_s"];
const V: [&[u8]; 4] = [b"v", b"t", b"texture_v", b"texture_t"];

/// The names of the two coordinates of the second set of uv, as the writer of scenes gives them.
const SECOND_UV: [&[u8]; 2] = [b"u1", b"v1"];

/// The names of a list of corners.
const VERTEX_INDICES: [&[u8]; 2] = [b"vertex_indices", b"vertex_index"];

/// Notes that an element has properties which are not read.
fn unread(parts: &mut Parts<'_>, element: &Element, message: &str, which: fn(&[u8]) -> bool) {
    if element.count > 0 && element.properties.iter().any(|property| which(&property.name)) {
        parts.note_several(message, element.count, element.place.clone());
    }
}

/// Whether a property is part of a colour.
fn is_colour(name: &[u8]) -> bool {
    let name = name.strip_prefix(b"diffuse_").unwrap_or(name);
    [&b"red"[..], b"green", b"blue", b"r", b"g", b"b", b"alpha", b"a", b"material_index"].contains(&name)
}

fn vertices<R: BufRead>(
    source: &mut Source<'_, R>,
    rows: &mut Rows<'_>,
    element: &Element,
    parts: &mut Parts<'_>,
    part: usize,
) -> Read_<()> {
    let find = |name: &[u8]| element.find(&[name]);
    let [Some(x), Some(y), Some(z)] = [find(b"x"), find(b"y"), find(b"z")] else {
        return Err(source.whole("its vertices have no x, y and z"));
    };
    let given_normal = NORMAL.map(find);
    let normal = match given_normal {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => None,
    };
    let [u, v, second_u, second_v] =
        [element.find(&U), element.find(&V), find(SECOND_UV[0]), find(SECOND_UV[1])];
    if normal.is_none() && given_normal.iter().any(Option::is_some) {
        let message = "normals with fewer than three coordinates are left out";
        parts.note_several(message, element.count, element.place.clone());
    }
    if u.is_some() != v.is_some() || second_u.is_some() != second_v.is_some() {
        let message = "uv with a single coordinate are left out";
        parts.note_several(message, element.count, element.place.clone());
    }
    unread(parts, element, parts::VERTEX_COLOURS, is_colour);
    let count = element.count as usize;
    let before = parts.mesh(part).positions.len();
    let mesh = parts.mesh(part);
    mesh.positions.reserve(count);
    mesh.normals.reserve(if normal.is_some() { count } else { 0 });
    for vertex in before..before + count {
        rows.next(source, element, None)?;
        let get = |i: usize| rows.scalars[i] as f32;
        let place = || Some(FilePosition::Item(format!("vertex {vertex} (counted from 0)")));
        let given_normal = normal.map(|n| n.map(get)).map(parts::normal);
        let [given_uv, given_second] =
            [u.zip(v), second_u.zip(second_v)].map(|both| both.map(|(u, v)| parts::uv([get(u), get(v)])));
        let mesh = parts.mesh(part);
        mesh.positions.push([get(x), get(y), get(z)]);
        mesh.normals.extend(given_normal.map(Option::unwrap_or_default));
        mesh.uv.extend(given_uv.map(Option::unwrap_or_default));
        mesh.second_uv.extend(given_second.map(Option::unwrap_or_default));
        if given_normal == Some(None) {
            parts.note(parts::NO_NORMAL, place());
        }
        if given_uv == Some(None) || given_second == Some(None) {
            parts.note(parts::NO_UV, place());
        }
    }
    // An element of this name may occur twice.
    let mesh = parts.mesh(part);
    let vertices = mesh.positions.len();
    if [mesh.normals.len(), mesh.uv.len(), mesh.second_uv.len()].iter().any(|&n| n != 0 && n != vertices) {
        return Err(source.whole("only some of its vertices have normals or uv"));
    }
    Ok(())
}

/// A list of vertices; not required if there are no elements.
fn list_of_vertices<R: BufRead>(
    source: &Source<'_, R>,
    element: &Element,
    what: &str,
) -> Read_<Option<usize>> {
    let corners = element.find(&VERTEX_INDICES);
    let corners = corners.filter(|&i| element.properties[i].length.is_some());
    match corners {
        None if element.count > 0 => Err(source.whole(format!("its {what} have no list vertex_indices"))),
        corners => Ok(corners),
    }
}

/// The vertex with a given number.
fn index(i: f64) -> Option<u32> {
    (i >= 0.0 && i < f64::from(u32::MAX) && i.fract() == 0.0).then_some(i as u32)
}

fn faces<R: BufRead>(
    source: &mut Source<'_, R>,
    rows: &mut Rows<'_>,
    element: &Element,
    parts: &mut Parts<'_>,
    part: usize,
    polygons: &mut Polygons,
) -> Read_<()> {
    let Some(corners) = list_of_vertices(source, element, "faces")? else { return Ok(()) };
    unread(parts, element, "colours of faces are not read", is_colour);
    unread(parts, element, "uv of faces' corners are not read", |name| name == b"texcoord");
    let smallest = match rows.encoding {
        Encoding::Text => 8,
        _ => 1 + 3 * element.properties[corners].scalar.size() as u64,
    };
    parts.mesh(part).triangles.reserve(element.count.min(source.left() / smallest) as usize);
    for _ in 0..element.count {
        let face = polygons.faces;
        polygons.faces += 1;
        rows.next(source, element, Some(corners))?;
        let index = |i: f64| {
            let wrong = || source.whole(format!("face {face} (counted from 0) has the invalid vertex {i}"));
            index(i).ok_or_else(wrong)
        };
        match rows.list[..] {
            [a, b, c] => parts.mesh(part).triangles.push([index(a)?, index(b)?, index(c)?]),
            ref list if list.len() as u64 > MOST_CORNERS => {
                let most = format!(
                    "face {face} (counted from 0) has {} corners, more than the maximum of 2²⁰",
                    list.len()
                );
                return Err(source.whole(most));
            }
            ref list => {
                if list.len() < 3 {
                    parts.note("faces of fewer than three corners are left out", face_place(face));
                } else {
                    for &i in list {
                        polygons.corners.push(index(i)?);
                    }
                }
                polygons.ends.push((face, polygons.corners.len()));
            }
        }
    }
    Ok(())
}

/// Triangle strips: each triangle shares the last two corners of the one before, and every other one has the opposite
/// winding. In a list, −1 ends a strip.
fn tristrips<R: BufRead>(
    source: &mut Source<'_, R>,
    rows: &mut Rows<'_>,
    element: &Element,
    triangles: &mut Vec<[u32; 3]>,
) -> Read_<()> {
    let Some(corners) = list_of_vertices(source, element, "strips of triangles")? else { return Ok(()) };
    for list in 0..element.count {
        rows.next(source, element, Some(corners))?;
        for strip in rows.list.split(|&i| i == -1.0) {
            let index = |i: f64| {
                let wrong =
                    || source.whole(format!("strip {list} (counted from 0) has the invalid vertex {i}"));
                index(i).ok_or_else(wrong)
            };
            for (i, corners) in strip.windows(3).enumerate() {
                let [a, b, c] = [index(corners[0])?, index(corners[1])?, index(corners[2])?];
                triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }
    Ok(())
}
