//! OpenEXR: linear 32-bit floats, channels R, G, B, scan lines from the top.
//!
//! ZIP over blocks of 16 lines: on noisy floats no lossless method saves much (640×480 with 2% noise: 3.5 MB
//! of 3.7 in 110 ms; PIZ 3.2 MB in 140 ms), on smooth ones it is the smallest and fastest (1.2 MB in 37 ms;
//! PIZ 1.6 in 53), and all readers support it.

use std::io::{self, Cursor, Read, Seek, Write};

use ::exr::compression::Compression;
use ::exr::image::{AnyChannel, AnyChannels, Blocks, FlatSamples};
use ::exr::meta::attribute::{AttributeValue, Chromaticities, LineOrder, Text};
use ::exr::prelude::{Encoding, Image, IntegerBounds, Layer, LayerAttributes, MetaData, Vec2, WritableImage};

use super::options::PictureOptions;
use crate::film::cryptomatte::{self, Names};
use crate::film::{Identity, Picture};

/// The primaries and white point of Rec. 709, which readers assume by default; they are written to be explicit.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.3, 0.6),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.329),
};

/// Writes a picture's radiance, bit for bit, its layers, and its metadata: one line per fact, in the standard attribute
/// `comments`, because custom attributes would be in a different order each time. The
/// display window is the film, the data window the part of it in the picture.
pub fn encode(
    picture: &Picture,
    options: &PictureOptions<'_>,
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    let PictureOptions { facts, channels: layers, mattes, crop, view: _ } = *options;
    let colour = ["R", "G", "B"].into_iter().enumerate().map(|(c, name)| {
        AnyChannel::new(name, FlatSamples::F32(picture.rgb.iter().map(|rgb| rgb[c]).collect()))
    });
    let layers = layers
        .iter()
        .map(|channel| AnyChannel::new(channel.name.as_str(), FlatSamples::F32(channel.values.clone())));
    let channels = AnyChannels::sort(colour.chain(layers).collect());
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let text = |text: &str| Text::new_or_none(text.replace(|c: char| !c.is_ascii(), "?"));
    let mut attributes = LayerAttributes {
        software_name: facts.and_then(|facts| text(facts.get("program")?)),
        comments: facts.and_then(|facts| text(&facts.to_string())),
        ..LayerAttributes::default()
    };
    attributes.other = mattes.iter().flat_map(|names| matte_attributes(names)).collect();
    let size = (picture.width as usize, picture.height as usize);
    let mut layer = Layer::new(size, attributes, encoding, channels);
    let pair = |[x, y]: [u32; 2]| Vec2(x as usize, y as usize);
    layer.attributes.layer_position = crop.map_or(Vec2(0, 0), |crop| pair(crop.from).to_i32());
    let mut image = Image::from_layer(layer);
    image.attributes.display_window =
        IntegerBounds::from_dimensions(crop.map_or(size.into(), |c| pair(c.film)));
    image.attributes.chromaticities = Some(REC_709);
    // One thread: blocks are then in the order of lines, and the renderer uses the other threads.
    if mattes.is_empty() {
        return image.write().non_parallel().to_buffered(out).map_err(to_io);
    }
    let mut file = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut file).map_err(to_io)?;
    let mut file = file.into_inner();
    sort_attributes(&mut file);
    out.write_all(&file)
}

/// The header attributes of a Cryptomatte layer, under a key that is specific to the layer.
fn matte_attributes(names: &Names) -> [(Text, AttributeValue); 4] {
    let key = format!("cryptomatte/{:07x}", cryptomatte::hash(names.layer) >> 4);
    let manifest = names.manifest();
    [
        ("name", names.layer),
        ("hash", "MurmurHash3_32"),
        ("conversion", "uint32_to_float32"),
        ("manifest", &manifest),
    ]
    .map(|(name, value)| (Text::from(&format!("{key}/{name}")[..]), AttributeValue::Text(Text::from(value))))
}

/// Sorts the attributes of a file's header by name: custom ones are in a different order each time. An attribute is a
/// name and a type, both zero-terminated, the length of its value, and the value; a zero byte ends the header.
fn sort_attributes(file: &mut [u8]) {
    const START: usize = 8;
    let end_of_text = |at: usize| file[at..].iter().position(|&byte| byte == 0).map(|len| at + len + 1);
    let end_of = |at: usize| {
        let length = end_of_text(end_of_text(at)?)?;
        let bytes = file.get(length..length + 4)?.try_into().ok()?;
        Some(length + 4 + u32::from_le_bytes(bytes) as usize)
    };
    let (mut attributes, mut at) = (Vec::new(), START);
    while file.get(at).is_some_and(|&byte| byte != 0) {
        // The header was just written, and so has this form.
        let Some(end) = end_of(at).filter(|&end| end <= file.len()) else { return };
        attributes.push(file[at..end].to_vec());
        at = end;
    }
    attributes.sort_unstable();
    file[START..at].copy_from_slice(&attributes.concat());
}

/// The Cryptomatte layers of a file, each with the number of names in its manifest.
pub fn mattes(file: impl Read) -> Vec<(String, usize)> {
    let Ok(meta) = MetaData::read_from_unbuffered(file, true) else { return Vec::new() };
    let others = || meta.headers.iter().flat_map(|header| &header.own_attributes.other);
    let text = |wanted: &str| {
        others().find_map(|(name, value)| match value {
            AttributeValue::Text(text) if *name == *wanted => Some(text.to_string()),
            _ => None,
        })
    };
    let mut found: Vec<_> = others()
        .filter_map(|(name, _)| {
            let key = name.to_string().strip_suffix("/name")?.to_owned();
            let layer = text(&format!("{key}/name")).filter(|_| key.starts_with("cryptomatte/"))?;
            let manifest = text(&format!("{key}/manifest"))?;
            let names: serde_json::Map<_, _> = serde_json::from_str(&manifest).ok()?;
            Some((layer, names.len()))
        })
        .collect();
    found.sort();
    found
}

/// The names of a file's channels.
pub fn channels(file: impl Read) -> Vec<String> {
    let meta = MetaData::read_from_unbuffered(file, true).ok();
    let headers = meta.iter().flat_map(|meta| &meta.headers);
    headers.flat_map(|header| &header.channels.list).map(|channel| channel.name.to_string()).collect()
}

/// The facts that [`encode`] has written into a file, if there are any.
pub fn facts(file: impl Read) -> Option<Identity> {
    let meta = MetaData::read_from_unbuffered(file, true).ok()?;
    Identity::parse(&meta.headers.first()?.own_attributes.comments.as_ref()?.to_string())
}

fn to_io(error: ::exr::error::Error) -> io::Error {
    match error {
        ::exr::error::Error::Io(error) => error,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use ::exr::prelude::{ReadChannels, ReadLayers, read};

    use super::*;
    use crate::film::Channel;
    use crate::output::options::Crop;
    use crate::output::picture::Format;
    use crate::output::picture::tests::{SIZES, bytes, speckle};

    fn decode(file: &[u8]) -> Picture {
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| (size, vec![[0.0f32; 3]; size.area()]),
                |(size, rgb), at, (r, g, b): (f32, f32, f32)| rgb[at.y() * size.width() + at.x()] = [r, g, b],
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(file))
            .unwrap();
        let (size, rgb) = image.layer_data.channel_data.pixels;
        Picture { width: size.width() as u32, height: size.height() as u32, rgb }
    }

    fn bits(picture: &Picture) -> Vec<[u32; 3]> {
        picture.rgb.iter().map(|rgb| rgb.map(f32::to_bits)).collect()
    }

    #[test]
    fn a_picture_is_read_back_to_the_bit() {
        for (width, height) in SIZES {
            let mut picture = speckle(width, height);
            picture.rgb[0] = [f32::MIN_POSITIVE / 2.0, 3e38, -0.0];
            let read = decode(&bytes(Format::Exr, &picture, 5.0));
            assert_eq!((read.width, read.height), (width, height));
            assert!(bits(&read) == bits(&picture), "{width}×{height}");
            picture.rgb[0][2] = 0.0;
            assert!(bits(&read) != bits(&picture));
        }
    }

    #[test]
    fn facts_are_read_back_and_do_not_affect_pixels() {
        let facts =
            Identity::default().with("program", "stride 1").with("scene", "5eed").with("samples", "0..8");
        let picture = speckle(17, 5);
        let file = |facts: Option<&Identity>| {
            let mut out = Cursor::new(Vec::new());
            encode(&picture, &PictureOptions { facts, ..PictureOptions::default() }, &mut out).unwrap();
            out.into_inner()
        };
        assert_eq!(super::facts(&file(Some(&facts))[..]), Some(facts.clone()));
        assert_eq!(file(Some(&facts)), file(Some(&facts)));
        assert!(bits(&decode(&file(Some(&facts)))) == bits(&picture));
        assert_eq!(super::facts(&file(None)[..]), None);
        assert_ne!(file(Some(&facts)), file(Some(&facts.clone().with("seed", 1))));
        // Characters that a Latin-1 reader does not support are no error.
        let strange = facts.clone().with("device", "gpu: Größe 東京");
        assert_eq!(super::facts(&file(Some(&strange))[..]).unwrap().get("device"), Some("gpu: Gr??e ??"));
    }

    #[test]
    fn layers_lie_beside_colour_and_keep_every_bit() {
        let picture = speckle(17, 5);
        let channel = |name: &str, c: usize| Channel {
            name: name.to_owned(),
            values: picture.rgb.iter().map(|rgb| rgb[c] - 0.5).collect(),
        };
        let layers = [channel("normal.X", 2), channel("albedo.R", 0), channel("depth.Z", 1)];
        let mut out = Cursor::new(Vec::new());
        let options = PictureOptions { channels: &layers, ..PictureOptions::default() };
        encode(&picture, &options, &mut out).unwrap();
        let file = out.into_inner();
        assert_eq!(super::channels(&file[..]), ["B", "G", "R", "albedo.R", "depth.Z", "normal.X"]);
        assert!(bits(&decode(&file)) == bits(&picture));
        let all = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let image = all.all_attributes().from_buffered(Cursor::new(&file)).unwrap();
        for layer in &layers {
            let list = &image.layer_data.channel_data.list;
            let found = list.iter().find(|channel| channel.name.to_string() == layer.name).unwrap();
            assert!(found.sample_data == FlatSamples::F32(layer.values.clone()), "{}", layer.name);
        }
    }

    #[test]
    fn a_part_of_a_film_has_its_position_in_the_header() {
        let facts = Identity::default().with("size", "40x30").with("crop", "5,9,17,6");
        let crop = Crop::of(&facts);
        assert_eq!(crop, Some(Crop { film: [40, 30], from: [5, 9] }));
        let mut out = Cursor::new(Vec::new());
        let picture = speckle(17, 6);
        encode(&picture, &PictureOptions { crop, ..PictureOptions::default() }, &mut out).unwrap();
        let file = out.into_inner();
        let meta = MetaData::read_from_buffered(Cursor::new(&file), true).unwrap();
        let header = &meta.headers[0];
        assert_eq!(header.shared_attributes.display_window, IntegerBounds::from_dimensions((40, 30)));
        assert_eq!(header.data_window(), IntegerBounds::new((5, 9), (17, 6)));
        assert!(bits(&decode(&file)) == bits(&picture));
        for bad in ["5", "a,b,c,d", "-1,0,3,3"] {
            assert_eq!(Crop::of(&Identity::default().with("size", "40x30").with("crop", bad)), None, "{bad}");
        }
        // A whole film is its own display window.
        let mut out = Cursor::new(Vec::new());
        encode(&picture, &PictureOptions::default(), &mut out).unwrap();
        let meta = MetaData::read_from_buffered(Cursor::new(out.into_inner()), true).unwrap();
        assert_eq!(meta.headers[0].data_window(), meta.headers[0].shared_attributes.display_window);
    }

    #[test]
    fn the_header_contains_only_what_determines_the_bits() {
        let file = bytes(Format::Exr, &speckle(17, 5), 0.0);
        let meta = MetaData::read_from_buffered(Cursor::new(&file), true).unwrap();
        let [header] = &meta.headers[..] else { panic!("one layer, not {}", meta.headers.len()) };
        let names: Vec<_> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R"]);
        assert_eq!(header.line_order, LineOrder::Increasing);
        assert_eq!(header.blocks, ::exr::meta::BlockDescription::ScanLines);
        assert_eq!(header.own_attributes, LayerAttributes::default());
        assert_eq!(header.shared_attributes.chromaticities, Some(REC_709));
        assert!(header.shared_attributes.other.is_empty() && header.shared_attributes.time_code.is_none());
    }
}
