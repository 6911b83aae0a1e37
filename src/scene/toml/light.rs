//! The keys of lights that are no surfaces.

use super::declared::Values;
use super::one_of::{Members, OneOf};
use super::report::{Diagnostics, Read};
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

fn light(values: Values, _: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Light> {
    values.build_alone(diagnostics)
}
