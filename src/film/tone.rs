//! Tone mapping: scene-linear radiance to the 8-bit codes of PNG files and screens.
//!
//! Exposure is a gain of 2^stops, then a [`Tone`] curve is applied, and values above white are clamped. A code
//! is the nearest of 256, halves rounded up. The thresholds between the codes are computed by the inverse function
//! once per [`ToneMap`], in `f64` and with `libm`'s power: no pixel needs a power, and all machines produce the
//! same picture.

pub use crate::math::colour::{linear_to_srgb, srgb_to_linear};
use crate::scene::{FilmSettings, Tone};

/// The conversion of radiance to display values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewTransform {
    /// Exposure in stops, applied first.
    pub exposure: f64,
    /// The tone curve.
    pub tone: Tone,
}

impl ViewTransform {
    /// The view transform of a film's settings.
    pub fn of(film: &FilmSettings) -> ViewTransform {
        ViewTransform { exposure: film.exposure, tone: film.tone }
    }

    /// The view transform for a picture file: with an sRGB curve in place of a raw one, because readers assume sRGB.
    pub fn of_file(self) -> ViewTransform {
        let tone = if self.tone == Tone::Linear { Tone::Srgb } else { self.tone };
        ViewTransform { tone, ..self }
    }

    /// sRGB with this exposure in stops.
    pub fn exposed(exposure: f64) -> ViewTransform {
        ViewTransform { exposure, tone: Tone::Srgb }
    }
}

/// The linear value that a curve maps to a code, in [0, 1).
fn inverse(tone: Tone, code: f64) -> f64 {
    match tone {
        Tone::Srgb => srgb_to_linear(code),
        Tone::Filmic => aces_inverse(srgb_to_linear(code)),
        Tone::Linear => code,
    }
}

/// Numerator and denominator of Narkowicz's fit of the ACES film curve, with its usual pre-exposure of 0.6;
/// highest power first.
const ACES: [[f64; 3]; 2] = [[0.36 * 2.51, 0.6 * 0.03, 0.0], [0.36 * 2.43, 0.6 * 0.59, 0.14]];

/// The ACES film curve for one linear channel, clamped to 0…1.
pub fn aces(x: f64) -> f64 {
    let [over, under] = ACES.map(|[square, linear, constant]| (square * x + linear) * x + constant);
    (over / under).min(1.0)
}

/// The linear value that the ACES film curve maps to `shown`, in [0, 1).
pub fn aces_inverse(shown: f64) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|power| ACES[0][power] - shown * ACES[1][power]);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

/// Below this every code is 0: the lowest first threshold, that of sRGB, is about 2⁻¹²·⁷.
const DARKEST: f32 = 1.0 / 8192.0;
/// Bits dropped from a float to get its bucket: with 128 buckets per octave, hardly one holds more than one threshold.
const BUCKET_SHIFT: u32 = 16;

/// The conversion of radiance to 8-bit codes by one view transform.
#[derive(Clone, Debug)]
pub struct ToneMap {
    gain: f32,
    /// `thresholds[c]` is the smallest value with code c; the last entry is unreachable.
    thresholds: Vec<f32>,
    /// The code of each bucket's lower edge, from `DARKEST` to white.
    codes: Vec<u8>,
}

impl ToneMap {
    /// The tone map of a view transform.
    pub fn new(view: ViewTransform) -> Self {
        let mut thresholds = vec![0.0];
        let least = |code: u8| inverse(view.tone, (f64::from(code) - 0.5) / 255.0);
        thresholds.extend((1..=255).map(|code| at_least(least(code))));
        let white = thresholds[255];
        thresholds.push(f32::INFINITY);

        let buckets = ((white.to_bits() - DARKEST.to_bits()) >> BUCKET_SHIFT) + 1;
        let mut code = 0u8;
        let codes = (0..buckets)
            .map(|bucket| {
                let edge = f32::from_bits(DARKEST.to_bits() + (bucket << BUCKET_SHIFT));
                while edge >= thresholds[usize::from(code) + 1] {
                    code += 1;
                }
                code
            })
            .collect();
        Self { gain: libm::exp2(view.exposure) as f32, thresholds, codes }
    }

    /// The 8-bit codes of a radiance.
    pub fn encode(&self, rgb: [f32; 3]) -> [u8; 3] {
        rgb.map(|linear| self.channel(linear * self.gain))
    }

    fn channel(&self, value: f32) -> u8 {
        if value >= self.thresholds[255] {
            return 255;
        }
        // Written such that NaN (zero radiance times an infinite gain) is also black.
        if !matches!(value.partial_cmp(&DARKEST), Some(std::cmp::Ordering::Greater)) {
            return 0;
        }
        let bucket = (value.to_bits() - DARKEST.to_bits()) >> BUCKET_SHIFT;
        let mut code = self.codes[bucket as usize];
        while value >= self.thresholds[usize::from(code) + 1] {
            code += 1;
        }
        code
    }
}

/// The smallest `f32` that is not below `value`.
fn at_least(value: f64) -> f32 {
    let rounded = value as f32;
    if f64::from(rounded) < value { rounded.next_up() } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, implemented directly.
    fn by_definition(curve: Tone, value: f32) -> u8 {
        let value = f64::from(value);
        let shown = match curve {
            Tone::Srgb => linear_to_srgb(value.clamp(0.0, 1.0)),
            Tone::Filmic => {
                let x = 0.6 * value;
                let film = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
                linear_to_srgb(film.clamp(0.0, 1.0))
            }
            Tone::Linear => value.clamp(0.0, 1.0),
        };
        (shown * 255.0 + 0.5).floor() as u8
    }

    #[test]
    fn tables_agree_with_the_definition() {
        for curve in Tone::ALL {
            let tone = ToneMap::new(ViewTransform { exposure: 0.0, tone: curve });
            let counted = (0..=200_000u32).map(|step| step as f32 / 190_000.0);
            let spread = (1e-6f32.to_bits()..20.0f32.to_bits()).step_by(997).map(f32::from_bits);
            for value in counted.chain(spread) {
                assert_eq!(tone.channel(value), by_definition(curve, value), "{curve:?} at {value}");
            }
            // Negative control: all curves differ.
            for other in Tone::ALL.into_iter().filter(|&other| other != curve) {
                assert_ne!(tone.channel(0.3), by_definition(other, 0.3), "{curve:?} and {other:?}");
            }
        }
    }

    #[test]
    fn codes_change_exactly_at_their_thresholds() {
        for curve in Tone::ALL {
            let tone = ToneMap::new(ViewTransform { exposure: 0.0, tone: curve });
            for code in 1..=255u8 {
                let threshold = tone.thresholds[usize::from(code)];
                assert_eq!(tone.channel(threshold), code, "{curve:?}");
                assert_eq!(tone.channel(threshold.next_down()), code - 1, "{curve:?}");
            }
        }
    }

    #[test]
    fn encoding_a_decoded_code_restores_it() {
        let tone = ToneMap::new(ViewTransform::exposed(0.0));
        for code in 0..=255u8 {
            assert_eq!(tone.channel(srgb_to_linear(f64::from(code) / 255.0) as f32), code);
        }
    }

    #[test]
    fn known_colours() {
        // 18% grey is 118 (117.6…) and half the light of white is 188 (187.5…) in sRGB.
        let tone = ToneMap::new(ViewTransform::exposed(0.0));
        assert_eq!(tone.encode([0.18, 0.5, 1.0]), [118, 188, 255]);
        assert_eq!(tone.encode([0.0, -1.0, 7.0]), [0, 0, 255]);
        assert_eq!(tone.encode([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]), [0, 255, 0]);
    }

    #[test]
    fn one_stop_doubles_the_radiance() {
        let (plain, brighter, darker) = (
            ToneMap::new(ViewTransform::exposed(0.0)),
            ToneMap::new(ViewTransform::exposed(1.0)),
            ToneMap::new(ViewTransform::exposed(-1.5)),
        );
        let rgb = [0.01, 0.1, 0.3];
        assert_eq!(brighter.encode(rgb), plain.encode(rgb.map(|c| c * 2.0)));
        assert_ne!(brighter.encode(rgb), plain.encode(rgb));
        let gain = 0.5f64.powf(1.5) as f32;
        assert_eq!(darker.encode(rgb), plain.encode(rgb.map(|c| c * gain)));
    }

    #[test]
    fn an_infinite_gain_keeps_black() {
        assert_eq!(ToneMap::new(ViewTransform::exposed(2000.0)).encode([0.0, 1e-30, 1.0]), [0, 255, 255]);
    }
}
