//! Decoding of OpenEXR files.

use super::fault::{MOST_BYTES, PictureError, check_header, check_size};
use super::picture::{Depth, Picture};
use exr::image::{AnyChannels, FlatSamples, Layer};
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, read};
use std::io::Cursor;

type FlatLayer = Layer<AnyChannels<FlatSamples>>;

/// Reads the first layer with channels R, G and B, or else with Y alone. Names may also end in these after a dot. The
/// picture is its data window.
pub(super) fn decode_exr(bytes: &[u8], room: u64) -> Result<Picture, PictureError> {
    let broken = |error: exr::error::Error| PictureError::Broken("EXR", error.to_string());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    // All parts are decoded, whichever contains the picture.
    let mut taken = 0;
    for header in &meta.headers {
        let [width, height] = [header.layer_size.x(), header.layer_size.y()].map(|side| side as u64);
        let texel = header.channels.bytes_per_pixel as u64;
        check_size(width, height, texel, room)?;
        check_header(width, height, bytes)?;
        taken += width * height * texel;
        if taken > MOST_BYTES {
            return Err(PictureError::TooLarge(width, height));
        }
        if taken > room {
            return Err(PictureError::TooMuchInAll(width, height));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;
    let layers = || image.layer_data.iter();
    let rgb = layers().find_map(|layer| Some((layer, channels(layer, ["R", "G", "B"])?.to_vec())));
    let found = rgb.or_else(|| layers().find_map(|layer| Some((layer, channels(layer, ["Y"])?.to_vec()))));
    let Some((layer, channels)) = found else {
        let message = "it has neither channels R, G and B nor Y at full resolution";
        return Err(PictureError::Unsupported(message.to_owned()));
    };
    let is_half = channels.iter().all(|samples| matches!(samples, FlatSamples::F16(_)));
    let texels = layer.size.width() * layer.size.height();
    let count = channels.len() as u32;
    let (depth, mut own) = (if is_half { Depth::Half } else { Depth::Float }, Vec::new());
    own.reserve(texels * channels.len() * depth.bytes());
    for texel in 0..texels {
        for samples in &channels {
            match samples {
                FlatSamples::F16(samples) if is_half => {
                    own.extend_from_slice(&samples[texel].to_bits().to_le_bytes());
                }
                FlatSamples::F16(samples) => own.extend_from_slice(&samples[texel].to_f32().to_le_bytes()),
                FlatSamples::F32(samples) => own.extend_from_slice(&samples[texel].to_le_bytes()),
                FlatSamples::U32(samples) => own.extend_from_slice(&(samples[texel] as f32).to_le_bytes()),
            }
        }
    }
    let size = [layer.size.width() as u32, layer.size.height() as u32];
    Ok(Picture::new(size, [count; 2], depth, &own))
}

/// The channels with these names, those without a prefix first.
fn channels<'a, const N: usize>(layer: &'a FlatLayer, names: [&str; N]) -> Option<[&'a FlatSamples; N]> {
    let list = &layer.channel_data.list;
    let find = |name: &str| {
        let is_it = |own: &str| own.eq_ignore_ascii_case(name);
        let found = list.iter().find(|channel| is_it(&channel.name.to_string()))?;
        let is_whole = found.sampling.x() == 1 && found.sampling.y() == 1;
        is_whole.then_some(&found.sample_data)
    };
    let with = |prefix: &str| {
        let mut found = [None; N];
        for (found, name) in found.iter_mut().zip(names) {
            *found = Some(find(&format!("{prefix}{name}"))?);
        }
        Some(found)
    };
    let prefixed = || {
        list.iter().find_map(|channel| {
            let name = channel.name.to_string();
            with(&name[..=name.rfind('.')?])
        })
    };
    let found = with("").or_else(prefixed)?;
    let mut all = [&list.first()?.sample_data; N];
    for (one, found) in all.iter_mut().zip(found) {
        *one = found?;
    }
    Some(all)
}
