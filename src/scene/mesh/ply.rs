//! PLY (Turk 1994): text, and binary of either byte order.

use super::Mesh;
use super::polygon::triangulate;
use super::source::{Read_, Source, number, shown, words};
use std::io::BufRead;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Text,
    Little,
    Big,
}

/// A scalar's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(word: &[u8]) -> Option<Scalar> {
        Some(match word {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// The number that the first bytes stand for. All types fit 64 bits.
    fn decode(self, bytes: &[u8], encoding: Encoding) -> f64 {
        macro_rules! of {
            ($type:ty) => {{
                const N: usize = size_of::<$type>();
                let mut raw = [0; N];
                raw.copy_from_slice(&bytes[..N]);
                match encoding {
                    Encoding::Big => f64::from(<$type>::from_be_bytes(raw)),
                    _ => f64::from(<$type>::from_le_bytes(raw)),
                }
            }};
        }
        match self {
            Scalar::I8 => of!(i8),
            Scalar::U8 => of!(u8),
            Scalar::I16 => of!(i16),
            Scalar::U16 => of!(u16),
            Scalar::I32 => of!(i32),
            Scalar::U32 => of!(u32),
            Scalar::F32 => of!(f32),
            Scalar::F64 => of!(f64),
        }
    }
}

#[derive(Clone, Debug)]
struct Property {
    name: Vec<u8>,
    /// The type of a list's length, if it is a list.
    length: Option<Scalar>,
    scalar: Scalar,
}

#[derive(Clone, Debug)]
struct Element {
    name: Vec<u8>,
    count: u64,
    properties: Vec<Property>,
}

impl Element {
    /// The fewest bytes that one takes.
    fn least_bytes(&self, encoding: Encoding) -> u64 {
        let one = |property: &Property| match encoding {
            // A digit and a blank.
            Encoding::Text => 2,
            _ => property.length.unwrap_or(property.scalar).size() as u64,
        };
        self.properties.iter().map(one).sum::<u64>().max(1)
    }

    fn find(&self, names: &[&[u8]]) -> Option<usize> {
        self.properties.iter().position(|property| names.contains(&property.name.as_slice()))
    }
}

/// The most elements, and properties of one: no honest file has more.
const MOST_PROPERTIES: usize = 1000;

fn header<R: BufRead>(source: &mut Source<'_, R>) -> Read_<(Encoding, Vec<Element>)> {
    let mut line = Vec::new();
    if !source.next_line(&mut line)? || words(&line).next() != Some(b"ply") {
        return Err(source.whole("this is no PLY file: it does not begin with \"ply\""));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        if !source.next_line(&mut line)? {
            return Err(source.whole("the header does not end: \"end_header\" is missing"));
        }
        let parts: Vec<&[u8]> = words(&line).take(6).collect();
        match parts[..] {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"end_header"] => break,
            [b"format", word, b"1.0"] => {
                encoding = Some(match word {
                    b"ascii" => Encoding::Text,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    _ => return Err(source.on_line(format!("unknown format {}", shown(word)))),
                });
            }
            [b"element", name, count] => {
                let Some(count) = number(count) else {
                    return Err(source.on_line(format!("{} is no number of elements", shown(count))));
                };
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            [b"property", ref of @ .., name] if !of.is_empty() => {
                let scalar = |word: &[u8]| {
                    Scalar::named(word).ok_or_else(|| source.on_line(format!("unknown type {}", shown(word))))
                };
                let (length, scalar) = match of {
                    [one] => (None, scalar(one)?),
                    [b"list", length, each] => (Some(scalar(length)?), scalar(each)?),
                    _ => return Err(source.on_line("a property is a type and a name, or a list of such")),
                };
                let Some(element) = elements.last_mut() else {
                    return Err(source.on_line("a property before the first element"));
                };
                element.properties.push(Property { name: name.into(), length, scalar });
                if element.properties.len() > MOST_PROPERTIES {
                    return Err(source.on_line("an element of more than 1,000 properties"));
                }
            }
            _ => return Err(source.on_line(format!("unknown header line {}", shown(&line)))),
        }
        if elements.len() > MOST_PROPERTIES {
            return Err(source.on_line("more than 1,000 kinds of elements"));
        }
    }
    match encoding {
        Some(encoding) => Ok((encoding, elements)),
        None => Err(source.whole("the header names no format")),
    }
}

/// The longest list: no honest polygon has more corners.
const MOST_CORNERS: u64 = 1 << 20;

/// Reads elements one by one: their scalars, and one of their lists.
struct Rows {
    encoding: Encoding,
    /// A line, or an element's bytes.
    buffer: Vec<u8>,
    /// One number for each property; a list's is its length.
    scalars: Vec<f64>,
    /// What is in the list that was asked for.
    list: Vec<f64>,
}

impl Rows {
    fn next<R: BufRead>(
        &mut self,
        source: &mut Source<'_, R>,
        element: &Element,
        wanted: Option<usize>,
    ) -> Read_<()> {
        self.scalars.clear();
        self.list.clear();
        match self.encoding {
            Encoding::Text => self.next_text(source, element, wanted),
            _ => self.next_binary(source, element, wanted),
        }
    }

    fn next_text<R: BufRead>(
        &mut self,
        source: &mut Source<'_, R>,
        element: &Element,
        wanted: Option<usize>,
    ) -> Read_<()> {
        loop {
            if !source.next_line(&mut self.buffer)? {
                return Err(source.whole("the file ends before its last element: it is cut off"));
            }
            if words(&self.buffer).next().is_some() {
                break;
            }
        }
        let mut words = words(&self.buffer);
        let mut next = || {
            let Some(word) = words.next() else {
                return Err(source.on_line("this line has fewer numbers than its element has properties"));
            };
            number::<f64>(word).ok_or_else(|| source.on_line(format!("{} is no number", shown(word))))
        };
        for (i, property) in element.properties.iter().enumerate() {
            let value = next()?;
            self.scalars.push(value);
            if property.length.is_some() {
                // As many as the line has: a length that lies runs out of words.
                for _ in 0..length(source, value)? {
                    let value = next()?;
                    if wanted == Some(i) {
                        self.list.push(value);
                    }
                }
            }
        }
        Ok(())
    }

    fn next_binary<R: BufRead>(
        &mut self,
        source: &mut Source<'_, R>,
        element: &Element,
        wanted: Option<usize>,
    ) -> Read_<()> {
        for (i, property) in element.properties.iter().enumerate() {
            let mut raw = [0; 8];
            let scalar = property.length.unwrap_or(property.scalar);
            source.exact(&mut raw[..scalar.size()])?;
            let value = scalar.decode(&raw, self.encoding);
            self.scalars.push(value);
            if property.length.is_some() {
                let count = length(source, value)?;
                if count > MOST_CORNERS {
                    return Err(source.at_byte(format!("a list of {count} numbers")));
                }
                let size = property.scalar.size();
                if count * size as u64 > source.left() {
                    return Err(source.at_byte(format!(
                        "a list of {count} numbers, but only {} bytes are left",
                        source.left()
                    )));
                }
                self.buffer.resize(count as usize * size, 0);
                source.exact(&mut self.buffer)?;
                if wanted == Some(i) {
                    let decode = |bytes| property.scalar.decode(bytes, self.encoding);
                    self.list.extend(self.buffer.chunks_exact(size).map(decode));
                }
            }
        }
        Ok(())
    }
}

fn length<R: BufRead>(source: &Source<'_, R>, value: f64) -> Read_<u64> {
    if value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0 {
        Ok(value as u64)
    } else {
        Err(source.at_byte(format!("{value} is no length of a list")))
    }
}

/// Reads a PLY file.
pub(super) fn read<R: BufRead>(source: &mut Source<'_, R>) -> Read_<Mesh> {
    let (encoding, elements) = header(source)?;
    for element in &elements {
        // Checked before anything is set aside for them.
        let needed = u128::from(element.count) * u128::from(element.least_bytes(encoding));
        // The last line may lack its end.
        let needed = if encoding == Encoding::Text { needed.saturating_sub(1) } else { needed };
        if needed > u128::from(source.left()) {
            return Err(source.whole(format!(
                "the header promises {} of element {}, which take at least {needed} bytes, but only {} follow",
                element.count,
                shown(&element.name),
                source.left()
            )));
        }
    }
    let mut mesh = Mesh::default();
    // Polygons of more than three corners wait until all vertices are there.
    let (mut polygons, mut ends) = (Vec::new(), Vec::new());
    let mut rows = Rows { encoding, buffer: Vec::new(), scalars: Vec::new(), list: Vec::new() };
    for element in &elements {
        match element.name.as_slice() {
            b"vertex" => vertices(source, &mut rows, element, &mut mesh)?,
            b"face" => faces(source, &mut rows, element, &mut mesh, &mut polygons, &mut ends)?,
            _ => {
                for _ in 0..element.count {
                    rows.next(source, element, None)?;
                }
            }
        }
    }
    let mut first = 0;
    for end in ends {
        triangulate(&polygons[first..end], &mesh.positions, &mut mesh.triangles);
        first = end;
    }
    Ok(mesh)
}

fn vertices<R: BufRead>(
    source: &mut Source<'_, R>,
    rows: &mut Rows,
    element: &Element,
    mesh: &mut Mesh,
) -> Read_<()> {
    let find = |name: &[u8]| element.find(&[name]);
    let [Some(x), Some(y), Some(z)] = [find(b"x"), find(b"y"), find(b"z")] else {
        return Err(source.whole("its vertices have no x, y and z"));
    };
    let normal = match [find(b"nx"), find(b"ny"), find(b"nz")] {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => None,
    };
    let u = element.find(&[b"u", b"s", b"texture_u", b"texture_s"]);
    let v = element.find(&[b"v", b"t", b"texture_v", b"texture_t"]);
    let count = element.count as usize;
    mesh.positions.reserve(count);
    mesh.normals.reserve(if normal.is_some() { count } else { 0 });
    for _ in 0..count {
        rows.next(source, element, None)?;
        let get = |i: usize| rows.scalars[i] as f32;
        mesh.positions.push([get(x), get(y), get(z)]);
        mesh.normals.extend(normal.map(|n| n.map(get)));
        if let (Some(u), Some(v)) = (u, v) {
            mesh.uv.push([get(u), get(v)]);
        }
    }
    // An element of this name may come twice.
    let vertices = mesh.positions.len();
    if [mesh.normals.len(), mesh.uv.len()].iter().any(|&n| n != 0 && n != vertices) {
        return Err(source.whole("some of its vertices have normals or uv, and some have none"));
    }
    Ok(())
}

fn faces<R: BufRead>(
    source: &mut Source<'_, R>,
    rows: &mut Rows,
    element: &Element,
    mesh: &mut Mesh,
    polygons: &mut Vec<u32>,
    ends: &mut Vec<usize>,
) -> Read_<()> {
    let corners = element.find(&[b"vertex_indices", b"vertex_index"]);
    let Some(corners) = corners.filter(|&i| element.properties[i].length.is_some()) else {
        return Err(source.whole("its faces have no list of vertex_indices"));
    };
    let smallest = match rows.encoding {
        Encoding::Text => 8,
        _ => 1 + 3 * element.properties[corners].scalar.size() as u64,
    };
    mesh.triangles.reserve(element.count.min(source.left() / smallest) as usize);
    for face in 0..element.count {
        rows.next(source, element, Some(corners))?;
        let index = |&i: &f64| {
            let fits = i >= 0.0 && i < f64::from(u32::MAX) && i.fract() == 0.0;
            fits.then_some(i as u32)
        };
        let wrong = |i: f64| source.whole(format!("face {face} (counted from 0) has {i} for a vertex"));
        match rows.list[..] {
            // A point or a line has no side to be seen.
            [] | [_] | [_, _] => {}
            [a, b, c] => {
                let corner = |i: f64| index(&i).ok_or_else(|| wrong(i));
                mesh.triangles.push([corner(a)?, corner(b)?, corner(c)?]);
            }
            ref list => {
                for i in list {
                    polygons.push(index(i).ok_or_else(|| wrong(*i))?);
                }
                ends.push(polygons.len());
            }
        }
    }
    Ok(())
}
