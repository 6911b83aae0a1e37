//! A scene as plain data.
//!
//! Lengths are the scene's own unit, angles are radians, colours are linear Rec. 709, radiance is in
//! W·m⁻²·sr⁻¹. Vectors are in world space, right-handed.

mod choice;
mod environment;
mod film;
mod filter;
mod group;
mod render;

pub use self::choice::Choice;
pub use self::environment::EnvironmentPicture;
pub use self::film::{EXPOSURES, FilmMode, FilmSettings, LONGEST_SIDE, Tone};
pub use self::filter::Filter;
pub use self::group::{Group, Instance};
pub use self::render::{Integrator, MOST_BOUNCES, RenderSettings, Sampler, UNLIMITED, endless};
pub use crate::camera::CameraSettings;
pub use crate::light::AnyLight as Light;
pub use crate::light::list::*;
pub use crate::material::Modifiers;
pub use crate::material::list::*;
use crate::material::with_stand_ins;
pub use crate::parameter::{Colour, Named};
use crate::parameter::{Family, Value};
pub use crate::shape::list::*;
pub use crate::shape::{AnyShape as Shape, Mesh};
pub use crate::texture::ImageFile;
pub use crate::texture::list::*;
use glam::DVec3;

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
    /// The textures, each after those that it names.
    pub textures: Vec<Texture>,
    /// The image files of textures, each once.
    pub images: Vec<ImageFile>,
    /// The surfaces, those of groups too.
    pub entities: Vec<Entity>,
    /// The groups of surfaces, each after those that it holds.
    pub groups: Vec<Group>,
    /// Where groups stand, in the world and in each other.
    pub instances: Vec<Instance>,
    /// The lights that are not surfaces.
    pub lights: Vec<Light>,
    /// What a ray that leaves the scene sees: radiance from everywhere,
    pub environment: Colour,
    /// and a picture of what is all around, which is added to it.
    pub environment_picture: Option<EnvironmentPicture>,
}

impl Scene {
    /// Whether anything in it shines.
    pub fn has_light(&self) -> bool {
        let shines = |colour: &Colour| colour.iter().any(|&channel| channel > 0.0);
        self.entities.iter().any(|entity| shines(&entity.emission) || entity.emission_texture.is_some())
            || self.lights.iter().any(|light| {
                light.values().iter().any(|value| matches!(value, Value::Colour(colour) if shines(colour)))
            })
            || shines(&self.environment)
            || self.environment_picture.is_some_and(|picture| shines(&picture.scale))
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
    /// The parameters that are textures, those of `modifiers` among them. Their values there and in `kind` do not count.
    pub textures: Vec<Textured>,
    /// What every material may have besides: holes, another material behind, maps.
    pub modifiers: Modifiers,
}

/// Matte, of half the light.
impl Default for Material {
    fn default() -> Self {
        let matte = MatteParameters { reflectance: [0.5; 3], roughness: 0.0 };
        Material {
            name: "material".to_owned(),
            kind: matte.into(),
            textures: Vec::new(),
            modifiers: Modifiers::default(),
        }
    }
}

impl Material {
    /// The indices of the materials that it names.
    pub fn named(&self) -> impl Iterator<Item = usize> {
        self.kind.materials().chain(self.modifiers.back)
    }

    /// What it does with light, with values of parameters that are textures which make it one that looks at them.
    pub fn textured_kind(&self) -> MaterialKind {
        with_stand_ins(&self.kind, self.textures.iter().map(|textured| textured.parameter))
    }
}

/// A parameter that is a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Textured {
    /// Its name.
    pub parameter: &'static str,
    /// The index of the texture.
    pub texture: usize,
}

/// A named texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The name that materials and other textures use.
    pub name: String,
    /// What it is.
    pub kind: TextureKind,
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
    /// The texture that this radiance is instead. Points of quads and boxes are drawn in proportion to it; the light of
    /// other shapes paths find by chance.
    pub emission_texture: Option<usize>,
    /// Whether the outward side is the other one.
    pub flip_normal: bool,
    /// Index of the group that it is a part of, in whose space it is; of none it is in the world.
    pub within: Option<usize>,
}

/// A dark sphere of radius 1 at the origin, of the first material.
impl Default for Entity {
    fn default() -> Self {
        Entity {
            name: "entity".to_owned(),
            shape: Shape::Sphere(SphereParameters { center: DVec3::ZERO, radius: 1.0 }),
            material: 0,
            emission: [0.0; 3],
            emission_texture: None,
            flip_normal: false,
            within: None,
        }
    }
}
