//! Wavefront OBJ: vertices, uv, normals, faces, and the names of groups and materials.

use super::parts::{self, Parts};
use super::polygon;
use super::source::{FilePosition, LONGEST_LINE, Read_, Source, number, number_or_nan, shown, words};
use std::collections::{HashMap, HashSet};
use std::io::BufRead;

/// The columns of an OBJ file, each with its own numbering.
#[derive(Default)]
struct Columns {
    positions: Vec<[f32; 3]>,
    uv: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// For each position, the last vertex made from it, from 1.
    last: Vec<u32>,
    /// The vertices by position, part, uv and normal, for positions whose chain became too long.
    others: HashMap<[u32; 4], u32>,
}

/// A corner of a face: a position, a uv and a normal. The latter two are counted from 1, so that 0 means none.
type Corner = (u32, u32, u32);

/// A vertex of a part, made from a corner.
struct Vertex {
    part: u32,
    uv: u32,
    normal: u32,
    /// Its index in the part.
    number: u32,
    /// The previous vertex made from the same position, from 1.
    before: u32,
}

/// The maximum length of a position's chain of vertices.
const LONGEST_CHAIN: usize = 64;

/// The maximum number of vertices in all parts.
const MOST_VERTICES: usize = 1 << 30;

/// The note about statements that draw curves.
const CURVES: &str = "curves and free-form surfaces are left out";

/// A name in a line: a name for the following items, or a reference.
#[derive(Default)]
pub(super) struct Name {
    pub(super) name: String,
    /// The line.
    pub(super) place: Option<FilePosition>,
}

/// References of an OBJ file to other files.
#[derive(Default)]
pub(super) struct Names {
    /// Material libraries, by lines that may list several.
    pub(super) libraries: Vec<Name>,
    /// Materials, with the location of their first use.
    pub(super) materials: Vec<Name>,
}

/// Reads an OBJ file into its parts, and returns its references to other files.
///
/// Statements about levels of detail and shadows have no effect here and are skipped. There is a note about everything
/// else that is left out.
pub(super) fn read<R: BufRead>(source: &mut Source<'_, R>, parts: &mut Parts<'_>) -> Read_<Names> {
    let mut columns = Columns::default();
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut names = Names::default();
    let mut used = HashSet::new();
    let (mut line, mut more) = (Vec::new(), Vec::new());
    let (mut given_corners, mut corners) = (Vec::new(), Vec::new());
    let (mut group, mut material) = (String::new(), String::new());
    let mut part = None;
    let mut is_smooth = false;
    while source.next_line(&mut line)? {
        uncomment(&mut line, 0);
        // A line that ends in a backslash continues.
        while line.last() == Some(&b'\\') {
            line.pop();
            line.push(b' ');
            // A statement may be as long as a line: each line of it is scanned once.
            if line.trim_ascii().is_empty() {
                line.clear();
            }
            if !source.next_line(&mut more)? {
                break;
            }
            if line.len() + more.len() > LONGEST_LINE {
                return Err(source.too_long());
            }
            let from = line.len();
            line.extend_from_slice(&more);
            uncomment(&mut line, from);
        }
        let mut given = words(&line);
        match given.next() {
            Some(b"v") => {
                // A weight may follow, which polygons ignore, or a colour.
                if given.clone().nth(5).is_some() {
                    parts.note(parts::VERTEX_COLOURS, source.line());
                }
                columns.positions.push(numbers(source, given)?);
                columns.last.push(0);
            }
            Some(b"vn") => {
                let normal = parts::normal(numbers(source, given)?);
                if normal.is_none() {
                    parts.note(parts::NO_NORMAL, source.line());
                }
                columns.normals.push(normal.unwrap_or_default());
            }
            Some(b"vt") => {
                // The second is optional.
                let u = numbers::<_, 1>(source, given.clone())?;
                let v = given.nth(1).map_or(Some(0.0), number_or_nan);
                if v.is_none() {
                    parts.note("an invalid second coordinate of uv is taken for 0", source.line());
                }
                let v = v.unwrap_or_default();
                let uv = parts::uv([u[0], v]);
                if uv.is_none() {
                    parts.note(parts::NO_UV, source.line());
                }
                columns.uv.push(uv.unwrap_or_default());
            }
            // The second form predates version 3 of the format.
            Some(b"f" | b"fo") => {
                given_corners.clear();
                for word in given {
                    given_corners.push(corner(source, &columns, parts, word)?);
                }
                if given_corners.len() < 3 {
                    parts.note("faces of fewer than three corners are left out", source.line());
                    continue;
                }
                if is_smooth && given_corners.iter().any(|&(_, _, normal)| normal == 0) {
                    parts.note(
                        "faces of smoothing groups are flat without normals; export the file with normals to smooth them",
                        source.line(),
                    );
                }
                let part = *part.get_or_insert_with(|| parts.of(&group, &material));
                corners.clear();
                for &corner in &given_corners {
                    corners.push(columns.vertex(&mut vertices, parts, part, corner));
                }
                if vertices.len() + columns.others.len() > MOST_VERTICES {
                    return Err(source.on_line("more than the maximum of 2³⁰ vertices"));
                }
                match corners[..] {
                    [a, b, c] => {
                        let mesh = parts.mesh(part);
                        mesh.triangles.push([a, b, c]);
                        if polygon::is_flat([a, b, c], &mesh.positions) {
                            parts.note(parts::FLAT, source.line());
                        }
                    }
                    ref corners => parts.polygon(part, corners, || source.line()),
                }
            }
            Some(b"s") => is_smooth = !matches!(given.next(), None | Some(b"off" | b"0")),
            Some(b"g" | b"o") => (group, part) = (name_after(&line), None),
            Some(b"usemtl") => {
                (material, part) = (name_after(&line), None);
                if used.insert(material.clone()) {
                    names.materials.push(Name { name: material.clone(), place: source.line() });
                }
            }
            Some(b"mtllib") => names.libraries.push(Name { name: name_after(&line), place: source.line() }),
            Some(b"p" | b"l") => parts.note("points and lines are left out", source.line()),
            Some(b"curv" | b"curv2" | b"surf" | b"bzp" | b"bsp" | b"cdc" | b"cdp" | b"res") => {
                parts.note(CURVES, source.line());
            }
            Some(b"usemap" | b"maplib") => parts.note("textures are not read", source.line()),
            Some(b"call" | b"csh") => parts.note("calls of other files and programs are ignored", source.line()),
            Some(
                // Of curves and surfaces: their points, kinds and limits.
                b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"parm" | b"trim" | b"hole" | b"scrv" | b"sp"
                | b"end" | b"con" | b"ctech" | b"stech"
                // Display settings of other programs.
                | b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"shadow_obj" | b"trace_obj",
            )
            | None => {}
            Some(_) => parts.note("unknown statements are ignored", source.line()),
        }
    }
    Ok(names)
}

/// Statements whose words are names, which may contain `#`.
const NAMING_STATEMENTS: [&[u8]; 12] = [
    b"g", b"o", b"usemtl", b"mtllib", b"usemap", b"maplib", b"newmtl", b"bump", b"disp", b"decal", b"refl",
    b"norm",
];

/// Removes a comment from a line, including a backslash at its end: comments do not continue in the next line.
///
/// A `#` begins a comment unless it is part of a number such as `1.#QNAN`. On a line of names it must be between
/// blanks: 3ds Max calls materials `Material #25`.
///
/// There is none before `from`.
pub(super) fn uncomment(line: &mut Vec<u8>, from: usize) {
    let first = words(line).next().unwrap_or_default();
    let has_names = NAMING_STATEMENTS.contains(&first) || first.starts_with(b"map_");
    let begins = |at: usize| match at.checked_sub(1).map(|before| line[before]) {
        None => true,
        Some(before) if has_names => {
            before.is_ascii_whitespace() && line.get(at + 1).is_none_or(u8::is_ascii_whitespace)
        }
        Some(before) => before != b'.',
    };
    let comment = (from..line.len()).find(|&at| line[at] == b'#' && begins(at));
    comment.into_iter().for_each(|comment| line.truncate(comment));
}

impl Columns {
    /// The index in a part of the vertex for a corner, which is added if it is new.
    fn vertex(&mut self, all: &mut Vec<Vertex>, parts: &mut Parts<'_>, part: usize, corner: Corner) -> u32 {
        let (position, uv, normal) = corner;
        let last = &mut self.last[position as usize];
        let mut at = *last;
        let mut length = 0;
        // A position usually has few vertices: one for each distinct combination on its faces.
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
        let number = parts.vertex(part, self.positions[position as usize], given_normal, [given_uv, None]);
        // An unlimited chain would take quadratic time.
        if length >= LONGEST_CHAIN {
            self.others.insert(key, number);
        } else {
            all.push(Vertex { part: part as u32, uv, normal, number, before: *last });
            *last = all.len() as u32;
        }
        number
    }
}

/// The rest of a line after its first word: a name may contain blanks.
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
        *x = number_or_nan(word).ok_or_else(|| source.on_line(format!("{} is not a number", shown(word))))?;
    }
    Ok(numbers)
}

/// `7`, `7/2`, `7//3` or `7/2/3`; negative numbers count back from the last item so far. Undefined uv and normals are
/// ignored.
fn corner<R: BufRead>(
    source: &Source<'_, R>,
    columns: &Columns,
    parts: &mut Parts<'_>,
    word: &[u8],
) -> Read_<Corner> {
    let lengths = [columns.positions.len(), columns.uv.len(), columns.normals.len()];
    let mut indices = [0_u32; 3];
    let mut given = word.split(|&b| b == b'/');
    for (i, (index, len)) in indices.iter_mut().zip(lengths).enumerate() {
        let part = given.next().unwrap_or_default();
        if part.is_empty() && i > 0 {
            continue;
        }
        let wrong = || source.on_line(format!("{} is not a corner of a face", shown(word)));
        let given: i64 = number(part).ok_or_else(wrong)?;
        let from_one = if given < 0 { (len as i64 + 1).saturating_add(given) } else { given };
        match (from_one >= 1 && from_one <= len as i64, i) {
            (true, _) => *index = from_one as u32,
            (false, 0) => {
                let message = format!("{} refers to number {given} of {len} vertices so far", shown(word));
                return Err(source.on_line(message));
            }
            (false, 1) => parts.note("references to undefined uv are ignored", source.line()),
            (false, _) => parts.note("references to undefined normals are ignored", source.line()),
        }
    }
    if given.next().is_some() {
        return Err(source.on_line(format!("{} is not a corner of a face", shown(word))));
    }
    Ok((indices[0] - 1, indices[1], indices[2]))
}
