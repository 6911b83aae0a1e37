//! What a program is compiled for: its variant, and the constants and tables that its WGSL takes from the host.

use super::device::Device;
use super::heap::{self, Paging};
use super::layout::{
    CHANCE_BITS, IS_CYLINDER, IS_DISK, MOST_BRANCHES, NOTHING, OFFSET_CENTRE, OFFSET_DRAWN, OFFSET_TENT,
    OFFSET_UNIFORM, REJECT_SHIFT, REJECTS, TAPS_IN_A_WORD,
};
use super::tables::{self, Tables};
use super::tree;
use crate::film::MAX_RADIANCE;
use crate::film::Reject;
use crate::film::fixed::{FRACTION_BITS, TAP_BITS, WEIGHT_BITS};
use crate::film::sums::MAX_SUMMED;
use crate::film::weights::{CELL_BITS, POSITION_BITS, TABLE_BITS};
use crate::gpu::GpuError;
use crate::integrator::{ROULETTE_AT_MOST, ROULETTE_AT_MOST_FROM, ROULETTE_FROM, ROULETTE_KEEPS};
use crate::light::NO_LIGHT;
use crate::light::{self, LightKind};
use crate::material::Kind;
use crate::math::lanes::scalar::Wrapping;
use crate::sampling::{Block, sobol};
use crate::scene::{Integrator, Sampler};
use crate::shape::{BOUNDS_ERROR, NEEDLE, POSITION_ERROR, TRIANGLE_ERROR, UNIT_ROUNDOFF};
use crate::world::{FIRST_TRIANGLE, NO_INSTANCE};
use std::fmt::Write;

/// What is decided when a program is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Variant {
    pub(super) integrator: Integrator,
    pub(super) sampler: Sampler,
    /// Invocations in a workgroup.
    pub(super) workgroup_size: u32,
    /// What the scene asks of it.
    pub(super) plan: Plan,
}

/// What a program must know of its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    /// How the heap of tables is cut.
    pub(super) paging: Paging,
    /// The levels of the tree; zero without one.
    pub(super) levels: u32,
    /// Whether there are triangles in it.
    pub(super) triangles: bool,
    /// Whether there are shared meshes in it.
    pub(super) instances: bool,
    /// Whether light scatters around other normals than the surfaces' own.
    pub(super) smooth: bool,
    /// The filter's taps along an axis, where samples count in all pixels around them; zero elsewhere.
    pub(super) taps: u32,
    /// Whether there are disks or cylinders.
    pub(super) rare: bool,
}

impl Plan {
    /// For a scene on a device. Fails where it does not fit there.
    pub(super) fn of(device: &Device, tables: &Tables) -> Result<Plan, GpuError> {
        let paging = Paging::on(device, tables.words())?;
        let tree = &tables.tree;
        Ok(Plan {
            paging,
            levels: tree.levels,
            triangles: !tree.triangles.is_empty(),
            instances: !tree.places.is_empty(),
            smooth: tree.smooth,
            taps: tables.weights.taps,
            rare: tables.scene.rare_end > tables.scene.quads_end,
        })
    }
}

/// How [`Integrator`] and [`Sampler`] are told to the device.
const INTEGRATORS: [(&str, Integrator); 3] = [
    ("INTEGRATOR_PATH", Integrator::Path),
    ("INTEGRATOR_PATH_NAIVE", Integrator::PathNaive),
    ("INTEGRATOR_WHITTED", Integrator::Whitted),
];

const SAMPLERS: [(&str, Sampler); 2] =
    [("SAMPLER_INDEPENDENT", Sampler::Independent), ("SAMPLER_SOBOL", Sampler::Sobol)];

fn broken_kind() -> u32 {
    #[cfg(feature = "broken-material")]
    return Kind::Broken as u32;
    #[cfg(not(feature = "broken-material"))]
    return u32::MAX;
}

/// The constants and the tables that WGSL takes from here, as WGSL.
pub(super) fn text(variant: Variant) -> String {
    let block = |block: Block| block.at::<f32>(Wrapping(0)).0;
    let code = |reject: Reject| REJECTS.iter().find(|(_, r)| *r == reject).map_or(0, |(code, _)| *code);
    let whole = [
        ("WORKGROUP_SIZE", variant.workgroup_size),
        ("INTEGRATOR", variant.integrator as u32),
        ("SAMPLER", variant.sampler as u32),
        ("SOBOL_SALT", sobol::SALT),
        ("BLOCK_CAMERA", block(Block::CAMERA)),
        ("BLOCK_SCATTER", block(Block::SCATTER)),
        ("BLOCK_LIGHT", block(Block::LIGHT)),
        ("BLOCK_STRIDE", Block::STRIDE),
        ("KIND_MATTE", Kind::Matte as u32),
        ("KIND_MIRROR", Kind::Mirror as u32),
        ("KIND_GLASS", Kind::Glass as u32),
        ("KIND_CHECKERBOARD", Kind::Checkerboard as u32),
        ("KIND_BROKEN", broken_kind()),
        ("NO_LIGHT", NO_LIGHT),
        ("LIGHT_POINT", LightKind::Point as u32),
        ("LIGHT_SPHERE", LightKind::Sphere as u32),
        ("LIGHT_QUAD", LightKind::Quad as u32),
        ("LIGHT_TRIANGLE", LightKind::Triangle as u32),
        ("LIGHT_DISK", LightKind::Disk as u32),
        ("LIGHT_CYLINDER", LightKind::Cylinder as u32),
        ("FIRST_TRIANGLE", FIRST_TRIANGLE),
        ("NO_TRIANGLE", u32::MAX),
        ("NO_INSTANCE", NO_INSTANCE),
        ("NO_NODE", tree::NO_NODE),
        ("TREE_LEVELS", variant.plan.levels),
        ("LEAF_TRIANGLES", tree::TRIANGLES),
        ("LEAF_SPHERES", tree::SPHERES),
        ("LEAF_INSTANCE", tree::INSTANCE),
        ("LEAF", light::LEAF),
        ("COUNT_FROM", light::COUNT_FROM),
        ("ROULETTE_FROM", ROULETTE_FROM),
        ("ROULETTE_AT_MOST_FROM", ROULETTE_AT_MOST_FROM),
        ("MOST_BRANCHES", MOST_BRANCHES),
        ("OFFSET_CENTRE", OFFSET_CENTRE),
        ("OFFSET_UNIFORM", OFFSET_UNIFORM),
        ("OFFSET_TENT", OFFSET_TENT),
        ("OFFSET_DRAWN", OFFSET_DRAWN),
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
    ];
    let real = [
        ("IS_DISK", IS_DISK),
        ("IS_CYLINDER", IS_CYLINDER),
        ("PI", std::f32::consts::PI),
        ("FRAC_1_PI", std::f32::consts::FRAC_1_PI),
        ("EPSILON", f32::EPSILON),
        ("BELOW_ONE", crate::math::BELOW_ONE),
        ("NEARNESS", light::NEARNESS),
        ("GREATEST", light::GREATEST),
        ("LEAST_SHARE", light::LEAST_SHARE),
        ("FACING", light::FACING),
        ("NARROW", light::NARROW),
        ("LEAST_SOLID_ANGLE", light::LEAST_SOLID_ANGLE),
        ("ROULETTE_KEEPS", ROULETTE_KEEPS),
        ("ROULETTE_AT_MOST", ROULETTE_AT_MOST),
        ("NOTHING", NOTHING),
        ("POSITION_ERROR", POSITION_ERROR),
        ("BOUNDS_ERROR", BOUNDS_ERROR),
        ("TRIANGLE_ERROR", TRIANGLE_ERROR),
        ("NEEDLE", NEEDLE),
        ("SHADOW_LENGTH", light::SHADOW_LENGTH),
        ("UNIT_ROUNDOFF", UNIT_ROUNDOFF),
        ("SMALLEST_NORMAL", f32::MIN_POSITIVE),
    ];
    let mut text = String::new();
    let named = INTEGRATORS.map(|(name, integrator)| (name, integrator as u32));
    let named = named.into_iter().chain(SAMPLERS.map(|(name, sampler)| (name, sampler as u32)));
    for (name, value) in whole.into_iter().chain(named) {
        writeln!(text, "const {name}: u32 = {value}u;").expect("a string takes all");
    }
    for (name, value) in real {
        // Debug's digits are the fewest that read back as the same float.
        writeln!(text, "const {name}: f32 = {value:?}f;").expect("a string takes all");
    }
    let Plan { triangles, instances, smooth, rare, .. } = variant.plan;
    for (name, is_so) in [
        ("TREE_TRIANGLES", triangles),
        ("TREE_INSTANCES", instances),
        ("TREE_SMOOTH", smooth),
        ("HAS_RARE", rare),
    ] {
        writeln!(text, "const {name}: bool = {is_so};").expect("a string takes all");
    }
    text + &tree::trail(variant.plan.levels)
        + &variant.plan.paging.text()
        + &heap::readers()
        + &tables::readers()
}
