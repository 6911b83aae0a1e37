//! The types of parameter values, and their limits.

use super::value::{ImageIndex, Value, Varying};
use glam::DVec3;

/// The limits of a number, which must also be representable in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// An exclusive lower limit.
    pub above: Option<f64>,
    /// The minimum.
    pub least: f64,
    /// The maximum.
    pub most: f64,
    /// An exclusive upper limit.
    pub below: Option<f64>,
}

impl Number {
    /// From `least` to `most`, inclusive.
    pub const fn between(least: f64, most: f64) -> Self {
        Self { above: None, least, most, below: None }
    }

    /// Above zero, with the minimum `least`.
    pub const fn positive(least: f64, most: f64) -> Self {
        Self { above: Some(0.0), least, most, below: None }
    }

    /// Above zero and below `limit`.
    pub const fn inside(limit: f64) -> Self {
        Self { above: Some(0.0), least: 0.0, most: limit, below: Some(limit) }
    }

    /// The requirement that `number` violates, in words; `None` if it is valid.
    pub fn objection(&self, number: f64) -> Option<String> {
        if !number.is_finite() {
            return Some("must be a finite number".into());
        }
        let single = number as f32;
        if !single.is_finite() {
            return Some(format!(
                "must be at most {}, the largest that 32 bits hold",
                limit(f32::MAX.into())
            ));
        }
        // Rendering uses 32 bits: a number that rounds to a limit is treated as equal to it.
        let rounded = f64::from(single);
        match (self.above, self.below) {
            (Some(above), Some(below)) if number <= above || rounded >= below => {
                return Some(format!("must be above {} and below {}", limit(above), limit(below)));
            }
            (Some(above), None) if number <= above => return Some(format!("must be above {}", limit(above))),
            _ => {}
        }
        if number != 0.0 && single == 0.0 {
            return Some("is so small that 32 bits would round it to 0".into());
        }
        if (self.least..=self.most).contains(&number) {
            None
        } else if self.above.is_none() {
            Some(format!("must be from {} to {}", limit(self.least), limit(self.most)))
        } else if number < self.least {
            Some(format!("must be at least {}", limit(self.least)))
        } else {
            Some(format!("must be at most {}", limit(self.most)))
        }
    }
}

impl Number {
    /// The smallest and the largest valid float.
    pub fn range(&self) -> [f32; 2] {
        let low = self.least as f32;
        let low = if self.above.is_some_and(|above| f64::from(low) <= above) { low.next_up() } else { low };
        let high = self.most as f32;
        let high =
            if self.below.is_some_and(|below| f64::from(high) >= below) { high.next_down() } else { high };
        [low, high]
    }
}

/// A limit in decimal or scientific notation.
fn limit(value: f64) -> String {
    if value.abs() >= 1e12 || value != 0.0 && value.abs() < 1e-4 {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

/// The type of a parameter's values, and their limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterKind {
    /// A number.
    Number(Number),
    /// One number for two axes, or two numbers.
    Pair(Number),
    /// Red, green and blue.
    Colour(Number),
    /// A point or a displacement.
    Vector(Number),
    /// A vector that is not zero.
    NonZero(Number),
    /// A vector that is not zero, of which only the direction matters: it is normalised.
    Direction(Number),
    /// The name of another material, which must be defined before.
    Material,
    /// One of these words.
    Word(&'static [&'static str]),
    /// One of these words for two axes, or two of them.
    Words(&'static [&'static str]),
    /// Yes or no.
    Flag,
    /// A number, a colour, or the name of a texture, which must be defined before.
    Varying(Number),
    /// A whole number from the first to the second, inclusive.
    Integer(u32, u32),
    /// An image file, or the tiles that `<UDIM>` represents.
    Image,
    /// A number, or the name of a texture, of which the red channel is used. Materials that name others may have it,
    /// too.
    Amount(Number),
    /// The name of a texture.
    Texture,
}

impl ParameterKind {
    /// A placeholder for a value that could not be read, so that the others can be checked: NaN, for which all
    /// comparisons except `!=` are false; `usize::MAX`, an invalid index, for a material, an image and a word; false
    /// for a flag; a texture for the name of one.
    pub fn unknown(&self) -> Value {
        match self {
            ParameterKind::Number(_) => Value::Number(f64::NAN),
            ParameterKind::Pair(_) => Value::Pair([f64::NAN; 2]),
            ParameterKind::Colour(_) => Value::Colour([f64::NAN; 3]),
            ParameterKind::Vector(_) | ParameterKind::NonZero(_) | ParameterKind::Direction(_) => {
                Value::Vector(DVec3::NAN)
            }
            ParameterKind::Material => Value::Material(usize::MAX),
            ParameterKind::Word(_) => Value::Word(usize::MAX),
            ParameterKind::Flag => Value::Flag(false),
            ParameterKind::Varying(_) => Value::Varying(Varying::Colour([f64::NAN; 3])),
            ParameterKind::Integer(..) => Value::Number(f64::NAN),
            ParameterKind::Words(_) => Value::Words([usize::MAX; 2]),
            ParameterKind::Image => Value::Image(ImageIndex(usize::MAX)),
            ParameterKind::Amount(_) => Value::Number(f64::NAN),
            ParameterKind::Texture => Value::Flag(true),
        }
    }
}

impl ParameterKind {
    /// A valid value in place of a texture; `None` if the parameter cannot be a texture. It is the maximum up to 1.5,
    /// so that an index of refraction refracts.
    pub fn stand_in(&self) -> Option<Value> {
        let one = |limits: &Number| {
            let [least, most] = limits.range();
            f64::from(1.5_f32.clamp(least, most))
        };
        match self {
            ParameterKind::Number(limits) | ParameterKind::Amount(limits) => Some(Value::Number(one(limits))),
            ParameterKind::Texture => Some(Value::Flag(true)),
            ParameterKind::Pair(limits) => Some(Value::Pair([one(limits); 2])),
            ParameterKind::Colour(limits) => Some(Value::Colour([one(limits); 3])),
            _ => None,
        }
    }
}

/// Normalises a vector that is not zero. It is scaled first, because squares of its components may overflow.
pub fn unit(vector: DVec3) -> DVec3 {
    (vector / vector.abs().max_element()).normalize()
}
