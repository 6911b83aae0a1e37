//! The keys of the camera, and what is made of them.

use glam::DVec3;

use super::common::{DIRECTION, POINT};
use super::report::{Read, Reports};
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
static FORWARD: Key<Direction> =
    Key::default("forward", DIRECTION, "[1, 0, 0]", "The direction of view, of any length; or give look_at.");
static LOOK_AT: Key<Vector> =
    Key::optional("look_at", POINT, "A point in the middle of the picture, instead of forward.");
static UP: Key<Direction> = Key::default(
    "up",
    DIRECTION,
    "[0, 0, 1]",
    "The world's up direction, of any length, not parallel to the direction of view.",
);
static TYPE: Key<OneWord> = Key::default(
    "type",
    OneWord(&["perspective", ORTHOGRAPHIC]),
    "\"perspective\"",
    "Whether rays meet in the eye, or are all parallel to the direction of view.",
);
static HEIGHT: Key<Number> = Key::optional(
    "height",
    LENGTH,
    "The height of the picture in the scene, for an orthographic camera, instead of vertical_fov.",
);
static VERTICAL_FOV: Key<Number> = Key::default(
    "vertical_fov",
    Number::inside(180.0),
    "90",
    "The angle between the top and the bottom of the picture, in degrees.",
);
static NEAR: Key<Number> =
    Key::default("near", DISTANCE, "0", "Nothing nearer than this distance along forward is seen.");
static FOCAL_LENGTH: Key<Number> = Key::default(
    "focal_length",
    LENGTH,
    "1",
    "The distance of the focal plane from the eye; a pinhole's picture does not depend on it.",
);
static APERTURE_RADIUS: Key<Number> = Key::default(
    "aperture_radius",
    DISTANCE,
    "0",
    "The radius of a thin lens; 0 for a pinhole. It needs focus_distance.",
);
static FOCUS_DISTANCE: Key<Number> =
    Key::optional("focus_distance", LENGTH, "The distance along forward that a thin lens renders sharp.");

const ORTHOGRAPHIC: &str = "orthographic";

pub(super) fn camera(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<CameraSettings> {
    let eye = fields.get(&EYE, reports);
    let forward = view_direction(fields, eye, reports);
    let up = fields.get(&UP, reports);
    let orthographic_height = orthographic_height(fields, reports);
    let vertical_fov = fields.get(&VERTICAL_FOV, reports);
    let near = fields.get(&NEAR, reports);
    let focal_length = fields.get(&FOCAL_LENGTH, reports);
    let aperture_radius = fields.get(&APERTURE_RADIUS, reports);
    let focus_distance = fields.find(&FOCUS_DISTANCE, reports);

    let up = match (forward, up) {
        (Ok((forward, at)), Ok(up)) if forward.cross(up).length() < PARALLEL => {
            let given = fields.has(&UP);
            let at = if given { fields.place_of(&UP) } else { at };
            let message = if given {
                "up is parallel to the direction of view"
            } else {
                "the direction of view is parallel to up, which is [0, 0, 1] unless the file says otherwise"
            };
            let other = if forward.z.abs() < 0.5 { "[0, 0, 1]" } else { "[0, 1, 0]" };
            Err(reports.error_with(at, message, |_| Some(format!("up = {other} would do"))))
        }
        (_, up) => up,
    };
    let focus_distance = match (focus_distance, &aperture_radius) {
        (Ok(None), Ok(_)) if fields.has(&APERTURE_RADIUS) => {
            let at = fields.place_of(&APERTURE_RADIUS);
            let message = "missing key \"focus_distance\" in the camera: a lens needs one";
            let help = "give focus_distance, or take aperture_radius away for a pinhole";
            Err(reports.error_with(at, message, |_| Some(help.into())))
        }
        (focus_distance, _) => focus_distance,
    };

    let focal_length = focal_length?;
    Ok(CameraSettings {
        eye: eye?,
        forward: forward?.0,
        up: up?,
        vertical_fov: vertical_fov?.to_radians(),
        orthographic_height: orthographic_height?,
        focal_length,
        near: near?,
        aperture_radius: aperture_radius?,
        // A pinhole renders every distance sharp.
        focus_distance: focus_distance?.unwrap_or(focal_length),
    })
}

/// The height of an orthographic camera's picture; none of another camera.
fn orthographic_height(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Option<f64>> {
    let is_orthographic = fields.get(&TYPE, reports)? == 1;
    let height = fields.get_if_there(&HEIGHT, reports)?;
    match height {
        None if is_orthographic => {
            let message = "missing key \"height\" in the camera: an orthographic one needs it";
            Err(reports.error(fields.place_of(&TYPE), message))
        }
        Some(_) if !is_orthographic => {
            let help = "type = \"orthographic\" has one; vertical_fov is what a perspective camera has";
            let message = "height is a key of an orthographic camera";
            Err(reports.error_with(fields.place_of(&HEIGHT), message, |_| Some(help.into())))
        }
        Some(_) if fields.has(&VERTICAL_FOV) => {
            let message = "an orthographic camera has a height, and no vertical_fov";
            let at = fields.place_of(&VERTICAL_FOV);
            Err(reports.error_with(at, message, |_| Some("take vertical_fov away".into())))
        }
        height => Ok(height),
    }
}

/// The direction of view, of length one, and where the file says so.
fn view_direction(
    fields: &Fields<'_, '_>,
    eye: Read<DVec3>,
    reports: &mut Reports<'_>,
) -> Read<(DVec3, usize)> {
    let forward = fields.get(&FORWARD, reports);
    let look_at = fields.find(&LOOK_AT, reports);
    if !fields.has(&LOOK_AT) {
        return Ok((forward?, fields.place_of(&FORWARD)));
    }
    let at = fields.place_of(&LOOK_AT);
    if fields.has(&FORWARD) {
        let message = "the camera has both forward and look_at";
        return Err(reports.error_with(at, message, |_| Some("keep one of them".into())));
    }
    let way = look_at?.map_or(DVec3::ZERO, |point| point) - eye?;
    if way == DVec3::ZERO {
        return Err(reports.error(at, "look_at is the same point as eye: there is no direction of view"));
    }
    Ok((unit(way), at))
}
