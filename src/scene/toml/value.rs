//! Simple values: numbers, vectors, words.

use std::marker::PhantomData;

use ::toml::de::{DeFloat, DeInteger, DeValue};
use glam::DVec3;
use serde_json::{Value as Json, json};

use super::form::{Value, ValueForm};
use super::report::{Diagnostics, Reported};
use crate::parameter::{Number, unit};
use crate::scene::description;
use crate::scene::spelling::{self, quote};
use crate::scene::synonyms;

/// The type of a value, with an article, for beginners.
pub(super) fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number with a point",
        DeValue::Boolean(_) => "a boolean",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// The same value in JSON; null if JSON cannot represent it.
pub(super) fn to_json(value: &DeValue<'_>) -> Json {
    match value {
        DeValue::String(text) => text.as_ref().into(),
        DeValue::Integer(integer) => integer_value(integer).map_or(Json::Null, |i| i.into()),
        DeValue::Float(float) => float_value(float).map_or(Json::Null, |f| f.into()),
        DeValue::Boolean(boolean) => (*boolean).into(),
        DeValue::Datetime(datetime) => datetime.to_string().into(),
        DeValue::Array(items) => items.iter().map(|item| to_json(item.get_ref())).collect(),
        DeValue::Table(table) => Json::Object(
            table.iter().map(|(key, value)| (key.get_ref().to_string(), to_json(value.get_ref()))).collect(),
        ),
    }
}

fn integer_value(integer: &DeInteger<'_>) -> Option<i64> {
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

fn float_value(float: &DeFloat<'_>) -> Option<f64> {
    float.as_str().parse().ok()
}

pub(super) fn wrong_type(
    key: &str,
    expected: &str,
    value: &Value<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Reported {
    let message = format!("{key} must be {expected}, not {}", kind(value.get_ref()));
    diagnostics.error_with(value.span().start, message, |_| match value.get_ref() {
        DeValue::String(text) if text.trim().parse::<f64>().is_ok() => Some("remove the quotes".into()),
        _ => None,
    })
}

/// A whole number, without a point.
pub(super) struct Integer {
    pub(super) least: u32,
    pub(super) most: u32,
}

impl ValueForm for Integer {
    type Output = u32;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<u32, Reported> {
        let DeValue::Integer(integer) = value.get_ref() else {
            return Err(wrong_type(key, "an integer", value, diagnostics));
        };
        let number = integer_value(integer).and_then(|i| u32::try_from(i).ok());
        match number.filter(|number| (self.least..=self.most).contains(number)) {
            Some(number) => Ok(number),
            None => {
                let given = diagnostics.source(value.span());
                let message = format!("{key} must be from {} to {}, not {given}", self.least, self.most);
                Err(diagnostics.error(value.span().start, message))
            }
        }
    }

    fn schema(&self) -> Json {
        json!({ "type": "integer", "minimum": self.least, "maximum": self.most })
    }
}

/// A whole number, or a word that stands for one.
pub(super) struct IntegerOr {
    pub(super) integer: Integer,
    pub(super) word: &'static str,
    pub(super) means: u32,
}

impl ValueForm for IntegerOr {
    type Output = u32;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<u32, Reported> {
        match value.get_ref() {
            DeValue::String(word) if *word == self.word => Ok(self.means),
            DeValue::Integer(_) => self.integer.read(key, value, diagnostics),
            DeValue::String(word) => {
                let message =
                    format!("{key} must be an integer or {}, not {}", quote(self.word), quote(word));
                Err(diagnostics.error(value.span().start, message))
            }
            _ => Err(wrong_type(key, &format!("an integer or {}", quote(self.word)), value, diagnostics)),
        }
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [self.integer.schema(), { "const": self.word }] })
    }
}

/// Integers are accepted.
impl ValueForm for Number {
    type Output = f64;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<f64, Reported> {
        let number = match value.get_ref() {
            // An integer beyond 64 bits is as good a number as any, and perhaps out of range.
            DeValue::Integer(integer) => integer_value(integer)
                .map(|i| i as f64)
                .or_else(|| if integer.radix() == 10 { integer.as_str().parse().ok() } else { None })
                .unwrap_or(f64::INFINITY),
            DeValue::Float(float) => float_value(float).unwrap_or(f64::NAN),
            _ => return Err(wrong_type(key, "a number", value, diagnostics)),
        };
        match self.objection(number) {
            None => Ok(number),
            Some(objection) => {
                let given = diagnostics.source(value.span());
                let message = format!("{key} {objection}, not {given}");
                Err(diagnostics.error(value.span().start, message))
            }
        }
    }

    fn schema(&self) -> Json {
        let mut schema = json!({ "type": "number" });
        match self.above {
            Some(above) => schema["exclusiveMinimum"] = above.into(),
            None => schema["minimum"] = self.least.into(),
        }
        if self.above.is_some_and(|above| self.least > above) {
            schema["minimum"] = self.least.into();
        }
        match self.below {
            Some(below) => schema["exclusiveMaximum"] = below.into(),
            None => schema["maximum"] = self.most.into(),
        }
        schema
    }
}

/// The names of three components, for messages about one of them.
type Axes = [&'static str; 3];

const SPACE: Axes = ["x", "y", "z"];
pub(super) const COLOUR: Axes = ["red", "green", "blue"];

/// Reads `axes.len()` numbers; all of them, so that all errors are seen.
pub(super) fn components<const N: usize>(
    each: &Number,
    axes: [&str; N],
    expected: &str,
    key: &str,
    value: &Value<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<[f64; N], Reported> {
    let DeValue::Array(items) = value.get_ref() else {
        return Err(wrong_type(key, expected, value, diagnostics));
    };
    if items.len() != N {
        let message = format!("{key} must be {expected}, not an array of {}", items.len());
        return Err(diagnostics.error(value.span().start, message));
    }
    let mut numbers = [Ok(0.0); N];
    for ((number, item), axis) in numbers.iter_mut().zip(items.iter()).zip(axes) {
        *number = each.read(&format!("{axis} of {key}"), item, diagnostics);
    }
    let mut read = [0.0; N];
    for (read, number) in read.iter_mut().zip(numbers) {
        *read = number?;
    }
    Ok(read)
}

pub(super) fn array_schema(each: &Number, length: usize) -> Json {
    json!({ "type": "array", "items": each.schema(), "minItems": length, "maxItems": length })
}

/// A colour: red, green, blue.
pub(super) struct Colour(pub(super) Number);

impl ValueForm for Colour {
    type Output = [f64; 3];

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<[f64; 3], Reported> {
        components(&self.0, COLOUR, "an array of 3 numbers (red, green, blue)", key, value, diagnostics)
    }

    fn schema(&self) -> Json {
        array_schema(&self.0, 3)
    }
}

/// A point or a displacement in space.
pub(super) struct Vector(pub(super) Number);

impl ValueForm for Vector {
    type Output = DVec3;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<DVec3, Reported> {
        let read = components(&self.0, SPACE, "an array of 3 numbers (x, y, z)", key, value, diagnostics);
        read.map(DVec3::from_array)
    }

    fn schema(&self) -> Json {
        array_schema(&self.0, 3)
    }
}

/// A non-zero vector.
pub(super) struct NonZero(pub(super) Vector);

impl ValueForm for NonZero {
    type Output = DVec3;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<DVec3, Reported> {
        let vector = self.0.read(key, value, diagnostics)?;
        if vector == DVec3::ZERO {
            return Err(
                diagnostics.error(value.span().start, format!("{key} must not be zero in all of x, y, z"))
            );
        }
        Ok(vector)
    }

    fn schema(&self) -> Json {
        let mut schema = self.0.schema();
        schema["not"] = json!({ "const": [0, 0, 0] });
        schema
    }
}

/// A non-zero vector, normalised.
pub(super) struct Direction(pub(super) NonZero);

impl ValueForm for Direction {
    type Output = DVec3;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<DVec3, Reported> {
        self.0.read(key, value, diagnostics).map(unit)
    }

    fn schema(&self) -> Json {
        self.0.schema()
    }
}

/// One number for two axes, or two numbers.
pub(super) struct Pair(pub(super) Number);

impl ValueForm for Pair {
    type Output = [f64; 2];

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<[f64; 2], Reported> {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => Ok([self.0.read(key, value, diagnostics)?; 2]),
            _ => {
                let expected = "a number, or an array of 2 numbers (along u, along v)";
                components(&self.0, ["u", "v"], expected, key, value, diagnostics)
            }
        }
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [self.0.schema(), array_schema(&self.0, 2)] })
    }
}

/// One number for three axes, or three numbers.
pub(super) struct Triple(pub(super) Number);

impl ValueForm for Triple {
    type Output = DVec3;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<DVec3, Reported> {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => self.0.read(key, value, diagnostics).map(DVec3::splat),
            _ => {
                let expected = "a number, or an array of 3 numbers (x, y, z)";
                components(&self.0, SPACE, expected, key, value, diagnostics).map(DVec3::from_array)
            }
        }
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [self.0.schema(), array_schema(&self.0, 3)] })
    }
}

/// Three rows of four numbers.
pub(super) struct Rows(pub(super) Number);

impl ValueForm for Rows {
    type Output = [[f64; 4]; 3];

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Self::Output, Reported> {
        let expected = "an array of 3 rows of 4 numbers";
        let DeValue::Array(rows) = value.get_ref() else {
            return Err(wrong_type(key, expected, value, diagnostics));
        };
        if rows.len() != 3 {
            let message = format!("{key} must be {expected}, not an array of {}", rows.len());
            return Err(diagnostics.error(value.span().start, message));
        }
        let mut read = [Ok([0.0; 4]); 3];
        for ((read, row), name) in read.iter_mut().zip(rows.iter()).zip(["first", "second", "third"]) {
            let axes = ["x", "y", "z", "translation"];
            let key = format!("the {name} row of {key}");
            *read = components(&self.0, axes, "an array of 4 numbers", &key, row, diagnostics);
        }
        let [x, y, z] = read;
        Ok([x?, y?, z?])
    }

    fn schema(&self) -> Json {
        json!({ "type": "array", "items": array_schema(&self.0, 4), "minItems": 3, "maxItems": 3 })
    }
}

/// `true` or `false`.
pub(super) struct Flag;

impl ValueForm for Flag {
    type Output = bool;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<bool, Reported> {
        match value.get_ref() {
            DeValue::Boolean(flag) => Ok(*flag),
            _ => Err(wrong_type(key, "true or false", value, diagnostics)),
        }
    }

    fn schema(&self) -> Json {
        json!({ "type": "boolean" })
    }
}

/// A non-empty string.
pub(super) struct Word;

impl ValueForm for Word {
    type Output = String;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<String, Reported> {
        match value.get_ref() {
            DeValue::String(word) if word.is_empty() => {
                Err(diagnostics.error(value.span().start, format!("{key} must not be empty")))
            }
            DeValue::String(word) => Ok(word.to_string()),
            _ => Err(wrong_type(key, "a string", value, diagnostics)),
        }
    }

    fn schema(&self) -> Json {
        json!({ "type": "string", "minLength": 1 })
    }
}

/// One of a few words.
pub(super) struct Choice<T>(PhantomData<T>);

impl<T> Choice<T> {
    pub(super) const NEW: Self = Self(PhantomData);
}

impl<T: description::Choice + Sync> ValueForm for Choice<T> {
    type Output = T;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<T, Reported> {
        let DeValue::String(word) = value.get_ref() else {
            return Err(wrong_type(key, "a string", value, diagnostics));
        };
        match T::find(word) {
            Some(choice) => Ok(choice),
            None => Err(unknown_word(T::WHAT, word, T::names(), value.span().start, diagnostics)),
        }
    }

    fn schema(&self) -> Json {
        json!({ "enum": T::names().collect::<Vec<_>>() })
    }
}

/// The index of a word in a list.
pub(super) struct OneWord(pub(super) &'static [&'static str]);

impl ValueForm for OneWord {
    type Output = usize;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<usize, Reported> {
        let DeValue::String(word) = value.get_ref() else {
            return Err(wrong_type(key, "a string", value, diagnostics));
        };
        match self.0.iter().position(|known| known == word) {
            Some(place) => Ok(place),
            None => Err(unknown_word(key, word, self.0.iter().copied(), value.span().start, diagnostics)),
        }
    }

    fn schema(&self) -> Json {
        json!({ "enum": self.0 })
    }
}

/// Reports an unknown word.
pub(super) fn unknown_word<'c>(
    what: &str,
    word: &str,
    known: impl Iterator<Item = &'c str> + Clone,
    at: usize,
    diagnostics: &mut Diagnostics<'_>,
) -> Reported {
    diagnostics.error_with(at, spelling::unknown(what, word), |_| {
        synonyms::advice(what, word).map(str::to_owned).or_else(|| spelling::instead(word, known))
    })
}
