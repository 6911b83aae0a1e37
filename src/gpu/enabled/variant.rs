//! Variants of the program, and the constants and tables that its WGSL takes from the host.

use super::device::Device;
use super::heap::{self, Paging};
use super::layout::{self, CHANCE_BITS, MOST_BRANCHES, NOTHING, REJECT_SHIFT, REJECTS, TAPS_IN_A_WORD};
use super::tables::{self, Tables};
use super::tree;
use crate::film::MAX_RADIANCE;
use crate::film::Reject;
use crate::film::fixed::{FRACTION_BITS, TAP_BITS, WEIGHT_BITS};
use crate::film::sums::MAX_SUMMED;
use crate::film::weights::{CELL_BITS, POSITION_BITS, TABLE_BITS};
use crate::gpu::{AdapterKind, GpuError};
use crate::light;
use crate::light::NO_LIGHT;
use crate::scene::Integrator;
use crate::shape::{BOUNDS_ERROR, CustomKind, NEEDLE};
use crate::texture::{COLOURED, Depth, SRGB};
use crate::world::{FIRST_TRIANGLE, NO_INSTANCE};
use std::fmt::Write;
use std::sync::Arc;

/// The parameters of compilation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ProgramVariant {
    pub(super) integrator: Integrator,
    /// Invocations per workgroup.
    pub(super) workgroup_size: u32,
    /// The properties of the scene.
    pub(super) plan: ProgramPlan,
}

/// The properties of a scene for which a program is compiled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ProgramPlan {
    /// The division of the heap of tables into pages.
    pub(super) paging: Paging,
    /// The number of levels of the tree; zero without one.
    pub(super) levels: u32,
    /// Whether the tree holds triangles.
    pub(super) triangles: bool,
    /// Whether the tree holds instances.
    pub(super) instances: bool,
    /// Whether there are groups.
    pub(super) groups: bool,
    /// The filter's taps along an axis if samples count in all pixels around them; otherwise zero.
    pub(super) taps: u32,
    /// Whether there are custom shapes.
    pub(super) custom: bool,
    /// Whether the numbers of the scene and of a dispatch are uniforms. Otherwise they are in storage buffers: Mesa's
    /// lavapipe recompiles a program for each dispatch if its loops depend on uniforms.
    pub(super) uniforms: bool,
    /// The recorded functions.
    pub(super) recorded: Arc<str>,
}

impl ProgramPlan {
    /// The plan for a scene on a device. Fails if the scene does not fit.
    pub(super) fn of(device: &Device, tables: &Tables) -> Result<ProgramPlan, GpuError> {
        let uniforms = device.description().kind != AdapterKind::Software;
        Ok(ProgramPlan { uniforms, ..ProgramPlan::of_tables(tables, Paging::on(device, tables.words())?) })
    }

    /// The plan for tables in a heap with this paging, with uniforms.
    pub(super) fn of_tables(tables: &Tables, paging: Paging) -> ProgramPlan {
        let tree = &tables.tree;
        ProgramPlan {
            paging,
            levels: tree.levels,
            triangles: !tree.triangles.is_empty(),
            instances: !tree.places.is_empty(),
            groups: tree.has_groups,
            taps: tables.weights.taps,
            custom: tables.scene.custom_end > tables.scene.quads_end,
            uniforms: true,
            recorded: tables.recorded.as_str().into(),
        }
    }
}

/// The constants and tables from the host, as WGSL.
pub(super) fn text(variant: &ProgramVariant) -> String {
    let code = |reject: Reject| REJECTS.iter().find(|(_, r)| *r == reject).map_or(0, |(code, _)| *code);
    let whole = [
        ("WORKGROUP_SIZE", variant.workgroup_size),
        ("NO_LIGHT", NO_LIGHT),
        ("FIRST_TRIANGLE", FIRST_TRIANGLE),
        ("NO_INSTANCE", NO_INSTANCE),
        ("NO_NODE", tree::NO_NODE),
        ("TREE_LEVELS", variant.plan.levels),
        ("TRIANGLES", tree::TRIANGLES),
        ("SPHERES", tree::SPHERES),
        ("QUADS", tree::QUADS),
        ("INSTANCE", tree::INSTANCE),
        ("PLANES", tree::PLANES),
        ("CUSTOM", tree::CUSTOM),
        ("LEAF", light::LEAF),
        ("COUNT_FROM", light::COUNT_FROM),
        ("MOST_BRANCHES", MOST_BRANCHES),
        ("TAPS", variant.plan.taps),
        ("TAP_WORDS", variant.plan.taps.div_ceil(TAPS_IN_A_WORD)),
        ("TAP_BITS", TAP_BITS),
        ("TABLE_BITS", TABLE_BITS),
        ("CELL_BITS", CELL_BITS),
        ("POSITION_BITS", POSITION_BITS),
        ("CHANCE_BITS", CHANCE_BITS),
        ("WEIGHT_BITS", WEIGHT_BITS),
        ("MAX_SUMMED_BITS", MAX_SUMMED.to_bits()),
        ("FRACTION_BITS", FRACTION_BITS),
        ("MAX_RADIANCE_BITS", MAX_RADIANCE.to_bits()),
        ("REJECT_NONE", 0),
        ("REJECT_NOT_A_NUMBER", code(Reject::NotANumber)),
        ("REJECT_TOO_BRIGHT", code(Reject::TooBright)),
        ("REJECT_NEGATIVE", code(Reject::Negative)),
        ("REJECT_SHIFT", REJECT_SHIFT),
        ("PICTURE_BITS8", Depth::Bits8 as u32),
        ("PICTURE_BITS16", Depth::Bits16 as u32),
        ("PICTURE_HALF", Depth::Half as u32),
        ("PICTURE_COLOURED", COLOURED),
        ("PICTURE_SRGB", SRGB),
    ];
    let real = [
        // The value that replaces the radius.
        ("IS_DISK", -(CustomKind::Disk.number() as f32)),
        ("EPSILON", f32::EPSILON),
        ("BELOW_ONE", crate::math::BELOW_ONE),
        ("NEARNESS", light::NEARNESS),
        ("GREATEST", light::GREATEST),
        ("LEAST_SHARE", light::LEAST_SHARE),
        ("FACING", light::FACING),
        ("NARROW", light::NARROW),
        ("NOTHING", NOTHING),
        ("SHARE_WITHIN", if variant.plan.groups { 2.0 * BOUNDS_ERROR } else { BOUNDS_ERROR }),
        ("NEEDLE", NEEDLE),
        ("SMALLEST_NORMAL", f32::MIN_POSITIVE),
    ];
    let mut text = String::new();
    for (name, value) in whole {
        writeln!(text, "const {name}: u32 = {value}u;").expect("a string takes all");
    }
    for (name, value) in real {
        // Debug prints the fewest digits that parse to the same float.
        writeln!(text, "const {name}: f32 = {value:?}f;").expect("a string takes all");
    }
    let &ProgramPlan { triangles, instances, groups, custom, .. } = &variant.plan;
    for (name, is_so) in [
        ("TREE_TRIANGLES", triangles),
        ("TREE_INSTANCES", instances),
        ("TREE_GROUPS", groups),
        ("HAS_CUSTOM", custom),
    ] {
        writeln!(text, "const {name}: bool = {is_so};").expect("a string takes all");
    }
    let space = if variant.plan.uniforms { "uniform" } else { "storage, read" };
    for (group, name, structure) in [(0, "scene", "Scene"), (1, "dispatch", "Dispatch")] {
        writeln!(text, "@group({group}) @binding(0) var<{space}> {name}: {structure};")
            .expect("a string takes all");
    }
    text + &layout::declarations()
        + &tree::trail(variant.plan.levels)
        + &variant.plan.paging.text()
        + &heap::readers()
        + &tables::readers()
}
