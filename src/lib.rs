//! `stride`: a physically based path tracer.
//!
//! The rooms, each of which imports only rooms above it:
//!
//! | room | what is in it |
//! |---|---|
//! | [`math`] | vectors, lanes, rays, frames |
//! | [`sampling`] | pixels, regions and samples; random streams; warps, each beside its density |
//! | [`parameter`] | how shapes, materials and lights are declared |
//! | [`shape`] | plane, sphere, quad, disk, cylinder, box, triangle mesh |
//! | [`material`] | materials, BxDFs and their interface |
//! | [`light`] | the interface of lights, area and point lights, and the choice among them |
//! | [`camera`] | film positions to rays |
//! | [`scene`] | the description: names, units, source lines; the readers of scene and mesh files |
//! | [`world`] | the compiled scene, and the intersection of rays with it |
//! | [`integrator`] | whitted, path, path-naive |
//! | [`film`] | exact sums, reconstruction filters, tone mapping |
//! | [`render`] | strides, batches, workers, the accumulator |
//! | [`gpu`] | the GPU worker |
//! | [`output`] | one sink per file |
//! | [`session`] | the processes of a render, and the channels between them |
//! | [`cli`] | one file per subcommand |

pub mod camera;
pub mod cli;
pub mod film;
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
pub mod world;
