//! Spectra, and their conversion to colours.
//!
//! Colours in a scene are linear Rec. 709. A spectrum becomes a colour when it is read, as in Mitsuba's `rgb` variants:
//! X = Σ S(λ)·x̄(λ)·Δλ / Σ ȳ(λ)·Δλ, and likewise Y and Z. For reflectances S is multiplied by D65, and the sum is
//! normalised so that Y = 1 for a reflectance of 1. Spectra of light and indices of refraction are not multiplied. Colours
//! outside the gamut of Rec. 709 are clipped.

use super::cie::{WAVELENGTHS, WEIGHTS, wavelength};
use super::text::{number, words};
use std::sync::Arc;

/// A spectrum.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Spectrum {
    /// The same value at all wavelengths.
    Uniform(f64),
    /// Wavelengths in nm, in increasing order, and values. It is interpolated linearly, and 0 outside.
    Samples(Arc<[[f64; 2]]>),
}

/// The quantity of a spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Of {
    /// The fraction of light that is reflected or transmitted.
    Reflectance,
    /// Emitted light.
    Light,
    /// Another quantity, such as an index of refraction or a roughness.
    Number,
}

/// From XYZ to linear Rec. 709 (IEC 61966-2-1).
const FROM_XYZ: [[f64; 3]; 3] =
    [[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]];

impl Spectrum {
    /// Parses one number, or pairs `wavelength:value`.
    pub(super) fn parse(text: &str) -> Result<Spectrum, String> {
        if !text.contains(':') {
            let mut words = words(text);
            let value = words.next().and_then(number).filter(|_| words.next().is_none());
            let message = "a spectrum is one number, or pairs of a wavelength and a value: 400:0.2, 700:0.5";
            return value.map(Spectrum::Uniform).ok_or_else(|| message.into());
        }
        let pair = |word: &str| {
            let (wavelength, value) = word.split_once(':')?;
            Some([number(wavelength)?, number(value)?])
        };
        let samples: Option<Vec<_>> = words(text).map(pair).collect();
        samples.ok_or_else(|| "a pair of a spectrum is written 400:0.2".into()).and_then(Self::of)
    }

    /// Parses the text of a file with a wavelength and a value on each line.
    pub(super) fn of_file(text: &str) -> Result<Spectrum, String> {
        let mut samples = Vec::new();
        for (line, given) in text.lines().enumerate() {
            let given = given.split('#').next().unwrap_or_default().trim();
            if given.is_empty() {
                continue;
            }
            let mut words = words(given);
            match (words.next().and_then(number), words.next().and_then(number), words.next()) {
                (Some(wavelength), Some(value), None) => samples.push([wavelength, value]),
                _ => return Err(format!("line {} is not a wavelength and a value", line + 1)),
            }
        }
        Self::of(samples)
    }

    /// A spectrum of samples. There must be two or more, in increasing order.
    pub(super) fn of(samples: Vec<[f64; 2]>) -> Result<Spectrum, String> {
        if samples.len() < 2 {
            return Err("a spectrum needs two wavelengths or more".into());
        }
        if samples.windows(2).any(|pair| pair[0][0] >= pair[1][0]) {
            return Err("the wavelengths of a spectrum must increase".into());
        }
        Ok(Spectrum::Samples(samples.into()))
    }

    /// The spectrum of a black body by Planck's law, between two wavelengths in nm. The temperature is in K, the
    /// radiance in W/(m² sr nm).
    pub(super) fn black_body(temperature: f64, [low, high]: [f64; 2]) -> Result<Spectrum, String> {
        const H: f64 = 6.626_070_15e-34;
        const C: f64 = 299_792_458.0;
        const K: f64 = 1.380_649e-23;
        if !(temperature > 0.0 && temperature <= 1e6) {
            return Err("a temperature must be above 0 and at most 1e6 K".into());
        }
        let at = |nanometres: f64| {
            let wavelength = nanometres * 1e-9;
            let exponent = H * C / (K * wavelength * temperature);
            2e-9 * H * C * C / (wavelength.powi(5) * (libm::exp(exponent) - 1.0))
        };
        let (low, high) = (low.max(WAVELENGTHS[0]), high.min(WAVELENGTHS[1]));
        if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
            return Err("a black body needs some wavelengths between 360 and 830 nm".into());
        }
        Self::of((0..=94).map(|i| low + (high - low) * f64::from(i) / 94.0).map(|w| [w, at(w)]).collect())
    }

    /// The colour of the spectrum.
    pub(super) fn colour(&self, of: Of) -> [f64; 3] {
        let samples = match self {
            // A uniform spectrum is not white, as the white of Rec. 709 is D65.
            Spectrum::Uniform(value) if of == Of::Light => {
                return FROM_XYZ.map(|row| row.iter().sum::<f64>() * value);
            }
            Spectrum::Uniform(value) => return [*value; 3],
            Spectrum::Samples(samples) => samples,
        };
        let is_reflectance = of == Of::Reflectance;
        let weights = if is_reflectance { &WEIGHTS.reflectance } else { &WEIGHTS.light };
        let mut xyz = [0.0; 3];
        for (row, weight) in weights.iter().enumerate() {
            let value = at(samples, wavelength(row));
            xyz.iter_mut().zip(weight).for_each(|(sum, weight)| *sum += value * weight);
        }
        let most = if is_reflectance { 1.0 } else { f64::INFINITY };
        FROM_XYZ.map(|row| (0..3).map(|i| row[i] * xyz[i]).sum::<f64>().clamp(0.0, most))
    }
}

/// The value of samples at a wavelength.
fn at(samples: &[[f64; 2]], wavelength: f64) -> f64 {
    let next = samples.partition_point(|sample| sample[0] <= wavelength);
    match (next.checked_sub(1).map(|before| samples[before]), samples.get(next)) {
        (Some([w0, v0]), Some(&[w1, v1])) => v0 + (v1 - v0) * (wavelength - w0) / (w1 - w0),
        (Some([w0, v0]), None) if w0 == wavelength => v0,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f64; 3], b: [f64; 3], by: f64) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by)
    }

    #[test]
    fn spectra_are_read() {
        assert_eq!(Spectrum::parse(" 0.5 "), Ok(Spectrum::Uniform(0.5)));
        let pairs = Spectrum::Samples([[400.0, 0.0], [700.0, 2.0]].into());
        assert_eq!(Spectrum::parse("400:0, 700:2"), Ok(pairs.clone()));
        assert_eq!(Spectrum::of_file("# nm value\n400 0\n\n700 2 # red\n"), Ok(pairs));
        for wrong in ["", "1 2", "400:1", "400:1 300:2", "400:1 400:2", "400:x 500:1", "400:1 500"] {
            assert!(Spectrum::parse(wrong).is_err(), "{wrong}");
        }
        assert_eq!(Spectrum::of_file("400 1\nx\n"), Err("line 2 is not a wavelength and a value".into()));
    }

    #[test]
    fn a_flat_reflectance_is_grey_and_a_flat_light_is_not() {
        let flat = Spectrum::Samples([[300.0, 0.5], [900.0, 0.5]].into());
        assert!(near(flat.colour(Of::Reflectance), [0.5; 3], 1e-3), "{:?}", flat.colour(Of::Reflectance));
        // Equal energy (x = y = 1/3) is redder than D65.
        let light = flat.colour(Of::Light);
        assert!(near(light, [0.602, 0.474, 0.455], 2e-3), "{light:?}");
        assert!(near(Spectrum::Uniform(0.5).colour(Of::Light), [0.602, 0.474, 0.454], 1e-3));
        assert_eq!(Spectrum::Uniform(0.5).colour(Of::Number), [0.5; 3]);
        // Monochromatic light of 520 nm is outside the gamut, and is clipped.
        let green = Spectrum::Samples([[515.0, 0.0], [520.0, 100.0], [525.0, 0.0]].into());
        let [red, g, _] = green.colour(Of::Light);
        assert!(red == 0.0 && g > 1.0);
    }

    /// The results of `spectrum_list_to_srgb` of Mitsuba 3.9.1 for the same samples, as light and as reflectances. The
    /// observer is a formula here and a table there.
    #[test]
    fn colours_are_those_of_mitsuba() {
        let of = |samples: &[[f64; 2]]| Spectrum::of(samples.to_vec()).expect("a spectrum");
        let body = |kelvin| Spectrum::black_body(kelvin, WAVELENGTHS).expect("a spectrum");
        let ramp = of(&[[400.0, 0.1], [500.0, 0.2], [600.0, 0.6], [700.0, 0.9]]);
        let hills = [
            [400.0, 0.1],
            [450.0, 0.2],
            [500.0, 0.3],
            [550.0, 0.2],
            [600.0, 0.5],
            [650.0, 0.6],
            [700.0, 0.65],
        ];
        let step = of(&[[360.0, 0.05], [579.0, 0.05], [581.0, 0.8], [830.0, 0.8]]);
        let lights = [
            (body(2000.0), [16.0163, 4.11327, 0.130966]),
            (body(3000.0), [733.097, 349.574, 112.734]),
            (body(6504.0), [44015.0, 41511.8, 43716.1]),
            (ramp.clone(), [0.872774, 0.34597, 0.102482]),
            (of(&hills), [0.673771, 0.251436, 0.17093]),
            (step.clone(), [1.0907, 0.0746254, 0.0213312]),
        ];
        let reflectances = [
            (ramp, [0.753468, 0.361815, 0.119093]),
            (of(&hills), [0.575538, 0.265101, 0.193785]),
            (step, [0.958204, 0.0781245, 0.0281517]),
        ];
        let check = |spectrum: &Spectrum, of: Of, theirs: [f64; 3], tolerance: f64| {
            let ours = spectrum.colour(of);
            let brightest = theirs.into_iter().fold(0.0, f64::max);
            assert!(near(ours, theirs, tolerance * brightest), "{of:?} {ours:?} {theirs:?}");
        };
        lights.iter().for_each(|(spectrum, theirs)| check(spectrum, Of::Light, *theirs, 6e-4));
        reflectances.iter().for_each(|(spectrum, theirs)| check(spectrum, Of::Reflectance, *theirs, 1e-3));
    }

    #[test]
    fn a_black_body_of_6504_kelvin_is_nearly_white_and_one_of_2000_is_red() {
        let chromaticity = |kelvin| {
            let [r, g, b] = Spectrum::black_body(kelvin, WAVELENGTHS).unwrap().colour(Of::Light);
            [r / g, b / g]
        };
        let [red, blue] = chromaticity(6504.0);
        assert!((red - 1.0).abs() < 0.08 && (blue - 1.0).abs() < 0.08, "{red} {blue}");
        let [red, blue] = chromaticity(2000.0);
        assert!(red > 2.0 && blue < 0.2, "{red} {blue}");
        assert!(Spectrum::black_body(0.0, WAVELENGTHS).is_err());
        assert!(Spectrum::black_body(f64::NAN, WAVELENGTHS).is_err());
        assert!(Spectrum::black_body(5000.0, [500.0, 400.0]).is_err());
    }
}
