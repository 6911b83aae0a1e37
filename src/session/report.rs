//! The result of a render.

use super::error::SessionError;
use super::identity::write_with_facts;
use crate::film::cryptomatte::Names;
use crate::film::noise::{FIRST_MILESTONE, brightness};
use crate::film::{Channel, Identity, Layer, Picture, ToneMap, ViewTransform};
use crate::output::OutputError;
use crate::render::accumulator::{Outcome, Totals};
use std::fmt;
use std::path::Path;
use std::time::Duration;

/// The result of a render.
#[derive(Debug)]
pub struct Report {
    /// The figures.
    pub totals: Totals,
    /// The requested and the estimated error, if an error was requested.
    pub noise: Option<Noise>,
    /// The minimum and the maximum number of samples per pixel.
    pub spp_range: [u64; 2],
    /// Whether every pixel has the same number of samples.
    pub whole: bool,
    /// The description of the devices that rendered.
    pub device: String,
    /// Each device, and the number of samples it made.
    pub devices: Vec<(String, u64)>,
    /// The description of a device that was lost.
    pub lost: Option<String>,
    /// The number of threads that rendered.
    pub threads: usize,
    /// Time to compile the scene.
    pub build: Duration,
    /// The picture.
    pub picture: Picture,
    /// The channels of the requested layers.
    pub layers: Vec<Channel>,
    /// The facts that determine the bits of the picture, as in its files.
    pub facts: Identity,
    /// The view transform of 8-bit files and windows.
    pub view: ViewTransform,
    /// The names in those of the layers that are Cryptomatte layers.
    pub mattes: Vec<Names>,
    /// The failure that ended the render, if there was one. The samples made by then have been written if possible.
    pub problem: Option<SessionError>,
}

impl Report {
    /// Writes the picture in the format of the extension, `.png`, `.exr` or `.hdr`. The file equals the one that the
    /// render writes on request without an overlay. EXR files contain the layers.
    ///
    /// # Errors
    ///
    /// If the extension is not one of these, or the file cannot be written. No half-written file remains.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        let mattes: Vec<&Names> = self.mattes.iter().collect();
        write_with_facts(path.as_ref(), &self.picture, &self.facts, (&self.layers, &mattes), self.view)
    }

    /// The picture in 8-bit sRGB, as in a PNG file: red, green and blue, row by row from the top left.
    pub fn srgb(&self) -> Vec<[u8; 3]> {
        let tone = ToneMap::new(self.view.of_file());
        self.picture.rgb.iter().map(|&rgb| tone.encode(rgb)).collect()
    }

    /// The channels of a requested layer; empty for another.
    pub fn layer(&self, layer: Layer) -> Vec<&Channel> {
        let names = layer.channels();
        self.layers.iter().filter(|channel| names.contains(&channel.name)).collect()
    }
}

/// The requested and the estimated error of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The requested error.
    pub asked: f64,
    /// The estimated error, if there were enough samples for an estimate.
    pub estimated: Option<f64>,
    /// Samples that every pixel has.
    pub spp: u32,
    /// Whether the picture is black, so that errors cannot be relative to its brightness.
    pub is_black: bool,
}

impl Noise {
    pub(super) fn of(asked: f64, outcome: &Outcome) -> Noise {
        let Totals { noise, spp, .. } = outcome.totals;
        let is_black = noise.is_none() && brightness(&outcome.film.picture().rgb) == 0.0;
        Noise { asked, estimated: noise.map(|[now, _]| now), spp, is_black }
    }

    /// Whether the estimated error is at most the requested one.
    pub fn reached(&self) -> bool {
        self.estimated.is_some_and(|estimated| estimated <= self.asked)
    }
}

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Noise { asked, estimated, spp, is_black } = *self;
        let least = 2 * FIRST_MILESTONE;
        match estimated {
            Some(now) if self.reached() => {
                write!(f, "the estimated error is {now:.5}; {asked} was requested")
            }
            Some(now) => write!(
                f,
                "the requested error of {asked} was not reached: the estimate is {now:.5} at {spp} samples per pixel"
            ),
            None if is_black && spp >= least => write!(
                f,
                "the requested error of {asked} cannot be checked: errors are relative to the picture's brightness, and the picture is black"
            ),
            None => write!(
                f,
                "the requested error of {asked} cannot be checked: an estimate needs more than {least} samples per pixel, and the render ended at {spp}"
            ),
        }
    }
}

/// Describes the minimum and the maximum number of samples per pixel. Each pixel has its first samples.
pub(crate) fn sample_counts(range: [u64; 2]) -> String {
    match range {
        [least, most] if least == most => format!("every pixel has its first {least} samples"),
        [0, most] => format!("each pixel has at most its first {most} samples, and some have none"),
        [least, most] => format!("every pixel has its first {least} samples, and some have up to {most}"),
    }
}
