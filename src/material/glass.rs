//! Smooth glass.

use super::kind::Kind;
use super::lobes::Dielectric;
use super::program::Leaf;
use super::row::{NUMBERS, Numbers, Row, Site, narrow};
use crate::math::{Float, Rgb};

/// A smooth dielectric interface; the inside is where the normal does not point.
#[derive(Clone, Copy, Debug)]
pub struct Glass;

impl Glass {
    /// The row of glass with this index of refraction of the inside over the outside, and these tints of what is
    /// reflected and transmitted.
    pub fn row(ior: f64, reflectance: [f64; 3], transmittance: [f64; 3]) -> Row {
        let [r, g, b] = narrow(transmittance);
        Row { numbers: [r, g, b, ior as f32, 0.0], ..Row::new(Kind::Glass, narrow(reflectance)) }
    }

    /// The transmittance and the index of refraction among the numbers of a row.
    #[inline(always)]
    pub fn unpack<F>([r, g, b, ior, _]: [F; NUMBERS]) -> ([F; 3], F) {
        ([r, g, b], ior)
    }
}

impl Leaf for Glass {
    type Lobe<F: Float> = Dielectric<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> Dielectric<F> {
        let ([r, g, b], ior) = Glass::unpack(numbers.further);
        Dielectric { ior, reflectance: numbers.colour, transmittance: Rgb::new(r, g, b) }
    }
}
