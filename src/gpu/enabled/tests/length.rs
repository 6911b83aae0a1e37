//! The length of programs.
//!
//! Mesa's software device compiles a program in a time that grows at least with the square of its length: a few seconds
//! at [`LIMIT`], minutes at three times as much.

use super::Device;
use crate::gpu::AdapterKind;
use std::collections::BTreeMap;
use std::env;
use std::io::{self, Write};
use wgpu::naga::{Block, Function, Module, Statement, front::wgsl};

/// Longer programs are compared only with [`LONG_PROGRAMS`], as in the nightly set.
const LIMIT: usize = 33_000;

/// The environment variable that includes long programs in comparisons.
const LONG_PROGRAMS: &str = "STRIDE_LONG_PROGRAMS";

/// Whether a program is left to the nightly set.
pub(super) fn is_too_long(device: &Device, length: usize) -> bool {
    let is_software = device.description().kind == AdapterKind::Software;
    is_software && length > LIMIT && env::var_os(LONG_PROGRAMS).is_none()
}

/// States that no program of these scenes was compared, past the capture of the output of tests that pass.
pub(super) fn report_left_out(scenes: &str) {
    let _ = writeln!(io::stderr(), "{scenes}: long programs for the GPU are left to `.ci/nightly gpu`");
}

/// The length of each function and entry point: the number of its expressions and of those of all functions that it
/// calls, once for every call, as drivers inline them.
pub(super) fn lengths(source: &str) -> BTreeMap<String, usize> {
    let module = wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    let mut lengths = Vec::new();
    // Functions come after those that they call.
    for (_, function) in module.functions.iter() {
        lengths.push(length(function, &lengths));
    }
    let names = module.functions.iter().map(|(_, function)| function.name.clone().unwrap_or_default());
    let mut named: BTreeMap<_, _> = names.zip(lengths.iter().copied()).collect();
    named.extend(entry_points(&module).map(|(name, function)| (name.to_owned(), length(function, &lengths))));
    named
}

fn entry_points(module: &Module) -> impl Iterator<Item = (&str, &Function)> {
    module.entry_points.iter().map(|entry| (entry.name.as_str(), &entry.function))
}

fn length(function: &Function, lengths: &[usize]) -> usize {
    function.expressions.len() + called(&function.body, lengths)
}

/// The length of all that the statements of a block call.
fn called(block: &Block, lengths: &[usize]) -> usize {
    let of = |statement: &Statement| match statement {
        Statement::Call { function, .. } => lengths[function.index()],
        Statement::Block(block) => called(block, lengths),
        Statement::If { accept, reject, .. } => called(accept, lengths) + called(reject, lengths),
        Statement::Switch { cases, .. } => cases.iter().map(|case| called(&case.body, lengths)).sum(),
        Statement::Loop { body, continuing, .. } => called(body, lengths) + called(continuing, lengths),
        _ => 0,
    };
    block.iter().map(of).sum()
}

#[test]
fn calls_count_as_often_as_they_are_written() {
    let program = |calls: &str| {
        format!("fn leaf(x: f32) -> f32 {{ return x * 2.0; }} fn root(x: f32) -> f32 {{ return {calls}; }}")
    };
    let [one, three] = ["leaf(x)", "leaf(x) + leaf(leaf(x))"].map(|calls| lengths(&program(calls)));
    assert_eq!(one["leaf"], three["leaf"]);
    assert!(three["root"] >= one["root"] + 2 * one["leaf"], "{one:?}, {three:?}");
}
