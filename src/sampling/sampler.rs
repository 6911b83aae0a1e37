//! The choice among sources of random numbers.

use super::block::PathId;
use super::endless::EndlessStream;
use super::independent::Independent;
use super::sobol::Sobol;
use crate::math::{Float, Uint, function};

/// A source of numbers in [0, 1) for paths, chosen once per render.
///
/// The choice is a value instead of a type. A draw serves a whole packet of paths, so that testing the choice costs
/// next to nothing, whereas a type would have every integrator compiled once for each source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampler {
    /// Independent uniform numbers.
    Independent(Independent),
    /// Scrambled Sobol points.
    Sobol(Sobol),
}

impl Sampler {
    /// The four numbers of a block.
    #[inline(always)]
    pub fn draw<F: Float>(&self, path: PathId<F>, block: F::Uint) -> [F; 4] {
        function!(F, draw(path, block), {
            match self {
                Sampler::Independent(independent) => independent.draw(path, block),
                Sampler::Sobol(sobol) => sobol.draw(path, block),
            }
        })
    }

    /// An endless stream of independent numbers for the decision of a block, whichever sampler is chosen.
    #[inline(always)]
    pub fn endless<F: Float>(&self, path: PathId<F>, block: F::Uint) -> EndlessStream<F> {
        let (Sampler::Independent(Independent { seed }) | Sampler::Sobol(Sobol { seed })) = self;
        EndlessStream::new(F::Uint::given(seed), path, block)
    }
}

impl From<Independent> for Sampler {
    fn from(independent: Independent) -> Sampler {
        Sampler::Independent(independent)
    }
}

impl From<Sobol> for Sampler {
    fn from(sobol: Sobol) -> Sampler {
        Sampler::Sobol(sobol)
    }
}
