//! What a render came to.

use super::error::SessionError;
use super::identity::write_saying;
use crate::film::cryptomatte::Names;
use crate::film::noise::{FIRST_MILESTONE, brightness};
use crate::film::{Channel, Identity, Layer, Picture, ToneMap, ViewTransform};
use crate::output::OutputError;
use crate::render::accumulator::{Outcome, Totals};
use std::fmt;
use std::path::Path;
use std::time::Duration;

/// What a render came to.
#[derive(Debug)]
pub struct Report {
    /// The figures.
    pub totals: Totals,
    /// What became of the error that was asked for.
    pub noise: Option<Noise>,
    /// The fewest and the most samples that a pixel has.
    pub spp_range: [u64; 2],
    /// Whether every pixel has the same number of samples.
    pub whole: bool,
    /// What rendered.
    pub device: String,
    /// Each device, and how many samples it made.
    pub devices: Vec<(String, u64)>,
    /// What became of a device that was lost on the way.
    pub lost: Option<String>,
    /// Threads that rendered.
    pub threads: usize,
    /// Time to compile the scene.
    pub build: Duration,
    /// The picture.
    pub picture: Picture,
    /// The layers that were asked for.
    pub layers: Vec<Channel>,
    /// What determines the bits of the picture, as its files say.
    pub facts: Identity,
    /// How 8-bit files and windows show it.
    pub view: ViewTransform,
    /// What those of the layers that are mattes are about.
    pub mattes: Vec<Names>,
    /// The failure that ended the render, if one did: whatever was rendered by then has been written all the same.
    pub problem: Option<SessionError>,
}

impl Report {
    /// Writes the picture in the format of the name's extension, `.png`, `.exr` or `.hdr`, whole or not at all: the file
    /// that the render writes at its end where it is asked for one without an overlay. Layers go into EXR files.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        let mattes: Vec<&Names> = self.mattes.iter().collect();
        write_saying(path.as_ref(), &self.picture, &self.facts, (&self.layers, &mattes), self.view)
    }

    /// The picture in 8-bit sRGB, as a PNG file has it: red, green and blue, row by row from the top left.
    pub fn srgb(&self) -> Vec<[u8; 3]> {
        let tone = ToneMap::new(self.view.of_file());
        self.picture.rgb.iter().map(|&rgb| tone.encode(rgb)).collect()
    }

    /// The channels of a layer that was asked for; none of another.
    pub fn layer(&self, layer: Layer) -> Vec<&Channel> {
        let names = layer.channels();
        self.layers.iter().filter(|channel| names.contains(&channel.name)).collect()
    }
}

/// What became of an error that a render was to end at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The error that was asked for.
    pub asked: f64,
    /// The error by estimate, where there were samples enough for one.
    pub estimated: Option<f64>,
    /// Samples that every pixel has.
    pub spp: u32,
    /// Whether the picture has no brightness that an error could be relative to.
    pub is_black: bool,
}

impl Noise {
    pub(super) fn of(asked: f64, outcome: &Outcome) -> Noise {
        let Totals { noise, spp, .. } = outcome.totals;
        let is_black = noise.is_none() && brightness(&outcome.film.picture().rgb) == 0.0;
        Noise { asked, estimated: noise.map(|[now, _]| now), spp, is_black }
    }

    /// Whether it is as small as was asked for, as far as is known.
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
                write!(f, "the error is {now:.5} by estimate; {asked} was asked for")
            }
            Some(now) => write!(
                f,
                "the error that was asked for, {asked}, is not reached: it is {now:.5} by estimate at {spp} samples a pixel"
            ),
            None if is_black && spp >= least => write!(
                f,
                "whether the error that was asked for, {asked}, is reached is not known: errors are relative to the picture's brightness, and the picture is black"
            ),
            None => write!(
                f,
                "whether the error that was asked for, {asked}, is reached is not known: an estimate takes more than {least} samples a pixel, and the render ended at {spp}"
            ),
        }
    }
}

/// Says which samples pixels have, of which the fewest and the most that one has are given. Each has its first ones.
pub(crate) fn sample_counts(range: [u64; 2]) -> String {
    match range {
        [least, most] if least == most => format!("every pixel has its first {least} samples"),
        [0, most] => format!("pixels have between no sample and their first {most}"),
        [least, most] => format!("every pixel has its first {least} samples, and some have up to {most}"),
    }
}
