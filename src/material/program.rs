//! Materials as programs.

use super::bxdf::Bxdf;
use super::row::{Columns, Numbers, Row, Site};
use crate::math::Float;
use crate::math::lanes::Value;

/// The parameters of a material, as a scene describes it.
pub trait MaterialParameters {
    /// The row with the parameters of the material's program.
    fn row(&self) -> Row;
}

/// A material that scatters light: a program that makes a lobe, possibly a combination of several, from the numbers of
/// a row and the point of evaluation.
///
/// If the colour of the row is black, every lobe that is not a delta lobe must be black, too, because paths sample no
/// lights there (see [`Bsdf::is_black`](super::Bsdf::is_black)).
pub trait Leaf {
    /// Whether it uses [`Site::uv`], which are unspecified otherwise.
    const USES_UV: bool = false;

    /// Whether its lobe is computed inline, as those of frequent materials are. All others together are out of line,
    /// because scenes without them would pay for tests and registers between the frequent ones.
    const IS_FREQUENT: bool = false;

    /// Its BxDF.
    type Lobe<F: Float>: Bxdf<F> + Value<F>;

    /// The lobe at a point.
    fn lobe<F: Float>(numbers: &Numbers<F>, site: &Site<F>) -> Self::Lobe<F>;
}

/// A material that delegates to one of several others. One that does not choose by uv overrides no function, and
/// `walk.rs` handles it by name.
pub trait Chooser {
    /// Whether it chooses by uv.
    const BY_UV: bool = false;

    /// The row chosen at uv by a row of this kind, and the uv for the chosen one.
    #[inline(always)]
    fn choose<F: Float>(_columns: &Columns, row: F::Uint, uv: [F; 2]) -> (F::Uint, [F; 2]) {
        (row, uv)
    }

    /// The lengths of the chosen row's uv per length of uv.
    #[inline(always)]
    fn uv_scale<F: Float>(_columns: &Columns, _row: F::Uint) -> [F; 2] {
        [F::splat(1.0); 2]
    }
}
