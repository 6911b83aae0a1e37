//! Lights that are no surfaces.

use super::declared::Values;
use super::one_of::{Members, OneOf};
use super::report::{Read, Reports};
use super::table::Fields;
use crate::parameter::Family;
use crate::scene::description::Light;

pub(super) const LIGHT: OneOf<Light> = OneOf {
    what: "light",
    members: Some(Members {
        declarations: Light::DECLARATIONS,
        textured: false,
        common: None,
        more: |_| &[],
        build: light,
    }),
    variants: &[],
};

fn light(values: Values, _: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Light> {
    values.build_alone(reports)
}
