//! The keys of the environment, and their conversion.

use ::toml::de::DeValue;
use serde_json::{Value as Json, json};

use super::common::{DIRECTION, RADIANCE};
use super::form::{Value, ValueForm};
use super::report::{Diagnostics, Placed, Read};
use super::table::{Fields, Key, Table};
use super::value::{COLOUR, Colour, Direction, Word, array_schema, components};
use crate::parameter::{ImageIndex, Number, limits};
use crate::scene::description::EnvironmentPicture;
use crate::scene::spelling::quote;
use crate::texture::UDIM;

pub(super) static ENVIRONMENT_TABLE: Table = Table {
    what: "the environment",
    keys: &[&RADIANCE_EVERYWHERE, &FILE, &SCALE, &ROTATE, &UP],
    rules: r#"{
        "not": { "required": ["radiance", "file"] },
        "dependentRequired": { "scale": ["file"], "rotate": ["file"], "up": ["file"] }
    }"#,
};

static RADIANCE_EVERYWHERE: Key<Colour> =
    Key::default("radiance", RADIANCE, "[0, 0, 0]", "Constant radiance from every direction, in W/(m² sr).");
static FILE: Key<Word> = Key::optional(
    "file",
    Word,
    "An equirectangular environment picture, which replaces radiance: a .png, .jpg, .tga, .bmp, .tif, .webp, .hdr or .exr file, relative to this one. With up = [0, 0, 1] and without rotation, the centre column is in direction +x, and the column a quarter left of the centre in direction +y.",
);
static SCALE: Key<Factor> = Key::default(
    "scale",
    Factor(limits::RADIANCE),
    "1",
    "A factor for the radiance of the picture: one number, or one for each channel.",
);
static ROTATE: Key<Number> = Key::default(
    "rotate",
    EnvironmentPicture::TURNS,
    "0",
    "The rotation of the picture about up in degrees, counter-clockwise as seen from above.",
);
static UP: Key<Direction> = Key::default(
    "up",
    DIRECTION,
    "[0, 0, 1]",
    "The direction of the upper edge of the picture, of any length. With [0, 1, 0], the centre column is in direction +x, and the column a quarter left of the centre in direction −z.",
);

/// The radiance of rays that leave the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surroundings {
    pub(super) radiance: [f64; 3],
    pub(super) picture: Option<EnvironmentPicture>,
}

pub(super) fn environment(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Surroundings> {
    let radiance = fields.get(&RADIANCE_EVERYWHERE, diagnostics);
    let file = picture(fields, diagnostics);
    let (scale, rotate, up) =
        (fields.get(&SCALE, diagnostics), fields.get(&ROTATE, diagnostics), fields.get(&UP, diagnostics));
    if !fields.has(&FILE) {
        let places = [
            ("scale", fields.has(&SCALE), fields.place_of(&SCALE)),
            ("rotate", fields.has(&ROTATE), fields.place_of(&ROTATE)),
            ("up", fields.has(&UP), fields.place_of(&UP)),
        ];
        // The key may be misspelt.
        let mut outcome = file.map(|_| ());
        let is_absent = outcome.is_ok();
        for (name, _, at) in places.into_iter().filter(|(_, is_given, _)| *is_given && is_absent) {
            let message = format!("{name} applies to a picture, and the environment has none");
            let help = format!("add a picture with file, or remove {name}");
            outcome = Err(diagnostics.error_with(at, message, |_| Some(help)));
        }
        outcome?;
        return Ok(Surroundings { radiance: radiance?, picture: None });
    }
    if fields.has(&RADIANCE_EVERYWHERE) {
        let message = "the environment has both radiance and file";
        let help = Some("keep one of them".into());
        return Err(diagnostics.error_with(fields.place_of(&RADIANCE_EVERYWHERE), message, |_| help));
    }
    let (scale, rotate, up) = (scale?, rotate?.to_radians(), up?);
    let picture = file?.map(|file| EnvironmentPicture { file, scale, rotate, up });
    Ok(Surroundings { radiance: radiance?, picture })
}

/// The picture of a file, if the key is present.
fn picture(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Option<ImageIndex>> {
    let Some(name) = fields.get_if_there(&FILE, diagnostics)? else { return Ok(None) };
    let at = fields.place_of(&FILE);
    if name.contains(UDIM) {
        let message =
            format!("the environment needs a single picture, but {} stands for several", quote(UDIM));
        return Err(diagnostics.error(at, message));
    }
    let image = ImageIndex(diagnostics.image(&Placed { at, value: name.clone() })?);
    if let Some(message) = diagnostics.odd_numbers(image, &name) {
        let help = "negative numbers and NaN are replaced by 0, and infinity by the maximum";
        diagnostics.warn(Some(at), message, help);
    }
    Ok(Some(image))
}

/// A number from zero, or one for each channel.
struct Factor(Number);

impl ValueForm for Factor {
    type Output = [f64; 3];

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Read<[f64; 3]> {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => Ok([self.0.read(key, value, diagnostics)?; 3]),
            _ => {
                let expected = "a number, or an array of 3 numbers (red, green, blue)";
                components(&self.0, COLOUR, expected, key, value, diagnostics)
            }
        }
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [self.0.schema(), array_schema(&self.0, 3)] })
    }
}
