//! A camera defined by its focal point, as in the window.

use super::description::{CameraSettings, Scene};
use crate::parameter::unit;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A camera defined by the point that it looks at. It displays as the camera of a scene file, which is read back as
/// [`Viewpoint::settings`] to the bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Viewpoint {
    /// The eye.
    pub eye: [f64; 3],
    /// The point at the centre of the image.
    pub look_at: [f64; 3],
    /// The up direction, of any length.
    pub up: [f64; 3],
    /// The angle between the top and the bottom of the image, in degrees. An orthographic camera has none.
    pub vertical_fov: f64,
    /// The height of an orthographic camera's image.
    pub orthographic_height: Option<f64>,
    /// The near clipping distance along the viewing direction.
    pub near: f64,
    /// The radius of a thin lens; zero for a pinhole.
    pub aperture_radius: f64,
    /// The distance along the viewing direction at which a thin lens is in focus.
    pub focus_distance: f64,
}

impl Viewpoint {
    /// The camera; `None` if its values are out of range.
    pub fn settings(&self) -> Option<CameraSettings> {
        let eye = DVec3::from_array(self.eye);
        let of_any = CameraSettings {
            eye,
            forward: unit(DVec3::from_array(self.look_at) - eye),
            up: unit(DVec3::from_array(self.up)),
            near: self.near,
            orthographic_height: self.orthographic_height,
            ..CameraSettings::default()
        };
        let pinhole = match self.orthographic_height {
            Some(_) => of_any,
            None => CameraSettings { vertical_fov: self.vertical_fov.to_radians(), ..of_any },
        };
        let (aperture_radius, focus_distance) = (self.aperture_radius, self.focus_distance);
        let camera = match aperture_radius > 0.0 {
            true => CameraSettings { aperture_radius, focus_distance, ..pinhole },
            false => pinhole,
        };
        let look_at = CameraSettings { eye: DVec3::from_array(self.look_at), ..camera.clone() };
        let stands = |camera| Scene { camera, ..Scene::default() }.checked().ok();
        stands(look_at).and(stands(camera)).map(|scene| scene.camera)
    }
}

impl fmt::Display for Viewpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [eye, look_at, up] =
            [self.eye, self.look_at, self.up].map(|vector| vector.map(number).join(", "));
        writeln!(f, "[camera]\neye = [{eye}]\nlook_at = [{look_at}]\nup = [{up}]")?;
        match self.orthographic_height {
            Some(height) => writeln!(f, "type = \"orthographic\"\nheight = {}", number(height))?,
            None => writeln!(f, "vertical_fov = {}", number(self.vertical_fov))?,
        }
        if self.near > 0.0 {
            writeln!(f, "near = {}", number(self.near))?;
        }
        if self.aperture_radius > 0.0 {
            let [radius, distance] = [self.aperture_radius, self.focus_distance].map(number);
            writeln!(f, "aperture_radius = {radius}\nfocus_distance = {distance}")?;
        }
        Ok(())
    }
}

/// The fewest digits that are read back as the same number.
fn number(value: f64) -> String {
    format!("{value}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse;

    fn read(viewpoint: &Viewpoint) -> CameraSettings {
        parse(&viewpoint.to_string(), "a.toml".as_ref()).expect("a camera").scene.camera
    }

    #[test]
    fn a_viewpoint_is_read_back_to_the_bit() {
        let pinhole = Viewpoint {
            eye: [0.1, -6.0, 2.503],
            look_at: [1e-7, 1e9 / 3.0, 0.9],
            up: [0.3, -0.1, 12.0],
            vertical_fov: 40.0,
            orthographic_height: None,
            near: 0.0,
            aperture_radius: 0.0,
            focus_distance: 3.0,
        };
        let lens = Viewpoint { near: 0.5, aperture_radius: 1e-3, focus_distance: 5.5, ..pinhole.clone() };
        let parallel = Viewpoint { orthographic_height: Some(0.3), ..lens.clone() };
        for viewpoint in [pinhole.clone(), lens, parallel.clone()] {
            assert_eq!(Some(read(&viewpoint)), viewpoint.settings());
        }
        // Negative control, and invalid cameras.
        let other = Viewpoint { vertical_fov: 40.000_000_1, ..pinhole.clone() };
        assert_ne!(Some(read(&other)), pinhole.settings());
        for far in [1e300, f64::NAN] {
            assert_eq!(Viewpoint { eye: [0.0, far, 0.0], ..pinhole.clone() }.settings(), None);
            assert_eq!(Viewpoint { look_at: [0.0, far, 0.0], ..pinhole.clone() }.settings(), None);
        }
        assert_eq!(Viewpoint { look_at: pinhole.eye, ..pinhole.clone() }.settings(), None);
        assert_eq!(Viewpoint { up: [0.0; 3], ..pinhole }.settings(), None);
        assert_eq!(Viewpoint { orthographic_height: Some(0.0), ..parallel }.settings(), None);
    }
}
