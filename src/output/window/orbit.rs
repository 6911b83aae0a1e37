//! A camera that orbits a point, controlled by the mouse.

use crate::camera::CameraSettings;
use crate::scene::Viewpoint;
use glam::{DQuat, DVec3};

/// The minimum angle between the direction of view and up or down, in radians: at the poles left is undefined.
const FROM_POLES: f64 = 0.02;

/// A camera that looks at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Orbit {
    camera: CameraSettings,
    /// The distance of that point along `forward`.
    distance: f64,
    /// The initial `distance`, which limits how much closer or farther the camera may move.
    first_distance: f64,
}

/// The maximum ratio between the initial distance and a later one, in both directions.
const REACH: f64 = 1e4;

impl Orbit {
    /// A camera that looks at the point at `distance` in front of it.
    pub fn new(camera: &CameraSettings, distance: f64) -> Orbit {
        Orbit { camera: camera.clone(), distance, first_distance: distance }
    }

    fn target(&self) -> DVec3 {
        self.camera.eye + self.camera.forward * self.distance
    }

    fn left(&self) -> DVec3 {
        self.camera.up.cross(self.camera.forward).normalize()
    }

    /// Orbits the point, so that the scene follows a mouse that moves right and down by these
    /// fractions of the picture's height: half a turn for one height.
    pub fn turn(&mut self, right: f64, down: f64) {
        use std::f64::consts::PI;
        let target = self.target();
        let (up, forward) = (self.camera.up, self.camera.forward);
        // From straight up to straight down.
        let angle = up.dot(forward).clamp(-1.0, 1.0).acos();
        let lower = (angle + down * PI).clamp(FROM_POLES, PI - FROM_POLES) - angle;
        let turn = DQuat::from_axis_angle(up, -right * PI) * DQuat::from_axis_angle(self.left(), lower);
        self.camera.forward = (turn * forward).normalize();
        self.camera.eye = target - self.camera.forward * self.distance;
    }

    /// Moves the camera along its own axes, so that its point follows a mouse that moves right and down by these
    /// fractions of the picture's height.
    pub fn pan(&mut self, right: f64, down: f64) {
        let of_perspective = 2.0 * self.distance * (self.camera.vertical_fov / 2.0).tan();
        let height = self.camera.orthographic_height.unwrap_or(of_perspective);
        let left = self.left();
        let up = self.camera.forward.cross(left);
        self.camera.eye += (left * right + up * down) * height;
    }

    /// Moves the camera towards the point by a tenth of the distance per step, or away from it.
    pub fn dolly(&mut self, steps: f64) {
        let target = self.target();
        let (nearest, before) = (self.first_distance / REACH, self.distance);
        self.distance = (self.distance * 0.9_f64.powf(steps)).clamp(nearest, self.first_distance * REACH);
        self.camera.eye = target - self.camera.forward * self.distance;
        // In an orthographic view closer objects are no larger: the visible height is reduced instead.
        let scaled = |height: f64| height * self.distance / before;
        self.camera.orthographic_height = self.camera.orthographic_height.map(scaled);
    }

    /// The camera for a render, with coordinates rounded to about six digits.
    pub fn viewpoint(&self) -> Viewpoint {
        let camera = &self.camera;
        let digits = (6.0 - self.distance.log10().floor()).clamp(0.0, 15.0) as usize;
        // Avoids −0.
        let short = |value: f64| format!("{value:.digits$}").parse().unwrap_or(value) + 0.0;
        // A field of view in degrees has few digits, unlike its radians.
        let vertical_fov = (camera.vertical_fov.to_degrees() * 1e9).round() / 1e9;
        Viewpoint {
            eye: camera.eye.to_array().map(short),
            look_at: self.target().to_array().map(short),
            up: camera.up.to_array(),
            vertical_fov,
            orthographic_height: camera.orthographic_height,
            near: camera.near,
            aperture_radius: camera.aperture_radius,
            focus_distance: camera.focus_distance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::scene::parse;

    fn camera(text: &str) -> CameraSettings {
        parse(text, "a.toml".as_ref()).expect("a scene").scene.camera
    }

    fn orbit() -> Orbit {
        let text = "[camera]\neye = [0, -6, 2.5]\nlook_at = [0, 0, 0.9]\nvertical_fov = 40\nnear = 0.5\n\
                    aperture_radius = 0.1\nfocus_distance = 5.5\n";
        let camera = camera(text);
        Orbit::new(&camera, (36.0_f64 + 1.6 * 1.6).sqrt())
    }

    #[test]
    fn an_orbit_keeps_its_point_and_distance() {
        let mut orbit = orbit();
        let (target, eye) = (orbit.target(), orbit.camera.eye);
        assert!((target - DVec3::new(0.0, 0.0, 0.9)).length() < 1e-12);
        for (right, down) in [(0.1, 0.0), (0.0, 0.2), (-0.7, 5.0), (0.3, -9.0), (0.0, 0.4)] {
            orbit.turn(right, down);
            assert!((orbit.target() - target).length() < 1e-9);
            assert!(((orbit.camera.eye - target).length() - orbit.distance).abs() < 1e-9);
            assert!(orbit.camera.up.cross(orbit.camera.forward).length() > 0.01, "not at a pole");
        }
        assert!((orbit.camera.eye - eye).length() > 1.0);
    }

    /// The position of a point in the camera's picture: right and down from the centre, in heights of the picture.
    fn seen(orbit: &Orbit, point: DVec3) -> [f64; 2] {
        let (way, left) = (point - orbit.camera.eye, orbit.left());
        let up = orbit.camera.forward.cross(left);
        let scale = 1.0 / (2.0 * (orbit.camera.vertical_fov / 2.0).tan() * way.dot(orbit.camera.forward));
        [-way.dot(left) * scale, -way.dot(up) * scale]
    }

    #[test]
    fn the_orbited_point_follows_the_mouse() {
        let mut orbit = orbit();
        let target = orbit.target();
        orbit.pan(0.25, -0.1);
        let [right, down] = seen(&orbit, target);
        assert!((right - 0.25).abs() < 1e-9 && (down + 0.1).abs() < 1e-9, "{right} {down}");
        // Objects in front turn with the mouse: a point nearer than the centre follows it.
        let mut orbit = self::orbit();
        let near = orbit.target() - orbit.camera.forward;
        orbit.turn(0.05, 0.0);
        assert!(seen(&orbit, near)[0] > 0.01, "{:?}", seen(&orbit, near));
        let mut orbit = self::orbit();
        orbit.turn(0.0, 0.05);
        assert!(seen(&orbit, near)[1] > 0.01, "{:?}", seen(&orbit, near));
    }

    #[test]
    fn dollying_moves_closer_up_to_a_limit() {
        let mut orbit = orbit();
        let (target, far) = (orbit.target(), orbit.distance);
        orbit.dolly(1.0);
        assert!((orbit.distance / far - 0.9).abs() < 1e-12);
        assert!((orbit.target() - target).length() < 1e-9);
        orbit.dolly(1e9);
        assert!(orbit.distance > 0.0 && (orbit.target() - target).length() < 1e-6);
        orbit.dolly(-1e9);
        assert!(orbit.distance.is_finite());
    }

    #[test]
    fn the_viewpoint_contains_all_camera_settings() {
        let mut orbit = orbit();
        let text = orbit.viewpoint().to_string();
        assert!(text.contains("eye = [0, -6, 2.5]\nlook_at = [0, 0, 0.9]\n"), "{text}");
        assert!(text.contains("vertical_fov = 40\nnear = 0.5\n"), "{text}");
        assert_eq!(camera(&text), orbit.camera, "the camera did not move");
        orbit.turn(0.123, 0.0456);
        orbit.pan(0.01, 0.002);
        orbit.dolly(2.0);
        let (said, meant) = (orbit.viewpoint().settings().expect("a camera"), &orbit.camera);
        let seen = |camera: &CameraSettings| Camera::new(camera, 640, 480);
        let (said_seen, meant_seen) = (seen(&said), seen(meant));
        for (a, b) in [(said_seen.eye, meant_seen.eye), (said_seen.forward, meant_seen.forward)] {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-6), "{a:?} {b:?}");
        }
        assert_eq!(
            (said.near, said.aperture_radius, said.focus_distance),
            (meant.near, meant.aperture_radius, meant.focus_distance)
        );
        // Negative control: the camera moved.
        assert!((said.eye - camera(&text).eye).length() > 0.1);
    }

    #[test]
    fn an_orthographic_camera_that_moves_closer_covers_less() {
        let text =
            "[camera]\neye = [0, -6, 2.5]\nlook_at = [0, 0, 2.5]\ntype = \"orthographic\"\nheight = 4\n";
        let mut orbit = Orbit::new(&camera(text), 6.0);
        assert_eq!(orbit.viewpoint().settings().as_ref(), Some(&orbit.camera), "the camera did not move");
        let target = orbit.target();
        orbit.pan(0.25, -0.5);
        assert!(
            (orbit.target() - target - DVec3::new(-1.0, 0.0, -2.0)).length() < 1e-9,
            "{}",
            orbit.target()
        );
        orbit.dolly(1.0);
        let height = orbit.viewpoint().settings().and_then(|camera| camera.orthographic_height);
        assert!(height.is_some_and(|height| (height - 3.6).abs() < 1e-9), "{height:?}");
    }
}
