//! Numbers, colours and textures of materials and lights.

use super::builder::Builder;
use super::object::{Object, Property, Tag, Value};
use super::report::Read;
use super::shade::{Shade, Taken};
use super::spectrum::{Of, Spectrum};
use super::text::numbers;
use crate::parameter::{ImageIndex, Varying};
use crate::scene::description::{CheckerboardTexture, ConstantTexture, ImageTexture};
use crate::scene::spelling::quote;
use crate::texture::{ColorSpace, TexelFilter, Wrap};
use glam::{DMat2, DMat4, DVec2};

impl Builder<'_, '_> {
    /// A property that may be a number, a colour, a spectrum or a texture.
    pub(super) fn shade(&mut self, object: &Object, name: &str, default: f64, of: Of) -> Read<Shade> {
        self.taken(object, name, default, Taken::Colour(of))
    }

    /// A property that may be a number, or a texture of which one number is used.
    pub(super) fn scalar(&mut self, object: &Object, name: &str, default: f64) -> Read<Shade> {
        self.taken(object, name, default, Taken::Number)
    }

    fn taken(&mut self, object: &Object, name: &str, default: f64, taken: Taken) -> Read<Shade> {
        match object.find(name) {
            None => Ok(Shade::Colour([default; 3])),
            Some(property) => self.shade_of(object, property, default, taken),
        }
    }

    /// The roughness for a property that is the α of a microfacet distribution: roughness = √α.
    pub(super) fn roughness(&mut self, object: &Object, name: &str, default: f64) -> Read<Shade> {
        Ok(match self.taken(object, name, default, Taken::Alpha)? {
            Shade::Colour(alpha) => Shade::Colour(alpha.map(f64::sqrt)),
            texture => texture,
        })
    }

    /// A property that cannot be a texture. A texture is reported, and replaced by the default.
    pub(super) fn colour(&mut self, object: &Object, name: &str, default: f64, of: Of) -> Read<[f64; 3]> {
        let shade = self.shade(object, name, default, of)?;
        if matches!(shade, Shade::Texture(_)) {
            let what = format!("a texture as {name} of {}", object.what());
            self.reports.lacks(object.place, what, "its default is rendered instead");
        }
        Ok(shade.colour_or([default; 3]))
    }

    fn shade_of(&mut self, object: &Object, property: &Property, default: f64, taken: Taken) -> Read<Shade> {
        Ok(Shade::Colour(match &property.value {
            Value::Number(number) => [*number; 3],
            Value::Whole(number) => [*number as f64; 3],
            Value::Rgb(colour) => *colour,
            Value::Spectrum(spectrum) => spectrum.colour(taken.of()),
            &Value::Object(index) if self.document.objects[index].tag == Tag::Texture => {
                return self.texture(index, default, taken);
            }
            _ => {
                let message =
                    format!("{} of {} must be a number, a colour or a texture", property.name, object.what());
                return Err(self.reports.error(property.place, message));
            }
        }))
    }

    /// The texture of a normal map or a bump map, which may be constant.
    pub(super) fn map(&mut self, index: usize) -> Read<usize> {
        Ok(match self.texture(index, 0.5, Taken::Colour(Of::Number))? {
            Shade::Texture(texture) => texture,
            Shade::Colour(colour) => {
                let value = Varying::Colour(colour);
                self.add_texture(self.object(index), ConstantTexture { value })
            }
        })
    }

    /// The texture of an object with the tag `texture`. It is converted once for each purpose.
    fn texture(&mut self, index: usize, default: f64, taken: Taken) -> Read<Shade> {
        let purpose = (index, taken, default.to_bits());
        if let Some(&known) = self.shades.get(&purpose) {
            return known;
        }
        let shade = self.new_texture(index, default, taken);
        self.shades.insert(purpose, shade);
        shade
    }

    fn new_texture(&mut self, index: usize, default: f64, taken: Taken) -> Read<Shade> {
        let (object, of) = (self.object(index), taken.of());
        let spectrum = match object.plugin.as_str() {
            "bitmap" => return self.bitmap(index, default, taken),
            "checkerboard" => return self.checkerboard(index, taken),
            "srgb" => return self.shade(object, "color", default, of),
            "uniform" => return self.shade(object, "value", 1.0, of),
            "rawconstant" => {
                let property = object.find("value");
                return match property.map(|property| &property.value) {
                    Some(Value::Triple(value)) => Ok(Shade::Colour(*value)),
                    _ => self.shade(object, "value", default, Of::Number),
                };
            }
            "d65" => {
                // D65 is white in Rec. 709.
                let scale = object.number("scale", 1.0, self.reports)?;
                let colour = self.colour(object, "color", 1.0, Of::Number)?;
                return Ok(Shade::Colour(colour.map(|channel| channel * scale)));
            }
            "blackbody" => self.black_body(object)?,
            "regular" | "irregular" => self.samples(object)?,
            other => {
                let what = format!("texture {}", quote(other));
                object.ignore_all();
                self.reports.lacks(object.place, what, "the default of the parameter is rendered instead");
                return Ok(Shade::Colour([default; 3]));
            }
        };
        Ok(Shade::Colour(spectrum.colour(of)))
    }

    fn black_body(&mut self, object: &Object) -> Read<Spectrum> {
        let temperature = object.number("temperature", f64::NAN, self.reports)?;
        let low = object.number("wavelength_min", 360.0, self.reports)?;
        let high = object.number("wavelength_max", 830.0, self.reports)?;
        let body = Spectrum::black_body(temperature, [low, high]);
        body.map_err(|message| self.reports.error(object.place, message))
    }

    fn samples(&mut self, object: &Object) -> Read<Spectrum> {
        if let Some(Property { value: Value::Spectrum(spectrum), .. }) = object.find("value") {
            return Ok(spectrum.clone());
        }
        let list = |name: &str, reports: &mut super::report::Reports| {
            let text = object.text(name, reports)?;
            let list = text.and_then(|(text, _)| numbers(text));
            list.ok_or_else(|| {
                let message = format!("{} of {} must be a list of numbers", name, object.what());
                reports.error(text.map_or(object.place, |(_, place)| place), message)
            })
        };
        let values = list("values", self.reports)?;
        let wavelengths = if object.plugin == "irregular" {
            list("wavelengths", self.reports)?
        } else {
            let low = object.number("wavelength_min", 360.0, self.reports)?;
            let high = object.number("wavelength_max", 830.0, self.reports)?;
            let last = values.len().saturating_sub(1).max(1) as f64;
            (0..values.len()).map(|i| low + (high - low) * i as f64 / last).collect()
        };
        if wavelengths.len() != values.len() {
            let message = format!("{} wavelengths and {} values", wavelengths.len(), values.len());
            return Err(self.reports.error(object.place, message));
        }
        let pairs =
            wavelengths.into_iter().zip(values).map(|(wavelength, value)| [wavelength, value]).collect();
        Spectrum::of(pairs).map_err(|message| self.reports.error(object.place, message))
    }

    fn bitmap(&mut self, index: usize, default: f64, taken: Taken) -> Read<Shade> {
        let object = self.object(index);
        if taken == Taken::Alpha {
            // stride would interpolate square roots of texels, where Mitsuba interpolates the texels.
            let what = "a bitmap as the alpha of a bsdf";
            self.reports.lacks(object.place, what, "the default of alpha is rendered instead");
            return Ok(Shade::Colour([default; 3]));
        }
        if let Some(&known) = self.textures.get(&(index, None)) {
            return Ok(Shade::Texture(known));
        }
        object.ignore(&["format", "accel"]);
        let raw = object.flag("raw", false, self.reports)?;
        let filters = [("bilinear", TexelFilter::Linear), ("nearest", TexelFilter::Nearest)];
        let filter = object.word("filter_type", &filters, self.reports)?;
        let wraps = [("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)];
        let wrap = object.word("wrap_mode", &wraps, self.reports)?;
        let to_uv = self.uv_transform(object)?;
        let placed = match Placement::of_picture(to_uv) {
            Some(placed) => placed,
            None => {
                let what = "a to_uv that shears a bitmap";
                self.reports.lacks(object.place, what, "it is left out");
                Placement { scale: [1.0, -1.0], offset: [0.0, 1.0], rotate: 0.0 }
            }
        };
        let file = ImageIndex(self.image(object, "filename")?);
        let texture = ImageTexture {
            file,
            color_space: if raw { ColorSpace::Data } else { ColorSpace::Auto },
            wrap: [wrap; 2],
            filter,
            mipmap: false,
            uv_scale: placed.scale,
            uv_offset: placed.offset,
            uv_rotate: placed.rotate,
            uv_set: 0.0,
        };
        let texture = self.add_texture(object, texture);
        self.textures.insert((index, None), texture);
        Ok(Shade::Texture(texture))
    }

    /// A checkerboard. Where Mitsuba takes one number from it, its two values change places (`eval_1`, version 3.9.1).
    fn checkerboard(&mut self, index: usize, taken: Taken) -> Read<Shade> {
        let object = self.object(index);
        if let Some(&known) = self.textures.get(&(index, Some(taken))) {
            return Ok(Shade::Texture(known));
        }
        let mut check = |name: &str, default: f64| {
            let shade = match taken {
                Taken::Alpha => self.roughness(object, name, default)?,
                Taken::Colour(_) | Taken::Number => self.taken(object, name, default, taken)?,
            };
            Ok(match shade {
                Shade::Colour(colour) => Varying::Colour(colour),
                Shade::Texture(texture) => {
                    let what = "a texture in a checkerboard";
                    self.reports.lacks(object.place, what, "it is scaled into each check");
                    Varying::Texture(texture)
                }
            })
        };
        let (even, odd) = (check("color0", 0.4)?, check("color1", 0.2)?);
        let to_uv = self.uv_transform(object)?;
        let (checks_per_unit, turned) = match checks(to_uv) {
            Some(checks) => checks,
            None => {
                let what = "a to_uv that rotates a checkerboard, or moves it by a fraction of a check";
                self.reports.lacks(object.place, what, "it is left out");
                ([2.0; 2], false)
            }
        };
        let is_number = !matches!(taken, Taken::Colour(_));
        let (even, odd) = if turned != is_number { (odd, even) } else { (even, odd) };
        let texture = self.add_texture(object, CheckerboardTexture { even, odd, checks_per_unit });
        self.textures.insert((index, Some(taken)), texture);
        Ok(Shade::Texture(texture))
    }

    /// The linear part and the offset of a transform of uv.
    fn uv_transform(&mut self, object: &Object) -> Read<(DMat2, DVec2)> {
        let transform = object.transform("to_uv", self.reports)?.map_or(DMat4::IDENTITY, |(t, _)| t);
        let at = |row: usize, column: usize| transform.col(column)[row];
        let linear = DMat2::from_cols(DVec2::new(at(0, 0), at(1, 0)), DVec2::new(at(0, 1), at(1, 1)));
        Ok((linear, DVec2::new(at(0, 3), at(1, 3))))
    }
}

/// The transform of uv for a picture: scale, then rotation, then offset.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placement {
    scale: [f64; 2],
    offset: [f64; 2],
    /// In degrees.
    rotate: f64,
}

impl Placement {
    /// The transform for a picture. Its first row is at v = 0 in Mitsuba and at v = 1 in stride, so v becomes 1 − v.
    /// There is none if `to_uv` shears.
    fn of_picture((linear, offset): (DMat2, DVec2)) -> Option<Placement> {
        let down = |v: DVec2| DVec2::new(v.x, -v.y);
        let (u, v) = (down(linear.x_axis), down(linear.y_axis));
        let (scale_u, turn) = match u.y {
            0.0 => (u.x, DVec2::X),
            _ => (u.length(), u.normalize()),
        };
        let scale_v = v.dot(turn.perp());
        let is_square = v.dot(turn).abs() <= 1e-6 * v.length();
        let rotate = libm::atan2(turn.y, turn.x).to_degrees();
        (is_square && turn.is_finite()).then_some(Placement {
            scale: [scale_u, scale_v],
            offset: [offset.x, 1.0 - offset.y],
            rotate,
        })
    }
}

/// Checks per unit, and whether the two colours are exchanged, for a checkerboard with two checks per unit of
/// transformed uv. There is no result for a rotation, or for an offset by a fraction of a check.
fn checks((linear, offset): (DMat2, DVec2)) -> Option<([f64; 2], bool)> {
    let straight = linear.x_axis.y == 0.0 && linear.y_axis.x == 0.0;
    let scale = DVec2::new(linear.x_axis.x, linear.y_axis.y) * 2.0;
    let moved = offset * 2.0;
    let whole = moved.round();
    if !straight || (moved - whole).abs().max_element() > 1e-9 || scale.x == 0.0 || scale.y == 0.0 {
        return None;
    }
    // ⌊−x⌋ is −⌊x⌋ − 1.
    let mirrored = f64::from(u8::from(scale.x < 0.0) + u8::from(scale.y < 0.0));
    let turned = (whole.x + whole.y + mirrored).rem_euclid(2.0) == 1.0;
    Some((scale.abs().to_array(), turned))
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: (DMat2, DVec2) = (DMat2::IDENTITY, DVec2::ZERO);

    #[test]
    fn pictures_stand_on_their_heads_in_mitsuba() {
        let upright = Placement { scale: [1.0, -1.0], offset: [0.0, 1.0], rotate: 0.0 };
        assert_eq!(Placement::of_picture(IDENTITY), Some(upright));
        let turned = DMat2::from_angle(std::f64::consts::FRAC_PI_2);
        let placed = Placement::of_picture((turned * 2.0, DVec2::new(0.25, 0.5))).expect("no shear");
        assert_eq!(placed.rotate, -90.0);
        // The transformed uv of both conventions agree, with v reversed.
        let (sin, cos) = placed.rotate.to_radians().sin_cos();
        for uv in [DVec2::new(0.0, 0.0), DVec2::new(1.0, 0.3), DVec2::new(-2.0, 5.0)] {
            let there = turned * 2.0 * uv + DVec2::new(0.25, 0.5);
            let s = DVec2::new(uv.x * placed.scale[0], uv.y * placed.scale[1]);
            let here = DVec2::new(cos * s.x - sin * s.y, sin * s.x + cos * s.y) + DVec2::from(placed.offset);
            assert!((here - DVec2::new(there.x, 1.0 - there.y)).length() < 1e-12, "{here} {there}");
        }
        let sheared = DMat2::from_cols(DVec2::X, DVec2::new(0.5, 1.0));
        assert_eq!(Placement::of_picture((sheared, DVec2::ZERO)), None);
    }

    #[test]
    fn checks_are_counted_and_change_places() {
        assert_eq!(checks(IDENTITY), Some(([2.0; 2], false)));
        let of = |scale: [f64; 2], offset: [f64; 2]| {
            checks((DMat2::from_diagonal(DVec2::from(scale)), DVec2::from(offset)))
        };
        assert_eq!(of([5.0, 4.0], [1.0, 0.5]), Some(([10.0, 8.0], true)));
        assert_eq!(of([-5.0, 4.0], [0.0, 0.5]), Some(([10.0, 8.0], false)));
        assert_eq!(of([5.0, 4.0], [0.1, 0.0]), None);
        assert_eq!(of([0.0, 4.0], [0.0, 0.0]), None);
        assert_eq!(checks((DMat2::from_angle(0.5), DVec2::ZERO)), None);
        // Mitsuba's formula: the second colour if exactly one of the fractions is above a half.
        let (scale, offset) = ([-3.0, 2.0], [0.5, 1.0]);
        let (per_unit, turned) = of(scale, offset).expect("straight");
        for uv in [[0.1, 0.1], [0.3, 0.1], [0.1, 0.4], [0.9, 0.77]] {
            let half = |i: usize| (uv[i] * scale[i] + offset[i]).rem_euclid(1.0) > 0.5;
            let here = (0..2).map(|i| (uv[i] * per_unit[i]).floor()).sum::<f64>().rem_euclid(2.0) == 1.0;
            assert_eq!(here != turned, half(0) != half(1), "{uv:?}");
        }
    }
}
