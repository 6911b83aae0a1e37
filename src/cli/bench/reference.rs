//! The picture that `stride bench noise` compares with: rendered, or read from a file.

use super::measurement::{Bench, Verbosity};
use crate::cli::failure::{Failure, usage};
use crate::film::Picture;
use crate::output::{Format, read_picture};
use crate::scene::Sampler;
use anyhow::anyhow;
use std::num::NonZeroUsize;
use std::path::Path;

/// Added to the scene's seed for the reference. The measured pictures count up from the scene's seed. It has no power of
/// two as a factor: samplers hash seeds, and seeds that differ in the highest bit alone give correlated numbers.
const SEED: u32 = 0x9e37_79b9;

/// Rejects file names without the extension .exr: PNG is clamped, and Radiance HDR has an error of up to 0.4% of its own.
pub(super) fn check_name(path: &Path) -> Result<(), Failure> {
    match Format::of(path) {
        Ok(Format::Exr) => Ok(()),
        _ => Err(usage(format!("--reference {}: a reference is OpenEXR, a file named .exr", path.display()))),
    }
}

/// Reads a reference for the film of a scene.
pub(super) fn read(path: &Path, bench: &Bench) -> Result<Picture, Failure> {
    let (_, picture) = read_picture(path)?;
    let (file, film) = (path.display(), &bench.scene.film);
    let [width, height] = [picture.width, picture.height];
    if [width, height] != [film.width, film.height] {
        return Err(anyhow!(
            "the reference {file} has {width}×{height} pixels, but the scene is measured at {}×{}; give --size \
             {width}x{height}, or another reference",
            film.width,
            film.height
        )
        .into());
    }
    let is_finite = |rgb: &[f32; 3]| rgb.iter().all(|c| c.is_finite());
    if let Some(first) = picture.rgb.iter().position(|rgb| !is_finite(rgb)) {
        let (x, y) = (first as u32 % width, first as u32 / width);
        return Err(anyhow!(
            "pixel {x},{y} of the reference {file} is NaN or infinite, so that no error can be computed; render the \
             reference again"
        )
        .into());
    }
    Ok(picture)
}

/// Renders the reference with `sobol`, whose error is the smallest; `None` if Ctrl-C was pressed before the end.
pub(super) fn render(bench: &Bench, spp: u32, threads: NonZeroUsize) -> Result<Option<Picture>, Failure> {
    bench.print_progress(&format!("rendering the reference, {spp} samples per pixel"));
    let mut scene = bench.scene.clone();
    scene.render.seed = scene.render.seed.wrapping_add(SEED);
    scene.render.sampler = Sampler::Sobol;
    Ok(bench.render(scene, spp, threads, Verbosity::Progress)?.map(|report| report.picture))
}
