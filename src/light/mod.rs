//! Lights: the one door to them is [`LightTable`]. It chooses a light, samples a direction towards it, and tells what
//! rays see that leave the scene; what kinds of lights there are is known in this room only.

mod area;
mod bounds;
mod columns;
mod contract;
mod cylinder;
mod disk;
mod environment;
mod flat;
mod kinds;
mod lamps;
pub(crate) mod list;
#[cfg(test)]
pub(crate) mod made_up;
mod point;
mod quad;
mod rectangle;
mod sample;
mod sphere;
mod table;
mod tree;
mod triangle;

pub use area::AreaLight;
pub use bounds::LightBounds;
pub use columns::{LaneLights, LightRow};
pub use contract::{Light, LightParameters};
pub use environment::Environment;
pub use kinds::{LightKind, Listed};
pub use lamps::{LEAST_TRIANGLES, Lamp, MeshLamp};
pub use list::*;
pub use point::PointLight;
pub use quad::LEAST_SOLID_ANGLE;
pub use sample::{EmittedRay, Escaped, LightSample, SHADOW_LENGTH};
pub use table::{LightTable, NO_LIGHT};
pub use tree::{COUNT_FROM, FACING, GREATEST, LEAF, LEAST_SHARE, LightNode, LightTree, NARROW, NEARNESS};
pub use triangle::Triangle;
