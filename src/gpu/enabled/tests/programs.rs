//! Recorded programs, without a device.

use super::super::heap::Paging;
use super::super::program;
use super::super::recorded::{self, Source};
use super::super::tables::Tables;
use super::super::variant::ProgramPlan;
use super::gallery::{gallery, glow, groups, interiors, modified, sunny};
use super::pictures::shipped;
use super::{Prepared, scenes};
use crate::integrator::Settings;
use crate::scene::{Filter, Integrator, Sampler, Scene};
use wgpu::naga;

const INTEGRATORS: [Integrator; 3] = [Integrator::Path, Integrator::PathNaive, Integrator::Whitted];

/// The recorded functions of a scene's program, with all calls compared.
fn recorded(scene: &Scene) -> String {
    let prepared = Prepared::new(scene, 0);
    let settings = Settings::new(&prepared.render, prepared.offset);
    let integrator = scene.render.integrator;
    let source = Source { scene: &prepared.scene, world: &prepared.world, settings: &settings, integrator };
    recorded::record(&source, true).unwrap().text()
}

fn validate(scene: &Scene) {
    let prepared = Prepared::new(scene, 0);
    let tables = Tables::new(&prepared.job()).unwrap();
    let source = program::text(&prepared.render, 64, &ProgramPlan::of_tables(&tables, Paging::ONE));
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
    let (flags, capabilities) = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    if let Err(error) = naga::valid::Validator::new(flags, capabilities).validate(&module) {
        panic!("{}", error.emit_to_string(&source));
    }
}

#[test]
fn every_scene_has_a_valid_program_with_unique_functions() {
    let others = [
        scenes::cover(16, 12),
        scenes::bazaar(16, 12),
        scenes::lamps(16, 12),
        scenes::shop(16, 12),
        scenes::copies(16, 12),
        scenes::lamps_of_triangles(16, 12),
        scenes::beacon([1.0; 3]),
        scenes::everything(16, 12),
        gallery(16, 12),
        sunny(16, 12),
        interiors(16, 12),
        groups(16, 12),
        modified(16, 12),
        glow(16, 12),
    ];
    for scene in shipped().into_iter().map(|(_, scene)| scene).chain(others) {
        for integrator in INTEGRATORS {
            for sampler in [Sampler::Independent, Sampler::Sobol] {
                let scene = scenes::with(scene.clone(), integrator, sampler);
                assert!(recorded(&scene).contains("fn start_path("));
                validate(&scene);
            }
        }
    }
}

#[test]
fn a_program_depends_on_the_structure_of_a_scene_and_not_on_its_numbers() {
    for integrator in INTEGRATORS {
        let scene = scenes::with(scenes::everything(32, 24), integrator, Sampler::Sobol);
        let text = recorded(&scene);
        assert_eq!(recorded(&scene), text, "from one recording to the next");
        let mut other = scenes::with(scenes::everything(16, 12), integrator, Sampler::Sobol);
        other.camera.eye.x -= 0.5;
        other.camera.aperture_radius *= 0.5;
        other.environment = [0.5, 0.1, 0.3];
        other.render.max_depth += 1;
        for entity in &mut other.entities {
            entity.emission = entity.emission.map(|c| c * 0.5);
        }
        other.lights.push(other.lights[0].clone());
        assert_eq!(recorded(&other), text, "{integrator:?}");

        // Negative controls: another structure.
        let mut pinhole = scene.clone();
        pinhole.camera.aperture_radius = 0.0;
        let mut filtered = scene.clone();
        filtered.film.filter = Filter::None;
        let independent = scenes::with(scene.clone(), integrator, Sampler::Independent);
        let fewer = scenes::with(scenes::bazaar(32, 24), integrator, Sampler::Sobol);
        for other in [pinhole, filtered, independent, fewer] {
            assert_ne!(recorded(&other), text, "{integrator:?}");
        }
    }
}
