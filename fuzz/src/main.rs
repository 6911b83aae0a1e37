//! Hurls spoiled files at a reader, for some seconds, from a seed: what it finds, it finds again.
//!
//! ```sh
//! cargo run --manifest-path fuzz/Cargo.toml -- glb 600 1
//! ```
//!
//! Not optimised, so that overflows and broken promises are panics.
//!
//! A spoiled file begins as a good one. Bytes are changed, left out, doubled, copied from elsewhere, replaced by
//! numbers that break arithmetic or by words of the format; what a reader accepts becomes a beginning too. A reader
//! must give a result or an error: a panic ends the program, and `last.SUFFIX` in the system's folder for temporary
//! files is what caused it; so do ten seconds, or 64 bytes of memory for each of the file's and 64 MiB.

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Cursor;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use stride::film::file::FilmReader;
use stride::output::npy::read::DumpReader;
use stride::output::read_picture;
use stride::scene::mesh::{self, Split};

/// Counts what is set aside, so that a file that lies about its size is noticed.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        MOST.fetch_max(NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are those that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: likewise.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

struct Target {
    name: &'static str,
    seeds: Vec<Vec<u8>>,
    words: &'static [&'static str],
    /// Whether the reader took it.
    read: fn(&[u8]) -> bool,
}

fn parse_mesh(name: &str, bytes: &[u8]) -> bool {
    let splits = [Split::Whole, Split::Materials, Split::Named(vec!["a".into(), "red".into()])];
    let read = |split: &Split| mesh::parse(Path::new(name), bytes, bytes.len() as u64, split, &mut |_, _| {});
    let all = splits.each_ref().map(|split| read(split).is_ok());
    all[0]
}

/// A material library, as one that a mesh names.
fn parse_library(bytes: &[u8]) -> bool {
    let folder = std::env::temp_dir().join(format!("stride-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("a.mtl"), bytes).expect("a file");
    let obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    mesh::parse(&folder.join("a.obj"), &obj[..], obj.len() as u64, &Split::Materials, &mut |_, _| {}).is_ok()
}

fn targets(wanted: &str) -> Vec<Target> {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let scenes = scenes.read_dir().expect("scenes").map(|entry| entry.expect("an entry").path());
    let scenes = scenes.filter(|path| path.extension().is_some_and(|e| e == "toml"));
    let scenes: Vec<_> = scenes.map(|path| std::fs::read(path).expect("a scene")).collect();
    let vertex = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
                  property float ny\nproperty float nz\n";
    let face = "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    let text = format!(
        "ply\nformat ascii 1.0\n{vertex}{face}0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n4 0 1 2 3\n"
    );
    let binary = |name: &str, little: bool| {
        let mut bytes = format!("ply\nformat {name} 1.0\n{vertex}{face}").into_bytes();
        let order = |bytes: [u8; 4]| if little { bytes } else { [bytes[3], bytes[2], bytes[1], bytes[0]] };
        for [x, y] in [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            bytes.extend([x, y, 0.0, 0.0, 0.0, 1.0].iter().flat_map(|x| order(x.to_le_bytes())));
        }
        for list in [&[0_u32, 1, 2][..], &[0, 1, 2, 3]] {
            bytes.push(list.len() as u8);
            bytes.extend(list.iter().flat_map(|i| order(i.to_le_bytes())));
        }
        bytes
    };
    let obj = b"mtllib no.mtl\no a\ng b\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 1\nvt 0 0\nvt 1\nvn 0 0 1\nusemtl red\nf 1 2 3\n\
                f 1/1/1 2/2/1 3/1/1 -1/-1/-1\nf 1//1 \\\n3//1 4//1\n";
    let mtl = b"newmtl a\nKa 1 1 1\nKd 0.5 0.5 0.5\nKs 0.5\nKe 1 2 3\nTf 1 1 1\nNi 1.5\nd -halo 0.5\nTr 0.5\nillum 7\n\
                map_Kd a.png\nnewmtl b\nKd 1\n";
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAABAAIAAAA=";
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"a","children":[1],"scale":[1,2,1]}},{{"mesh":0,"rotation":[0,0,0,1]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0,"mode":4}}]}}],"materials":[{{"name":"red","pbrMetallicRoughness":{{"baseColorFactor":[1,0,0,1],"metallicFactor":0}},"extensions":{{"KHR_materials_ior":{{"ior":1.5}}}}}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},{{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],"buffers":[{{"byteLength":44,"uri":"data:;base64,{data}"}}]}}"#
    );
    let glb = {
        let mut text = json.replace(&format!(r#","uri":"data:;base64,{data}""#), "").into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut buffer: Vec<u8> =
            [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        buffer.extend([0_u8, 0, 1, 0, 2, 0, 0, 0]);
        let word = |n: usize| (n as u32).to_le_bytes();
        [
            b"glTF",
            &word(2)[..],
            &word(28 + text.len() + buffer.len()),
            &word(text.len()),
            b"JSON",
            &text,
            &word(buffer.len()),
            b"BIN\0",
            &buffer,
        ]
        .concat()
    };
    let accessors: &[&str] = &[
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
        "\"normalized\":true,",
        "null",
        "1e999",
    ];
    vec![
        Target {
            name: "ply",
            seeds: vec![
                text.into_bytes(),
                binary("binary_little_endian", true),
                binary("binary_big_endian", false),
            ],
            words: &[
                "property list uint double a\n",
                "element face 9\n",
                "element x 3\n",
                "property double x\n",
                "list ",
                "end_header\n",
                "nan ",
                "inf ",
            ],
            read: |bytes| parse_mesh("a.ply", bytes),
        },
        Target {
            name: "obj",
            seeds: vec![obj.to_vec()],
            words: &[
                "f 1 2 3 4 5\n",
                "v 1e38 nan -inf\n",
                "usemtl a\n",
                "g red\n",
                "-9223372036854775808",
                "//",
                "\\\n",
                "vt 1 1\n",
            ],
            read: |bytes| parse_mesh("a.obj", bytes),
        },
        Target {
            name: "mtl",
            seeds: vec![mtl.to_vec()],
            words: &[
                "newmtl c\n",
                "Kd nan\n",
                "Ni 0\n",
                "Ke 1e39 1 1\n",
                "illum 99999999999\n",
                "d -halo\n",
                "Tr inf\n",
            ],
            read: parse_library,
        },
        Target {
            name: "gltf",
            seeds: vec![json.into_bytes()],
            words: accessors,
            read: |bytes| parse_mesh("a.gltf", bytes),
        },
        Target { name: "glb", seeds: vec![glb], words: accessors, read: |bytes| parse_mesh("a.glb", bytes) },
        Target {
            name: "toml",
            seeds: scenes,
            words: &[
                "[[entities]]\n",
                "[materials.a]\n",
                "type = \"box\"\n",
                "{ type = \"disk\", ",
                "nan",
                "-inf",
                "1e400",
                "\"\"\"",
                "[[[[",
                "a.b.c.d = 1\n",
                "max = [1, 1, 1]\n",
            ],
            read: |bytes| {
                std::str::from_utf8(bytes)
                    .is_ok_and(|text| stride::scene::parse(text, Path::new("a.toml")).is_ok())
            },
        },
        Target {
            name: "film",
            seeds: made(wanted, "film"),
            words: &[],
            read: |bytes| FilmReader::open(Cursor::new(bytes)).is_ok_and(|reader| reader.read().is_ok()),
        },
        Target {
            name: "npy",
            seeds: made(wanted, "npy"),
            words: &["'shape': (", "99999999999999999999", "'descr': ", "{", "}"],
            read: parse_dump,
        },
        Target {
            name: "exr",
            seeds: made(wanted, "exr"),
            words: EXR,
            read: |bytes| parse_picture("exr", bytes),
        },
        Target {
            name: "png",
            seeds: made(wanted, "png"),
            words: &["IHDR", "IDAT", "PLTE", "tRNS", "IEND"],
            read: |bytes| parse_picture("png", bytes),
        },
        Target {
            name: "hdr",
            seeds: made(wanted, "hdr"),
            words: &["-Y 99999 +X 99999\n", "EXPOSURE=", "#?RADIANCE\n", "FORMAT=32-bit_rle_xyze\n"],
            read: |bytes| parse_picture("hdr", bytes),
        },
    ]
}

const EXR: &[&str] = &[
    "channels\0chlist\0",
    "dataWindow\0box2i\0",
    "tiles\0tiledesc\0",
    "compression\0compression\0",
    "\x7f\x7f\x7f\x7f",
];

fn parse_dump(bytes: &[u8]) -> bool {
    let Ok(mut dump) = DumpReader::new(bytes, bytes.len() as u64) else { return false };
    while let Ok(samples) = dump.next(1000) {
        if samples.is_empty() {
            return true;
        }
    }
    false
}

/// A picture, which is read from a file.
fn parse_picture(suffix: &str, bytes: &[u8]) -> bool {
    let path = std::env::temp_dir().join(format!("stride-fuzz-{}.{suffix}", std::process::id()));
    std::fs::write(&path, bytes).expect("a file");
    read_picture(&path).is_ok()
}

/// Files that the program itself has made, where it has been built; none unless they are wanted.
fn made(wanted: &str, suffix: &str) -> Vec<Vec<u8>> {
    if wanted != suffix {
        return Vec::new();
    }
    let folder = tempfile::tempdir().expect("a folder");
    let stride = std::env::var("STRIDE").unwrap_or_else(|_| "stride".into());
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/room.toml");
    let render = |name: &str, more: &[&str]| {
        let path = folder.path().join(format!("{name}.{suffix}"));
        let run = std::process::Command::new(&stride)
            .args(["render", "--headless", "--quiet", "--size", "6x4", "--spp", "4", "--threads", "1"])
            .arg(match suffix {
                "film" => "--film",
                "npy" => "--samples",
                _ => "-o",
            })
            .arg(&path)
            .arg("-o")
            .arg(folder.path().join("other.png"))
            .args(more)
            .arg(&scene)
            .status();
        run.is_ok_and(|status| status.success()).then(|| std::fs::read(path).expect("a file"))
    };
    let more = if suffix == "exr" { ["--layers", "all"] } else { ["--range", "2..3"] };
    let files: Vec<_> = [render("a", &[]), render("b", &more)].into_iter().flatten().collect();
    assert!(!files.is_empty(), "there is no {suffix} to spoil: STRIDE says where the program is");
    files
}

/// Numbers at the ends of what types hold.
const EDGES: [u64; 12] =
    [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 1 << 60, i64::MAX as u64, u64::MAX];

fn spoil(bytes: &mut Vec<u8>, other: &[u8], words: &[&str], random: &mut Pcg64) {
    let place = |bytes: &[u8], random: &mut Pcg64| random.random_range(0..=bytes.len());
    let range = |bytes: &[u8], random: &mut Pcg64| {
        let from = random.random_range(0..=bytes.len());
        let most = if random.random_range(0..4) == 0 { bytes.len() } else { 32 };
        from..(from + random.random_range(0..=most)).min(bytes.len())
    };
    match random.random_range(0..10) {
        0 if !bytes.is_empty() => {
            let at = random.random_range(0..bytes.len());
            bytes[at] = random.next_u32() as u8;
        }
        1 if !bytes.is_empty() => {
            let at = random.random_range(0..bytes.len());
            bytes[at] ^= 1 << random.random_range(0..8);
        }
        2 => bytes.truncate(place(bytes, random)),
        3 => drop(bytes.drain(range(bytes, random))),
        4 => {
            let copy = bytes[range(bytes, random)].to_vec();
            let at = place(bytes, random);
            bytes.splice(at..at, copy);
        }
        5 => {
            let copy = other[range(other, random)].to_vec();
            let at = range(bytes, random);
            bytes.splice(at, copy);
        }
        6 => {
            let edge = EDGES[random.random_range(0..EDGES.len())];
            let (little, size) = (edge.to_le_bytes(), [1, 2, 4, 8][random.random_range(0..4)]);
            let at = place(bytes, random);
            let end = (at + size).min(bytes.len());
            bytes.splice(at..end, little[..size].to_vec());
        }
        7 => {
            // A number in text, for another.
            let digits: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
            let Some(&first) = digits.get(random.random_range(0..digits.len().max(1))) else { return };
            let last = (first..bytes.len()).find(|&i| !bytes[i].is_ascii_digit()).unwrap_or(bytes.len());
            let number = match random.random_range(0..3) {
                0 => EDGES[random.random_range(0..EDGES.len())].to_string(),
                1 => random.random_range(0..10_u32).to_string(),
                _ => format!("-{}", random.random_range(0..1000_u32)),
            };
            bytes.splice(first..last, number.into_bytes());
        }
        _ if !words.is_empty() => {
            let word = words[random.random_range(0..words.len())];
            let at = place(bytes, random);
            bytes.splice(at..at, word.bytes());
        }
        _ => bytes.extend(std::iter::repeat_n(random.next_u32() as u8, random.random_range(0..64))),
    }
}

/// What no file of that size may take, twice.
const SLOW: Duration = Duration::from_secs(10);

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: u64| {
        arguments.get(i).map_or(default, |text| text.parse().expect("seconds and a seed are numbers"))
    };
    let wanted = arguments.first().map_or("", String::as_str);
    let Some(target) = targets(wanted).into_iter().find(|target| target.name == wanted) else {
        eprintln!("usage: stride-fuzz ply|obj|mtl|gltf|glb|toml|film|npy|exr|png|hdr [SECONDS] [SEED]");
        std::process::exit(2);
    };
    let (seconds, seed) = (number(1, 60), number(2, 1));
    let random = &mut Pcg64::seed_from_u64(seed);
    for good in &target.seeds {
        assert!((target.read)(good), "a good {} is refused", target.name);
    }
    let mut pool = target.seeds;
    let seeds = pool.len();
    let last = std::env::temp_dir().join(format!("last.{}", target.name));
    let start = Instant::now();
    let (mut runs, mut taken) = (0_u64, 0_u64);
    let mut slowest = Duration::ZERO;
    while start.elapsed() < Duration::from_secs(seconds) {
        let mut bytes = pool[random.random_range(0..pool.len())].clone();
        let other = pool[random.random_range(0..pool.len())].clone();
        for _ in 0..1 << random.random_range(0..4) {
            spoil(&mut bytes, &other, target.words, random);
        }
        bytes.truncate(1 << 16);
        std::fs::write(&last, &bytes).expect("the file that is tried");
        let before = NOW.load(Ordering::Relaxed);
        MOST.store(before, Ordering::Relaxed);
        let began = Instant::now();
        let took = (target.read)(&bytes);
        let memory = MOST.load(Ordering::Relaxed) - before;
        let mut time = began.elapsed();
        if time > SLOW {
            // Others may have had the machine meanwhile.
            let again = Instant::now();
            (target.read)(&bytes);
            time = time.min(again.elapsed());
        }
        assert!(time < SLOW, "{} takes {time:?}", last.display());
        assert!(memory <= (64 << 20) + 64 * bytes.len(), "{} takes {memory} bytes of memory", last.display());
        slowest = slowest.max(time);
        runs += 1;
        if took {
            taken += 1;
            // Those it has are kept; of the others as many as there is room for.
            if pool.len() < seeds + 256 {
                pool.push(bytes);
            } else {
                let at = random.random_range(seeds..pool.len());
                pool[at] = bytes;
            }
        }
    }
    println!("{}: {runs} files, {taken} taken, the slowest in {slowest:?}; seed {seed}", target.name);
}
