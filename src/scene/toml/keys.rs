//! Every key of the format: name, form, default and description. The reader and the JSON Schema both follow
//! these tables, so a key is added here and used in `build`.

use super::build::{self, PartMaterials, RawEntity, RawShape};
use super::form::{At, Block, Key, ListOf, MapOf, OneOf, Table, Variant, WordOr, WordOrMap};
use super::materials::Raw;
use super::value::{
    Choice, Colour, Direction, Flag, Integer, IntegerOr, NonZero, Number, Pair, Rows, Triple, Vector, Word,
};
use crate::scene::description::{
    CameraSettings, FilmMode, FilmSettings, Filter, Integrator, Light, RenderSettings, Sampler, Scene, Tone,
    UNLIMITED,
};
use glam::DAffine3;

// Lengths whose squares, and the squares of whose inverses, fit 32 bits.
pub(super) const LONGEST: f64 = 1e18;
pub(super) const SHORTEST: f64 = 1e-18;
// The size of a mesh whose triangles, a thousandth of that, still have areas that fit.
pub(super) const SMALLEST_MESH: f64 = 1e-15;

const COORDINATE: Number = Number::between(-LONGEST, LONGEST);
const LENGTH: Number = Number::positive(SHORTEST, LONGEST);
const DISTANCE: Number = Number::between(0.0, LONGEST);
const POINT: Vector = Vector(COORDINATE);
const EDGE: NonZero = NonZero(POINT);
const DIRECTION: Direction = Direction(EDGE);
const FRACTION: Colour = Colour(Number::between(0.0, 1.0));
// The film holds radiance up to 2³⁰ (design §2).
const RADIANCE: Colour = Colour(Number::between(0.0, (1u32 << 30) as f64));
// What gives the same radiance at any distance that there may be: neither a film nor a unit of length limits it.
const INTENSITIES: Colour = Colour(Number::between(0.0, LONGEST * LONGEST));
const FILTER_RADIUS: Number = Number::positive(1e-6, 16.0);
const REFRACTION: Number = Number::positive(1e-3, 1e3);
const FACTOR: Number = Number::between(-1e9, 1e9);
// On planes their size is a length.
const CHECKS: Number = Number::positive(SHORTEST, LONGEST);

/// The whole file.
pub(super) static SCENE: Block<Scene> = Block { table: &SCENE_TABLE, build: build::scene };

static SCENE_TABLE: Table =
    Table::new("a scene file", &[&FILM, &CAMERA, &RENDER, &MATERIALS, &ENTITIES, &LIGHTS, &ENVIRONMENT]);

pub(super) static FILM: Key<Block<FilmSettings>> = Key::default(
    "film",
    Block { table: &FILM_TABLE, build: build::film },
    "{}",
    "The picture's shape and how samples become pixels.",
);
pub(super) static CAMERA: Key<Block<CameraSettings>> = Key::default(
    "camera",
    Block { table: &CAMERA_TABLE, build: build::camera },
    "{}",
    "Where the picture is taken from.",
);
pub(super) static RENDER: Key<Block<RenderSettings>> = Key::default(
    "render",
    Block { table: &RENDER_TABLE, build: build::render },
    "{}",
    "How light is followed.",
);
pub(super) static MATERIALS: Key<MapOf<OneOf<Raw>>> =
    Key::default("materials", MapOf(MATERIAL), "{}", "What surfaces do with light, each under its name.");
pub(super) static ENTITIES: Key<ListOf<Block<RawEntity>>> = Key::default(
    "entities",
    ListOf(Block { table: &ENTITY_TABLE, build: build::entity }),
    "[]",
    "The surfaces of the scene.",
);
pub(super) static LIGHTS: Key<ListOf<OneOf<Light>>> =
    Key::default("lights", ListOf(LIGHT), "[]", "The lights that are not surfaces.");
pub(super) static ENVIRONMENT: Key<Block<[f64; 3]>> = Key::default(
    "environment",
    Block { table: &ENVIRONMENT_TABLE, build: build::environment },
    "{}",
    "What a ray that leaves the scene sees.",
);

/// Where a key that stands in the wrong place may belong.
pub(super) static HEADERS: &[(&str, &Table)] = &[
    ("[film]", &FILM_TABLE),
    ("[camera]", &CAMERA_TABLE),
    ("[render]", &RENDER_TABLE),
    ("[[entities]]", &ENTITY_TABLE),
    ("[environment]", &ENVIRONMENT_TABLE),
];

static FILM_TABLE: Table = Table::new("the film", &[&WIDTH, &HEIGHT, &EXPOSURE, &TONE, &FILTER, &MODE]);

pub(super) static WIDTH: Key<Integer> =
    Key::default("width", Integer { least: 1, most: 65536 }, "640", "Pixels in a row.");
pub(super) static HEIGHT: Key<Integer> =
    Key::default("height", Integer { least: 1, most: 65536 }, "480", "Rows of pixels.");
pub(super) static EXPOSURE: Key<Number> = Key::default(
    "exposure",
    Number::between(-64.0, 64.0),
    "0",
    "Stops: PNG and window show radiance times 2 to this power.",
);
pub(super) static TONE: Key<Choice<Tone>> = Key::default(
    "tone",
    TONES,
    "\"srgb\"",
    "The curve of PNG and window: srgb (clipped at white) or filmic (highlights roll off).",
);
pub(super) const TONES: Choice<Tone> =
    Choice { what: "tone curve", options: &[("srgb", Tone::Srgb), ("filmic", Tone::Filmic)] };
pub(super) static FILTER: Key<WordOr<Filter>> = Key::default(
    "filter",
    FILTERS,
    "\"tent\"",
    "The reconstruction filter: none (pixel centres), box, tent, gaussian, mitchell, blackman-harris or lanczos; or a table that gives its radius.",
);
pub(super) const FILTERS: WordOr<Filter> = WordOr(OneOf {
    what: "filter",
    variants: &[
        Variant::new("none", &NO_FILTER_TABLE, build::no_filter),
        Variant::new("box", &BOX_TABLE, build::box_filter),
        Variant::new("tent", &TENT_TABLE, build::tent_filter),
        Variant::new("gaussian", &GAUSSIAN_TABLE, build::gaussian_filter),
        Variant::new("mitchell", &MITCHELL_TABLE, build::mitchell_filter),
        Variant::new("blackman-harris", &BLACKMAN_HARRIS_TABLE, build::blackman_harris_filter),
        Variant::new("lanczos", &LANCZOS_TABLE, build::lanczos_filter),
    ],
});
static NO_FILTER_TABLE: Table = Table::new("filter \"none\"", &[]);
static BOX_TABLE: Table = Table::new("filter \"box\"", &[&BOX_RADIUS]);
static TENT_TABLE: Table = Table::new("filter \"tent\"", &[&TENT_RADIUS]);
static GAUSSIAN_TABLE: Table = Table::new("filter \"gaussian\"", &[&GAUSSIAN_RADIUS, &SIGMA]);
static MITCHELL_TABLE: Table =
    Table::new("filter \"mitchell\"", &[&MITCHELL_RADIUS, &MITCHELL_B, &MITCHELL_C]);
static BLACKMAN_HARRIS_TABLE: Table = Table::new("filter \"blackman-harris\"", &[&BLACKMAN_HARRIS_RADIUS]);
static LANCZOS_TABLE: Table = Table::new("filter \"lanczos\"", &[&LANCZOS_RADIUS]);

pub(super) static BOX_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "0.5", "Half the filter's width in pixels.");
pub(super) static TENT_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "1.0", "Half the filter's width in pixels.");
pub(super) static GAUSSIAN_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "1.5", "Half the filter's width in pixels.");
pub(super) static SIGMA: Key<Number> =
    Key::default("sigma", Number::between(0.05, 16.0), "0.5", "Standard deviation in pixels.");
pub(super) static MITCHELL_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "2.0", "Half the filter's width in pixels.");
pub(super) static MITCHELL_B: Key<Number> = Key::default(
    "b",
    Number::between(0.0, 1.0),
    "0.3333333333333333",
    "Mitchell and Netravali's B: 1 blurs.",
);
pub(super) static MITCHELL_C: Key<Number> = Key::default(
    "c",
    Number::between(0.0, 1.0),
    "0.3333333333333333",
    "Mitchell and Netravali's C: 1 rings.",
);
pub(super) static BLACKMAN_HARRIS_RADIUS: Key<Number> =
    Key::default("radius", FILTER_RADIUS, "1.5", "Half the filter's width in pixels.");
pub(super) static LANCZOS_RADIUS: Key<Number> = Key::default(
    "radius",
    FILTER_RADIUS,
    "3.0",
    "Half the filter's width in pixels: the lobes on each side of its middle.",
);

pub(super) static MODE: Key<Choice<FilmMode>> = Key::optional(
    "mode",
    MODES,
    "How samples are filtered: importance (each pixel draws its own from the filter) or continuous (each sample lands on every pixel within the filter's reach); the filter decides if this is absent.",
);
pub(super) const MODES: Choice<FilmMode> = Choice {
    what: "mode",
    options: &[("importance", FilmMode::Importance), ("continuous", FilmMode::Continuous)],
};

static CAMERA_TABLE: Table = Table {
    what: "the camera",
    keys: &[
        &EYE,
        &FORWARD,
        &LOOK_AT,
        &UP,
        &VERTICAL_FOV,
        &NEAR,
        &FOCAL_LENGTH,
        &APERTURE_RADIUS,
        &FOCUS_DISTANCE,
    ],
    rules: r#"{
        "not": { "required": ["forward", "look_at"] },
        "dependentRequired": { "aperture_radius": ["focus_distance"] }
    }"#,
};

pub(super) static EYE: Key<Vector> = Key::default("eye", POINT, "[0, 0, 0]", "The focal point.");
pub(super) static FORWARD: Key<Direction> =
    Key::default("forward", DIRECTION, "[1, 0, 0]", "The direction of view, of any length; or give look_at.");
pub(super) static LOOK_AT: Key<Vector> =
    Key::optional("look_at", POINT, "A point in the middle of the picture, instead of forward.");
pub(super) static UP: Key<Direction> = Key::default(
    "up",
    DIRECTION,
    "[0, 0, 1]",
    "The world's up direction, of any length, not parallel to the direction of view.",
);
pub(super) static VERTICAL_FOV: Key<Number> = Key::default(
    "vertical_fov",
    Number::inside(180.0),
    "90",
    "The angle between the top and the bottom of the picture, in degrees.",
);
pub(super) static NEAR: Key<Number> =
    Key::default("near", DISTANCE, "0", "Nothing nearer than this distance along forward is seen.");
pub(super) static FOCAL_LENGTH: Key<Number> = Key::default(
    "focal_length",
    LENGTH,
    "1",
    "The distance of the focal plane from the eye; a pinhole's picture does not depend on it.",
);
pub(super) static APERTURE_RADIUS: Key<Number> = Key::default(
    "aperture_radius",
    DISTANCE,
    "0",
    "The radius of a thin lens; 0 for a pinhole. It needs focus_distance.",
);
pub(super) static FOCUS_DISTANCE: Key<Number> =
    Key::optional("focus_distance", LENGTH, "The distance along forward that a thin lens renders sharp.");

static RENDER_TABLE: Table = Table::new(
    "the render settings",
    &[&INTEGRATOR, &SAMPLER, &MAX_DEPTH, &SAMPLES, &ADAPTIVE, &SEED, &AMBIENT],
);

pub(super) static INTEGRATOR: Key<Choice<Integrator>> = Key::default(
    "integrator",
    INTEGRATORS,
    "\"path\"",
    "How light is followed: whitted (recursive ray tracing, which asks every lamp at every diffuse hit; a mesh of \
     256 triangles or more is one lamp), path, or path-naive (lights are found by chance).",
);
pub(super) const INTEGRATORS: Choice<Integrator> = Choice {
    what: "integrator",
    options: &[
        ("whitted", Integrator::Whitted),
        ("path", Integrator::Path),
        ("path-naive", Integrator::PathNaive),
    ],
};
pub(super) static SAMPLER: Key<Choice<Sampler>> = Key::default(
    "sampler",
    SAMPLERS,
    "\"sobol\"",
    "Where random numbers come from: sobol (spread evenly over a pixel's samples) or independent.",
);
pub(super) const SAMPLERS: Choice<Sampler> =
    Choice { what: "sampler", options: &[("sobol", Sampler::Sobol), ("independent", Sampler::Independent)] };
pub(super) static MAX_DEPTH: Key<IntegerOr> = Key::default(
    "max_depth",
    IntegerOr { integer: Integer { least: 0, most: MOST_BOUNCES }, word: "unlimited", means: UNLIMITED },
    "5",
    "The largest number of bounces: 0 sees emitters only; \"unlimited\" leaves it to Russian roulette (path).",
);
/// The largest limit that may be asked for.
const MOST_BOUNCES: u32 = 10_000;
pub(super) static SAMPLES: Key<Integer> =
    Key::default("samples", Integer { least: 1, most: u32::MAX }, "500", "Samples for each pixel.");
pub(super) static ADAPTIVE: Key<Flag> = Key::default(
    "adaptive",
    Flag,
    "false",
    "Spends samples where the error is: pixels stop by themselves, with as many samples as there are at most.",
);
pub(super) static SEED: Key<Integer> =
    Key::default("seed", Integer { least: 0, most: u32::MAX }, "0", "The seed of all randomness.");
pub(super) static AMBIENT: Key<At<Colour>> = Key::default(
    "ambient",
    At(RADIANCE),
    "[0, 0, 0]",
    "Whitted only: radiance added at every diffuse hit, times its reflectance.",
);

const MATERIAL: OneOf<Raw> = OneOf {
    what: "material",
    variants: &[
        Variant::new("matte", &MATTE_TABLE, build::matte),
        Variant::new("mirror", &MIRROR_TABLE, build::mirror),
        Variant::new("glass", &GLASS_TABLE, build::glass),
        Variant::new("checkerboard", &CHECKERBOARD_TABLE, build::checkerboard),
        #[cfg(feature = "broken-material")]
        Variant { tag: "broken", table: &BROKEN_TABLE, build: build::broken, hidden: true },
    ],
};

static MATTE_TABLE: Table = Table::new("a matte material", &[&REFLECTANCE]);
static MIRROR_TABLE: Table = Table::new("a mirror", &[&REFLECTANCE]);
static GLASS_TABLE: Table = Table::new("a glass", &[&IOR, &GLASS_REFLECTANCE, &TRANSMITTANCE]);
static CHECKERBOARD_TABLE: Table = Table::new("a checkerboard", &[&EVEN, &ODD, &CHECKS_PER_UNIT]);
#[cfg(feature = "broken-material")]
static BROKEN_TABLE: Table = Table::new("a broken material", &[]);

pub(super) static REFLECTANCE: Key<Colour> = Key::required(
    "reflectance",
    FRACTION,
    "The fraction of light that is reflected: red, green, blue, each 0 to 1.",
);
pub(super) static IOR: Key<Number> = Key::required(
    "ior",
    REFRACTION,
    "Index of refraction of the inside over the outside: 1.5 for glass in air, 1.33 for water.",
);
pub(super) static GLASS_REFLECTANCE: Key<Colour> =
    Key::default("reflectance", FRACTION, "[1, 1, 1]", "Tint of what is reflected.");
pub(super) static TRANSMITTANCE: Key<Colour> =
    Key::default("transmittance", FRACTION, "[1, 1, 1]", "Tint of what is transmitted.");
pub(super) static EVEN: Key<At<Word>> = Key::required(
    "even",
    At(Word),
    "The name of the material where the numbers of the check along u and along v have an even sum.",
);
pub(super) static ODD: Key<At<Word>> = Key::required("odd", At(Word), "The name of the material elsewhere.");
pub(super) static CHECKS_PER_UNIT: Key<Pair> = Key::default(
    "checks_per_unit",
    Pair(CHECKS),
    "1",
    "Checks for each unit of uv: one number, or one along u and one along v. A plane's uv are lengths in it.",
);

static ENTITY_TABLE: Table =
    Table::new("an entity", &[&NAME, &SHAPE, &ENTITY_MATERIAL, &EMISSION, &FLIP_NORMAL]);

pub(super) static NAME: Key<At<Word>> = Key::optional("name", At(Word), "What messages call the entity.");
pub(super) static SHAPE: Key<OneOf<RawShape>> =
    Key::required("shape", SHAPES, "The entity's form and place.");
pub(super) static ENTITY_MATERIAL: Key<At<Word>> = Key::required(
    "material",
    At(Word),
    "The name of the entity's material; of a mesh, that of parts for which its materials name no other.",
);
pub(super) static EMISSION: Key<Colour> = Key::default(
    "emission",
    RADIANCE,
    "[0, 0, 0]",
    "Radiance that leaves the outward side, in W/(m² sr): red, green, blue.",
);
pub(super) static FLIP_NORMAL: Key<Flag> = Key::default(
    "flip_normal",
    Flag,
    "false",
    "Turns the outward side: a plane's n, a sphere's outside, a quad's u × v, a disk's normal, away from a cylinder's axis, a box's outside, a triangle's counter-clockwise side.",
);

const SHAPES: OneOf<RawShape> = OneOf {
    what: "shape",
    variants: &[
        Variant::new("plane", &PLANE_TABLE, build::plane),
        Variant::new("sphere", &SPHERE_TABLE, build::sphere),
        Variant::new("quad", &QUAD_TABLE, build::quad),
        Variant::new("disk", &DISK_TABLE, build::disk),
        Variant::new("cylinder", &CYLINDER_TABLE, build::cylinder),
        Variant::new("box", &CUBOID_TABLE, build::cuboid),
        Variant::new("mesh", &MESH_TABLE, build::mesh),
    ],
};

static PLANE_TABLE: Table = Table::new("a plane", &[&NORMAL, &PLANE_DISTANCE]);
static SPHERE_TABLE: Table = Table::new("a sphere", &[&CENTER, &RADIUS]);
static QUAD_TABLE: Table = Table::new("a quad", &[&CORNER, &U, &V]);
static DISK_TABLE: Table = Table::new("a disk", &[&DISK_CENTER, &DISK_NORMAL, &DISK_RADIUS]);
static CYLINDER_TABLE: Table = Table::new("a cylinder", &[&FROM, &TO, &CYLINDER_RADIUS]);
static CUBOID_TABLE: Table = Table::new("a box", &[&MIN, &MAX]);
static MESH_TABLE: Table = Table::new("a mesh", &[&MESH_FILE, &TRANSFORM, &PART_MATERIALS]);
static TRANSFORM_TABLE: Table = Table {
    what: "a transform",
    keys: &[&SCALE, &ROTATE, &TRANSLATE, &MATRIX],
    rules: r#"{
        "not": { "anyOf": [
            { "required": ["matrix", "scale"] },
            { "required": ["matrix", "rotate"] },
            { "required": ["matrix", "translate"] }
        ] }
    }"#,
};

pub(super) static NORMAL: Key<NonZero> = Key::required(
    "normal",
    EDGE,
    "The direction the plane faces. Its length does not matter: it is made one.",
);
pub(super) static PLANE_DISTANCE: Key<Number> = Key::required(
    "distance",
    COORDINATE,
    "Signed distance of the plane from the origin along its normal, a length whatever the normal's: X·n = distance, where n is the normal over its length.",
);
pub(super) static CENTER: Key<Vector> = Key::required("center", POINT, "The centre of the sphere.");
pub(super) static RADIUS: Key<Number> = Key::required("radius", LENGTH, "The radius of the sphere.");
pub(super) static CORNER: Key<Vector> =
    Key::required("corner", POINT, "The corner of the quad where uv is (0, 0).");
pub(super) static U: Key<NonZero> = Key::required("u", EDGE, "The first edge, from the corner.");
pub(super) static V: Key<NonZero> =
    Key::required("v", EDGE, "The second edge, from the corner. The quad faces u × v.");

pub(super) static DISK_CENTER: Key<Vector> = Key::required("center", POINT, "The centre of the disk.");
pub(super) static DISK_NORMAL: Key<Direction> =
    Key::required("normal", DIRECTION, "The direction the disk faces, of any length.");
pub(super) static DISK_RADIUS: Key<Number> = Key::required(
    "radius",
    LENGTH,
    "The radius of the disk. Its uv are the angle about the normal over 2π and the distance from the centre over the radius.",
);
pub(super) static FROM: Key<Vector> =
    Key::required("from", POINT, "The end of the cylinder's axis where v is 0. Both ends are open.");
pub(super) static TO: Key<Vector> = Key::required("to", POINT, "The end where v is 1.");
pub(super) static CYLINDER_RADIUS: Key<Number> =
    Key::required("radius", LENGTH, "The radius of the cylinder. Its u is the angle about the axis over 2π.");
pub(super) static MIN: Key<Vector> =
    Key::required("min", POINT, "The corner of the box with the least x, y and z.");
pub(super) static MAX: Key<Vector> = Key::required(
    "max",
    POINT,
    "The corner of the box with the greatest x, y and z. On each side uv run from 0 to 1, v along z, or along y on top and bottom.",
);

pub(super) static MESH_FILE: Key<At<Word>> = Key::required(
    "file",
    At(Word),
    "A .ply, .obj, .glb or .gltf file, relative to this one. Entities may share it: it is read once.",
);
pub(super) static PART_MATERIALS: Key<WordOrMap<PartMaterials, At<Word>>> = Key::optional(
    "materials",
    WordOrMap { word: "file", means: PartMaterials::OfFile, value: At(Word), map: PartMaterials::Named },
    "Materials of parts of the mesh: \"file\" takes those of the file (colours of MTL, base materials of glTF, and \
     what they emit); a table gives one of the scene's to each group or material of the file that it names. What \
     is left has the entity's.",
);
pub(super) static TRANSFORM: Key<Block<DAffine3>> = Key::default(
    "transform",
    Block { table: &TRANSFORM_TABLE, build: build::transform },
    "{}",
    "From the file's space to the world: scale, then rotate, then translate; or a matrix.",
);
pub(super) static SCALE: Key<Triple> =
    Key::default("scale", Triple(FACTOR), "1", "One number, or one for each axis; below zero it mirrors.");
pub(super) static ROTATE: Key<Vector> = Key::default(
    "rotate",
    Vector(Number::between(-1e6, 1e6)),
    "[0, 0, 0]",
    "Degrees about the x axis, then about y, then about z.",
);
pub(super) static TRANSLATE: Key<Vector> =
    Key::default("translate", POINT, "[0, 0, 0]", "Where the file's origin goes.");
pub(super) static MATRIX: Key<Rows> = Key::optional(
    "matrix",
    Rows(COORDINATE),
    "Three rows of four numbers, instead: the first three columns are what x, y and z become, the fourth is the translation.",
);

const LIGHT: OneOf<Light> =
    OneOf { what: "light", variants: &[Variant::new("point", &POINT_LIGHT_TABLE, build::point_light)] };

static POINT_LIGHT_TABLE: Table = Table::new("a point light", &[&POSITION, &INTENSITY]);

pub(super) static POSITION: Key<Vector> = Key::required("position", POINT, "Where the light is.");
pub(super) static INTENSITY: Key<Colour> =
    Key::required("intensity", INTENSITIES, "Radiant intensity in W/sr, the same in every direction.");

static ENVIRONMENT_TABLE: Table = Table::new("the environment", &[&ENVIRONMENT_RADIANCE]);

pub(super) static ENVIRONMENT_RADIANCE: Key<Colour> =
    Key::default("radiance", RADIANCE, "[0, 0, 0]", "Radiance from every direction, in W/(m² sr).");
