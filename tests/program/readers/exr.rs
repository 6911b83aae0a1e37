//! EXR files, read by OpenEXR's own reader and NumPy.

use super::{python_with, run};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use stride::film::cryptomatte::Mattes;
use stride::film::{Channel, Layer};
use stride::math::lanes::Level;
use stride::render::preview;
use stride::sampling::Region;

const WIDTH: u32 = 40;
const HEIGHT: u32 = 30;
const SPP: u32 = 8;

/// Checks a render's files against each other. Its arguments: the EXR with all layers, the dump of its samples, the
/// values of its layers as computed by this crate (a `.npy` with a row for each channel of
/// `LAYERS`), and the EXR that `stride merge` made from its film.
const CHECK: &str = "
import sys, numpy, OpenEXR
exr, dump, layers, merged = sys.argv[1:5]
WIDTH, HEIGHT, SPP = 40, 30, 8

def read(path):
    with OpenEXR.File(path, separate_channels=True) as file:
        pixels = {name: channel.pixels.copy() for name, channel in file.channels().items()}
        return file.header(), pixels

header, pixels = read(exr)
assert all(p.dtype == numpy.float32 and p.shape == (HEIGHT, WIDTH) for p in pixels.values()), pixels
samples = numpy.load(dump)
assert len(samples) == WIDTH * HEIGHT * SPP
place = samples['pixel'].astype(int)
count = numpy.bincount(place, minlength=WIDTH * HEIGHT)

# Colour is the mean of the samples, which is rounded once to single precision.
squares = numpy.zeros(WIDTH * HEIGHT)
for channel, name in enumerate('RGB'):
    radiance = samples['radiance'][:, channel].astype(float)
    mean = numpy.bincount(place, radiance, WIDTH * HEIGHT) / count
    assert numpy.abs(pixels[name].ravel() - mean).max() <= 1e-7 * (1 + mean.max()), name
    squares += numpy.bincount(place, radiance**2, WIDTH * HEIGHT) / count - mean**2
variance = squares / (count - 1)
assert numpy.abs(pixels['variance.Y'].ravel() - variance).max() <= 1e-6 * (1 + variance.max())
assert (pixels['samples.Y'].ravel() == count).all()

# The other layers, to the bit.
rows = numpy.load(layers)
names = [bytes(row['name']).decode() for row in rows]
assert set(names) | set('RGB') | {'variance.Y', 'samples.Y'} <= set(pixels), names
for name, row in zip(names, rows):
    assert (pixels[name].ravel().view('u4') == row['values'].view('u4')).all(), name

# The film's picture is the render's, with its layers.
_, again = read(merged)
assert set(again) == set(pixels), again
assert all((again[name].view('u4') == pixels[name].view('u4')).all() for name in again)
print(len(names))
";

/// Checks the variance of a film of weighted samples against the definition, by Mitchell and Netravali's own
/// formula. Its arguments: the EXR, and the dump of its samples.
const CHECK_WEIGHED: &str = "
import sys, numpy, OpenEXR
exr, dump = sys.argv[1:3]
with OpenEXR.File(exr, separate_channels=True) as file:
    pixels = {name: channel.pixels.astype(float) for name, channel in file.channels().items()}
height, width = pixels['R'].shape
samples = numpy.load(dump)
radiance = samples['radiance'].astype(float)

def mitchell(x):
    x, b, c = numpy.abs(x), 1 / 3, 1 / 3
    near = (12 - 9*b - 6*c) * x**3 + (-18 + 12*b + 6*c) * x**2 + 6 - 2*b
    far = (-b - 6*c) * x**3 + (6*b + 30*c) * x**2 + (-12*b - 48*c) * x + 8*b + 24*c
    return numpy.where(x < 1, near, numpy.where(x < 2, far, 0))

worst = scale = 0
for y in range(height):
    for x in range(width):
        w = mitchell(samples['x'] - (x + 0.5)) * mitchell(samples['y'] - (y + 0.5))
        there = numpy.nonzero(w)
        w, seen = w[there], radiance[there]
        mean = (w @ seen) / w.sum()
        assert all(abs(pixels[name][y, x] - mean[i]) < 1e-3 * (1 + mean[i]) for i, name in enumerate('RGB'))
        spread = w**2 @ ((seen - mean)**2).sum(1) / (w.sum()**2 - (w**2).sum())
        worst, scale = max(worst, abs(pixels['variance.Y'][y, x] - spread)), max(scale, spread)
assert pixels['samples.Y'].min() == pixels['samples.Y'].max() == len(samples) / (width * height)
# Taps and their squares are rounded to multiples of 2^-14.
assert worst < 2e-3 * scale, (worst, scale)
print('good')
";

fn stride(folder: &Path, arguments: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    let output = command.args(arguments).current_dir(folder).output().expect("stride");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A NumPy file of channels: a row with name and values for each.
fn write_channels(path: &Path, channels: &[Channel]) {
    let pixels = WIDTH * HEIGHT;
    let mut header = format!(
        "{{'descr': [('name', 'S24'), ('values', '<f4', ({pixels},))], 'fortran_order': False, 'shape': ({},)}}",
        channels.len()
    );
    // Magic, version and length have ten bytes; the total must be a multiple of 64.
    header += &" ".repeat(63 - (10 + header.len()) % 64);
    header += "\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for channel in channels {
        let mut name = [0_u8; 24];
        name[..channel.name.len()].copy_from_slice(channel.name.as_bytes());
        bytes.extend(name);
        channel.values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    fs::write(path, bytes).expect("a writable folder");
}

#[test]
fn openexr_and_numpy_read_the_same_values() {
    let Some(python) = python_with("numpy, OpenEXR") else { return };
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| -> PathBuf { dir.path().join(name) };
    let scene = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
    let render = |seed: &str, exr: &str, dump: &str, film: &str| {
        let size = format!("{WIDTH}x{HEIGHT}");
        let fixed =
            ["render", &scene, "--headless", "-q", "--layers", "all", "--size", &size, "--seed", seed];
        let spp = SPP.to_string();
        stride(
            dir.path(),
            &[&fixed[..], &["--spp", &spp, "-o", exr, "--samples", dump, "--film", film]].concat(),
        );
    };
    render("0", "a.exr", "a.npy", "a.film");
    render("1", "b.exr", "b.npy", "b.film");
    stride(dir.path(), &["merge", "a.film", "-o", "merged.exr"]);
    let mut scene = stride::scene::load(scene.as_ref()).expect("a scene").scene;
    (scene.film.width, scene.film.height) = (WIDTH, HEIGHT);
    let (integrator, level) = (Arc::from(crate::common::integrator(&scene)), Level::available()[0]);
    let region = Region::whole(WIDTH, HEIGHT);
    let mattes = Mattes::of(&scene);
    let mut channels = preview(&integrator, level, region, SPP, &Layer::ALL, &mattes);
    write_channels(&path("layers.npy"), &channels);

    let check =
        |files: [&str; 4]| run(&python, CHECK, &files.map(path).each_ref().map(|path| path.as_path()));
    assert_eq!(check(["a.exr", "a.npy", "layers.npy", "merged.exr"]), Ok(channels.len().to_string()));
    // Negative controls: each of the files from another render.
    for files in [
        ["b.exr", "a.npy", "layers.npy", "merged.exr"],
        ["a.exr", "b.npy", "layers.npy", "merged.exr"],
        ["a.exr", "a.npy", "layers.npy", "b.exr"],
    ] {
        assert!(check(files).expect_err("files of two renders").contains("AssertionError"), "{files:?}");
    }
    channels[3].values[77] = channels[3].values[77].next_up();
    write_channels(&path("layers.npy"), &channels);
    assert!(
        check(["a.exr", "a.npy", "layers.npy", "merged.exr"])
            .expect_err("a bit is wrong")
            .contains("AssertionError")
    );
}

#[test]
fn the_variance_of_weighted_samples_matches_numpy() {
    let Some(python) = python_with("numpy, OpenEXR") else { return };
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| -> PathBuf { dir.path().join(name) };
    let scene = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
    let film =
        ["--headless", "-q", "--size", "24x18", "--filter", "mitchell", "--layers", "variance,samples"];
    for seed in ["0", "1"] {
        let (exr, dump) = (format!("{seed}.exr"), format!("{seed}.npy"));
        let render = ["--spp", "6", "--seed", seed, "-o", &exr, "--samples", &dump];
        stride(dir.path(), &[&["render", &scene], &film[..], &render].concat());
    }
    let check = |files: [&str; 2]| {
        run(&python, CHECK_WEIGHED, &files.map(path).each_ref().map(|path| path.as_path()))
    };
    assert_eq!(check(["0.exr", "0.npy"]), Ok("good".to_owned()));
    // Negative control: another seed's samples.
    assert!(check(["0.exr", "1.npy"]).expect_err("files of two renders").contains("AssertionError"));
}
