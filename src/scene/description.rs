//! A scene as plain data.
//!
//! Lengths are the scene's own unit, angles are radians, colours are linear Rec. 709, radiance is in
//! W·m⁻²·sr⁻¹. Vectors are in world space, right-handed.

mod choice;
mod colour;
mod film;
mod filter;
pub mod limits;
mod render;

pub use self::choice::Choice;
pub use self::colour::Colour;
pub use self::film::{FilmMode, FilmSettings, LONGEST_SIDE, MOST_STOPS, Tone};
pub use self::filter::Filter;
pub use self::render::{Integrator, MOST_BOUNCES, RenderSettings, Sampler, UNLIMITED, endless};
pub use crate::camera::CameraSettings;
pub use crate::shape::Mesh;
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// A whole scene. One that a reader gives is checked: indices are in range and every value is possible. The default
/// is what an empty scene file gives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The picture's shape and how samples become pixels.
    pub film: FilmSettings,
    /// Where the picture is taken from.
    pub camera: CameraSettings,
    /// How light is followed.
    pub render: RenderSettings,
    /// The materials, checkerboards after the materials they name.
    pub materials: Vec<Material>,
    /// The surfaces.
    pub entities: Vec<Entity>,
    /// The lights that are not surfaces.
    pub lights: Vec<Light>,
    /// What a ray that leaves the scene sees: radiance from everywhere.
    pub environment: Colour,
}

impl Scene {
    /// Whether anything in it shines.
    pub fn has_light(&self) -> bool {
        let shines = |colour: &Colour| colour.iter().any(|&channel| channel > 0.0);
        self.entities.iter().any(|entity| shines(&entity.emission))
            || self.lights.iter().any(|Light::Point { intensity, .. }| shines(intensity))
            || shines(&self.environment)
            || self.render.integrator == Integrator::Whitted && shines(&self.render.ambient)
    }
}

/// A named material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name that entities use.
    pub name: String,
    /// What it does with light.
    pub kind: MaterialKind,
}

/// What a material does with light.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialKind {
    /// Scatters evenly, on both sides.
    Matte {
        /// The fraction reflected, 0 to 1 in each channel.
        reflectance: Colour,
    },
    /// Reflects perfectly, on both sides.
    Mirror {
        /// The fraction reflected, 0 to 1 in each channel.
        reflectance: Colour,
    },
    /// A smooth dielectric interface; the inside is where the normal does not point.
    Glass {
        /// Index of refraction of the inside over the outside, above zero.
        ior: f64,
        /// Tint of what is reflected, 0 to 1 in each channel.
        reflectance: Colour,
        /// Tint of what is transmitted, 0 to 1 in each channel.
        transmittance: Colour,
    },
    /// Alternates two materials over the surface's uv.
    Checkerboard {
        /// Index of the material where ⌊u·a⌋ + ⌊v·b⌋ is even.
        even: usize,
        /// Index of the material elsewhere.
        odd: usize,
        /// Checks along u and v for each unit of uv, above zero.
        checks_per_unit: [f64; 2],
    },
    /// Returns NaN, infinity and −1 in turn: for testing that samples are rejected.
    #[cfg(feature = "broken-material")]
    Broken,
}

/// A surface in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Entity {
    /// The name that messages use.
    pub name: String,
    /// Its form and place.
    pub shape: Shape,
    /// Index of its material.
    pub material: usize,
    /// Radiance that leaves its outward side.
    pub emission: Colour,
    /// Whether the outward side is the other one.
    pub flip_normal: bool,
}

/// A dark sphere of radius 1 at the origin, of the first material.
impl Default for Entity {
    fn default() -> Self {
        Entity {
            name: "entity".to_owned(),
            shape: Shape::Sphere { center: DVec3::ZERO, radius: 1.0 },
            material: 0,
            emission: [0.0; 3],
            flip_normal: false,
        }
    }
}

/// A form and its place.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// All X with X·normal = distance.
    Plane {
        /// Of length one.
        normal: DVec3,
        /// Signed distance from the origin along the normal.
        distance: f64,
    },
    /// All X with |X − center| = radius.
    Sphere {
        /// The centre.
        center: DVec3,
        /// The radius, above zero.
        radius: f64,
    },
    /// The parallelogram corner + a·u + b·v with a and b in 0…1; outward is u × v.
    Quad {
        /// The corner where uv is (0, 0).
        corner: DVec3,
        /// The first edge.
        u: DVec3,
        /// The second edge, not parallel to the first.
        v: DVec3,
    },
    /// The points X of a plane with |X − center| ≤ radius; outward is the normal.
    Disk {
        /// The centre.
        center: DVec3,
        /// Of length one.
        normal: DVec3,
        /// The radius, above zero.
        radius: f64,
    },
    /// The points at a distance from a line between its ends, which are open; outward is away from the line.
    Cylinder {
        /// One end of the line.
        from: DVec3,
        /// The other end, somewhere else.
        to: DVec3,
        /// The distance, above zero.
        radius: f64,
    },
    /// The six sides of a box along the axes.
    Box {
        /// The least corner.
        min: DVec3,
        /// The greatest corner, above the least along each axis.
        max: DVec3,
    },
    /// Triangles; outward is their counter-clockwise side.
    Mesh {
        /// The triangles, in the space of their file. Entities of one file share them.
        mesh: Arc<Mesh>,
        /// From there to the world; it can be inverted.
        transform: DAffine3,
    },
}

/// A light that is not a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Sends the same intensity in every direction.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity in W/sr.
        intensity: Colour,
    },
}
