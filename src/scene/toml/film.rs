//! The keys of the film, and what is made of them.

use std::fmt;
use std::str::FromStr;

use super::one_of::{OneOf, Variant, WordOr};
use super::report::{Read, Reports, word};
use super::table::{Fields, Key, Table};
use super::value::{Choice, Integer};
use crate::parameter::Number;
use crate::scene::description::{FilmMode, FilmSettings, Filter, Tone};

pub(super) static FILM_TABLE: Table =
    Table::new("the film", &[&WIDTH, &HEIGHT, &EXPOSURE, &TONE, &FILTER, &MODE]);

static WIDTH: Key<Integer> =
    Key::default("width", Integer { least: 1, most: 65536 }, "640", "Pixels in a row.");
static HEIGHT: Key<Integer> =
    Key::default("height", Integer { least: 1, most: 65536 }, "480", "Rows of pixels.");
static EXPOSURE: Key<Number> = Key::default(
    "exposure",
    Number::between(-64.0, 64.0),
    "0",
    "Stops: PNG and window show radiance times 2 to this power.",
);
static TONE: Key<Choice<Tone>> = Key::default(
    "tone",
    TONES,
    "\"srgb\"",
    "The curve of PNG and window: srgb (clipped at white) or filmic (highlights roll off).",
);

const TONES: Choice<Tone> =
    Choice { what: "tone curve", options: &[("srgb", Tone::Srgb), ("filmic", Tone::Filmic)] };

static FILTER: Key<WordOr<Filter>> = Key::default(
    "filter",
    FILTERS,
    "\"tent\"",
    "The reconstruction filter: none (pixel centres), box, tent, gaussian, mitchell, blackman-harris or lanczos; or a table that gives its radius.",
);

const FILTERS: WordOr<Filter> = WordOr(OneOf {
    what: "filter",
    members: None,
    variants: &[
        Variant::new("none", &NO_FILTER_TABLE, no_filter),
        Variant::new("box", &BOX_TABLE, box_filter),
        Variant::new("tent", &TENT_TABLE, tent_filter),
        Variant::new("gaussian", &GAUSSIAN_TABLE, gaussian_filter),
        Variant::new("mitchell", &MITCHELL_TABLE, mitchell_filter),
        Variant::new("blackman-harris", &BLACKMAN_HARRIS_TABLE, blackman_harris_filter),
        Variant::new("lanczos", &LANCZOS_TABLE, lanczos_filter),
    ],
});

static NO_FILTER_TABLE: Table = Table::new("filter \"none\"", &[]);
static BOX_TABLE: Table = Table::new("filter \"box\"", &[&BOX_RADIUS]);
static TENT_TABLE: Table = Table::new("filter \"tent\"", &[&TENT_RADIUS]);
static GAUSSIAN_TABLE: Table = Table::new("filter \"gaussian\"", &[&GAUSSIAN_RADIUS, &SIGMA]);
static MITCHELL_TABLE: Table =
    Table::new("filter \"mitchell\"", &[&MITCHELL_RADIUS, &MITCHELL_B, &MITCHELL_C]);
static BLACKMAN_HARRIS_TABLE: Table = Table::new("filter \"blackman-harris\"", &[&BLACKMAN_HARRIS_RADIUS]);
static LANCZOS_TABLE: Table = Table::new("filter \"lanczos\"", &[&LANCZOS_RADIUS]);

const FILTER_RADIUS: Number = Number::positive(1e-6, 16.0);

static BOX_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "0.5", "Half the filter's width in pixels.");
static TENT_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "1.0", "Half the filter's width in pixels.");
static GAUSSIAN_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "1.5", "Half the filter's width in pixels.");
static SIGMA: Key<Number> =
    Key::default("sigma", Number::between(0.05, 16.0), "0.5", "Standard deviation in pixels.");
static MITCHELL_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "2.0", "Half the filter's width in pixels.");
static MITCHELL_B: Key<Number> = Key::default(
    "b",
    Number::between(0.0, 1.0),
    "0.3333333333333333",
    "Mitchell and Netravali's B: 1 blurs.",
);
static MITCHELL_C: Key<Number> = Key::default(
    "c",
    Number::between(0.0, 1.0),
    "0.3333333333333333",
    "Mitchell and Netravali's C: 1 rings.",
);
static BLACKMAN_HARRIS_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "1.5", "Half the filter's width in pixels.");
static LANCZOS_RADIUS: Key<Number> = Key::default(
    "radius",
    FILTER_RADIUS,
    "3.0",
    "Half the filter's width in pixels: the lobes on each side of its middle.",
);
static MODE: Key<Choice<FilmMode>> = Key::optional(
    "mode",
    MODES,
    "How samples are filtered: importance (each pixel draws its own from the filter) or continuous (each sample lands on every pixel within the filter's reach); the filter decides if this is absent.",
);

const MODES: Choice<FilmMode> = Choice {
    what: "mode",
    options: &[("importance", FilmMode::Importance), ("continuous", FilmMode::Continuous)],
};

pub(super) fn film(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<FilmSettings> {
    let width = fields.get(&WIDTH, reports);
    let height = fields.get(&HEIGHT, reports);
    let exposure = fields.get(&EXPOSURE, reports);
    let tone = fields.get(&TONE, reports);
    let filter = fields.get(&FILTER, reports);
    let mode = fields.find(&MODE, reports);
    let film = FilmSettings {
        width: width?,
        height: height?,
        exposure: exposure?,
        tone: tone?,
        filter: filter?,
        mode: mode?,
    };
    match film.problem() {
        None => Ok(film),
        Some(problem) => {
            let given = fields.has(&MODE);
            let at = if given { fields.place_of(&MODE) } else { fields.place_of(&FILTER) };
            Err(reports.error(at, problem))
        }
    }
}

fn no_filter(_: &Fields<'_, '_>, _: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::None)
}

fn box_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::Box { radius: fields.get(&BOX_RADIUS, reports)? })
}

fn tent_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::Tent { radius: fields.get(&TENT_RADIUS, reports)? })
}

fn gaussian_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    let radius = fields.get(&GAUSSIAN_RADIUS, reports);
    let sigma = fields.get(&SIGMA, reports);
    Ok(Filter::Gaussian { radius: radius?, sigma: sigma? })
}

fn mitchell_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    let radius = fields.get(&MITCHELL_RADIUS, reports);
    let b = fields.get(&MITCHELL_B, reports);
    let c = fields.get(&MITCHELL_C, reports);
    Ok(Filter::Mitchell { radius: radius?, b: b?, c: c? })
}

fn blackman_harris_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::BlackmanHarris { radius: fields.get(&BLACKMAN_HARRIS_RADIUS, reports)? })
}

fn lanczos_filter(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Filter> {
    Ok(Filter::Lanczos { radius: fields.get(&LANCZOS_RADIUS, reports)? })
}

impl FromStr for Filter {
    type Err = String;

    /// The filter of this name with its usual radius, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| FILTERS.read_word(name, 0, reports), name)
    }
}

/// "tent 1", "gaussian 1.5, sigma 0.5": the name, the radius, and what else there is to it.
impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Filter::None => f.write_str("none"),
            Filter::Box { radius } => write!(f, "box {radius}"),
            Filter::Tent { radius } => write!(f, "tent {radius}"),
            Filter::Gaussian { radius, sigma } => write!(f, "gaussian {radius}, sigma {sigma}"),
            Filter::Mitchell { radius, b, c } => write!(f, "mitchell {radius}, b {b}, c {c}"),
            Filter::BlackmanHarris { radius } => write!(f, "blackman-harris {radius}"),
            Filter::Lanczos { radius } => write!(f, "lanczos {radius}"),
        }
    }
}

/// The name, as in a scene file.
impl fmt::Display for FilmMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(MODES.name(*self))
    }
}

impl FromStr for FilmMode {
    type Err = String;

    /// The mode of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| MODES.pick(name, 0, reports), name)
    }
}

impl FromStr for Tone {
    type Err = String;

    /// The tone curve of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        word(|reports| TONES.pick(name, 0, reports), name)
    }
}
