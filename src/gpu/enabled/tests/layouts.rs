//! The WGSL as parsed by naga, compared with the host's layouts. No GPU is used.

use super::super::heap::Paging;
use super::super::layout::{declarations, structures};
use super::super::program;
use super::super::tables::Tables;
use super::super::variant::ProgramPlan;
use super::{Prepared, scenes};
use crate::scene::{Integrator, Sampler};
use wgpu::naga;

/// The library of a program, and the code for rendering, for a scene with everything.
fn text(integrator: Integrator, sampler: Sampler, workgroup_size: u32) -> String {
    let scene = scenes::with(scenes::everything(16, 12), integrator, sampler);
    let prepared = Prepared::new(&scene, 0);
    let tables = Tables::new(&prepared.job()).unwrap();
    program::text(&prepared.render, workgroup_size, &ProgramPlan::of_tables(&tables, Paging::ONE))
}

fn parse(source: &str) -> naga::Module {
    naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)))
}

/// Mismatches of WGSL structures with the host's.
fn differences(source: &str) -> Vec<String> {
    let module = parse(source);
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).unwrap();
    let mut differences = Vec::new();
    for structure in structures() {
        let (name, size) = (structure.name, structure.size);
        let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
        let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, span }, .. })) = found else {
            differences.push(format!("{name} is not in the WGSL"));
            continue;
        };
        if *span as usize != size {
            differences.push(format!("{name} takes {span} bytes, not {size}"));
        }
        let named: Vec<_> = structure.named().collect();
        if members.len() != named.len() {
            differences.push(format!("{name} has {} fields, not {}", members.len(), named.len()));
        }
        for (member, field) in members.iter().zip(named) {
            let theirs = (
                member.name.as_deref().unwrap_or(""),
                member.offset as usize,
                layouter[member.ty].size as usize,
            );
            let ours = (field.name, field.offset, field.size);
            if theirs != ours {
                differences.push(format!("{name}: {theirs:?}, not {ours:?}"));
            }
        }
    }
    differences
}

#[test]
fn structures_have_the_layout_of_the_host() {
    assert_eq!(differences(&text(Integrator::Path, Sampler::Sobol, 64)), Vec::<String>::new());
}

#[test]
fn moved_renamed_and_missing_fields_are_detected() {
    let source = declarations();
    assert_eq!(differences(&source), Vec::<String>::new());
    for (right, wrong) in [
        // WGSL would align the vector to the next 16 bytes.
        ("    centre: vec3f,\n    radius: f32,", "    radius: f32,\n    centre: vec3f,"),
        ("    first_reject: u32,", "    last_reject: u32,"),
        ("    far2: f32,\n", ""),
    ] {
        let changed = source.replacen(right, wrong, 1);
        assert!(changed != source, "{right:?} is not there");
        assert!(!differences(&changed).is_empty(), "{wrong:?} went unnoticed");
    }
}

#[test]
fn the_program_is_valid_for_every_workgroup_size_integrator_and_sampler() {
    let integrators = [Integrator::Path, Integrator::PathNaive, Integrator::Whitted];
    let usual = integrators.into_iter().flat_map(|integrator| {
        [Sampler::Independent, Sampler::Sobol].map(|sampler| (integrator, sampler, 64))
    });
    let others = [1, 256].map(|size| (Integrator::Path, Sampler::Sobol, size));
    for (integrator, sampler, workgroup_size) in usual.chain(others) {
        let source = text(integrator, sampler, workgroup_size);
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::empty(),
        );
        validator.validate(&parse(&source)).unwrap();
    }
}
