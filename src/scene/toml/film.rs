//! The keys of the film, and their conversion.

use super::one_of::{OneOf, Variant, WordOr};
use super::report::{Diagnostics, Read};
use super::table::{Fields, Key, Table};
use super::value::{Choice, Integer};
use crate::parameter::Number;
use crate::scene::description::{EXPOSURES, FilmMode, FilmSettings, Filter, LONGEST_SIDE, Tone};

pub(super) static FILM_TABLE: Table =
    Table::new("the film", &[&WIDTH, &HEIGHT, &EXPOSURE, &TONE, &FILTER, &MODE]);

const SIDE: Integer = Integer { least: 1, most: LONGEST_SIDE };

static WIDTH: Key<Integer> = Key::default("width", SIDE, "640", "The width of the image in pixels.");
static HEIGHT: Key<Integer> = Key::default("height", SIDE, "480", "Rows of pixels.");
static EXPOSURE: Key<Number> = Key::default(
    "exposure",
    EXPOSURES,
    "0",
    "The exposure of PNG files and the window, in stops: radiance is multiplied by 2 to this power.",
);
static TONE: Key<Choice<Tone>> = Key::default(
    "tone",
    Choice::NEW,
    "\"srgb\"",
    "The tone curve of PNG files and the window: srgb (clipped at white) or filmic (with a highlight roll-off).",
);

static FILTER: Key<WordOr<Filter>> = Key::default(
    "filter",
    FILTERS,
    "\"tent\"",
    "The reconstruction filter: none (pixel centres), box, tent, gaussian, mitchell, blackman-harris or lanczos; or a table with its type and radius.",
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

static BOX_RADIUS: Key<Number> =
    Key::default("radius", Filter::RADII, "0.5", "Half the filter's width in pixels.");
static TENT_RADIUS: Key<Number> =
    Key::default("radius", Filter::RADII, "1.0", "Half the filter's width in pixels.");
static GAUSSIAN_RADIUS: Key<Number> =
    Key::default("radius", Filter::RADII, "1.5", "Half the filter's width in pixels.");
static SIGMA: Key<Number> = Key::default("sigma", Filter::SIGMAS, "0.5", "Standard deviation in pixels.");
static MITCHELL_RADIUS: Key<Number> =
    Key::default("radius", Filter::RADII, "2.0", "Half the filter's width in pixels.");
static MITCHELL_B: Key<Number> = Key::default(
    "b",
    Filter::SHARES,
    "0.3333333333333333",
    "The parameter B of Mitchell and Netravali; larger values blur.",
);
static MITCHELL_C: Key<Number> = Key::default(
    "c",
    Filter::SHARES,
    "0.3333333333333333",
    "The parameter C of Mitchell and Netravali; larger values ring.",
);
static BLACKMAN_HARRIS_RADIUS: Key<Number> =
    Key::default("radius", Filter::RADII, "1.5", "Half the filter's width in pixels.");
static LANCZOS_RADIUS: Key<Number> = Key::default(
    "radius",
    Filter::RADII,
    "3.0",
    "Half the filter's width in pixels, which is the number of lobes on each side.",
);
static MODE: Key<Choice<FilmMode>> = Key::optional(
    "mode",
    Choice::NEW,
    "How samples are filtered: importance (each pixel draws its own samples from the filter) or continuous (each sample contributes to every pixel within the filter's radius). The default depends on the filter.",
);

pub(super) fn film(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<FilmSettings> {
    let width = fields.get(&WIDTH, diagnostics);
    let height = fields.get(&HEIGHT, diagnostics);
    let exposure = fields.get(&EXPOSURE, diagnostics);
    let tone = fields.get(&TONE, diagnostics);
    let filter = fields.get(&FILTER, diagnostics);
    let mode = fields.find(&MODE, diagnostics);
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
            Err(diagnostics.error(at, problem))
        }
    }
}

fn no_filter(_: &Fields<'_, '_>, _: &mut Diagnostics<'_>) -> Read<Filter> {
    Ok(Filter::None)
}

fn box_filter(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Filter> {
    Ok(Filter::Box { radius: fields.get(&BOX_RADIUS, diagnostics)? })
}

fn tent_filter(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Filter> {
    Ok(Filter::Tent { radius: fields.get(&TENT_RADIUS, diagnostics)? })
}

fn gaussian_filter(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Filter> {
    let radius = fields.get(&GAUSSIAN_RADIUS, diagnostics);
    let sigma = fields.get(&SIGMA, diagnostics);
    Ok(Filter::Gaussian { radius: radius?, sigma: sigma? })
}

fn mitchell_filter(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Filter> {
    let radius = fields.get(&MITCHELL_RADIUS, diagnostics);
    let b = fields.get(&MITCHELL_B, diagnostics);
    let c = fields.get(&MITCHELL_C, diagnostics);
    Ok(Filter::Mitchell { radius: radius?, b: b?, c: c? })
}

fn blackman_harris_filter(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Filter> {
    Ok(Filter::BlackmanHarris { radius: fields.get(&BLACKMAN_HARRIS_RADIUS, diagnostics)? })
}

fn lanczos_filter(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Filter> {
    Ok(Filter::Lanczos { radius: fields.get(&LANCZOS_RADIUS, diagnostics)? })
}
