//! The list of lights that are not surfaces.

use crate::parameter::family;

family! {
    /// A light that is not a surface, as a scene describes it.
    pub enum AnyLight as dyn super::Described {
        Point(point::PointLightParameters),
    }
}
