//! The keys of lights that are no surfaces, and what is made of them.

use super::limits::{LONGEST, POINT, RADIANCE};
use super::report::{Read, Reports};
use super::table::{Fields, Key, OneOf, Table, Variant};
use super::value::{Colour, Number, Vector};
use crate::scene::description::Light;

// What gives the same radiance at any distance that there may be: neither a film nor a unit of length limits it.
const INTENSITIES: Colour = Colour(Number::between(0.0, LONGEST * LONGEST));
pub(super) const LIGHT: OneOf<Light> =
    OneOf { what: "light", variants: &[Variant::new("point", &POINT_LIGHT_TABLE, point_light)] };

static POINT_LIGHT_TABLE: Table = Table::new("a point light", &[&POSITION, &INTENSITY]);

static POSITION: Key<Vector> = Key::required("position", POINT, "Where the light is.");
static INTENSITY: Key<Colour> =
    Key::required("intensity", INTENSITIES, "Radiant intensity in W/sr, the same in every direction.");

pub(super) static ENVIRONMENT_TABLE: Table = Table::new("the environment", &[&ENVIRONMENT_RADIANCE]);

static ENVIRONMENT_RADIANCE: Key<Colour> =
    Key::default("radiance", RADIANCE, "[0, 0, 0]", "Radiance from every direction, in W/(m² sr).");

fn point_light(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Light> {
    let position = fields.get(&POSITION, reports);
    let intensity = fields.get(&INTENSITY, reports);
    Ok(Light::Point { position: position?, intensity: intensity? })
}

pub(super) fn environment(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<[f64; 3]> {
    fields.get(&ENVIRONMENT_RADIANCE, reports)
}
