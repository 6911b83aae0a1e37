//! Metals, smooth and rough.

use super::kind::Kind;
use super::lobes::{Ggx, LEAST_ALPHA, Metal, RoughMetal, SmoothMetal};
use super::metals::{INDICES, Index, NAMES};
use super::program::{Leaf, MaterialParameters};
use super::row::{Numbers, Row, Site, padded};
use crate::math::{Float, Rgb, narrow};
use crate::parameter::{Colour, Number, ParameterKind, Problem, Word, parameters};

parameters! {
    /// A metal: reflects on both sides, by the Fresnel equations for conductors. It has either a metal's name, or eta
    /// and k.
    pub struct ConductorParameters: "conductor", "a conductor" {
        /// The name of a metal with a known index of refraction, instead of eta and k.
        metal: Option<Word> = ParameterKind::Word(NAMES) => nothing,
        /// The index of refraction η relative to the outside: red, green, blue.
        eta: Option<Colour> = ParameterKind::Colour(Number::positive(1e-3, 1e3)) => nothing,
        /// The extinction coefficient k: red, green, blue.
        k: Option<Colour> = ParameterKind::Colour(Number::between(0.0, 1e3)) => nothing,
        /// Roughness, 0 to 1. Its square is α of a GGX distribution of microfacets: one number, or one along u and one
        /// along v. Below 0.01 the surface is perfectly smooth.
        roughness: [f64; 2] = ParameterKind::Pair(Number::between(0.0, 1.0)) => "0",
    }
    check = check;
    rules = r#"{
        "oneOf": [
            { "required": ["metal"], "not": { "anyOf": [{ "required": ["eta"] }, { "required": ["k"] }] } },
            { "required": ["eta", "k"], "not": { "required": ["metal"] } }
        ]
    }"#;
}

/// Checks that the index of refraction is given in one way, and replaces a name by its index.
fn check(
    parameters: ConductorParameters,
    _warnings: &mut Vec<Problem>,
) -> Result<ConductorParameters, Problem> {
    let problem = |parameter, message: &str, help: Option<&str>| {
        Err(Problem { parameter, message: message.into(), help: help.map(Into::into) })
    };
    let is_unknown = |colour: Option<Colour>| colour.into_iter().flatten().any(f64::is_nan);
    match parameters {
        ConductorParameters { metal: Some(Word(place)), .. } if place >= NAMES.len() => Ok(parameters),
        ConductorParameters { eta, k, .. } if is_unknown(eta) || is_unknown(k) => Ok(parameters),
        ConductorParameters { metal: None, eta: None, k: None, .. } => problem(
            "metal",
            "a conductor needs either metal or both eta and k",
            Some("for example: metal = \"gold\""),
        ),
        ConductorParameters { metal: Some(_), eta: Some(_), .. } => {
            problem("eta", "the conductor has both metal and eta", Some("keep one of them"))
        }
        ConductorParameters { metal: Some(_), k: Some(_), .. } => {
            problem("k", "the conductor has both metal and k", Some("keep one of them"))
        }
        ConductorParameters { eta: Some(_), k: None, .. } => {
            problem("eta", "the conductor has eta but no k", Some("give both"))
        }
        ConductorParameters { eta: None, k: Some(_), .. } => {
            problem("k", "the conductor has k but no eta", Some("give both"))
        }
        ConductorParameters { metal: Some(Word(place)), .. } => Ok(match INDICES.get(place) {
            Some(&Index { eta, k }) => {
                ConductorParameters { metal: None, eta: Some(eta), k: Some(k), ..parameters }
            }
            None => parameters,
        }),
        both => Ok(both),
    }
}

impl ConductorParameters {
    /// The index of refraction; that of the outside if none is given, which reflects nothing.
    fn index(&self) -> [Colour; 2] {
        let named = self.metal.and_then(|Word(place)| INDICES.get(place));
        let (eta, k) = named.map_or((self.eta, self.k), |named| (Some(named.eta), Some(named.k)));
        [eta.unwrap_or([1.0; 3]), k.unwrap_or([0.0; 3])]
    }
}

/// α along u and along v; `None` if the surface is smooth.
pub(super) fn alpha(roughness: [f64; 2]) -> Option<[f32; 2]> {
    let [along_u, along_v] = roughness.map(|roughness| (roughness * roughness) as f32);
    let is_smooth = along_u < LEAST_ALPHA && along_v < LEAST_ALPHA;
    (!is_smooth).then(|| [along_u.max(LEAST_ALPHA), along_v.max(LEAST_ALPHA)])
}

impl MaterialParameters for ConductorParameters {
    fn row(&self) -> Row {
        let [eta, k] = self.index().map(narrow);
        let ([er, eg, eb], [kr, kg, kb]) = (eta, k);
        // It has no colour apart from its index, but it is not black.
        let row = |kind| Row::new(kind, [1.0; 3]);
        match alpha(self.roughness) {
            None => Row { numbers: padded([er, eg, eb, kr, kg, kb]), ..row(Kind::SmoothConductor) },
            Some([along_u, along_v]) => Row {
                numbers: [er, eg, eb, kr, kg, kb, along_u, along_v],
                is_anisotropic: along_u != along_v,
                ..row(Kind::Conductor)
            },
        }
    }
}

/// The metal of a row.
#[inline(always)]
fn metal<F: Float>(numbers: &Numbers<F>) -> Metal<F> {
    let [er, eg, eb, kr, kg, kb, ..] = numbers.further;
    Metal { eta: Rgb::new(er, eg, eb), k: Rgb::new(kr, kg, kb) }
}

/// A rough metal.
#[derive(Clone, Copy, Debug)]
pub struct Conductor;

impl Leaf for Conductor {
    type Lobe<F: Float> = RoughMetal<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> RoughMetal<F> {
        let [.., along_u, along_v] = numbers.further;
        RoughMetal { metal: metal(numbers), normals: Ggx { alpha: [along_u, along_v] } }
    }
}

/// A smooth metal.
#[derive(Clone, Copy, Debug)]
pub struct SmoothConductor;

impl Leaf for SmoothConductor {
    type Lobe<F: Float> = SmoothMetal<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> SmoothMetal<F> {
        SmoothMetal { metal: metal(numbers) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lobes::fresnel_conductor;
    use super::*;

    #[test]
    fn names_have_their_indices() {
        let named = |name| {
            let place = NAMES.iter().position(|known| *known == name).unwrap();
            ConductorParameters { metal: Some(Word(place)), eta: None, k: None, roughness: [0.0; 2] }
        };
        let gold = check(named("gold"), &mut Vec::new()).unwrap();
        assert_eq!((gold.metal, gold.eta.is_some(), gold.k.is_some()), (None, true, true));
        assert_eq!(gold.row(), named("gold").row());
        // Reflectances at normal incidence of spectra under D65, in linear Rec. 709, as printed by `benches/metals.py`;
        // red of gold is out of gamut (1.04).
        let reflectances = [
            ("aluminium", [0.907, 0.916, 0.922]),
            ("beryllium", [0.539, 0.533, 0.534]),
            ("brass", [0.910, 0.778, 0.423]),
            ("chromium", [0.550, 0.556, 0.554]),
            ("cobalt", [0.683, 0.655, 0.616]),
            ("copper", [0.932, 0.623, 0.522]),
            ("gold", [0.980, 0.728, 0.365]),
            ("iron", [0.530, 0.513, 0.494]),
            ("lead", [0.657, 0.661, 0.693]),
            ("manganese", [0.603, 0.574, 0.541]),
            ("mercury", [0.781, 0.779, 0.778]),
            ("nickel", [0.697, 0.640, 0.563]),
            ("niobium", [0.500, 0.507, 0.501]),
            ("palladium", [0.733, 0.697, 0.652]),
            ("platinum", [0.679, 0.640, 0.584]),
            ("rhodium", [0.797, 0.765, 0.742]),
            ("silver", [0.989, 0.984, 0.978]),
            ("titanium", [0.619, 0.579, 0.543]),
            ("tungsten", [0.516, 0.496, 0.467]),
            ("vanadium", [0.520, 0.535, 0.567]),
        ];
        assert_eq!(reflectances.map(|(name, _)| name), NAMES);
        for (name, expected) in reflectances {
            let [eta, k] = named(name).index().map(narrow);
            for (i, expected) in expected.into_iter().enumerate() {
                let ours = fresnel_conductor(1.0_f32, eta[i], k[i]);
                assert!((ours - expected).abs() < 0.02, "{name}: {ours}, not {expected}");
            }
        }
        assert!(NAMES.is_sorted(), "one finds a name sooner");
    }

    #[test]
    fn smooth_and_rough_metals_have_separate_programs() {
        let row =
            |roughness| ConductorParameters { metal: Some(Word(0)), eta: None, k: None, roughness }.row();
        assert_eq!(row([0.0; 2]).kind, Kind::SmoothConductor);
        assert_eq!(row([0.0099; 2]).kind, Kind::SmoothConductor);
        let brushed = row([0.0, 0.5]);
        assert_eq!((brushed.kind, brushed.is_anisotropic), (Kind::Conductor, true));
        assert_eq!(brushed.numbers[6..], [LEAST_ALPHA, 0.25]);
        assert!(!row([0.5; 2]).is_anisotropic);
    }
}
