//! Decoding of bytes by accessors. All bytes are known to exist, and memory is checked before anything is decoded.

use std::rc::Rc;

/// The types of components.
const I8: u32 = 5120;
const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// The number of bytes that a component takes.
pub(super) fn size(component: u32) -> Result<u64, String> {
    match component {
        I8 | U8 => Ok(1),
        I16 | U16 => Ok(2),
        U32 | F32 => Ok(4),
        other => Err(format!("has components of the unknown type {other}")),
    }
}

/// Components at equal distances in a buffer.
pub(super) struct View {
    pub(super) bytes: Rc<Vec<u8>>,
    pub(super) first: usize,
    pub(super) stride: usize,
    pub(super) count: usize,
}

/// Vectors of `N` floats.
pub(super) struct Floats<const N: usize> {
    pub(super) view: View,
    pub(super) component: u32,
    pub(super) normalized: bool,
    /// Whether the accessor has no buffer view: all vectors that are not replaced are zero.
    pub(super) is_zero: bool,
    /// The indices of replaced vectors, and their replacements.
    pub(super) sparse: Option<(Indices, View)>,
}

impl<const N: usize> Floats<N> {
    pub(super) fn count(&self) -> usize {
        self.view.count
    }

    /// The number of replacements, which may exceed the number of vectors.
    pub(super) fn replacing(&self) -> usize {
        self.sparse.as_ref().map_or(0, |(places, _)| places.count())
    }

    pub(super) fn decode(&self) -> Result<Vec<[f32; N]>, String> {
        self.decode_first(self.view.count)
    }

    /// Decodes the first `count` vectors only.
    pub(super) fn decode_first(&self, count: usize) -> Result<Vec<[f32; N]>, String> {
        let wide = size(self.component)? as usize;
        let one = |view: &View, i: usize| {
            let at = view.first + i * view.stride;
            let bytes = &view.bytes[at..at + N * wide];
            std::array::from_fn(|c| number(&bytes[c * wide..], self.component, self.normalized))
        };
        let count = count.min(self.view.count);
        let mut all: Vec<[f32; N]> = match self.is_zero {
            true => vec![[0.0; N]; count],
            false => (0..count).map(|i| one(&self.view, i)).collect(),
        };
        if let Some((places, values)) = &self.sparse {
            for i in 0..places.count() {
                if let Some(place) = all.get_mut(places.replaced(i, self.view.count)?) {
                    *place = one(values, i);
                }
            }
        }
        Ok(all)
    }
}

/// Indices of vertices, or of replaced elements.
pub(super) struct Indices {
    pub(super) accessor: usize,
    pub(super) view: View,
    pub(super) component: u32,
    /// The positions of replaced indices, and their replacements.
    pub(super) sparse: Option<Box<(Indices, Indices)>>,
}

impl Indices {
    pub(super) fn count(&self) -> usize {
        self.view.count
    }

    /// The number of replacements, which may exceed the number of indices.
    pub(super) fn replacing(&self) -> usize {
        self.sparse.as_ref().map_or(0, |sparse| sparse.0.count())
    }

    pub(super) fn decode(&self) -> Result<Vec<u32>, String> {
        let mut all: Vec<u32> = (0..self.count()).map(|i| self.get(i)).collect::<Result<_, _>>()?;
        if let Some((places, values)) = self.sparse.as_deref() {
            for i in 0..places.count() {
                let at = places.replaced(i, all.len())?;
                all[at] = values.get(i)?;
            }
        }
        Ok(all)
    }

    /// The element, below `count`, that replacement `i` replaces.
    fn replaced(&self, i: usize, count: usize) -> Result<usize, String> {
        let at = self.get(i)? as usize;
        if at < count {
            Ok(at)
        } else {
            Err(format!("accessor {} replaces element {at} of {count}", self.accessor))
        }
    }

    fn get(&self, i: usize) -> Result<u32, String> {
        let bytes = &self.view.bytes[self.view.first + i * self.view.stride..];
        match self.component {
            U8 => Ok(u32::from(bytes[0])),
            U16 => Ok(u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))),
            U32 => Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            _ => Err(format!("accessor {} holds indices that are not unsigned integers", self.accessor)),
        }
    }
}

/// The component at the start of some bytes as a float; normalised integers become fractions.
fn number(bytes: &[u8], component: u32, normalized: bool) -> f32 {
    let (value, most) = match component {
        I8 => (f32::from(bytes[0] as i8), 127.0),
        U8 => (f32::from(bytes[0]), 255.0),
        I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        U16 => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        U32 => (u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32, 4_294_967_295.0),
        _ => (f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]), 1.0),
    };
    if normalized && component != F32 { (value / most).max(-1.0) } else { value }
}
