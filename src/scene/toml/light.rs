//! Lights that are no surfaces, and the keys of the environment.

use super::common::RADIANCE;
use super::declared::Values;
use super::one_of::{Members, OneOf};
use super::report::{Read, Reports};
use super::table::{Fields, Key, Table};
use super::value::Colour;
use crate::parameter::Family;
use crate::scene::description::Light;

pub(super) const LIGHT: OneOf<Light> = OneOf {
    what: "light",
    members: Some(Members { declarations: Light::DECLARATIONS, textured: false, build: light }),
    variants: &[],
};

fn light(values: Values, reports: &mut Reports<'_>) -> Read<Light> {
    values.build_alone(reports)
}

pub(super) static ENVIRONMENT_TABLE: Table = Table::new("the environment", &[&ENVIRONMENT_RADIANCE]);

static ENVIRONMENT_RADIANCE: Key<Colour> =
    Key::default("radiance", RADIANCE, "[0, 0, 0]", "Radiance from every direction, in W/(m² sr).");

pub(super) fn environment(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<[f64; 3]> {
    fields.get(&ENVIRONMENT_RADIANCE, reports)
}
