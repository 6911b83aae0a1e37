//! Lights. Integrators use them through [`LightTable`] alone: it chooses a light, samples a direction towards it, gives
//! densities, and the radiance along rays that leave the scene.
//!
//! | file | what is in it |
//! |---|---|
//! | `contract` | the interface of lights: [`Light`], and [`LightParameters`] for their parameters |
//! | `list` | the parameters of lights that are not surfaces, for scenes |
//! | `kinds` | the list of kinds, and the dispatch of lanes to them |
//! | `table`, `columns` | all lights of a scene, and their rows |
//! | `tree`, `bounds` | the choice among lights, by estimates of their contribution |
//! | `lamps` | the lights as `whitted` samples them: a mesh of many triangles is one |
//! | `sample` | the results of sampling |
//! | `area`, `flat`, `rectangle` | code that kinds share |
//! | `point`, `spot`, `directional`, `sphere`, `quad`, `triangle`, `disk`, `cylinder`, `textured_quad`, `distant_picture` | the kinds |
//! | `power` | intensities that are given as power |
//! | `environment` | the constant environment |
//!
//! No integrator names a kind, nor does the GPU.

mod area;
mod bounds;
mod columns;
mod contract;
mod cylinder;
mod directional;
mod disk;
mod distant_picture;
mod environment;
mod flat;
mod kinds;
mod lamps;
pub(crate) mod list;
#[cfg(test)]
pub(crate) mod made_up;
mod point;
mod power;
mod quad;
mod rectangle;
mod sample;
mod sphere;
mod spot;
mod table;
mod textured_quad;
mod tree;
mod triangle;

pub use area::AreaLight;
pub use bounds::LightBounds;
pub use columns::{LaneLights, LightRow};
pub use contract::{Light, LightList, LightParameters, Listed};
pub use directional::{Distant, DistantDisk};
pub use distant_picture::{DistantPicture, Surroundings};
pub use environment::Environment;
pub use kinds::LightKind;
pub use lamps::{LEAST_TRIANGLES, Lamp, MeshLamp};
pub use list::*;
pub use point::PointLight;
pub use quad::LEAST_SOLID_ANGLE;
pub use sample::{EmittedRay, Escaped, LightSample, SHADOW_LENGTH};
pub use spot::{Falloff, Ramp, SpotLight};
pub use table::{Groups, LightTable, NO_LIGHT};
pub use textured_quad::{TexturedQuad, textured_radiance};
pub use tree::{
    COUNT_FROM, FACING, GREATEST, LEAF, LEAST_SHARE, LightChoice, LightNode, LightTree, NARROW, NEARNESS,
};
pub use triangle::Triangle;
