//! The bytes of a glTF document: buffers, buffer views, and accessors.
//!
//! Every range is checked against the available bytes before memory is allocated for it.

use super::accessors::{Floats, Indices, View, size};
use super::document::{Accessor, Document, Sparse};
use super::extensions::compressed;
use super::fault::only;
use super::room::Room;
use crate::scene::mesh::source::{beside, open};
use crate::shape::MOST_TRIANGLES;
use data_encoding::{BASE64, BASE64_NOPAD};
use percent_encoding::percent_decode_str;
use std::io::Read;
use std::path::Path;
use std::rc::Rc;

/// The buffers loaded so far.
pub(super) struct Buffers<'a> {
    /// The document's own file.
    file: &'a Path,
    /// The binary chunk of a `.glb`: the first buffer.
    binary: Option<Rc<Vec<u8>>>,
    loaded: Vec<Option<Rc<Vec<u8>>>>,
    pub(super) room: Room,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(file: &'a Path, binary: Option<Vec<u8>>, room: Room) -> Self {
        Buffers { file, binary: binary.map(Rc::new), loaded: Vec::new(), room }
    }

    /// An accessor's vectors of `N` floats.
    pub(super) fn floats<const N: usize>(
        &mut self,
        document: &Document,
        index: usize,
    ) -> Result<Floats<N>, String> {
        let accessor = accessor(document, index)?;
        let name = |message: String| format!("accessor {index} {message}");
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        if accessor.kind != kind {
            return Err(name(format!("holds {:?}, which does not fit its use", accessor.kind)));
        }
        let component = accessor.component_type;
        let element = N as u64 * size(component).map_err(name)?;
        let view = match accessor.buffer_view {
            Some(view) => {
                self.view(document, view, accessor.byte_offset, accessor.count, element).map_err(name)?
            }
            // The caller checks the memory for these zeros before it decodes them.
            None if accessor.count <= MOST_TRIANGLES as u64 => {
                View { bytes: Rc::default(), first: 0, stride: 0, count: accessor.count as usize }
            }
            None => return Err(name(format!("declares {} elements without a buffer view", accessor.count))),
        };
        let sparse = self.sparse(document, index, accessor, element).map_err(name)?;
        let (normalized, is_zero) = (accessor.normalized, accessor.buffer_view.is_none());
        Ok(Floats { view, component, normalized, is_zero, sparse })
    }

    /// The indices of an accessor's replaced elements, and their replacements.
    fn sparse(
        &mut self,
        document: &Document,
        accessor: usize,
        Accessor { sparse, .. }: &Accessor,
        element: u64,
    ) -> Result<Option<(Indices, View)>, String> {
        let Some(Sparse { count, indices, values }) = sparse else { return Ok(None) };
        let component = indices.component_type;
        let view = self.view(document, indices.buffer_view, indices.byte_offset, *count, size(component)?)?;
        let values = self.view(document, values.buffer_view, values.byte_offset, *count, element)?;
        Ok(Some((Indices { accessor, view, component, sparse: None }, values)))
    }

    /// An accessor's indices.
    pub(super) fn indices(&mut self, document: &Document, index: usize) -> Result<Indices, String> {
        let accessor = accessor(document, index)?;
        let name = |message: String| format!("accessor {index} {message}");
        if accessor.kind != "SCALAR" {
            return Err(name(format!("holds {:?}, which cannot be indices", accessor.kind)));
        }
        let component = accessor.component_type;
        let size = size(component).map_err(name)?;
        let Some(view) = accessor.buffer_view else {
            let message = "has no buffer view, and all indices would be 0: name the one with the indices, or export the file again";
            return Err(name(message.into()));
        };
        let view = self.view(document, view, accessor.byte_offset, accessor.count, size).map_err(name)?;
        let sparse = self.sparse(document, index, accessor, size).map_err(name)?;
        let sparse = sparse.map(|(places, values)| {
            let values = Indices { accessor: index, view: values, component, sparse: None };
            Box::new((places, values))
        });
        Ok(Indices { accessor: index, view, component, sparse })
    }

    /// Elements of a given size in a view, with their range checked.
    fn view(
        &mut self,
        document: &Document,
        index: usize,
        offset: u64,
        count: u64,
        element: u64,
    ) -> Result<View, String> {
        let Some(view) = document.buffer_views.get(index) else {
            return Err(format!("has buffer view {index}, but {}", only(document.buffer_views.len())));
        };
        if let Some(compression) = view.extensions.compression()
            && self.is_elsewhere(document, view.buffer)
        {
            return Err(format!("has buffer view {index}: {}", compressed(compression)));
        }
        let bytes = self.buffer(document, view.buffer)?;
        let view_end = view.byte_offset.checked_add(view.byte_length);
        if view_end.is_none_or(|end| end > bytes.len() as u64) {
            let (length, have) = (view.byte_length, bytes.len());
            return Err(format!(
                "has buffer view {index}: {length} bytes from byte {} of a buffer of {have}",
                view.byte_offset
            ));
        }
        let stride = view.byte_stride.unwrap_or(element);
        if stride < element {
            return Err(format!(
                "has elements of {element} bytes, of which buffer view {index} holds {stride}"
            ));
        }
        let last = count.checked_sub(1).map(|before| before.checked_mul(stride));
        let end = match last {
            None => Some(0),
            Some(last) => last.and_then(|last| last.checked_add(offset)?.checked_add(element)),
        };
        if end.is_none_or(|end| end > view.byte_length) {
            let length = view.byte_length;
            return Err(format!(
                "declares {count} elements, more than fit in buffer view {index} of {length} bytes"
            ));
        }
        let first = if count == 0 { 0 } else { (view.byte_offset + offset) as usize };
        Ok(View { bytes, first, stride: stride as usize, count: count as usize })
    }

    /// Whether a buffer has no bytes: it represents the uncompressed form of another one.
    fn is_elsewhere(&self, document: &Document, index: usize) -> bool {
        document.buffers.get(index).is_some_and(|buffer| {
            let is_chunk = index == 0 && self.binary.is_some() && buffer.extensions.compression().is_none();
            buffer.uri.is_none() && !is_chunk
        })
    }

    /// A buffer's bytes, loaded once.
    fn buffer(&mut self, document: &Document, index: usize) -> Result<Rc<Vec<u8>>, String> {
        let Some(buffer) = document.buffers.get(index) else {
            return Err(format!("needs buffer {index}, but {}", only(document.buffers.len())));
        };
        self.loaded.resize(document.buffers.len(), None);
        if let Some(bytes) = &self.loaded[index] {
            return Ok(Rc::clone(bytes));
        }
        let bytes = match &buffer.uri {
            None if index == 0 => {
                self.binary.clone().ok_or_else(|| "needs the binary chunk, which is missing".to_owned())?
            }
            None => return Err(format!("needs buffer {index}, which has neither a URI nor a binary chunk")),
            Some(uri) => {
                Rc::new(self.load(uri, buffer.byte_length).map_err(|e| format!("needs buffer {index}: {e}"))?)
            }
        };
        if (bytes.len() as u64) < buffer.byte_length {
            let (have, promised) = (bytes.len(), buffer.byte_length);
            return Err(format!(
                "needs buffer {index}, which has {have} bytes of {promised}: it is truncated"
            ));
        }
        self.loaded[index] = Some(Rc::clone(&bytes));
        Ok(bytes)
    }

    fn load(&mut self, uri: &str, length: u64) -> Result<Vec<u8>, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((_, text)) = data.split_once(";base64,") else {
                return Err("its data: URI is not in base64".into());
            };
            let padded =
                if text.ends_with('=') || text.len().is_multiple_of(4) { BASE64 } else { BASE64_NOPAD };
            return padded
                .decode(text.as_bytes())
                .map_err(|error| format!("its data: URI is invalid base64: {error}"));
        }
        if uri.split_once(':').is_some_and(|(scheme, _)| scheme.len() > 1 && !scheme.contains('/')) {
            return Err(format!("{:?} is on another machine", shortened(uri)));
        }
        let path = beside(self.file, &percent_decode_str(uri).decode_utf8_lossy());
        let (file, _) = open(&path).map_err(|error| error.to_string())?;
        let mut bytes = Vec::new();
        // No more than the declared length.
        match file.take(length).read_to_end(&mut bytes) {
            Ok(read) => {
                self.room.add_file(read as u64);
                Ok(bytes)
            }
            Err(error) => Err(format!("{}: cannot be read: {error}", path.display())),
        }
    }
}

fn accessor(document: &Document, index: usize) -> Result<&Accessor, String> {
    let missing = || format!("it needs accessor {index}, but {}", only(document.accessors.len()));
    document.accessors.get(index).ok_or_else(missing)
}

fn shortened(text: &str) -> String {
    text.chars().take(60).collect()
}
