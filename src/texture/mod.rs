//! Textures: numbers and colours that differ from point to point of a surface.
//!
//! | file | what is in it |
//! |---|---|
//! | `constant`, `image`, `checkerboard`, `mix`, `scale`, `noise` | a kind of texture each: its parameters, its program, its value |
//! | `list` | the list of kinds |
//! | `instruction` | the instructions of programs |
//! | `program` | textures as programs, and what they take |
//! | `columns` | the instructions and the pictures of a scene as tables |
//! | `compile` | from the textures of a scene to these tables |
//! | `table` | the textures of a scene in one table |
//! | `site` | the point at which a texture is looked up |
//! | `evaluate` | the evaluation of programs, which finds the value of a texture at a point |
//! | `fetch` | the texels of pictures |
//! | `picture`, `mipmap` | pictures in memory, and coarser levels of them |
//! | `fault` | what is wrong with picture files, and their limits |
//! | `decode`, `decode_exr` | picture files |
//! | `files` | image files and their tiles |
//!
//! A texture is compiled into a short program, whose instructions lead from one to the next; what they compute is kept
//! on a stack of a few colours. A new kind of texture is a new file, a `mod` line here, a line in `list.rs`, and an
//! instruction in `instruction.rs` and `evaluate.rs`.

mod checkerboard;
mod columns;
mod compile;
mod constant;
mod decode;
mod decode_exr;
mod evaluate;
mod fault;
mod fetch;
mod files;
mod image;
mod instruction;
pub(crate) mod list;
mod mipmap;
mod mix;
mod noise;
mod picture;
mod program;
mod scale;
mod site;
mod table;

pub use columns::{COLOURED, SRGB};
pub use compile::{Compiler, TooDeep, costs};
pub use decode::{decode, read};
pub use fault::{EXTENSIONS, MOST_BYTES, MOST_BYTES_IN_ALL, PictureError};
pub use files::{FilesError, ImageFile, Tile, UDIM, read_files};
pub use image::{ColorSpace, TexelFilter, Wrap};
pub use list::*;
pub use picture::{Depth, Picture};
pub use program::{Cost, MOST_INSTRUCTIONS, STACK};
pub use site::Site;
pub use table::{NO_TEXTURE, TextureTable};
#[cfg(test)]
mod tests;
