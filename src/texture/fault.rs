//! Errors of picture files, and limits of their size.

use std::io;
use thiserror::Error;

/// The number of bytes in a GiB.
const GIB: u64 = 1 << 30;

/// The maximum number of bytes of a picture, in its file and in memory.
pub const MOST_BYTES: u64 = GIB;

/// The maximum number of bytes in memory of all pictures of a scene, without their coarser levels.
pub const MOST_BYTES_IN_ALL: u64 = 8 * GIB;

/// The longest side of a picture.
pub(super) const LONGEST_SIDE: u64 = 1 << 16;

/// The maximum number of pixels per byte of a file compressed by deflate, which expands one byte to at most 1032; a
/// pixel has at least one bit.
const MOST_PIXELS_PER_BYTE: u64 = 8 * 1032;

/// The extensions of picture files.
pub const EXTENSIONS: [&str; 10] = ["png", "jpg", "jpeg", "tga", "bmp", "tif", "tiff", "webp", "hdr", "exr"];

/// A picture file that could not be read.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The file does not exist.
    #[error("there is no such file")]
    Missing,
    /// It is a directory.
    #[error("this is a folder")]
    IsFolder,
    /// Another error of the operating system.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// The name has no extension of a known format.
    #[error("a picture is a {}", listed())]
    UnknownFormat,
    /// The picture is empty.
    #[error("this picture has no texels")]
    Empty,
    /// The picture is above the limits.
    #[error(
        "a picture of {0}×{1} texels is larger than the limits of {side} a side and {most} GiB",
        side = LONGEST_SIDE,
        most = MOST_BYTES / GIB
    )]
    TooLarge(u64, u64),
    /// The picture exceeds the memory that is left for all pictures of the scene.
    #[error(
        "with this picture of {0}×{1} texels the pictures of the scene take more than {most} GiB in all",
        most = MOST_BYTES_IN_ALL / GIB
    )]
    TooMuchInAll(u64, u64),
    /// The file is larger than any picture may be.
    #[error("this file is larger than {most} GiB, the limit for a picture", most = MOST_BYTES / GIB)]
    FileTooLarge,
    /// The file is too short for the size in its header.
    #[error("its header promises {0}×{1} texels, too many for {2} bytes")]
    TooFewBytes(u64, u64, u64),
    /// The contents do not match the extension, or are incomplete.
    #[error("this is not a complete {0} file ({1})")]
    Broken(&'static str, String),
    /// A valid file with numbers that textures do not support.
    #[error("{0}")]
    Unsupported(String),
}

/// The extensions as part of a sentence.
fn listed() -> String {
    let (last, others) = EXTENSIONS.split_last().unwrap_or((&"", &[]));
    let others: Vec<_> = others.iter().map(|extension| format!(".{extension}")).collect();
    format!("{} or .{last}", others.join(", "))
}

/// Checks a size before memory is allocated, with `room` bytes left for the pictures of the scene.
pub(super) fn check_size(width: u64, height: u64, texel: u64, room: u64) -> Result<(), PictureError> {
    if width == 0 || height == 0 {
        return Err(PictureError::Empty);
    }
    let bytes = width.saturating_mul(height).saturating_mul(texel);
    if width.max(height) > LONGEST_SIDE || bytes > MOST_BYTES {
        return Err(PictureError::TooLarge(width, height));
    }
    if bytes > room {
        return Err(PictureError::TooMuchInAll(width, height));
    }
    Ok(())
}

/// Checks whether a file compressed by deflate, or less efficiently, has enough bytes for a size.
pub(super) fn check_header(width: u64, height: u64, bytes: &[u8]) -> Result<(), PictureError> {
    if width.saturating_mul(height) > (bytes.len() as u64).saturating_mul(MOST_PIXELS_PER_BYTE) {
        return Err(PictureError::TooFewBytes(width, height, bytes.len() as u64));
    }
    Ok(())
}
