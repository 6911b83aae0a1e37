//! Arguments that several commands share, and their parsers.

use super::failure::Failure;
use super::reading::{ReadingArguments, scene_file};
use crate::api::check_film;
use crate::scene::{
    self, Choice, FilmMode, Filter, Integrator, LONGEST_SIDE, Loaded, MOST_BOUNCES, Sampler, Scene,
};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The help text of an option, with the names that it accepts.
pub(super) fn named<C: Choice>(about: &str) -> String {
    format!("{about}: {}", C::listed())
}

/// The heading of options that replace settings of the scene.
pub(super) const SCENE_HEADING: &str = "Scene settings";

/// The scene file, and changes to the scene.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct SceneArguments {
    #[arg(help = scene_file())]
    pub scene: PathBuf,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Seed of all random numbers, instead of the scene's
    #[arg(long, help_heading = SCENE_HEADING, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    pub seed: Option<u32>,
    /// Size of the film in pixels, instead of the scene's
    #[arg(long, help_heading = SCENE_HEADING, value_name = "WxH", allow_hyphen_values = true, value_parser = size)]
    pub size: Option<(u32, u32)>,
    #[arg(long, help_heading = SCENE_HEADING, value_name = "NAME", help = named::<Integrator>("Integrator, instead of the scene's"))]
    pub integrator: Option<Integrator>,
    #[arg(long, help_heading = SCENE_HEADING, value_name = "NAME", value_parser = sampler, help = named::<Sampler>("Sampler, instead of the scene's"))]
    pub sampler: Option<Samplers>,
    /// Maximum number of bounces, or unlimited, instead of the scene's; 0 shows only emitters
    #[arg(long, help_heading = SCENE_HEADING, value_name = "N", allow_negative_numbers = true, value_parser = max_depth)]
    pub max_depth: Option<u32>,
    #[arg(long, help_heading = SCENE_HEADING, value_name = "NAME", help = named::<Filter>("Reconstruction filter, instead of the scene's"))]
    pub filter: Option<Filter>,
    /// Filtering mode, instead of the scene's: importance (each pixel's samples are drawn from the filter) or continuous
    /// (each sample contributes to all pixels within the filter radius) [default: the best mode for the filter]
    #[arg(long, help_heading = SCENE_HEADING, value_name = "NAME")]
    pub film_mode: Option<FilmMode>,
}

impl SceneArguments {
    /// Reads the scene, prints its warnings, and applies the changes.
    pub(super) fn load(&self, quiet: bool) -> Result<Scene, Failure> {
        Ok(self.load_whole(quiet)?.scene)
    }

    /// The same, also returning the files that the scene was read from and its crop of the film.
    pub(super) fn load_whole(&self, quiet: bool) -> Result<Loaded, Failure> {
        let mut loaded = self.reading.load(&self.scene, quiet)?;
        if !quiet {
            for warning in &loaded.warnings {
                let _ = writeln!(std::io::stderr(), "warning: {warning}");
            }
        }
        let scene = &mut loaded.scene;
        if let Some((width, height)) = self.size {
            (scene.film.width, scene.film.height) = (width, height);
            loaded.crop = None;
        }
        if let Some(filter) = self.filter {
            scene.film.filter = filter;
        }
        if let Some(mode) = self.film_mode {
            scene.film.mode = Some(mode);
        }
        if let Some(seed) = self.seed {
            scene.render.seed = seed;
        }
        if let Some(integrator) = self.integrator {
            scene.render.integrator = integrator;
        }
        if let Some(samplers) = &self.sampler {
            scene.render.sampler = samplers.first();
        }
        if let Some(max_depth) = self.max_depth {
            scene.render.max_depth = max_depth;
        }
        check_film(scene)?;
        Ok(loaded)
    }

    /// The requested samplers.
    pub(super) fn samplers(&self) -> Option<Vec<Sampler>> {
        self.sampler.as_ref().map(|samplers| samplers.0.clone())
    }

    /// The name of the scene: the file's name.
    pub(super) fn name(&self) -> String {
        self.scene.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }
}

/// One or more samplers. Only commands that parse the option with [`samplers`] accept several.
#[derive(Clone, Debug)]
pub(super) struct Samplers(Vec<Sampler>);

impl Samplers {
    /// The only sampler, or the first of several.
    pub(super) fn first(&self) -> Sampler {
        self.0[0]
    }
}

/// Parses "sobol".
fn sampler(text: &str) -> Result<Samplers, String> {
    Ok(Samplers(vec![text.parse()?]))
}

/// Parses "sobol,independent".
pub(super) fn samplers(text: &str) -> Result<Samplers, String> {
    let mut found = Vec::new();
    for name in text.split(',') {
        let sampler: Sampler = name.trim().parse()?;
        if found.contains(&sampler) {
            return Err(format!("{} is named twice", sampler.name()));
        }
        found.push(sampler);
    }
    Ok(Samplers(found))
}

/// Parses "640x480".
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let error = || format!("a size is WIDTHxHEIGHT, like 640x480, each side from 1 to {LONGEST_SIDE}");
    let (width, height) = text.split_once(['x', '×']).ok_or_else(error)?;
    let side =
        |text: &str| text.parse().ok().filter(|side| (1..=LONGEST_SIDE).contains(side)).ok_or_else(error);
    Ok((side(width)?, side(height)?))
}

/// Parses "7".
pub(super) fn seed(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| "a seed is a whole number from 0 to 4294967295".to_owned())
}

/// Parses "12" or "unlimited" as a number of bounces.
pub(super) fn max_depth(text: &str) -> Result<u32, String> {
    let number = || text.parse().ok().filter(|depth| *depth <= MOST_BOUNCES);
    let depth = if text == "unlimited" { Some(scene::UNLIMITED) } else { number() };
    depth.ok_or_else(|| {
        format!("a number of bounces is a whole number from 0 to {MOST_BOUNCES}, or unlimited")
    })
}

/// Parses "10,20,64,48" as a part of the film.
pub(super) fn crop(text: &str) -> Result<[u32; 4], String> {
    let error = || "a crop is X,Y,WIDTH,HEIGHT in whole pixels, like 10,20,64,48".to_owned();
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    numbers.ok().and_then(|numbers| numbers.try_into().ok()).ok_or_else(error)
}

/// Parses "30s", "1.5m", "250ms" or "2h"; a bare number is in seconds.
pub(super) fn duration(text: &str) -> Result<Duration, String> {
    let error = || "a time is a number with a unit, like 30s, 1.5m, 2h or 250ms".to_owned();
    let split = text.rfind(|c: char| !c.is_ascii_alphabetic()).map_or(0, |last| last + 1);
    let (number, unit) = text.split_at(split);
    let seconds = match unit {
        "ms" => 0.001,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(error()),
    };
    let number: f64 = number.trim().parse().map_err(|_| error())?;
    Duration::try_from_secs_f64(number * seconds).ok().filter(|d| !d.is_zero()).ok_or_else(error)
}

/// Parses "16..32", from the first sample index to one past the last.
pub(super) fn range(text: &str) -> Result<Range<u32>, String> {
    let error = || {
        "a range of samples is FIRST..END, like 16..32 for the samples 16 to 31, or FIRST.. without an end"
            .to_owned()
    };
    let (first, end) = text.split_once("..").ok_or_else(error)?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| error());
    let end = if end.trim().is_empty() { u32::MAX } else { number(end)? };
    let range = number(first)?..end;
    if range.is_empty() { Err(format!("the range {text} is empty: {}", error())) } else { Ok(range) }
}

/// A path as shown in messages.
pub(super) fn shown(path: &Path) -> String {
    path.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Args;

    #[test]
    fn sizes_crops_and_times_are_read_or_refused() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        for bad in ["", "640", "0x480", "640x", "-1x5", "1e3x5", "65537x1", "640x480x2"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!((max_depth("0"), max_depth("unlimited")), (Ok(0), Ok(scene::UNLIMITED)));
        for bad in ["", "-1", "10001", "4294967295", "endless"] {
            assert!(max_depth(bad).is_err(), "{bad}");
        }
        assert_eq!(crop("1,2,3,4"), Ok([1, 2, 3, 4]));
        for bad in ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "-1,0,1,1"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
        assert_eq!((range("16..32"), range("16..")), (Ok(16..32), Ok(16..u32::MAX)));
        for bad in [
            "",
            "16",
            "..",
            "..32",
            "4294967295..",
            "3..3",
            "4..3",
            "-1..3",
            "1...3",
            "1..=3",
            "0..4294967296",
        ] {
            assert!(range(bad).is_err(), "{bad}");
        }
        assert_eq!(duration("30s"), Ok(Duration::from_secs(30)));
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("250ms"), Ok(Duration::from_millis(250)));
        for bad in ["", "s", "0", "-1s", "nan", "inf", "1e300h", "5 parsecs"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn help_lists_all_choices() {
        let command = SceneArguments::augment_args(clap::Command::new("stride"));
        let help = |id: &str| {
            let argument = command.get_arguments().find(|argument| argument.get_id() == id).unwrap();
            argument.get_help().unwrap().to_string()
        };
        assert!(Integrator::names().all(|name| help("integrator").contains(name)));
        assert!(Sampler::names().all(|name| help("sampler").contains(name)));
        assert!(Filter::names().all(|name| help("filter").contains(name)));
        assert!(FilmMode::names().all(|name| help("film_mode").contains(name)));
    }
}
