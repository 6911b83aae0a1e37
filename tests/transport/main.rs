//! Light transport: shapes, materials, lights and integrators, compared with mathematics and with each other.

#[path = "../common/mod.rs"]
mod common;

mod agreement;
mod environment;
mod furnace;
mod groups;
mod hits;
mod instances;
mod interiors;
mod lanes;
mod lights;
mod meshes;
mod modifiers;
mod roulette;
mod scattering;
mod tangents;
mod tiny;
mod trees;
mod truth;
mod units;
mod whitted;
