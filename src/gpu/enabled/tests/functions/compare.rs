//! Comparison of the results of calls on a device with those on a lane.

use super::super::super::record::Signature;
use super::super::super::tables::{ROUND_ERROR, SurfaceColumns, Tables, surface_rows};
use super::super::Device;
use super::super::probe;
use super::super::watched::Call;
use crate::world::{FIRST_TRIANGLE, SurfaceTable};
use std::collections::HashMap;
use std::fmt;
use wgpu::naga::{self, ScalarKind, TypeInner};

/// The tolerance for a float, relative to the largest component of its vector. Roots and quotients on a device are off
/// by a few ulp, and differences of such values by more.
const BOUND: f32 = 1e-4;

/// The fraction of calls, in thousandths, that may exceed the tolerance: a rounding error may reverse a comparison, or
/// cancellation may amplify it.
const MOST_OFF: usize = 10;

/// Functions with a larger fraction, in thousandths, and the reason.
const EXCEPTIONS: [(&str, usize); 0] = [];

/// A deliberate mistake in a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    None,
    /// The first operator of the function is replaced.
    Operator,
    /// Two arguments of the same type are swapped.
    Arguments,
}

/// Statistics of a comparison.
#[derive(Debug, Default)]
pub(super) struct Compared {
    calls: usize,
    /// Calls whose results are equal to the bit.
    same: usize,
    /// Calls with a float outside of [`BOUND`], or a different integer or boolean.
    off: usize,
    /// The largest error of a float in the other calls.
    worst: f32,
    /// The first call outside of the tolerance.
    first: Option<String>,
}

impl Compared {
    pub(super) fn agrees(&self, function: &str) -> bool {
        let exception = EXCEPTIONS.iter().find(|(name, _)| *name == function);
        self.off * 1000 <= self.calls * exception.map_or(MOST_OFF, |(_, most)| *most)
    }
}

impl fmt::Display for Compared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Compared { calls, same, off, worst, first } = self;
        write!(f, "{calls} calls, {same} the same to the bit, {off} off, others by {worst:.1e} at most")?;
        first.as_ref().map_or(Ok(()), |first| write!(f, "; {first}"))
    }
}

/// The device's indices of the host's surfaces and triangles.
pub(super) struct Rows {
    rows: HashMap<u32, u32>,
}

impl Rows {
    pub(super) fn of(tables: &Tables) -> Rows {
        let (table, own) = (SurfaceTable::default(), SurfaceColumns::default());
        let (number, words) = surface_rows(&table, &own).place("row").expect("rows have numbers");
        let surfaces = (0..).zip(tables.surfaces.chunks_exact(words));
        let surfaces = surfaces.map(|(place, row)| (row[number.word][number.first], place));
        let triangles = (0..).zip(&tables.tree.triangles);
        let triangles = triangles.map(|(place, triangle)| (triangle.number, place | FIRST_TRIANGLE));
        // Shared meshes are stored among the triangles, with their own numbers.
        let triangles = triangles.filter(|(number, _)| *number >= FIRST_TRIANGLE);
        Rows { rows: surfaces.chain(triangles).collect() }
    }

    fn on_device(&self, number: u32) -> u32 {
        self.rows.get(&number).copied().unwrap_or(number)
    }
}

/// A number of a value in WGSL.
struct Leaf {
    /// The WGSL expression that reads it from the entire value.
    path: String,
    kind: ScalarKind,
    /// Numbers of one vector have the same index.
    group: usize,
    /// Whether it is the number of a surface or triangle.
    is_row: bool,
    /// Whether it is an error bound: the device's is up to [`ROUND_ERROR`] times larger on round surfaces.
    is_error: bool,
}

fn scalar_name(kind: ScalarKind) -> &'static str {
    match kind {
        ScalarKind::Float => "f",
        ScalarKind::Uint => "u",
        _ => unreachable!("vectors are of floats or integers"),
    }
}

/// The numbers of a type.
fn leaves(module: &naga::Module, ty: naga::Handle<naga::Type>, path: &str, out: &mut Vec<Leaf>) {
    let group = out.last().map_or(0, |leaf| leaf.group + 1);
    let ty = &module.types[ty];
    match &ty.inner {
        TypeInner::Scalar(scalar) => {
            let is_row = path.ends_with(".surface") || path.ends_with(".row");
            let is_error = path.ends_with(".error");
            out.push(Leaf { path: path.to_owned(), kind: scalar.kind, group, is_row, is_error });
        }
        TypeInner::Vector { size, scalar } => {
            let names = ["x", "y", "z", "w"].iter().take(*size as usize);
            out.extend(names.map(|name| Leaf {
                path: format!("{path}.{name}"),
                kind: scalar.kind,
                group,
                is_row: false,
                is_error: false,
            }));
        }
        TypeInner::Struct { members, .. } => {
            for member in members {
                leaves(module, member.ty, &format!("{path}.{}", member.name.as_deref().unwrap()), out);
            }
        }
        other => unreachable!("no value of a program is a {other:?}"),
    }
}

/// An expression for a value of a type whose numbers start at word `next` of the input.
fn expression(module: &naga::Module, ty: naga::Handle<naga::Type>, next: &mut usize) -> String {
    let mut number = |kind: ScalarKind| {
        *next += 1;
        let i = *next - 1;
        match kind {
            ScalarKind::Float => format!("float({i}u)"),
            ScalarKind::Bool => format!("(word({i}u) != 0u)"),
            _ => format!("word({i}u)"),
        }
    };
    let ty = &module.types[ty];
    match &ty.inner {
        TypeInner::Scalar(scalar) => number(scalar.kind),
        TypeInner::Vector { size, scalar } => {
            let numbers: Vec<_> = (0..*size as usize).map(|_| number(scalar.kind)).collect();
            format!("vec{}{}({})", *size as usize, scalar_name(scalar.kind), numbers.join(", "))
        }
        TypeInner::Struct { members, .. } => {
            let members: Vec<_> = members.iter().map(|member| expression(module, member.ty, next)).collect();
            format!("{}({})", ty.name.as_deref().unwrap(), members.join(", "))
        }
        other => unreachable!("no value of a program is a {other:?}"),
    }
}

/// The function with its first operator replaced, if it has one.
fn with_another_operator(text: &str) -> Option<String> {
    let (head, body) = text.split_once("{\n")?;
    let pairs = [(" * ", " + "), (" + ", " - "), (" - ", " + "), (" ^ ", " | "), (" < ", " >= ")];
    let (right, wrong) = pairs.into_iter().find(|(right, _)| body.contains(right))?;
    Some(format!("{head}{{\n{}", body.replacen(right, wrong, 1)))
}

/// Repeats calls of a function on a device. `None` if there is nothing to change.
pub(super) fn compare(
    device: &Device,
    library: &str,
    tables: &Tables,
    rows: &Rows,
    function: &Signature,
    calls: &[Call],
    change: Change,
) -> Option<Compared> {
    let module = naga::front::wgsl::parse_str(library)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(library)));
    let named = module.functions.iter().find(|(_, found)| found.name.as_ref() == Some(&function.name));
    let (_, wgsl) = named.unwrap_or_else(|| panic!("{} is not in the program", function.name));
    let mut into = Vec::new();
    for (i, argument) in wgsl.arguments.iter().enumerate() {
        leaves(&module, argument.ty, &format!("argument_{i}"), &mut into);
    }
    let mut out = Vec::new();
    let result = wgsl.result.as_ref().expect("functions of programs have results");
    leaves(&module, result.ty, "result", &mut out);
    let name = &function.name;
    assert!(
        calls.iter().all(|call| call.arguments.len() == into.len() && call.result.len() == out.len()),
        "{name} has other parameters or another result in WGSL"
    );

    let mut next = 0;
    let mut arguments: Vec<_> =
        wgsl.arguments.iter().map(|argument| expression(&module, argument.ty, &mut next)).collect();
    let mut library = library.to_owned();
    match change {
        Change::None => {}
        Change::Operator => {
            library = library.replacen(&function.text, &with_another_operator(&function.text)?, 1);
        }
        Change::Arguments => {
            let count = arguments.len();
            let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
            let ty = |i: usize| wgsl.arguments[i].ty;
            let (i, j) = pairs.into_iter().find(|&(i, j)| ty(i) == ty(j))?;
            arguments.swap(i, j);
        }
    }
    let puts = out.iter().enumerate().map(|(i, leaf)| match leaf.kind {
        ScalarKind::Float => format!("put_float({i}u, {});", leaf.path),
        _ => format!("put({i}u, u32({}));", leaf.path),
    });
    let lines = format!("let result = {name}({}); {}", arguments.join(", "), puts.collect::<String>());
    let place = |(word, leaf): (&u32, &Leaf)| if leaf.is_row { rows.on_device(*word) } else { *word };
    // A function without parameters still reads one word.
    let words_in = into.len().max(1);
    let inputs = calls.iter().flat_map(|call| {
        let mut words: Vec<_> = call.arguments.iter().zip(&into).map(place).collect();
        words.resize(words_in, 0);
        words
    });
    let inputs: Vec<_> = inputs.collect();
    let results = probe::run(device, &library, &lines, [words_in, out.len()], &inputs, tables);
    let mut compared = Compared { calls: calls.len(), ..Compared::default() };
    for (call, got) in calls.iter().zip(results.chunks_exact(out.len())) {
        let expected: Vec<_> = call.result.iter().zip(&out).map(place).collect();
        match distance(&expected, got, &out) {
            _ if expected == got => compared.same += 1,
            Some(distance) if distance <= BOUND => compared.worst = compared.worst.max(distance),
            _ => {
                compared.off += 1;
                compared.first.get_or_insert_with(|| {
                    let differing = |words: &[u32], leaves: &[Leaf]| -> Vec<String> {
                        let differing = |(word, leaf): (&u32, &Leaf)| match leaf.kind {
                            ScalarKind::Float => format!("{:?}", f32::from_bits(*word)),
                            _ => word.to_string(),
                        };
                        words.iter().zip(leaves).map(differing).collect()
                    };
                    let [ours, theirs] = [&expected[..], got].map(|words| differing(words, &out).join(" "));
                    format!("{} gives {theirs}, not {ours}", differing(&call.arguments, &into).join(" "))
                });
            }
        }
    }
    Some(compared)
}

/// The largest error of a float, relative to the largest component of its vector; `None` if another number differs.
///
/// A NaN on one side only counts as different.
fn distance(expected: &[u32], got: &[u32], leaves: &[Leaf]) -> Option<f32> {
    let mut most = 0.0_f32;
    for (i, leaf) in leaves.iter().enumerate() {
        if leaf.kind != ScalarKind::Float {
            if expected[i] != got[i] {
                return None;
            }
            continue;
        }
        let [ours, theirs] = [expected[i], got[i]].map(f32::from_bits);
        // A device has no infinity.
        if (ours.is_nan() && theirs.is_nan()) || (ours == f32::INFINITY && theirs >= f32::MAX) {
            continue;
        }
        let group = leaves.iter().zip(expected).filter(|(other, _)| other.group == leaf.group);
        let size = group.map(|(_, word)| f32::from_bits(*word).abs()).fold(f32::MIN_POSITIVE, f32::max);
        let most_error = if leaf.is_error { ours * ROUND_ERROR } else { ours };
        let nearest = if theirs > ours { theirs.min(most_error) } else { ours };
        let share = (nearest - theirs).abs() / size;
        if share.is_nan() {
            return None;
        }
        most = most.max(share);
    }
    Some(most)
}
