//! Sampling: random streams and the warps that shape them, each beside its density.

pub mod block;
pub mod independent;
pub mod sampler;
pub mod sobol;
pub mod stream;
pub mod warp;

pub use block::{Block, PathId};
pub use independent::Independent;
pub use sampler::Sampler;
pub use sobol::Sobol;
pub use stream::Stream;
