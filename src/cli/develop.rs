//! `stride develop`: makes a picture from dumped samples.

use super::arguments::{self, range};
use super::failure::{Failure, usage};
use super::render::{self, Layers};
use crate::api::part;
use crate::film::cryptomatte::Mattes;
use crate::film::develop::Developer;
use crate::film::{Channel, Film, Identity, Layer, Layout, SampleRanges, Splatter, ViewTransform, Weights};
use crate::integrator;
use crate::math::lanes::Level;
use crate::output::{self, Crop, PictureOptions, npy, write_picture};
use crate::sampling::Region;
use crate::scene::{FilmMode, FilmSettings, Filter, Tone};
use crate::session;
use std::io::Write;
use std::ops::Range;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct DevelopArguments {
    /// Sample dump (render --samples), of a film in mode continuous, or of a whole film with filter box
    samples: PathBuf,
    /// Reconstruction filter: box, tent, gaussian, mitchell, blackman-harris or lanczos
    #[arg(long, value_name = "NAME")]
    filter: Filter,
    /// Filter radius in pixels, instead of the filter's default
    #[arg(long, value_name = "PIXELS")]
    radius: Option<f64>,
    /// Size of the film in pixels, if the file does not contain it
    #[arg(long, value_name = "WxH", value_parser = arguments::size)]
    size: Option<(u32, u32)>,
    /// Picture to write: .png, .exr or .hdr; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    outputs: Vec<PathBuf>,
    /// Layers for EXR files that samples determine: variance, samples, or all
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = render::layer)]
    layers: Vec<Layers>,
    /// Exposure of PNG files in stops, instead of the render's
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = render::exposure)]
    exposure: Option<f64>,
    /// Tone curve of PNG files, srgb or filmic, instead of the render's
    #[arg(long, value_name = "NAME")]
    tone: Option<Tone>,
    /// Print only errors
    #[arg(short, long)]
    quiet: bool,
}

/// Samples read at a time.
const PIECE: usize = 1 << 16;

/// The metadata of a sample dump.
struct Dumped {
    facts: Identity,
    width: u32,
    height: u32,
    /// The part that becomes the picture, and the part that has samples.
    shown: Region,
    rendered: Region,
    /// The requested range of samples of every pixel.
    asked: Option<Range<u32>>,
}

pub(super) fn run(arguments: &DevelopArguments) -> Result<(), Failure> {
    let level = Level::from_environment().map_err(usage)?;
    for path in &arguments.outputs {
        output::check_writable(path)?;
    }
    let filter = match arguments.radius {
        Some(radius) if !(0.5..=16.0).contains(&radius) => return Err(usage("a radius is 0.5 to 16 pixels")),
        Some(radius) => arguments.filter.with_radius(radius),
        None => arguments.filter,
    };
    if let Some(layer) =
        arguments.layers.iter().filter_map(|asked| asked.0).find(|layer| !layer.is_of_radiance())
    {
        return Err(usage(format!(
            "samples do not determine the layer {}; render the scene with it (render --layers)",
            layer.name()
        )));
    }
    let layers: Vec<Layer> =
        render::layers(&arguments.layers).into_iter().filter(Layer::is_of_radiance).collect();
    let mut dump = npy::read::open_dump(&arguments.samples)?;
    let dumped = match (dump.facts(), arguments.size) {
        (Some(facts), None) => Dumped::from_facts(facts, arguments)?,
        (Some(_), Some(_)) => {
            return Err(usage("the file contains the size of its film; omit --size"));
        }
        (None, Some((width, height))) => Dumped::of_size(width, height),
        (None, None) => {
            return Err(usage(format!(
                "{:?} does not contain the size of its film (was it saved by another program?); set --size",
                arguments.samples
            )));
        }
    };
    let film = FilmSettings {
        width: dumped.width,
        height: dumped.height,
        filter,
        mode: Some(FilmMode::Continuous),
        ..FilmSettings::default()
    };
    if let Some(problem) = film.problem() {
        return Err(usage(problem));
    }
    let weights = Weights::new(filter);
    let (region, shown) = dumped.shown.with_margin(weights.reach(), dumped.height);
    if !dumped.rendered.contains(region) {
        return Err(anyhow::anyhow!(
            "{:?} belongs to a crop, and its samples around the crop suffice only for a narrower filter than {filter}; render the crop with a filter of this width",
            arguments.samples
        )
        .into());
    }
    let spreads = layers.contains(&Layer::Variance);
    let layout = Layout { weighted: true, spreads, shown, ..Layout::plain(region.width, region.height) };
    let origin = [region.x, region.y];
    let splatter = Splatter::new(weights, origin).with_spreads(spreads);
    let mut developer = Developer::new(layout, splatter, dumped.width, origin, level)?;
    let failed = |reason: String| anyhow::anyhow!("cannot develop {:?}: {reason}", arguments.samples);
    loop {
        let samples = dump.next(PIECE).map_err(|fault| failed(fault.to_string()))?;
        if samples.is_empty() {
            break;
        }
        developer.add(&samples).map_err(|misplaced| {
            failed(format!("{misplaced}; is the film's size {}×{}?", dumped.width, dumped.height))
        })?;
    }
    let film = developer.finish();
    let facts = dumped.developed(filter, &film);
    let exposure = arguments.exposure.or_else(|| dumped.facts.get("exposure")?.parse().ok());
    let tone = arguments.tone.or_else(|| dumped.facts.get("tone")?.parse().ok());
    let view = ViewTransform { exposure: exposure.unwrap_or(0.0), tone: tone.unwrap_or_default() };
    let picture = film.picture();
    let channels: Vec<Channel> =
        layers.iter().flat_map(|&layer| film.channels(layer, &Mattes::none())).collect();
    let (facts, channels, crop) = (Some(&facts), &channels[..], Crop::of(&facts));
    let options = PictureOptions { view, facts, channels, mattes: &[], crop };
    // All files are written, even if one fails.
    let written: Vec<_> =
        arguments.outputs.iter().map(|path| write_picture(path, &picture, &options)).collect();
    written.into_iter().collect::<Result<(), _>>()?;
    if !arguments.quiet {
        let names: Vec<String> = arguments.outputs.iter().map(|path| path.display().to_string()).collect();
        // Standard error may be closed, which is not an error.
        let _ = writeln!(std::io::stderr(), "{} samples; wrote {}", dump.count(), names.join(", "));
    }
    Ok(())
}

impl Dumped {
    /// From the metadata in the file.
    fn from_facts(facts: &Identity, arguments: &DevelopArguments) -> Result<Dumped, Failure> {
        let path = &arguments.samples;
        let strange = || anyhow::anyhow!("the metadata of {path:?} is not in a known form");
        let fact = |name: &str| facts.get(name).ok_or_else(strange);
        let (width, height) = arguments::size(fact("size")?).map_err(|_| strange())?;
        let part = |text: &str| {
            let crop = arguments::crop(text).map_err(|_| strange())?;
            part(Some(crop), width, height).map_err(|_| strange())
        };
        let (shown, rendered) = (part(fact("crop")?)?, part(fact("rendered")?)?);
        let (filter, mode) = (fact("filter")?, fact("mode")?);
        let whole = shown == Region::whole(width, height);
        let even = mode == FilmMode::Continuous.to_string() || (filter == "box 0.5" && whole);
        if !even {
            return Err(anyhow::anyhow!(
                "the samples of {path:?} were drawn from the filter {filter}, and cannot be filtered by another; render with --film-mode continuous for uniform samples"
            )
            .into());
        }
        if fact("integrator")?.parse().is_ok_and(integrator::contributes) {
            return Err(anyhow::anyhow!(
                "the integrator of {path:?} contributes light to other pixels, and the dump lacks these contributions; render the scene with the filter"
            )
            .into());
        }
        let asked = facts.get("asked").and_then(|asked| range(asked).ok());
        Ok(Dumped { facts: facts.clone(), width, height, shown, rendered, asked })
    }

    /// From the size alone.
    fn of_size(width: u32, height: u32) -> Dumped {
        let whole = Region::whole(width, height);
        let facts = Identity::default()
            .with("program", concat!("stride ", env!("CARGO_PKG_VERSION")))
            .with("size", format_args!("{width}x{height}"))
            .with("filter", "")
            .with("mode", "");
        Dumped { facts, width, height, shown: whole, rendered: whole, asked: None }
    }

    /// The metadata of a picture of these samples with a filter, equal to that of a render.
    fn developed(&self, filter: Filter, film: &Film) -> Identity {
        let [least, most] = film.seen_range();
        let end = u32::try_from(most).unwrap_or(u32::MAX);
        let sample_ranges = SampleRanges::prefix(self.asked.clone().unwrap_or(0..end), least, most);
        let facts = self.facts.facts().filter(|(name, _)| !session::NOTES.contains(name));
        let facts = facts.fold(Identity::default(), |facts, (name, value)| match name {
            "filter" => facts.with(name, filter),
            "mode" => facts.with(name, FilmMode::Continuous),
            _ => facts.with(name, value),
        });
        session::facts(&facts, &sample_ranges)
    }
}
