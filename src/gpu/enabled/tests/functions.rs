//! Every recorded function, compared with the same code on one lane.
//!
//! Paths are traced with numbers that store the arguments and results of all functions, and the device computes the
//! same calls. A new function is thus compared as soon as a path calls it; a function that no path calls is an error.

mod calls;
mod compare;

use super::super::record::{Program, Signature};
use super::super::recorded::{self, Source};
use super::super::tables::Tables;
use super::gallery::{gallery, glow, groups, interiors, modified, sunny};
use super::length::{is_too_long, lengths};
use super::pictures::shipped;
use super::probe::library_for;
use super::watched::Calls;
use super::{Device, Prepared, device, scenes};
use crate::integrator::Settings;
use crate::scene::{FilmMode, Filter, Integrator, Sampler, Scene};
use compare::{Change, Compared, Rows};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// The scene in the repository that has rough surfaces, spotlights and suns.
fn surfaces() -> Scene {
    let mut shipped = shipped().into_iter();
    let (_, scene) = shipped.find(|(name, _)| name == "surfaces").expect("it comes with the program");
    scene
}

/// Runs that together call everything: one scene has every kind of shape, and of the older lights and materials.
fn runs() -> Vec<Scene> {
    let run = |integrator, sampler, filter| {
        let mut scene = scenes::with(scenes::everything(48, 32), integrator, sampler);
        (scene.film.filter, scene.film.mode) = (filter, Some(FilmMode::Importance));
        scene.render.max_depth = 12;
        scene
    };
    vec![
        run(Integrator::Path, Sampler::Sobol, Filter::Gaussian { radius: 1.5, sigma: 0.5 }),
        run(Integrator::PathNaive, Sampler::Independent, Filter::Tent { radius: 1.0 }),
        run(Integrator::Whitted, Sampler::Sobol, Filter::Box { radius: 0.5 }),
        scenes::with(scenes::cover(48, 32), Integrator::Path, Sampler::Independent),
        scenes::with(scenes::lamps(48, 32), Integrator::Path, Sampler::Sobol),
        scenes::with(surfaces(), Integrator::Path, Sampler::Sobol),
        scenes::with(surfaces(), Integrator::PathNaive, Sampler::Independent),
        scenes::with(surfaces(), Integrator::Whitted, Sampler::Independent),
        scenes::with(gallery(48, 32), Integrator::Path, Sampler::Sobol),
        scenes::with(sunny(48, 32), Integrator::Path, Sampler::Sobol),
        scenes::with(sunny(48, 32), Integrator::Whitted, Sampler::Independent),
        scenes::with(interiors(24, 16), Integrator::Path, Sampler::Sobol),
        scenes::with(interiors(24, 16), Integrator::Whitted, Sampler::Sobol),
        scenes::with(groups(24, 16), Integrator::Path, Sampler::Sobol),
        scenes::with(modified(48, 32), Integrator::Path, Sampler::Sobol),
        scenes::with(modified(48, 32), Integrator::Whitted, Sampler::Independent),
        scenes::with(glow(24, 16), Integrator::Path, Sampler::Sobol),
    ]
}

/// A program, calls of its functions, and the data that the device needs to repeat them.
struct Run {
    prepared: Prepared,
    integrator: Integrator,
    tables: Tables,
    library: String,
    program: Program,
    /// The lengths of functions by their names in WGSL.
    lengths: BTreeMap<String, usize>,
    /// Calls of functions by their names in WGSL.
    calls: BTreeMap<String, Calls>,
}

/// The letters and digits of a name, which are the same in Rust and in WGSL.
fn letters(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

impl Run {
    fn new(device: &Device, scene: &Scene) -> Run {
        let prepared = Prepared::new(scene, 0);
        let integrator = scene.render.integrator;
        let tables = Tables::new(&prepared.job()).unwrap();
        let library = library_for(device, &tables, integrator);
        let settings = Settings::new(&prepared.render, prepared.offset);
        let source =
            Source { scene: &prepared.scene, world: &prepared.world, settings: &settings, integrator };
        let program = recorded::record(&source, false).unwrap();
        let mut seen: BTreeMap<_, _> = calls::of(&source, &prepared.whole)
            .into_iter()
            .map(|(name, calls)| (letters(name), calls))
            .collect();
        let named = program.functions().iter();
        let calls = named.filter_map(|function| {
            let calls = seen.remove(&letters(&function.name))?;
            Some((function.name.clone(), calls))
        });
        let calls = calls.collect();
        let lengths = lengths(&library);
        Run { prepared, integrator, tables, library, program, lengths, calls }
    }

    fn compare(&self, device: &Device, function: &Signature, change: Change) -> Option<Compared> {
        let calls = self.calls.get(&function.name)?;
        let rows = Rows::of(&self.tables);
        compare::compare(device, &self.library, &self.tables, &rows, function, &calls.kept, change)
    }

    /// The text of a function and of all functions that it calls.
    fn whole_text(&self, function: &Signature) -> String {
        let is_called = |other: &&Signature| {
            other.name != function.name && function.text.contains(&format!("{}(", other.name))
        };
        let called = self.program.functions().iter().filter(is_called).map(|other| self.whole_text(other));
        function.text.clone() + &called.collect::<String>()
    }
}

#[test]
fn every_recorded_function_agrees_with_a_lane() {
    let Some(device) = device() else { return };
    let (mut done, mut met) = (HashSet::new(), BTreeSet::new());
    let (mut all, mut compared_once, mut refused) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for scene in runs() {
        let run = Run::new(&device, &scene);
        let sampler = run.prepared.render.sampler;
        for function in run.program.functions() {
            all.insert(function.name.clone());
            let Some(calls) = run.calls.get(&function.name) else { continue };
            met.insert(function.name.clone());
            // Functions with enough compared calls are not compared again in the same scene.
            if calls.kept.len() >= 500 && !done.insert((scene.entities.len(), run.whole_text(function))) {
                continue;
            }
            // Long functions consist of others that are compared, and pictures compare the whole.
            let length = run.lengths[&function.name];
            if is_too_long(&device, length) {
                continue;
            }
            let Some(compared) = run.compare(&device, function, Change::None) else { continue };
            compared_once.insert(function.name.clone());
            println!("{:?}, {sampler:?}, {} of length {length}: {compared}", run.integrator, function.name);
            if !compared.agrees(&function.name) {
                refused.push(format!("{:?}, {}: {compared}", run.integrator, function.name));
            }
        }
    }
    assert_eq!(refused, Vec::<String>::new());
    // The broken material returns NaN; tests of rejected samples cover it.
    let never: Vec<_> = all.difference(&met).filter(|name| !name.starts_with("broken_")).collect();
    assert!(never.is_empty(), "no scene calls {never:?}");
    let never: Vec<_> = met.difference(&compared_once).collect();
    assert!(never.is_empty(), "{never:?} are too long in every scene");
}

#[test]
fn one_changed_operator_and_swapped_arguments_are_noticed() {
    let Some(device) = device() else { return };
    let run = Run::new(&device, &runs()[0]);
    for (what, change, least) in [("operators", Change::Operator, 25), ("arguments", Change::Arguments, 5)] {
        let (mut changed, mut unnoticed) = (0, Vec::new());
        for function in run.program.functions() {
            let Some(compared) = run.compare(&device, function, change) else { continue };
            changed += 1;
            if compared.agrees(&function.name) {
                unnoticed.push(format!("{}: {compared}", function.name));
            }
        }
        println!("{what}: {changed} changed, unnoticed {unnoticed:?}");
        assert!(changed >= least, "only {changed} functions have {what} to change");
        // An operator may be in code that few calls reach.
        assert!(unnoticed.len() * 8 <= changed, "{what} of {unnoticed:?}");
    }
}
