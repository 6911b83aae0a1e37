//! Picture files that cannot be read, and the limits of those that can.

use std::io;
use thiserror::Error;

/// Bytes of a GiB.
const GIB: u64 = 1 << 30;

/// The most bytes of a picture, in its file and in memory.
pub const MOST_BYTES: u64 = GIB;

/// The most bytes in memory of all pictures of a scene, without the coarser levels that are made of them.
pub const MOST_BYTES_IN_ALL: u64 = 8 * GIB;

/// The longest side of a picture.
pub(super) const LONGEST_SIDE: u64 = 1 << 16;

/// The most pixels for each byte of a file that is packed by deflate, which makes 1032 bytes of one; a pixel has a bit
/// at least.
const MOST_PIXELS_PER_BYTE: u64 = 8 * 1032;

/// The extensions of picture files.
pub const EXTENSIONS: [&str; 10] = ["png", "jpg", "jpeg", "tga", "bmp", "tif", "tiff", "webp", "hdr", "exr"];

/// A picture file that could not be read.
#[derive(Debug, Error)]
pub enum PictureError {
    /// There is none.
    #[error("there is no such file")]
    Missing,
    /// It is a folder.
    #[error("this is a folder")]
    IsFolder,
    /// Anything else that the operating system refuses.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// The name ends in nothing that names a format.
    #[error("a picture is a {}", listed())]
    UnknownFormat,
    /// No texel at all.
    #[error("there is no texel in this picture")]
    Empty,
    /// More than there may be.
    #[error(
        "a picture of {0}×{1} texels is larger than the limits of {side} a side and {most} GiB",
        side = LONGEST_SIDE,
        most = MOST_BYTES / GIB
    )]
    TooLarge(u64, u64),
    /// More than is left of what all pictures of a scene may take.
    #[error(
        "with this picture of {0}×{1} texels the pictures of the scene take more than {most} GiB in all",
        most = MOST_BYTES_IN_ALL / GIB
    )]
    TooMuchInAll(u64, u64),
    /// A file that is larger than any picture may be.
    #[error("this file is larger than {most} GiB, the most that a picture may take", most = MOST_BYTES / GIB)]
    FileTooLarge,
    /// The promise of a header that the file is too short for.
    #[error("its header promises {0}×{1} texels, too many for {2} bytes")]
    TooFewBytes(u64, u64, u64),
    /// What is in the file is not what its name says, or only a part of it.
    #[error("this is no whole {0} file ({1})")]
    Broken(&'static str, String),
    /// A whole file, of numbers that textures do not take.
    #[error("{0}")]
    Unsupported(String),
}

/// The extensions in a sentence.
fn listed() -> String {
    let (last, others) = EXTENSIONS.split_last().unwrap_or((&"", &[]));
    let others: Vec<_> = others.iter().map(|extension| format!(".{extension}")).collect();
    format!("{} or .{last}", others.join(", "))
}

/// Refuses a size before there is memory for it, of which `room` bytes are left to the pictures of a scene.
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

/// Refuses a size for which a file has not bytes enough, where it is packed by deflate or worse.
pub(super) fn check_promise(width: u64, height: u64, bytes: &[u8]) -> Result<(), PictureError> {
    if width.saturating_mul(height) > (bytes.len() as u64).saturating_mul(MOST_PIXELS_PER_BYTE) {
        return Err(PictureError::TooFewBytes(width, height, bytes.len() as u64));
    }
    Ok(())
}
