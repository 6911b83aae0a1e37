//! Tone mapping: scene-linear radiance to the 8-bit sRGB of PNG files and screens.
//!
//! Exposure is a gain of 2^stops; then comes the transfer function of IEC 61966-2-1, and what is brighter
//! than white is white. A code is the nearest of 256, halves upwards. The thresholds between the codes are
//! found by the inverse function once per [`ToneMap`], in `f64` and with `libm`'s power: no pixel takes a
//! power, and every machine draws the same picture.

/// The encoded value in [0, 1] of a linear one in [0, 1].
pub fn linear_to_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// The linear value in [0, 1] of an encoded one in [0, 1].
pub fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// Below this every code is 0: the first threshold is about 2⁻¹²·⁷.
const DARKEST: f32 = 1.0 / 8192.0;
/// Bits dropped from a float to get its bucket: 128 buckets to the octave hold at most one threshold each.
const BUCKET_SHIFT: u32 = 16;

/// Radiance to 8-bit sRGB at one exposure.
#[derive(Clone, Debug)]
pub struct ToneMap {
    gain: f32,
    /// `thresholds[c]` is the smallest value with code c; one more that nothing reaches ends the list.
    thresholds: Vec<f32>,
    /// The code of each bucket's lower edge, from `DARKEST` to 1.
    codes: Vec<u8>,
}

impl ToneMap {
    /// A tone map that brightens by `exposure` stops.
    pub fn new(exposure: f64) -> Self {
        let mut thresholds = vec![0.0];
        thresholds.extend((1..=255).map(|code| at_least(srgb_to_linear((f64::from(code) - 0.5) / 255.0))));
        thresholds.push(f32::INFINITY);

        let buckets = (1.0f32.to_bits() - DARKEST.to_bits()) >> BUCKET_SHIFT;
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
        Self { gain: libm::exp2(exposure) as f32, thresholds, codes }
    }

    /// The 8-bit sRGB colour of a radiance.
    pub fn encode(&self, rgb: [f32; 3]) -> [u8; 3] {
        rgb.map(|linear| self.channel(linear * self.gain))
    }

    fn channel(&self, value: f32) -> u8 {
        if value >= 1.0 {
            return 255;
        }
        // Written so that NaN (no radiance times an endless gain) is black as well.
        if !matches!(value.partial_cmp(&DARKEST), Some(std::cmp::Ordering::Greater)) {
            return 0;
        }
        let bucket = (value.to_bits() - DARKEST.to_bits()) >> BUCKET_SHIFT;
        let code = self.codes[bucket as usize];
        code + u8::from(value >= self.thresholds[usize::from(code) + 1])
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

    /// The definition, word for word.
    fn by_definition(value: f32) -> u8 {
        (linear_to_srgb(f64::from(value).clamp(0.0, 1.0)) * 255.0 + 0.5).floor() as u8
    }

    #[test]
    fn table_agrees_with_the_definition() {
        let tone = ToneMap::new(0.0);
        for step in 0..=200_000u32 {
            let value = step as f32 / 190_000.0;
            assert_eq!(tone.channel(value), by_definition(value), "at {value}");
        }
        for bits in (1e-6f32.to_bits()..2.0f32.to_bits()).step_by(997) {
            let value = f32::from_bits(bits);
            assert_eq!(tone.channel(value), by_definition(value), "at {value}");
        }
    }

    #[test]
    fn codes_change_exactly_at_their_thresholds() {
        let tone = ToneMap::new(0.0);
        for code in 1..=255u8 {
            let threshold = tone.thresholds[usize::from(code)];
            assert_eq!(tone.channel(threshold), code);
            assert_eq!(tone.channel(threshold.next_down()), code - 1);
        }
    }

    #[test]
    fn decoding_a_code_and_encoding_it_gives_the_code() {
        let tone = ToneMap::new(0.0);
        for code in 0..=255u8 {
            assert_eq!(tone.channel(srgb_to_linear(f64::from(code) / 255.0) as f32), code);
        }
    }

    #[test]
    fn known_colours() {
        // 18% grey is 118 (117.6…) and half the light of white is 188 (187.5…) in sRGB.
        let tone = ToneMap::new(0.0);
        assert_eq!(tone.encode([0.18, 0.5, 1.0]), [118, 188, 255]);
        assert_eq!(tone.encode([0.0, -1.0, 7.0]), [0, 0, 255]);
        assert_eq!(tone.encode([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]), [0, 255, 0]);
    }

    #[test]
    fn a_stop_doubles_the_light() {
        let (plain, brighter, darker) = (ToneMap::new(0.0), ToneMap::new(1.0), ToneMap::new(-1.5));
        let rgb = [0.01, 0.1, 0.3];
        assert_eq!(brighter.encode(rgb), plain.encode(rgb.map(|c| c * 2.0)));
        assert_ne!(brighter.encode(rgb), plain.encode(rgb));
        let gain = 0.5f64.powf(1.5) as f32;
        assert_eq!(darker.encode(rgb), plain.encode(rgb.map(|c| c * gain)));
    }

    #[test]
    fn an_endless_gain_leaves_black_black() {
        assert_eq!(ToneMap::new(2000.0).encode([0.0, 1e-30, 1.0]), [0, 255, 255]);
    }
}
