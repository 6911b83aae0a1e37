//! A physically based path tracer whose pictures are identical to the bit for any number of threads.
//!
//! ```
//! use stride::{Layer, Render, Scene};
//!
//! let scene = Scene::load("scenes/cover.toml")?;
//! let render = Render::new(&scene).size((64, 48)).samples(4).layers([Layer::Depth]);
//! let report = render.run()?;
//! let [red, green, blue] = report.picture.rgb[0]; // linear radiance, upper left pixel
//! let depth = &report.layer(Layer::Depth)[0].values;
//! # let folder = tempfile::tempdir()?;
//! # let file = folder.path().join("cover.exr");
//! # assert!(red >= 0.0 && green >= 0.0 && blue >= 0.0 && depth.len() == 64 * 48);
//! report.save(&file)?; // .exr, .png or .hdr
//! # assert!(file.exists());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! - [`Scene`] is plain data: load it from a file, or build it in code and check it with [`Scene::checked`].
//! - [`Render`] holds the settings of a render: samples, time or error; threads or a GPU; layers and files.
//!   [`Render::run`] waits for the picture, [`Render::start`] returns a [`RenderHandle`] with events and a way to stop,
//!   and [`Render::run_with_samples`] passes every sample to a callback.
//! - [`Report`] is the result of a render, and [`Error`] the reason why it failed.
//!
//! The library prints nothing and ends no process, and two renders in one process are independent. There are three
//! programs in `examples/`.
//!
//! # Modules
//!
//! Each module imports only modules above it:
//!
//! | module | contents |
//! |---|---|
//! | [`math`] | vectors, lanes, rays, frames |
//! | [`sampling`] | pixels, regions and samples; random streams; warps, each beside its density |
//! | [`parameter`] | the declaration of shapes, textures, materials and lights |
//! | [`shape`] | the shapes, in a file each; triangle meshes |
//! | [`texture`] | textures and images |
//! | [`material`] | materials, and the lobes that they are made of |
//! | [`light`] | the interface of lights, area and point lights, and light sampling |
//! | [`camera`] | camera rays |
//! | [`scene`] | the scene description: names, units, source lines; the readers of scene and mesh files |
//! | [`world`] | the compiled scene: surfaces, and the search for what a ray hits |
//! | [`integrator`] | whitted, path, path-naive |
//! | [`film`] | exact sums, reconstruction filters, tone mapping |
//! | [`render`] | strides, batches, workers, the accumulator |
//! | [`gpu`] | the GPU worker |
//! | [`output`] | one sink per file |
//! | [`session`] | the processes of a render, and the channels between them |
//! | [`api`] | the interface for programs: render settings and their rules |
//! | [`fleet`] | renders on many machines, over a NATS server |
//! | [`cli`] | the command line |

pub mod api;
pub mod camera;
pub mod cli;
pub mod film;
pub mod fleet;
pub mod gpu;
pub mod integrator;
pub mod light;
pub mod material;
pub mod math;
pub mod output;
pub mod parameter;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod session;
pub mod shape;
pub mod texture;
pub mod world;

pub use api::{Error, Events, Render, RenderHandle, SettingsError};
pub use film::{Layer, Picture};
pub use sampling::Sample;
pub use scene::Scene;
pub use session::{Event, Report};
