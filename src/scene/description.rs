//! A scene as plain data.
//!
//! Lengths are in the scene's own unit, angles in radians, colours in linear Rec. 709, radiance in W·m⁻²·sr⁻¹. Vectors
//! are in world space, right-handed.

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
use crate::material::with_placeholders;
pub use crate::parameter::{Colour, Named};
use crate::parameter::{Family, Value};
pub use crate::shape::list::*;
pub use crate::shape::{AnyShape as Shape, Mesh};
pub use crate::texture::ImageFile;
pub use crate::texture::list::*;
use glam::DVec3;

/// A scene. Scenes from readers are checked: indices and values are in range. The default is that of an empty scene
/// file.
///
/// ```
/// use stride::scene::{CameraSettings, MatteParameters, SphereParameters};
/// use stride::{Render, Scene};
///
/// let mut scene = Scene { camera: CameraSettings::looking_at([0.0, -5.0, 0.0], [0.0; 3]), ..Scene::default() };
/// let white = scene.add_material("white", MatteParameters { reflectance: [0.8; 3], roughness: 0.0 });
/// scene.add_entity("ball", SphereParameters { center: [0.0; 3].into(), radius: 1.0 }, white);
/// scene.environment = [1.0; 3];
/// let scene = scene.checked().expect("a valid scene");
/// let report = Render::new(&scene).size((8, 6)).samples(1).run()?;
/// assert_eq!(report.picture.rgb[0], [1.0; 3]); // the sky, in the corner
/// # Ok::<(), stride::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The size of the image and its reconstruction from samples.
    pub film: FilmSettings,
    /// The camera.
    pub camera: CameraSettings,
    /// The render settings.
    pub render: RenderSettings,
    /// The materials; checkerboards and mixes follow the materials that they refer to.
    pub materials: Vec<Material>,
    /// The textures, each after those that it refers to.
    pub textures: Vec<Texture>,
    /// The image files of textures, without duplicates.
    pub images: Vec<ImageFile>,
    /// The surfaces, including those of groups.
    pub entities: Vec<Entity>,
    /// The groups of surfaces, each after those that it contains.
    pub groups: Vec<Group>,
    /// Instances of groups, in the world and in other groups.
    pub instances: Vec<Instance>,
    /// The lights that are no surfaces.
    pub lights: Vec<Light>,
    /// Constant radiance from the environment, W·m⁻²·sr⁻¹.
    pub environment: Colour,
    /// An environment picture, whose radiance is added to the constant one.
    pub environment_picture: Option<EnvironmentPicture>,
}

impl Scene {
    /// Whether the scene contains any light.
    pub fn has_light(&self) -> bool {
        let shines = |colour: &Colour| colour.iter().any(|&channel| channel > 0.0);
        self.entities.iter().any(Entity::emits)
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
    /// The name by which entities refer to it.
    pub name: String,
    /// The kind with its parameters.
    pub kind: MaterialKind,
    /// The parameters that are textures, including those of `modifiers`. Their values in these fields are ignored.
    pub textures: Vec<Textured>,
    /// Properties that every material may have: holes, a back side, maps.
    pub modifiers: Modifiers,
}

/// A matte material with a reflectance of one half.
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
    /// The indices of the materials that it refers to.
    pub fn named(&self) -> impl Iterator<Item = usize> {
        self.kind.materials().chain(self.modifiers.back)
    }

    /// The kind, with textured parameters set to values for which the kind reports that it uses them.
    pub fn textured_kind(&self) -> MaterialKind {
        with_placeholders(&self.kind, self.textures.iter().map(|textured| textured.parameter))
    }
}

/// A parameter that is a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Textured {
    /// The parameter's name.
    pub parameter: &'static str,
    /// The index of the texture.
    pub texture: usize,
}

/// A named texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The name by which materials and other textures refer to it.
    pub name: String,
    /// The kind with its parameters.
    pub kind: TextureKind,
}

/// A surface in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Entity {
    /// The name in messages.
    pub name: String,
    /// The shape.
    pub shape: Shape,
    /// Index of its material.
    pub material: usize,
    /// Radiance emitted on the outward side, W·m⁻²·sr⁻¹.
    pub emission: Colour,
    /// The texture of the emission, which replaces `emission`.
    pub emission_texture: Option<usize>,
    /// Whether the outward side and the inward side are swapped.
    pub flip_normal: bool,
    /// Index of the group that contains it and in whose space it is; `None` in the world.
    pub within: Option<usize>,
}

impl Entity {
    /// Whether it emits.
    pub fn emits(&self) -> bool {
        self.emission.iter().any(|&channel| channel > 0.0) || self.emission_texture.is_some()
    }
}

/// A sphere of radius 1 at the origin, with the first material and without emission.
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
