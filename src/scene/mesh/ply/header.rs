//! The header of a PLY file: its encoding, its elements and their properties.

use crate::scene::mesh::parts::Parts;
use crate::scene::mesh::source::{FilePosition, Read_, Source, number, shown, words};
use std::io::BufRead;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Little,
    Big,
}

/// A scalar's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
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
    pub(super) fn named(word: &[u8]) -> Option<Scalar> {
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

    pub(super) fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// The number in the first bytes. All types fit in 64 bits.
    pub(super) fn decode(self, bytes: &[u8], encoding: Encoding) -> f64 {
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
pub(super) struct Property {
    pub(super) name: Vec<u8>,
    /// The line that declares it.
    pub(super) place: Option<FilePosition>,
    /// The type of a list's length, if it is a list.
    pub(super) length: Option<Scalar>,
    pub(super) scalar: Scalar,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: Vec<u8>,
    /// The line that declares it.
    pub(super) place: Option<FilePosition>,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// The minimum number of bytes of an element.
    pub(super) fn least_bytes(&self, encoding: Encoding) -> u64 {
        let one = |property: &Property| match encoding {
            // A digit and a blank.
            Encoding::Text => 2,
            _ => property.length.unwrap_or(property.scalar).size() as u64,
        };
        self.properties.iter().map(one).sum::<u64>().max(1)
    }

    pub(super) fn find(&self, names: &[&[u8]]) -> Option<usize> {
        self.properties.iter().position(|property| names.contains(&property.name.as_slice()))
    }
}

/// The maximum number of elements, and of properties of an element, far beyond that of real files.
const MOST_PROPERTIES: usize = 1000;

pub(super) fn header<R: BufRead>(
    source: &mut Source<'_, R>,
    parts: &mut Parts<'_>,
) -> Read_<(Encoding, Vec<Element>)> {
    let mut line = Vec::new();
    if !source.next_line(&mut line)? || words(&line).next() != Some(b"ply") {
        return Err(source.whole("this is not a PLY file: it does not begin with \"ply\""));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        if !source.next_line(&mut line)? {
            return Err(source.whole("the header does not end: \"end_header\" is missing"));
        }
        let given: Vec<&[u8]> = words(&line).take(6).collect();
        match given[..] {
            [b"comment", b"TextureFile", ..] => parts.note("textures are not read", source.line()),
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
                    return Err(source.on_line(format!("{} is not a number of elements", shown(count))));
                };
                let (name, place) = (name.into(), source.line());
                elements.push(Element { name, place, count, properties: Vec::new() });
            }
            [b"property", ref of @ .., name] if !of.is_empty() => {
                let scalar = |word: &[u8]| {
                    Scalar::named(word).ok_or_else(|| source.on_line(format!("unknown type {}", shown(word))))
                };
                let (length, scalar) = match of {
                    [one] => (None, scalar(one)?),
                    [b"list", length, each] => (Some(scalar(length)?), scalar(each)?),
                    _ => return Err(source.on_line("a property needs a type and a name")),
                };
                let Some(element) = elements.last_mut() else {
                    return Err(source.on_line("a property before the first element"));
                };
                let (name, place) = (name.into(), source.line());
                element.properties.push(Property { name, place, length, scalar });
                if element.properties.len() > MOST_PROPERTIES {
                    return Err(source.on_line("an element of more than 1,000 properties"));
                }
            }
            [b"format" | b"element" | b"property" | b"end_header", ..] => {
                return Err(source.on_line(format!("unknown header line {}", shown(&line))));
            }
            // For example, the name of a program without "comment" before it.
            _ => parts.note("unknown header lines are ignored", source.line()),
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
