//! Textures compared with formulas, and valid and invalid picture files.

mod files;
mod levels;
mod values;

use super::{
    ColorSpace, Compiler, Depth, ImageFile, ImageTexture, Picture, Site, TexelFilter, TextureKind, Tile, Wrap,
};
use crate::math::Vec3;
use crate::math::lanes::scalar::Wrapping;
use crate::parameter::ImageIndex;
use std::sync::Arc;

/// A plain image of the first picture.
fn plain() -> ImageTexture {
    ImageTexture {
        file: ImageIndex(0),
        color_space: ColorSpace::Data,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Linear,
        mipmap: false,
        uv_scale: [1.0; 2],
        uv_offset: [0.0; 2],
        uv_rotate: 0.0,
        uv_set: 0.0,
    }
}

/// A grey picture of floats, the first one at the upper left.
fn greys(width: u32, numbers: &[f32]) -> Picture {
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    Picture::new([width, numbers.len() as u32 / width], [1, 1], Depth::Float, &bytes)
}

fn file(picture: Picture) -> ImageFile {
    ImageFile::of("picture".into(), Arc::new(picture))
}

/// The values of the last of some textures at uv and points.
fn values(textures: &[TextureKind], images: &[ImageFile], at: &[([f32; 2], [f32; 3])]) -> Vec<[f32; 3]> {
    let mut compiler = Compiler::new(textures, images);
    let root = Wrapping(compiler.root(textures.len() - 1));
    let table = compiler.finish();
    at.iter()
        .map(|&(uv, p)| table.value::<f32>(root, Site::new(Vec3::splat(p), uv, 0.0)).channels())
        .collect()
}

/// The value at uv.
fn value(textures: &[TextureKind], images: &[ImageFile], uv: [f32; 2]) -> [f32; 3] {
    values(textures, images, &[(uv, [0.0; 3])])[0]
}
