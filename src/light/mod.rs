//! Lights. Integrators use them only through [`LightTable`]. It chooses lights, samples directions towards them, and
//! gives densities and the radiance along rays that leave the scene.
//!
//! | file | contents |
//! |---|---|
//! | `contract` | the interface of lights: [`Light`], and [`LightParameters`] for their parameters |
//! | `list` | the parameters of lights that are not surfaces, for scenes |
//! | `kinds` | the list of kinds, and the dispatch of lanes to them |
//! | `table`, `columns`, `corner_uv` | all lights of a scene, and their rows |
//! | `tree`, `bounds` | the choice among lights by estimates of their contribution |
//! | `emitters` | the units that `whitted` samples: single lights, and meshes of many triangles |
//! | `sample` | the results of sampling |
//! | `area`, `flat`, `rectangle` | code shared by several kinds |
//! | `point`, `spot`, `directional`, `sphere`, `quad`, `triangle`, `disk`, `cylinder`, `textured_quad`, `textured_round`, `textured_triangle`, `environment_map` | the kinds |
//! | `power` | conversion of power to intensity |
//! | `environment` | the constant environment |
//!
//! Neither integrators nor the GPU depend on particular kinds.

mod area;
mod bounds;
mod columns;
mod contract;
mod corner_uv;
mod cylinder;
mod directional;
mod disk;
mod emitters;
mod environment;
mod environment_map;
mod flat;
mod kinds;
pub(crate) mod list;
mod point;
mod power;
mod quad;
mod rectangle;
mod sample;
mod sphere;
mod spot;
mod table;
#[cfg(test)]
pub(crate) mod test_sky;
mod textured_quad;
mod textured_round;
mod textured_triangle;
mod tree;
mod triangle;

pub use area::AreaLight;
pub use bounds::LightBounds;
pub use columns::{LaneLights, LightRow};
pub use contract::{Light, LightList, LightParameters, ListedLight};
pub use corner_uv::{CornerUv, UvTriangle};
pub use directional::{Distant, DistantDisk};
pub use emitters::{Emitter, LEAST_TRIANGLES, MeshEmitter};
pub use environment::Environment;
pub use environment_map::{EnvironmentMap, EnvironmentMapParameters};
pub use kinds::LightKind;
pub use list::*;
pub use point::PointLight;
pub use quad::LEAST_SOLID_ANGLE;
pub use sample::{EmittedRay, Escaped, LightSample, SHADOW_LENGTH};
pub use spot::{Falloff, Ramp, SpotLight};
pub use table::{LightGroups, LightTable, NO_LIGHT};
pub use textured_quad::{TexturedQuad, textured_radiance};
pub use textured_round::TexturedRound;
pub use textured_triangle::TexturedTriangle;
pub use tree::{
    COUNT_FROM, FACING, GREATEST, LEAF, LEAST_SHARE, LightChoice, LightNode, LightTree, NARROW, NEARNESS,
};
pub use triangle::Triangle;
