//! A scene as plain data.
//!
//! Lengths are the scene's own unit, angles are radians, colours are linear Rec. 709, radiance is in
//! W·m⁻²·sr⁻¹. Vectors are in world space, right-handed.

pub use crate::camera::CameraSettings;
pub use crate::light::AnyLight as Light;
pub use crate::light::list::*;
pub use crate::material::list::*;
pub use crate::parameter::Colour;
use crate::parameter::{Family, Value};
pub use crate::shape::list::*;
pub use crate::shape::{AnyShape as Shape, Mesh};

/// A whole scene, checked: indices are in range and every value is possible.
#[derive(Clone, Debug, PartialEq)]
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
            || self.lights.iter().any(|light| {
                light.values().iter().any(|value| matches!(value, Value::Colour(colour) if shines(colour)))
            })
            || shines(&self.environment)
            || self.render.integrator == Integrator::Whitted && shines(&self.render.ambient)
    }
}

/// The picture's shape and how samples become pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// Pixels in a row, 1 to 65,536.
    pub width: u32,
    /// Rows, 1 to 65,536.
    pub height: u32,
    /// Exposure of PNG and window in stops: display values are radiance × 2^exposure.
    pub exposure: f64,
    /// The tone curve of PNG and window.
    pub tone: Tone,
    /// The reconstruction filter.
    pub filter: Filter,
    /// How samples are filtered; none leaves it to [`Filter::usual_mode`].
    pub mode: Option<FilmMode>,
}

impl FilmSettings {
    /// How samples are filtered.
    pub fn mode(&self) -> FilmMode {
        self.mode.unwrap_or(self.filter.usual_mode())
    }

    /// What is wrong with the filter in this mode.
    pub fn problem(&self) -> Option<&'static str> {
        match (self.mode(), self.filter) {
            (FilmMode::Importance, filter) if filter.has_negative_lobes() => Some(
                "this filter is negative in places, and no sample can be drawn with a negative chance: it needs mode \"continuous\"",
            ),
            (FilmMode::Continuous, Filter::None) => Some(
                "filter \"none\" takes samples in pixel centres only: mode \"continuous\" needs a filter with a width",
            ),
            (FilmMode::Continuous, filter) if filter.radius() < 0.5 => Some(
                "samples would fall between the pixels: with mode \"continuous\" a filter's radius is at least 0.5",
            ),
            _ => None,
        }
    }
}

/// How samples are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmMode {
    /// Each pixel draws samples of its own from the filter, and all count the same (report §5.2.5).
    Importance,
    /// Samples are spread evenly over the film, and each lands on every pixel within the filter's reach.
    Continuous,
}

/// How linear values become the codes of 8-bit pictures and screens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// As they are, by the transfer function of IEC 61966-2-1, clipped at one.
    #[default]
    Srgb,
    /// Through Narkowicz's fit of the ACES film curve first (<https://knarkowicz.wordpress.com>, "ACES Filmic Tone
    /// Mapping Curve", 2016): dark tones gain contrast, and highlights roll off, to white at ten.
    Filmic,
    /// Codes in proportion to the values, for looking at numbers in a window.
    Linear,
}

impl Tone {
    /// All of them, in the order in which a viewer goes through them.
    pub const ALL: [Tone; 3] = [Tone::Srgb, Tone::Filmic, Tone::Linear];

    /// The name.
    pub fn name(self) -> &'static str {
        match self {
            Tone::Srgb => "srgb",
            Tone::Filmic => "filmic",
            Tone::Linear => "linear",
        }
    }
}

/// A reconstruction filter with its radius in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Every sample through the pixel's centre.
    None,
    /// Equal weight within the radius (½: the pixel itself).
    Box {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// A triangle that falls to zero at the radius (1 by default).
    Tent {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// exp(−x²/2σ²), lowered so that it ends at zero.
    Gaussian {
        /// Half the filter's width in pixels.
        radius: f64,
        /// σ in pixels.
        sigma: f64,
    },
    /// Two cubic pieces (Mitchell and Netravali 1988), stretched to the radius.
    Mitchell {
        /// Half the filter's width in pixels.
        radius: f64,
        /// B: 1 blurs.
        b: f64,
        /// C: 1 rings.
        c: f64,
    },
    /// The window of four cosines (Harris 1978).
    BlackmanHarris {
        /// Half the filter's width in pixels.
        radius: f64,
    },
    /// sinc x · sinc(x/radius).
    Lanczos {
        /// Half the filter's width in pixels, and how many lobes there are on each side.
        radius: f64,
    },
}

impl Filter {
    /// Half the filter's width in pixels.
    pub fn radius(self) -> f64 {
        match self {
            Filter::None => 0.0,
            Filter::Box { radius }
            | Filter::Tent { radius }
            | Filter::Gaussian { radius, .. }
            | Filter::Mitchell { radius, .. }
            | Filter::BlackmanHarris { radius }
            | Filter::Lanczos { radius } => radius,
        }
    }

    /// The same, stretched or cut off at another radius.
    pub fn with_radius(mut self, to: f64) -> Filter {
        match &mut self {
            Filter::None => {}
            Filter::Box { radius }
            | Filter::Tent { radius }
            | Filter::Gaussian { radius, .. }
            | Filter::Mitchell { radius, .. }
            | Filter::BlackmanHarris { radius }
            | Filter::Lanczos { radius } => *radius = to,
        }
        self
    }

    /// Whether some of its weights may be below zero.
    pub fn has_negative_lobes(self) -> bool {
        matches!(self, Filter::Mitchell { .. } | Filter::Lanczos { .. })
    }

    /// The mode of a film that doesn't say: what was measured to serve each filter best (see CONTRIBUTING.md).
    pub fn usual_mode(self) -> FilmMode {
        match self {
            Filter::None | Filter::Box { .. } | Filter::Tent { .. } => FilmMode::Importance,
            _ => FilmMode::Continuous,
        }
    }
}

/// What is wrong with following paths to any depth with this integrator, if it has no roulette to end them.
pub fn endless(integrator: Integrator, max_depth: u32) -> Option<&'static str> {
    (max_depth == UNLIMITED && integrator != Integrator::Path).then_some(
        "max_depth can be \"unlimited\" only with integrator \"path\": no other plays Russian roulette",
    )
}

/// As [`RenderSettings::max_depth`]: only Russian roulette ends paths.
pub const UNLIMITED: u32 = u32::MAX;

/// How light is followed.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// The integrator.
    pub integrator: Integrator,
    /// Where its random numbers come from.
    pub sampler: Sampler,
    /// The largest number of bounces: 0 sees emitters only, [`UNLIMITED`] sees all.
    pub max_depth: u32,
    /// Samples a pixel, at least one.
    pub samples: u32,
    /// Whether samples are spent where the error is: then `samples` is the most that a pixel gets.
    pub adaptive: bool,
    /// The seed of all randomness.
    pub seed: u32,
    /// The ambient term of `whitted`: radiance added at every diffuse hit, times its reflectance.
    pub ambient: Colour,
}

/// How light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Recursive ray tracing (Whitted 1980; report ch. 2).
    Whitted,
    /// The best unidirectional path tracer there is here.
    Path,
    /// The report's path tracer (§4.3): lights are found by chance.
    PathNaive,
}

/// Where random numbers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampler {
    /// Every number by itself: the error falls as 1/√n.
    Independent,
    /// Scrambled Sobol points: each decision's numbers are spread evenly over the samples of a pixel.
    Sobol,
}

/// A named material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name that entities use.
    pub name: String,
    /// What it does with light.
    pub kind: MaterialKind,
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
