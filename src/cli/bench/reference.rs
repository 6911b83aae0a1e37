//! The picture that `stride bench noise` compares with: rendered, or read from a file and checked.

use super::measurement::{Bench, Verbosity, counted};
use crate::cli::arguments::range;
use crate::cli::failure::{Failure, usage};
use crate::film::{Identity, Picture};
use crate::output::{Format, exr, read_picture};
use crate::scene::{Choice, Integrator, Sampler};
use anyhow::anyhow;
use std::fs::File;
use std::num::NonZeroUsize;
use std::path::Path;

/// Samples of the reference per sample of the largest measured picture.
pub(super) const FACTOR: u32 = 32;

/// Added to the scene's seed for the reference. The measured pictures count up from the scene's seed. It has no power of
/// two as a factor: samplers hash seeds, and seeds that differ in the highest bit alone give correlated numbers.
const SEED: u32 = 0x9e37_79b9;

/// Added to the first measured seed in advice. It is above the largest number of seeds.
const OTHER_SEED: u32 = 1000;

/// A picture to compare with.
#[derive(Debug)]
pub(super) struct Reference {
    pub(super) picture: Picture,
    /// Its source, samples, sampler and seed, for users.
    pub(super) about: String,
}

/// The pictures that are compared with the reference.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planned<'a> {
    pub(super) samplers: &'a [Sampler],
    pub(super) first_seed: u32,
    pub(super) seeds: u16,
    /// The largest number of samples per pixel.
    pub(super) most: u32,
}

/// Rejects file names without the extension .exr: PNG is clamped, and Radiance HDR has an error of up to 0.4% of its own.
pub(super) fn check_name(path: &Path) -> Result<(), Failure> {
    match Format::of(path) {
        Ok(Format::Exr) => Ok(()),
        _ => Err(usage(format!("--reference {}: a reference is OpenEXR, a file named .exr", path.display()))),
    }
}

/// Reads a reference for the film of a scene. Its metadata are checked, as far as it has them.
pub(super) fn read(path: &Path, bench: &Bench, planned: Planned<'_>) -> Result<Reference, Failure> {
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
    let facts = File::open(path).ok().and_then(exr::facts).unwrap_or_default();
    let objection = objection(&bench.identity(), &facts, planned);
    if let Some(objection) = objection {
        return Err(anyhow!("the reference {file} {objection}").into());
    }
    let unstated = unstated(&facts);
    if !unstated.is_empty() {
        let list = unstated.join(", ");
        bench.print_progress(&format!("warning: the reference {file} does not state: {list}; not checked"));
    }
    let samples = facts.get("samples").and_then(Samples::parse);
    if let Some(few) = samples.and_then(|samples| too_few(samples.least, planned.most)) {
        bench.print_progress(&few);
    }
    Ok(Reference { picture, about: describe(&path.display().to_string(), samples, &facts) })
}

/// Facts on which the expectation of a picture depends. Integrators other than `whitted` estimate the same one.
const SAME: [&str; 6] = ["camera", "scene", "size", "crop", "filter", "max depth"];

/// Facts on which its independence and its error depend.
const OTHERS: [&str; 3] = ["sampler", "seed", "samples"];

/// The value of the fact `scene` in files of renders without a fingerprint.
const UNKNOWN: &str = "unknown";

/// The reason why a picture with the facts `theirs` is no reference for pictures with the facts `ours`.
fn objection(ours: &Identity, theirs: &Identity, planned: Planned<'_>) -> Option<String> {
    let is_whitted = |facts: &Identity| facts.get("integrator") == Some(Integrator::Whitted.name());
    if let (Some(our), Some(their)) = (ours.get("integrator"), theirs.get("integrator"))
        && is_whitted(ours) != is_whitted(theirs)
    {
        return Some(format!(
            "is of the integrator {their}, but {our} is measured: whitted computes another picture; render the reference \
             with --integrator {our}"
        ));
    }
    let differs = |name: &&str| match (ours.get(name), theirs.get(name)) {
        (_, Some(UNKNOWN)) | (Some(_), None) => false,
        (ours, theirs) => ours != theirs,
    };
    if let Some(name) = SAME.into_iter().find(differs) {
        let [ours, theirs] = [ours, theirs].map(|facts| facts.get(name).unwrap_or("none"));
        return Some(match name {
            "camera" => {
                "is of a camera that was moved in the window; render it with the scene's camera".to_owned()
            }
            "scene" => {
                let [ours, theirs] = [ours, theirs].map(|digits| digits.get(..8).unwrap_or(digits));
                format!(
                    "is of another scene: its fingerprint is {theirs}…, not {ours}…; render it from this scene"
                )
            }
            _ => format!(
                "would differ in more than noise: its {name} is {theirs}, not {ours}; use one {name} for both"
            ),
        });
    }
    let sampler = theirs.get("sampler").and_then(Sampler::find)?;
    let seed: u32 = theirs.get("seed")?.parse().ok()?;
    let is_measured = seed.wrapping_sub(planned.first_seed) < planned.seeds.into();
    (is_measured && planned.samplers.contains(&sampler)).then(|| {
        format!(
            "shares samples with measured pictures: {} with the seed {seed}; render it with another seed, such as --seed {}",
            sampler.name(),
            planned.first_seed.wrapping_add(OTHER_SEED)
        )
    })
}

/// The facts that are not in a file, or have no meaning here.
fn unstated(facts: &Identity) -> Vec<&'static str> {
    let names = SAME.into_iter().filter(|name| *name != "camera").chain(OTHERS);
    names.filter(|name| facts.get(name).is_none_or(|value| value == UNKNOWN)).collect()
}

/// Samples per pixel of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Samples {
    least: u64,
    /// Whether some pixels have more.
    is_least: bool,
}

impl Samples {
    /// Parses "0..64", "0..8, 16..32, and some of 32..64" or "some of 0..8".
    fn parse(text: &str) -> Option<Samples> {
        let mut samples = Samples { least: 0, is_least: false };
        for part in text.split(", ") {
            if part.trim_start_matches("and ").starts_with("some of ") {
                samples.is_least = true;
            } else {
                let range = range(part).ok()?;
                samples.least += u64::from(range.end - range.start);
            }
        }
        Some(samples)
    }
}

/// A warning if the error of a reference with this number of samples is visible in the largest measured picture.
fn too_few(samples: u64, most: u32) -> Option<String> {
    let needed = u64::from(most) * u64::from(FACTOR);
    (samples < needed).then(|| {
        let excess = (1.0 + f64::from(most) / samples.max(1) as f64).sqrt() - 1.0;
        format!(
            "warning: the reference has {}; its own error adds about {:.1}% to the error at {most}; give it {needed} or more",
            counted(samples, "sample per pixel", "samples per pixel"),
            100.0 * excess
        )
    })
}

/// "r.exr, 64 samples per pixel, sobol, seed 1000".
fn describe(source: &str, samples: Option<Samples>, facts: &Identity) -> String {
    let samples = match samples {
        None => "unknown samples per pixel".to_owned(),
        Some(Samples { least, is_least }) => {
            let least = counted(least, "sample per pixel", "samples per pixel");
            if is_least { format!("at least {least}") } else { least }
        }
    };
    let sampler = facts.get("sampler").unwrap_or("unknown sampler");
    format!("{source}, {samples}, {sampler}, seed {}", facts.get("seed").unwrap_or(UNKNOWN))
}

/// Renders the reference with `sobol`, whose error is the smallest; `None` if Ctrl-C was pressed before the end.
pub(super) fn render(
    bench: &Bench,
    spp: u32,
    planned: Planned<'_>,
    threads: NonZeroUsize,
) -> Result<Option<Reference>, Failure> {
    if let Some(few) = too_few(spp.into(), planned.most) {
        bench.print_progress(&few);
    }
    bench.print_progress(&format!("rendering the reference, {spp} samples per pixel"));
    let mut scene = bench.scene.clone();
    scene.render.seed = scene.render.seed.wrapping_add(SEED);
    scene.render.sampler = Sampler::Sobol;
    let facts = Identity::default().with("sampler", scene.render.sampler).with("seed", scene.render.seed);
    let about = describe("rendered", Some(Samples { least: spp.into(), is_least: false }), &facts);
    let report = bench.render(scene, spp, threads, Verbosity::Progress)?;
    Ok(report.map(|report| Reference { picture: report.picture, about }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(changes: &[(&str, &str)]) -> Identity {
        let all = [
            ("scene", "5eed5eed5eed"),
            ("size", "24x18"),
            ("crop", "0,0,24,18"),
            ("filter", "box 0.5"),
            ("integrator", "path"),
            ("sampler", "sobol"),
            ("max depth", "5"),
            ("seed", "1000"),
            ("samples", "0..128"),
        ];
        let added = changes.iter().filter(|(name, _)| all.iter().all(|(known, _)| known != name));
        let value =
            |name: &str| changes.iter().find(|(changed, _)| *changed == name).map(|(_, value)| *value);
        let known = all.iter().map(|(name, old)| (*name, value(name).unwrap_or(old)));
        let given = known.chain(added.copied()).filter(|(_, value)| !value.is_empty());
        given.fold(Identity::default(), |facts, (name, value)| facts.with(name, value))
    }

    const PLANNED: Planned<'_> = Planned { samplers: &[Sampler::Sobol], first_seed: 5, seeds: 8, most: 4 };

    fn objected(changes: &[(&str, &str)]) -> Option<String> {
        objection(&facts(&[("seed", "5")]), &facts(changes), PLANNED)
    }

    #[test]
    fn references_that_would_differ_in_more_than_noise_are_refused() {
        for (name, value, words) in [
            ("scene", "0ddba11", "another scene: its fingerprint is 0ddba11…, not 5eed5eed…"),
            ("size", "48x18", "its size is 48x18, not 24x18"),
            ("crop", "1,0,24,18", "its crop is 1,0,24,18, not 0,0,24,18"),
            ("filter", "tent 1", "its filter is tent 1, not box 0.5"),
            ("max depth", "unlimited", "its max depth is unlimited, not 5"),
            ("integrator", "whitted", "is of the integrator whitted, but path is measured"),
            ("camera", "eye = [0, 0, 0]", "moved in the window"),
        ] {
            let found = objected(&[(name, value)]).unwrap_or_default();
            assert!(found.contains(words), "{name}: {found:?}");
        }
        for (name, value) in
            [("integrator", "path-naive"), ("sampler", "independent"), ("program", "x"), ("scene", "unknown")]
        {
            assert_eq!(objected(&[(name, value)]), None, "{name}");
        }
        for missing in SAME.into_iter().chain(OTHERS).chain(["integrator"]) {
            assert_eq!(objected(&[(missing, "")]), None, "{missing}");
        }
    }

    #[test]
    fn references_with_a_measured_sampler_and_seed_are_refused() {
        for (seed, is_measured) in [("4", false), ("5", true), ("12", true), ("13", false)] {
            let found = objected(&[("seed", seed)]);
            assert_eq!(found.is_some(), is_measured, "{seed}: {found:?}");
            assert!(found.is_none_or(|found| found.ends_with("--seed 1005")));
            assert_eq!(objected(&[("seed", seed), ("sampler", "independent")]), None);
        }
        // Seeds are counted modulo 2³².
        let last = Planned { first_seed: u32::MAX, seeds: 2, ..PLANNED };
        let objected = |seed: &str| objection(&facts(&[]), &facts(&[("seed", seed)]), last).is_some();
        assert_eq!(["4294967295", "0", "1"].map(objected), [true, true, false]);
    }

    #[test]
    fn facts_that_are_missing_are_listed() {
        assert!(unstated(&facts(&[])).is_empty());
        assert_eq!(unstated(&facts(&[("seed", ""), ("scene", "unknown")])), ["scene", "seed"]);
        assert_eq!(unstated(&Identity::default()).len(), 8);
    }

    #[test]
    fn samples_are_counted_and_compared_with_the_measured_ones() {
        let parse = |text: &str| Samples::parse(text).map(|samples| (samples.least, samples.is_least));
        assert_eq!(parse("0..64"), Some((64, false)));
        assert_eq!(parse("0..8, 16..32, and some of 32..64"), Some((24, true)));
        assert_eq!(parse("some of 0..8"), Some((0, true)));
        assert_eq!((parse("none"), parse("")), (None, None));
        assert_eq!(too_few(128, 4), None);
        // √(1 + 4/127) = 1.0156, √2 = 1.4142, √5 = 2.236.
        for (samples, words) in [(127, "about 1.6%"), (4, "about 41.4%"), (0, "about 123.6%")] {
            let said = too_few(samples, 4).unwrap();
            assert!(said.contains(words) && said.ends_with("give it 128 or more"), "{said}");
        }
    }

    #[test]
    fn references_are_described() {
        let said = describe("r.exr", Samples::parse("0..8, and some of 8..16"), &facts(&[]));
        assert_eq!(said, "r.exr, at least 8 samples per pixel, sobol, seed 1000");
        let said = describe("r.exr", None, &Identity::default());
        assert_eq!(said, "r.exr, unknown samples per pixel, unknown sampler, seed unknown");
    }
}
