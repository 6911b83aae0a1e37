//! The WGSL as naga reads it, against the host's layouts. No GPU is asked.

use super::super::heap::Paging;
use super::super::layout::structures;
use super::super::program::{self, MAIN};
use super::super::variant::{Plan, Variant};
use crate::scene::{Integrator, Sampler};
use wgpu::naga;

/// The declarations that the host's layouts are held to.
const LAYOUTS: &str = include_str!("../../layout.wgsl");

fn variant(workgroup_size: u32) -> Variant {
    let plan = Plan {
        paging: Paging::ONE,
        levels: 20,
        triangles: true,
        instances: true,
        smooth: true,
        taps: 6,
        rare: true,
    };
    Variant { integrator: Integrator::Path, sampler: Sampler::Sobol, workgroup_size, plan }
}

fn library() -> String {
    program::library(variant(64))
}

fn parse(source: &str) -> naga::Module {
    naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)))
}

/// What is wrong with WGSL's structures in the host's eyes.
fn differences(source: &str) -> Vec<String> {
    let module = parse(source);
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).unwrap();
    let mut differences = Vec::new();
    for (name, size, fields) in structures() {
        let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
        let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, span }, .. })) = found else {
            differences.push(format!("{name} is not in the WGSL"));
            continue;
        };
        if *span as usize != size {
            differences.push(format!("{name} takes {span} bytes, not {size}"));
        }
        let named: Vec<_> = fields.iter().filter(|field| !field.name.starts_with('_')).collect();
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
fn structures_lie_in_memory_as_the_host_lays_them() {
    assert_eq!(differences(&library()), Vec::<String>::new());
}

#[test]
fn a_moved_a_renamed_and_a_missing_field_are_noticed() {
    // Only the layouts matter here: whatever uses a field may go wrong.
    let source = LAYOUTS.split("@group(0)").next().unwrap();
    assert_eq!(differences(source), Vec::<String>::new());
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
    let usual = variant(64);
    let integrators = [Integrator::Path, Integrator::PathNaive, Integrator::Whitted];
    let variants = integrators.into_iter().flat_map(|integrator| {
        [Sampler::Independent, Sampler::Sobol].map(|sampler| Variant { integrator, sampler, ..usual })
    });
    for variant in variants.chain([1, 256].map(variant)) {
        let source = program::library(variant) + MAIN;
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::empty(),
        );
        validator.validate(&parse(&source)).unwrap();
    }
}
