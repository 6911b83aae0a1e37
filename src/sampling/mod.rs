//! Sampling: the pixels of a film and their samples; random streams; and warps, each with its density.

pub mod block;
pub mod endless;
mod grid;
pub mod independent;
mod region;
mod sample;
pub mod sampler;
mod smooth;
pub mod sobol;
pub mod stream;
pub mod warp;

pub use block::{Block, Blocks, PathId, VertexBlock};
pub use endless::EndlessStream;
pub use grid::{CELLS, Grids, Smooth};
pub use independent::Independent;
pub use region::{Rectangle, Region};
pub use sample::{Contribution, Pixel, Sample};
pub use sampler::Sampler;
pub use smooth::{MOST_POINTS, SmoothPoint};
pub use sobol::Sobol;
pub use stream::Stream;
