//! Sampling: random streams and the warps that shape them, each beside its density.

pub mod random;
pub mod sampler;
pub mod sobol;
pub mod stream;
pub mod warp;

pub use random::{Block, Independent, PathId};
pub use sampler::Sampler;
pub use sobol::Sobol;
pub use stream::Stream;
