//! The list of lights that are not surfaces.

use super::contract::LightParameters;
use super::table::LightTable;
use crate::parameter::family;

family! {
    /// A light that is not a surface, as a scene describes it.
    pub enum AnyLight {
        Point(point::PointLightParameters),
        Directional(directional::DirectionalLightParameters),
        Spot(spot::SpotLightParameters),
    }

    /// Adds the light to a table and returns its index there.
    pub fn add_to(&self, lights: &mut LightTable) -> u32 = light => light.add_to(lights);
}
