//! Values of textures, and values that may be textures.

use ::toml::de::DeValue;
use serde_json::{Value as Json, json};

use super::form::{Value, ValueForm};
use super::report::{Diagnostics, Placed, Reported};
use super::value::{COLOUR, Colour, OneWord, Word, array_schema, components, wrong_type};
use crate::parameter::Number;

/// A colour, or the name of a texture.
pub(super) struct ColourOr(pub(super) Colour);

/// The value of a [`ColourOr`].
pub(super) enum ColourOrName {
    Colour([f64; 3]),
    Name(Placed<String>),
}

impl ValueForm for ColourOr {
    type Output = ColourOrName;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<ColourOrName, Reported> {
        match value.get_ref() {
            // A number in quotes is a mistake.
            DeValue::String(word) if word.trim().parse::<f64>().is_err() => {
                let name = Word.read(key, value, diagnostics)?;
                Ok(ColourOrName::Name(Placed { at: value.span().start, value: name }))
            }
            _ => self.0.read(key, value, diagnostics).map(ColourOrName::Colour),
        }
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [self.0.schema(), Word.schema()] })
    }
}

/// A colour, or one number for grey.
pub(super) struct GreyOr(pub(super) Number);

impl ValueForm for GreyOr {
    type Output = [f64; 3];

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<[f64; 3], Reported> {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => Ok([self.0.read(key, value, diagnostics)?; 3]),
            _ => {
                let expected = "a number, an array of 3 numbers (red, green, blue) or the name of a texture";
                components(&self.0, COLOUR, expected, key, value, diagnostics)
            }
        }
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [self.0.schema(), array_schema(&self.0, 3)] })
    }
}

/// One word for two axes, or two words.
pub(super) struct TwoWords(pub(super) &'static [&'static str]);

impl ValueForm for TwoWords {
    type Output = [usize; 2];

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<[usize; 2], Reported> {
        let one = OneWord(self.0);
        match value.get_ref() {
            DeValue::String(_) => Ok([one.read(key, value, diagnostics)?; 2]),
            DeValue::Array(items) if items.len() == 2 => {
                let mut words = [0, 1].map(|i| one.read(key, &items[i], diagnostics)).into_iter();
                let (u, v) = (words.next(), words.next());
                Ok([u.unwrap_or(Ok(0))?, v.unwrap_or(Ok(0))?])
            }
            _ => {
                let expected = "a string, or an array of 2 strings (along u, along v)";
                Err(wrong_type(key, expected, value, diagnostics))
            }
        }
    }

    fn schema(&self) -> Json {
        let one = OneWord(self.0).schema();
        json!({ "anyOf": [one, { "type": "array", "items": one, "minItems": 2, "maxItems": 2 }] })
    }
}
