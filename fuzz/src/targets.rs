//! The readers with their seeds, and the correction of lengths and checksums of mutated files.

use crate::{memory, pictures};
use data_encoding::BASE64;
use glam::DAffine3;
use sha2::{Digest, Sha256};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use stride::film::file::FilmReader;
use stride::math::{Bounds, Ray, Vec3};
use stride::output::npy::read::DumpReader;
use stride::output::read_picture;
use stride::scene::LoadOptions;
use stride::scene::formats::mitsuba::{self, serialized};
use stride::scene::mesh::{self, Mesh, Split};
use stride::world::{Simple, TreeScope, Triangles, World, compile};

/// A reader.
pub struct Target {
    pub name: &'static str,
    /// Valid files, and unusual ones.
    pub seeds: Vec<Vec<u8>>,
    /// Words of the format.
    pub words: &'static [&'static str],
    /// Whether the reader accepts a file.
    pub read: fn(&[u8]) -> bool,
    /// Corrects lengths and checksums.
    pub mend: fn(&mut [u8]),
    /// The memory limit: a number of bytes, plus a number for each byte of the file.
    pub memory: [usize; 2],
}

/// For formats without compression.
const PLAIN: [usize; 2] = [8 << 20, 256];

/// A byte of deflated data is at most 1032 bytes of pixels, of which 1 bit can be one of 12 bytes; a picture may be
/// held twice.
const PACKED: [usize; 2] = [16 << 20, 1032 * 8 * 12 * 2];

/// The most bytes for each byte of XML, as `docs/mitsuba.md` has it.
const OF_XML: usize = 512;

/// The most bytes for each shape: `merge` and instances multiply them.
const OF_SHAPE: usize = 1 << 10;

/// What reading takes besides: values of variables, and the files of `fuzz/seeds` that a scene names.
const OF_READING: usize = 16 << 20;

/// There are 2¹⁸ shapes at most.
const MULTIPLIED: [usize; 2] = [(OF_SHAPE << 18) + OF_READING, OF_XML];

/// The names of all readers.
pub const NAMES: [&str; 13] =
    ["ply", "obj", "mtl", "gltf", "glb", "toml", "xml", "serialized", "film", "npy", "exr", "png", "hdr"];

/// The reader of this name.
pub fn target(name: &str) -> Option<Target> {
    let name = *NAMES.iter().find(|&&known| known == name)?;
    let target = Target { name, seeds: kept(name), words: &[], read: |_| false, mend: |_| {}, memory: PLAIN };
    Some(match name {
        "ply" => Target { read: |bytes| parse_mesh("a.ply", bytes), words: PLY, ..target },
        "obj" => Target { read: |bytes| parse_mesh("a.obj", bytes), words: OBJ, ..target },
        "mtl" => Target { read: parse_library, words: MTL, ..target },
        "gltf" => Target { read: |bytes| parse_mesh("a.gltf", bytes), words: GLTF, ..target },
        "glb" => {
            let seeds = kept("gltf").iter().filter_map(|document| binary(document)).collect();
            let mend = mend_glb;
            Target { read: |bytes| parse_mesh("a.glb", bytes), words: GLTF, seeds, mend, ..target }
        }
        "toml" => {
            let mut seeds = target.seeds;
            seeds.extend(files(&of_this_crate("../scenes"), "toml"));
            Target { read: parse_scene, words: TOML, seeds, ..target }
        }
        "xml" => Target { read: parse_mitsuba, words: XML, memory: MULTIPLIED, ..target },
        "serialized" => Target {
            read: |bytes| {
                [0, 1].map(|i| serialized::parse(bytes, i).map(|mesh| trust(&mesh))).iter().any(Result::is_ok)
            },
            seeds: serialized_meshes(),
            memory: PACKED,
            ..target
        },
        "film" => {
            let read =
                |bytes: &[u8]| FilmReader::open(Cursor::new(bytes)).is_ok_and(|reader| reader.read().is_ok());
            Target { read, words: FILM, seeds: rendered("film"), mend: seal, ..target }
        }
        "npy" => Target { read: parse_dump, words: NPY, seeds: rendered("npy"), ..target },
        "exr" => Target {
            read: |bytes| parse_picture("exr", bytes),
            words: EXR,
            seeds: pictures::exr(),
            memory: PACKED,
            ..target
        },
        "png" => Target {
            read: |bytes| parse_picture("png", bytes),
            words: PNG,
            seeds: pictures::png(),
            mend: mend_png,
            memory: PACKED,
            ..target
        },
        _ => Target {
            read: |bytes| parse_picture("hdr", bytes),
            words: HDR,
            seeds: pictures::hdr(),
            memory: PACKED,
            ..target
        },
    })
}

const PLY: &[&str] = &[
    "property list uint double a\n",
    "property list int int vertex_indices\n",
    "element face 9\n",
    "element tristrips 1\n",
    "element x 3\n",
    "property double x\n",
    "list ",
    "end_header\n",
    "nan ",
    "inf ",
    "-1 ",
];

const OBJ: &[&str] = &[
    "f 1 2 3 4 5\n",
    "f 1 2\n",
    "f 1//9 2/9 3/0/0\n",
    "v 1e38 nan -inf\n",
    "usemtl a\n",
    "g red\n",
    "mtllib a.mtl\n",
    "-9223372036854775808",
    "//",
    "\\\n",
    "#",
    "vt 1 1\n",
    "vn 0 0 0\n",
];

const MTL: &[&str] = &[
    "newmtl c\n",
    "Kd nan\n",
    "Ni 0\n",
    "Ke 1e39 1 1\n",
    "illum 99999999999\n",
    "d -halo\n",
    "Tr inf\n",
    "Kd spectral a.rfl\n",
    "map_Kd -o 1\n",
];

const GLTF: &[&str] = &[
    "\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"componentType\":5123},\"values\":{\"bufferView\":0}},",
    "\"byteStride\":",
    "\"byteOffset\":",
    "\"children\":[0,1],",
    "\"matrix\":[",
    "\"count\":",
    "5120",
    "5125",
    "\"mode\":5,",
    "\"NORMAL\":0,",
    "\"TEXCOORD_0\":1,",
    "\"JOINTS_0\":0,",
    "\"WEIGHTS_0\":0,",
    "\"skin\":0,",
    "\"weights\":[1,1],",
    "\"targets\":[{\"POSITION\":0}],",
    "\"inverseBindMatrices\":0,",
    "\"normalized\":true,",
    "null",
    "1e999",
];

const TOML: &[&str] = &[
    "[[entities]]\n",
    "[materials.a]\n",
    "type = \"box\"\n",
    "{ type = \"disk\", ",
    "transform = { scale = 1e-30 }",
    "nan",
    "-inf",
    "1e400",
    "\"\"\"",
    "[[[[",
    "a.b.c.d = 1\n",
    "max = [1, 1, 1]\n",
];

const XML: &[&str] = &[
    "<shape type=\"sphere\"/>",
    "<shape type=\"shapegroup\" id=\"g\">",
    "<shape type=\"instance\"><ref id=\"g\"/></shape>",
    "<ref id=\"a\"/>",
    "<include filename=\"all.xml\"/>",
    "<path value=\"..\"/>",
    "<default name=\"a\" value=\"$a$b\"/>",
    "$a",
    "&amp;",
    "&#0;",
    "<!DOCTYPE a [<!ENTITY b \"c\">]>",
    "<![CDATA[",
    "<transform name=\"to_world\"><scale value=\"0\"/></transform>",
    "<bsdf type=\"twosided\">",
    "<spectrum name=\"eta\" value=\"400:1, 500:2\"/>",
    "</scene>",
    "<shape type=\"merge\">",
    "<shape type=\"merge\"><ref id=\"g\"/><ref id=\"g\"/></shape>",
    "<shape type=\"cube\"><transform name=\"to_world\"><scale x=\"3\"/></transform></shape>",
    "<spectrum name=\"radiance\" filename=\"ramp.spd\"/>",
    "<alias id=\"m\" as=\"n\"/>",
    "xmlns:a=\"b\" ",
    "name=\"\\$a\"",
    "<!--",
    "filename=\"big.ply\"",
];

const FILM: &[&str] = &["\n\n", "asked: 1..2\n", "adaptive: 1\n", "scene: \n"];

const NPY: &[&str] = &["'shape': (", "99999999999999999999", "'descr': ", "{", "}", ",)", "# [[\"\",\"\"]]"];

const EXR: &[&str] = &[
    "channels\0chlist\0",
    "dataWindow\0box2i\0",
    "tiles\0tiledesc\0",
    "compression\0compression\0",
    "\x7f\x7f\x7f\x7f",
];

const PNG: &[&str] = &["IHDR", "IDAT", "PLTE", "tRNS", "IEND", "acTL", "fcTL", "iCCP", "zTXt"];

const HDR: &[&str] = &[
    "-Y 99999 +X 99999\n",
    "+X 4 -Y 3\n",
    "EXPOSURE=",
    "#?RADIANCE\n",
    "FORMAT=32-bit_rle_xyze\n",
    "\x02\x02",
];

fn of_this_crate(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// All files of a folder whose names end in `suffix`, sorted by name.
fn files(folder: &Path, suffix: &str) -> Vec<Vec<u8>> {
    let entries = folder.read_dir().expect("a folder of seeds");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == suffix));
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).expect("a seed")).collect()
}

/// The seeds that are files.
fn kept(suffix: &str) -> Vec<Vec<u8>> {
    files(&of_this_crate("seeds"), suffix)
}

/// The path of a file whose bytes are given to a reader: beside the seeds, so that it finds the files that these refer
/// to.
fn beside_seeds(name: &str) -> PathBuf {
    of_this_crate("seeds").join(name)
}

fn parse_mesh(name: &str, bytes: &[u8]) -> bool {
    let splits = [Split::Whole, Split::Materials, Split::Named(vec!["a".into(), "red".into()])];
    let read = |split: &Split| {
        mesh::parse(&beside_seeds(name), bytes, bytes.len() as u64, split, &mut |_, _| {}).ok()
    };
    let [whole, ..] = splits.each_ref().map(read);
    let Some(whole) = whole else { return false };
    whole.parts.iter().for_each(|(_, mesh)| trust(mesh));
    true
}

/// Processes a mesh as the start of a render does.
fn trust(mesh: &Mesh) {
    let vertices = mesh.positions.len();
    assert!(
        mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < vertices),
        "a corner is no vertex"
    );
    assert!([0, vertices].contains(&mesh.normals.len()), "normals are missing");
    assert!([0, vertices].contains(&mesh.uv.len()), "uv are missing");
    let mut triangles = Triangles::default();
    triangles.push(mesh, &DAffine3::IDENTITY, 0);
    let surfaces = Simple { triangles: Arc::new(triangles), ..Simple::default() };
    look_at(&surfaces, Bounds::of(mesh.positions.iter().copied()));
}

/// Builds the tree of some surfaces, and traces a few rays.
fn look_at(surfaces: &Simple, Bounds { low, high }: Bounds) {
    let world = World::with_tree_scope(surfaces, TreeScope::Everything);
    let middle = [0, 1, 2].map(|axis| low[axis] / 2.0 + high[axis] / 2.0);
    for axis in 0..3 {
        let mut o = middle;
        o[axis] = high[axis] + (high[axis] - low[axis]);
        let mut d = [0.0; 3];
        d[axis] = -1.0;
        let [o, d] = [o, d].map(|[x, y, z]| Vec3::new(x, y, z));
        world.intersect(&Ray::new(o, d), true);
        world.occluded(&Ray::new(o - d, d), f32::MAX, true, false);
    }
}

/// A material library that a mesh refers to.
fn parse_library(bytes: &[u8]) -> bool {
    let folder = std::env::temp_dir().join(format!("stride-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("a.mtl"), bytes).expect("a file");
    let obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    mesh::parse(&folder.join("a.obj"), &obj[..], obj.len() as u64, &Split::Materials, &mut |_, _| {}).is_ok()
}

fn parse_scene(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(loaded) = stride::scene::parse(text, &beside_seeds("a.toml")) else { return false };
    let Ok((_, surfaces)) = compile(&loaded.scene, 4, 3) else { return false };
    look_at(&surfaces, Bounds { low: [-1.0; 3], high: [1.0; 3] });
    true
}

/// A scene file of Mitsuba's. What its reader takes is measured by itself: the tree of its surfaces takes more.
fn parse_mitsuba(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let options = LoadOptions::default();
    let (loaded, taken) = memory::measured(|| mitsuba::parse(text, &beside_seeds("a.xml"), &options));
    let Ok(loaded) = loaded else { return false };
    let shapes = loaded.scene.entities.len() + loaded.scene.instances.len();
    let most = OF_READING + OF_XML * bytes.len() + OF_SHAPE * shapes;
    assert!(taken <= most, "{taken} bytes of memory for {} of file and {shapes} shapes", bytes.len());
    let Ok((_, surfaces)) = compile(&loaded.scene, 4, 3) else { return false };
    look_at(&surfaces, Bounds { low: [-1.0; 3], high: [1.0; 3] });
    true
}

/// A file with two serialized meshes, stored without compression so that mutations affect the mesh.
fn serialized_meshes() -> Vec<Vec<u8>> {
    [(3_u16, 0_u32), (4, 0), (4, 0x2000)]
        .map(|(version, precision)| serialized_mesh(version, precision))
        .into()
}

fn serialized_mesh(version: u16, precision: u32) -> Vec<u8> {
    let mut mesh = (precision | 2).to_le_bytes().to_vec();
    if version == 4 {
        mesh.extend(b"name\0");
    }
    mesh.extend([3_u64.to_le_bytes(), 1_u64.to_le_bytes()].concat());
    for x in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0] {
        match precision {
            0 => mesh.extend(x.to_le_bytes()),
            _ => mesh.extend(f64::from(x).to_le_bytes()),
        }
    }
    mesh.extend([0_u32, 1, 2].map(u32::to_le_bytes).concat());
    // A header of zlib, one stored block, and the checksum.
    let length = mesh.len() as u16;
    let stored = [&[0x78, 0x01, 0x01][..], &length.to_le_bytes(), &(!length).to_le_bytes(), &mesh].concat();
    let sum = mesh.iter().fold((1_u32, 0_u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65521;
        (a, (b + a) % 65521)
    });
    let one = [
        &0x041c_u16.to_le_bytes()[..],
        &version.to_le_bytes(),
        &stored,
        &(sum.1 << 16 | sum.0).to_be_bytes(),
    ]
    .concat();
    let places = [0, one.len()];
    let list: Vec<u8> = match version {
        3 => places.iter().flat_map(|&place| (place as u32).to_le_bytes()).collect(),
        _ => places.iter().flat_map(|&place| (place as u64).to_le_bytes()).collect(),
    };
    [&one[..], &one, &list, &2_u32.to_le_bytes()].concat()
}

fn parse_dump(bytes: &[u8]) -> bool {
    let Ok(mut dump) = DumpReader::new(bytes, bytes.len() as u64) else { return false };
    while let Ok(samples) = dump.next(1000) {
        if samples.is_empty() {
            return true;
        }
    }
    false
}

/// A picture file.
fn parse_picture(suffix: &str, bytes: &[u8]) -> bool {
    let path = std::env::temp_dir().join(format!("stride-fuzz-{}.{suffix}", std::process::id()));
    std::fs::write(&path, bytes).expect("a file");
    let Ok((_, picture)) = read_picture(&path) else { return false };
    assert_eq!(picture.rgb.len() as u64, u64::from(picture.width) * u64::from(picture.height));
    true
}

/// Films or sample dumps that the program writes.
fn rendered(suffix: &str) -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder");
    let stride = std::env::var("STRIDE").unwrap_or_else(|_| "stride".into());
    let render = |name: &str, more: &[&str]| {
        let path = folder.path().join(format!("{name}.{suffix}"));
        let run = std::process::Command::new(&stride)
            .args(["render", "--headless", "--quiet", "--size", "6x4", "--threads", "1"])
            .arg(if suffix == "film" { "--film" } else { "--samples" })
            .arg(&path)
            .arg("-o")
            .arg(folder.path().join("other.exr"))
            .args(more)
            .arg(of_this_crate("../scenes/room.toml"))
            .status();
        run.is_ok_and(|status| status.success()).then(|| std::fs::read(path).expect("a file"))
    };
    let seeds: Vec<_> = [
        render("plain", &["--spp", "4"]),
        render("range", &["--range", "2..3"]),
        render("cropped", &["--spp", "2", "--crop", "1,1,4,2", "--filter", "none"]),
        render("noise", &["--spp", "64", "--noise", "0.0001"]),
        render("adaptive", &["--spp", "64", "--noise", "0.0001", "--adaptive"]),
        render("variance", &["--spp", "4", "--layers", "variance"]),
        render("layers", &["--spp", "4", "--layers", "all"]),
    ]
    .into_iter()
    .flatten()
    .collect();
    assert!(!seeds.is_empty(), "there is no {suffix} to spoil: STRIDE says where the program is");
    seeds
}

/// A `.glb` of a `.gltf` whose buffer is a `data:` URI.
fn binary(document: &[u8]) -> Option<Vec<u8>> {
    let document = std::str::from_utf8(document).ok()?;
    let (before, data) = document.split_once(r#","uri":"data:"#)?;
    let (data, after) = data.split_once('"')?;
    let mut buffer = BASE64.decode(data.split_once(";base64,")?.1.as_bytes()).ok()?;
    let mut text = format!("{before}{}", after.trim_end()).into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = 28 + text.len() + buffer.len();
    let header = [*b"glTF", word(2), word(length), word(text.len()), *b"JSON"].concat();
    let second = [word(buffer.len()), *b"BIN\0"].concat();
    Some([header, text, second, buffer].concat())
}

/// Corrects the lengths in a `.glb`, if it has a second chunk.
fn mend_glb(bytes: &mut [u8]) {
    let length = bytes.len() as u32;
    let binary = (20..bytes.len()).find(|&i| bytes[i..].starts_with(b"BIN\0")).map(|i| i - 4);
    let mut put = |at: usize, word: u32| {
        if let Some(place) = bytes.get_mut(at..at + 4) {
            place.copy_from_slice(&word.to_le_bytes());
        }
    };
    put(8, length);
    put(12, binary.map_or(length.saturating_sub(20), |at| (at as u32).saturating_sub(20)));
    if let Some(at) = binary {
        put(at, length.saturating_sub(at as u32 + 8));
    }
}

/// Corrects the digest of a film.
fn seal(bytes: &mut [u8]) {
    if let Some(length) = bytes.len().checked_sub(32) {
        let digest = Sha256::digest(&bytes[..length]);
        bytes[length..].copy_from_slice(&digest);
    }
}

/// Corrects the checksums of a PNG's chunks.
fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 4) {
        let length = head.iter().fold(0, |length, &byte| length << 8 | usize::from(byte));
        let end = at + 8 + length;
        if end + 4 > bytes.len() {
            return;
        }
        let sum = crc(&bytes[at + 4..end]).to_be_bytes();
        bytes[end..end + 4].copy_from_slice(&sum);
        at = end + 4;
    }
}

/// The checksum of ISO 3309.
fn crc(bytes: &[u8]) -> u32 {
    let step = |rest: u32, _| if rest & 1 == 1 { 0xedb8_8320 ^ rest >> 1 } else { rest >> 1 };
    !bytes.iter().fold(u32::MAX, |rest, &byte| (0..8).fold(rest ^ u32::from(byte), step))
}
