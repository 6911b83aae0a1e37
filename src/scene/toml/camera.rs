//! The keys of the camera, and their conversion.

use glam::DVec3;

use super::common::{DIRECTION, POINT};
use super::report::{Diagnostics, Read};
use super::table::{Fields, Key, Table};
use super::value::{Direction, OneWord, Vector};
use crate::parameter::limits::{DISTANCE, LENGTH, PARALLEL};
use crate::parameter::{Number, unit};
use crate::scene::description::CameraSettings;

pub(super) static CAMERA_TABLE: Table = Table {
    what: "the camera",
    keys: &[
        &EYE,
        &FORWARD,
        &LOOK_AT,
        &UP,
        &TYPE,
        &VERTICAL_FOV,
        &HEIGHT,
        &NEAR,
        &FOCAL_LENGTH,
        &APERTURE_RADIUS,
        &FOCUS_DISTANCE,
    ],
    rules: r#"{
        "not": { "required": ["forward", "look_at"] },
        "dependentRequired": { "aperture_radius": ["focus_distance"] },
        "if": { "properties": { "type": { "const": "orthographic" } }, "required": ["type"] },
        "then": { "required": ["height"], "not": { "required": ["vertical_fov"] } },
        "else": { "not": { "required": ["height"] } }
    }"#,
};

static EYE: Key<Vector> = Key::default("eye", POINT, "[0, 0, 0]", "The focal point.");
static FORWARD: Key<Direction> = Key::default(
    "forward",
    DIRECTION,
    "[1, 0, 0]",
    "The viewing direction, of any length; alternatively, give look_at.",
);
static LOOK_AT: Key<Vector> =
    Key::optional("look_at", POINT, "The point at the centre of the image; replaces forward.");
static UP: Key<Direction> = Key::default(
    "up",
    DIRECTION,
    "[0, 0, 1]",
    "The direction that is up in the image, of any length, not parallel to the viewing direction.",
);
static TYPE: Key<OneWord> = Key::default(
    "type",
    OneWord(&["perspective", ORTHOGRAPHIC]),
    "\"perspective\"",
    "The projection: perspective, or orthographic with parallel rays.",
);
static HEIGHT: Key<Number> = Key::optional(
    "height",
    LENGTH,
    "The height of the image in the scene, for an orthographic camera; replaces vertical_fov.",
);
static VERTICAL_FOV: Key<Number> = Key::default(
    "vertical_fov",
    Number::inside(180.0),
    "90",
    "The angle between the top and the bottom of the image, in degrees.",
);
static NEAR: Key<Number> = Key::default("near", DISTANCE, "0", "The near clipping distance along forward.");
static FOCAL_LENGTH: Key<Number> = Key::default(
    "focal_length",
    LENGTH,
    "1",
    "The distance of the image plane from the eye. It does not affect the image: the angle of view is vertical_fov.",
);
static APERTURE_RADIUS: Key<Number> = Key::default(
    "aperture_radius",
    DISTANCE,
    "0",
    "The radius of a thin lens; 0 for a pinhole. A lens requires focus_distance.",
);
static FOCUS_DISTANCE: Key<Number> =
    Key::optional("focus_distance", LENGTH, "The distance along forward at which a thin lens is in focus.");

const ORTHOGRAPHIC: &str = "orthographic";

pub(super) fn camera(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<CameraSettings> {
    let eye = fields.get(&EYE, diagnostics);
    let forward = view_direction(fields, eye, diagnostics);
    let up = fields.get(&UP, diagnostics);
    let orthographic_height = orthographic_height(fields, diagnostics);
    let vertical_fov = fields.get(&VERTICAL_FOV, diagnostics);
    let near = fields.get(&NEAR, diagnostics);
    let focal_length = fields.get(&FOCAL_LENGTH, diagnostics);
    let aperture_radius = fields.get(&APERTURE_RADIUS, diagnostics);
    let focus_distance = fields.find(&FOCUS_DISTANCE, diagnostics);

    let up = match (forward, up) {
        (Ok((forward, at)), Ok(up)) if forward.cross(up).length() < PARALLEL => {
            let given = fields.has(&UP);
            let at = if given { fields.place_of(&UP) } else { at };
            let message = if given {
                "up is parallel to the viewing direction"
            } else {
                "the viewing direction is parallel to up, whose default is [0, 0, 1]"
            };
            let other = if forward.z.abs() < 0.5 { "[0, 0, 1]" } else { "[0, 1, 0]" };
            Err(diagnostics.error_with(at, message, |_| Some(format!("up = {other} would do"))))
        }
        (_, up) => up,
    };
    let focus_distance = match (focus_distance, &aperture_radius) {
        (Ok(None), Ok(_)) if fields.has(&APERTURE_RADIUS) => {
            let at = fields.place_of(&APERTURE_RADIUS);
            let message = "missing key \"focus_distance\" in the camera, which a lens needs";
            let help = "add focus_distance, or remove aperture_radius for a pinhole";
            Err(diagnostics.error_with(at, message, |_| Some(help.into())))
        }
        (focus_distance, _) => focus_distance,
    };

    let focal_length = focal_length?;
    // Converted scenes have the default.
    if focal_length != 1.0 {
        let at = fields.place_of(&FOCAL_LENGTH);
        let help =
            "set vertical_fov, which is 2·atan(h / (2·f)) for a focal length f and a sensor of height h";
        diagnostics.warn(Some(at), "focal_length does not affect the image", help);
    }
    Ok(CameraSettings {
        eye: eye?,
        forward: forward?.0,
        up: up?,
        vertical_fov: vertical_fov?.to_radians(),
        orthographic_height: orthographic_height?,
        focal_length,
        near: near?,
        aperture_radius: aperture_radius?,
        // A pinhole renders every distance in focus.
        focus_distance: focus_distance?.unwrap_or(focal_length),
    })
}

/// The height of an orthographic camera's image; `None` for a perspective camera.
fn orthographic_height(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Option<f64>> {
    let is_orthographic = fields.get(&TYPE, diagnostics)? == 1;
    let height = fields.get_if_there(&HEIGHT, diagnostics)?;
    match height {
        None if is_orthographic => {
            let message = "missing key \"height\" in the camera, which an orthographic camera needs";
            Err(diagnostics.error(fields.place_of(&TYPE), message))
        }
        Some(_) if !is_orthographic => {
            let help = "use vertical_fov, or set type = \"orthographic\"";
            let message = "height is a key of an orthographic camera";
            Err(diagnostics.error_with(fields.place_of(&HEIGHT), message, |_| Some(help.into())))
        }
        Some(_) if fields.has(&VERTICAL_FOV) => {
            let message = "an orthographic camera has height instead of vertical_fov";
            let at = fields.place_of(&VERTICAL_FOV);
            Err(diagnostics.error_with(at, message, |_| Some("remove vertical_fov".into())))
        }
        height => Ok(height),
    }
}

/// The unit viewing direction, and its position in the file.
fn view_direction(
    fields: &Fields<'_, '_>,
    eye: Read<DVec3>,
    diagnostics: &mut Diagnostics<'_>,
) -> Read<(DVec3, usize)> {
    let forward = fields.get(&FORWARD, diagnostics);
    let look_at = fields.find(&LOOK_AT, diagnostics);
    if !fields.has(&LOOK_AT) {
        return Ok((forward?, fields.place_of(&FORWARD)));
    }
    let at = fields.place_of(&LOOK_AT);
    if fields.has(&FORWARD) {
        let message = "the camera has both forward and look_at";
        return Err(diagnostics.error_with(at, message, |_| Some("keep one of them".into())));
    }
    let way = look_at?.map_or(DVec3::ZERO, |point| point) - eye?;
    if way == DVec3::ZERO {
        return Err(diagnostics.error(at, "look_at equals eye, which gives no viewing direction"));
    }
    Ok((unit(way), at))
}
