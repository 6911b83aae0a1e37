//! The keys of the environment, and what is made of them.

use ::toml::de::DeValue;
use serde_json::{Value as Json, json};

use super::common::{DIRECTION, RADIANCE};
use super::form::{Form, Value};
use super::report::{Placed, Read, Reports};
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
    Key::default("radiance", RADIANCE, "[0, 0, 0]", "Radiance from every direction, in W/(m² sr).");
static FILE: Key<Word> = Key::optional(
    "file",
    Word,
    "A picture of what is all around, instead of radiance: equirectangular, a .png, .jpg, .tga, .bmp, .tif, .webp, .hdr or .exr file, relative to this one. With up = [0, 0, 1] and without rotation its middle column is seen along +x and the quarter left of the middle along +y.",
);
static SCALE: Key<Factor> = Key::default(
    "scale",
    Factor(limits::RADIANCE),
    "1",
    "What the radiance of the picture is multiplied by: one number, or one for each channel.",
);
static ROTATE: Key<Number> = Key::default(
    "rotate",
    EnvironmentPicture::TURNS,
    "0",
    "Degrees by which the picture is turned about up, counter-clockwise seen from above.",
);
static UP: Key<Direction> = Key::default(
    "up",
    DIRECTION,
    "[0, 0, 1]",
    "The direction to the upper edge of the picture, of any length. With [0, 1, 0] its middle column is seen along +x and the quarter left of the middle along −z.",
);

/// What rays see that leave the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surroundings {
    pub(super) radiance: [f64; 3],
    pub(super) picture: Option<EnvironmentPicture>,
}

pub(super) fn environment(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Surroundings> {
    let radiance = fields.get(&RADIANCE_EVERYWHERE, reports);
    let file = picture(fields, reports);
    let (scale, rotate, up) =
        (fields.get(&SCALE, reports), fields.get(&ROTATE, reports), fields.get(&UP, reports));
    if !fields.has(&FILE) {
        let places = [
            ("scale", fields.has(&SCALE), fields.place_of(&SCALE)),
            ("rotate", fields.has(&ROTATE), fields.place_of(&ROTATE)),
            ("up", fields.has(&UP), fields.place_of(&UP)),
        ];
        // It may be misspelt.
        let mut outcome = file.map(|_| ());
        let is_absent = outcome.is_ok();
        for (name, _, at) in places.into_iter().filter(|(_, is_given, _)| *is_given && is_absent) {
            let message = format!("{name} is for a picture, and the environment has none");
            let help = format!("name a picture by file, or take {name} away");
            outcome = Err(reports.error_with(at, message, |_| Some(help)));
        }
        outcome?;
        return Ok(Surroundings { radiance: radiance?, picture: None });
    }
    if fields.has(&RADIANCE_EVERYWHERE) {
        let message = "the environment has both radiance and file";
        let help = Some("keep one of them".into());
        return Err(reports.error_with(fields.place_of(&RADIANCE_EVERYWHERE), message, |_| help));
    }
    let (scale, rotate, up) = (scale?, rotate?.to_radians(), up?);
    let picture = file?.map(|file| EnvironmentPicture { file, scale, rotate, up });
    Ok(Surroundings { radiance: radiance?, picture })
}

/// The picture that a file names, if it names one.
fn picture(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Option<ImageIndex>> {
    let Some(name) = fields.get_if_there(&FILE, reports)? else { return Ok(None) };
    let at = fields.place_of(&FILE);
    if name.contains(UDIM) {
        let message = format!("the environment is one picture, and {} stands for many", quote(UDIM));
        return Err(reports.error(at, message));
    }
    let image = ImageIndex(reports.image(&Placed { at, value: name.clone() })?);
    if let Some(message) = reports.odd_numbers(image, &name) {
        let help =
            "what is negative or no number counts as zero, and infinity as the largest that there may be";
        reports.warn(Some(at), message, help);
    }
    Ok(Some(image))
}

/// A number from zero on, or one for each channel.
struct Factor(Number);

impl Form for Factor {
    type Output = [f64; 3];

    fn read(&self, key: &str, value: &Value<'_>, reports: &mut Reports<'_>) -> Read<[f64; 3]> {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => Ok([self.0.read(key, value, reports)?; 3]),
            _ => {
                let expected = "a number, or an array of 3 numbers (red, green, blue)";
                components(&self.0, COLOUR, expected, key, value, reports)
            }
        }
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [self.0.schema(), array_schema(&self.0, 3)] })
    }
}
