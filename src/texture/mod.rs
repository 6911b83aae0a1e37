//! Textures: numbers and colours that vary over a surface.
//!
//! | file | contents |
//! |---|---|
//! | `constant`, `image`, `checkerboard`, `mix`, `scale`, `noise` | one kind of texture each: its parameters, its program, its value |
//! | `list` | the list of kinds |
//! | `instruction` | the instructions of programs |
//! | `program` | textures as programs, and their cost |
//! | `columns` | the instructions and pictures of a scene as tables |
//! | `compile` | compilation of a scene's textures to these tables |
//! | `table` | all textures of a scene in one table |
//! | `site` | the point at which a texture is evaluated |
//! | `slope_step` | the distances over which the slopes of textures are measured |
//! | `evaluate` | the evaluation of programs, which gives the value of a texture at a point |
//! | `fetch` | access to texels of pictures |
//! | `picture`, `mipmap` | pictures in memory, and their coarser levels |
//! | `fault` | errors of picture files, and their limits |
//! | `decode`, `decode_exr` | decoding of picture files |
//! | `files` | image files and their tiles |
//! | [`access`] | which files the readers of a scene open, and which they may open |
//!
//! A texture is compiled into a short program of linked instructions, which evaluates it with a stack of a few colours.
//! A new kind of texture needs a new file, a `mod` line here, a line in `list.rs`, and an instruction in
//! `instruction.rs` and `evaluate.rs`.

pub mod access;
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
mod slope_step;
mod table;

pub use columns::{COLOURED, SRGB};
pub use compile::{Compiler, TooDeep, costs, uses_of_second_uv};
pub use decode::{decode, read};
pub use fault::{EXTENSIONS, MOST_BYTES, MOST_BYTES_IN_ALL, PictureError};
pub use files::{FilesError, ImageFile, Tile, UDIM, read_files};
pub use image::{ColorSpace, TexelFilter, Wrap};
pub use list::*;
pub use picture::{Depth, Picture};
pub use program::{Cost, MOST_INSTRUCTIONS, STACK};
pub use site::{SecondUv, Site};
pub use slope_step::SlopeStep;
pub use table::{NO_TEXTURE, TextureTable};
#[cfg(test)]
mod tests;
