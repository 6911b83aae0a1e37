//! The camera: film positions to rays (report §2.1).

use crate::math::{Float, Ray, Vec3, function, narrow};
use crate::parameter::unit;
use crate::sampling::warp;
use glam::DVec3;

/// The parameters of a camera. Vectors are in world space; `forward` and `up` have length one and are not
/// parallel.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraSettings {
    /// The focal point.
    pub eye: DVec3,
    /// The direction of view, of length one.
    pub forward: DVec3,
    /// The world's up direction, of length one and not parallel to `forward`.
    pub up: DVec3,
    /// The angle between the top and the bottom of the picture, in radians, within (0, π). Ignored by an orthographic
    /// camera.
    pub vertical_fov: f64,
    /// The height of the picture in scene units, above zero, if the camera is orthographic: all rays are then parallel
    /// to
    /// `forward`.
    pub orthographic_height: Option<f64>,
    /// The distance of the focal plane from the eye along `forward` (report §2.1.2), above zero. It does not affect the
    /// picture of a pinhole camera.
    pub focal_length: f64,
    /// The near plane: the smallest visible distance along `forward`, zero or more.
    pub near: f64,
    /// The radius of a thin lens; zero for a pinhole.
    pub aperture_radius: f64,
    /// The distance along `forward` at which a thin lens is in focus, above zero.
    pub focus_distance: f64,
}

/// The camera of an empty scene file: a pinhole at the origin that looks along +x with z up, 90° high.
impl Default for CameraSettings {
    fn default() -> Self {
        CameraSettings {
            eye: DVec3::ZERO,
            forward: DVec3::X,
            up: DVec3::Z,
            vertical_fov: std::f64::consts::FRAC_PI_2,
            orthographic_height: None,
            focal_length: 1.0,
            near: 0.0,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        }
    }
}

impl CameraSettings {
    /// The default camera at another point, with `at` in the middle of its picture. Z is up, so that neither point may
    /// be vertically above the other.
    pub fn looking_at(eye: impl Into<DVec3>, at: impl Into<DVec3>) -> CameraSettings {
        let eye = eye.into();
        CameraSettings { eye, forward: unit(at.into() - eye), ..CameraSettings::default() }
    }
}

/// A camera over a film of a given size, ready to make rays.
///
/// The focal plane lies at the focal length in front of the eye; half its height is l·tan(θ/2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The focal point.
    pub eye: [f32; 3],
    /// The camera's axes, of length one: left = up × forward, its own up, forward.
    pub left: [f32; 3],
    /// See `left`.
    pub up: [f32; 3],
    /// See `left`.
    pub forward: [f32; 3],
    /// The film's centre in pixels.
    pub centre: [f32; 2],
    /// The width of a pixel on a focal plane at distance one; for an orthographic camera the width of a pixel in scene
    /// units.
    pub pixel_side: f32,
    /// Whether all rays are parallel to `forward`.
    pub is_orthographic: bool,
    /// The near plane: the smallest visible distance along `forward`.
    pub near: f32,
    /// The radius of the lens.
    pub aperture_radius: f32,
    /// The distance along `forward` at which the lens is in focus.
    pub focus_distance: f32,
}

impl Camera {
    /// A camera over a film of `width` × `height` pixels.
    pub fn new(settings: &CameraSettings, width: u32, height: u32) -> Camera {
        let forward = settings.forward.normalize();
        let left = settings.up.cross(forward).normalize();
        let up = forward.cross(left);
        // The length of the report's focal plane cancels in ray directions.
        let l = settings.focal_length;
        let half_height = l * libm::tan(settings.vertical_fov / 2.0);
        let of_perspective = 2.0 * half_height / f64::from(height) / l;
        let of_height = |own: f64| own / f64::from(height);
        let pixel_side = settings.orthographic_height.map_or(of_perspective, of_height);
        Camera {
            eye: narrow(settings.eye.to_array()),
            left: narrow(left.to_array()),
            up: narrow(up.to_array()),
            forward: narrow(forward.to_array()),
            centre: [width as f32 * 0.5, height as f32 * 0.5],
            pixel_side: pixel_side as f32,
            is_orthographic: settings.orthographic_height.is_some(),
            near: settings.near as f32,
            aperture_radius: settings.aperture_radius as f32,
            focus_distance: settings.focus_distance as f32,
        }
    }

    /// The ray through a film position (in pixels from the film's top left) and a lens point drawn with
    /// `lens` in [0, 1)².
    #[inline(always)]
    pub fn ray<F: Float>(&self, x: F, y: F, lens: [F; 2]) -> Ray<F> {
        function!(F, camera_ray(x, y, lens), {
            let (left, up, forward) =
                (Vec3::given(&self.left), Vec3::given(&self.up), Vec3::given(&self.forward));
            // Distances from the film's centre are exact in f32, and small in the most important part of the picture.
            let leftward = (-x + F::given(&self.centre[0])) * F::given(&self.pixel_side);
            let upward = (-y + F::given(&self.centre[1])) * F::given(&self.pixel_side);
            let across = left * leftward + up * upward;
            let (mut o, pinhole) = if self.is_orthographic {
                (Vec3::given(&self.eye) + across, forward)
            } else {
                (Vec3::given(&self.eye), forward + across)
            };
            let mut to_plane = pinhole;
            if self.aperture_radius > 0.0 {
                let (lens_x, lens_y) = warp::disk(lens);
                let shift = (left * lens_x + up * lens_y) * F::given(&self.aperture_radius);
                o = o + shift;
                to_plane = pinhole * F::given(&self.focus_distance) - shift;
            }
            let d = to_plane.normalized();
            if self.near > 0.0 {
                o = o + d * (F::given(&self.near) / d.dot(forward));
            }
            // The shutter is open for an instant.
            Ray { o, d, time: F::zero() }
        })
    }

    /// The area that a pixel covers at a point, on a plane that faces the eye. Points behind the eye have the area of
    /// the same depth in front of it.
    #[inline(always)]
    pub fn footprint<F: Float>(&self, p: Vec3<F>) -> F {
        let side = F::given(&self.pixel_side);
        if self.is_orthographic {
            return side * side;
        }
        // A pixel at the angle θ from the axis covers the solid angle side²·cos³θ, and r²·cos³θ = z³/r.
        let from_eye = p - Vec3::given(&self.eye);
        let z = from_eye.dot(Vec3::given(&self.forward)).abs();
        let r = from_eye.length().max(F::splat(f32::MIN_POSITIVE));
        z * z * (z / r) * (side * side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> CameraSettings {
        CameraSettings { eye: DVec3::new(1.0, 2.0, 3.0), ..CameraSettings::default() }
    }

    fn close(a: Vec3<f32>, b: [f32; 3]) {
        assert!((a - Vec3::splat(b)).length() < 1e-6, "{a:?} is not {b:?}");
    }

    #[test]
    fn the_field_of_view_spans_the_height_and_the_centre_looks_forward() {
        let camera = Camera::new(&settings(), 640, 480);
        let h = std::f32::consts::FRAC_1_SQRT_2;
        close(camera.ray(320.0, 240.0, [0.0; 2]).d, [1.0, 0.0, 0.0]);
        close(camera.ray(320.0, 0.0, [0.0; 2]).d, [h, 0.0, h]);
        close(camera.ray(320.0, 480.0, [0.0; 2]).d, [h, 0.0, -h]);
        // The film's left edge is the camera's left: +y when looking along +x with z up.
        assert!(camera.ray(0.0, 240.0, [0.0; 2]).d.y > 0.0);
        close(camera.ray(0.0, 240.0, [0.0; 2]).o, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn the_focal_length_does_not_affect_rays() {
        let near = Camera::new(&settings(), 64, 48);
        let far = Camera::new(&CameraSettings { focal_length: 4.0, ..settings() }, 64, 48);
        assert_eq!(near, far);
    }

    #[test]
    fn a_footprint_is_the_area_between_the_rays_of_a_pixel() {
        let camera = Camera::new(&settings(), 64, 48);
        for (x, y) in [(32.0, 24.0), (0.5, 0.5), (63.5, 24.0), (40.0, 47.5)] {
            let d = |x: f32, y: f32| camera.ray(x, y, [0.0; 2]).d;
            let across = d(x + 0.5, y) - d(x - 0.5, y);
            let along = d(x, y + 0.5) - d(x, y - 0.5);
            for distance in [0.5_f32, 3.0, 40.0] {
                let area = across.cross(along).length() * distance * distance;
                let found = camera.footprint(Vec3::splat(camera.eye) + d(x, y) * distance);
                assert!((found / area - 1.0).abs() < 2e-3, "({x}, {y}): {found}, not {area}");
            }
        }
        assert_eq!(camera.footprint(Vec3::<f32>::splat(camera.eye)), 0.0);
    }

    #[test]
    fn rays_start_at_the_near_plane() {
        let camera = Camera::new(&CameraSettings { near: 5.0, ..settings() }, 64, 48);
        for (x, y) in [(0.0, 0.0), (32.0, 24.0), (64.0, 10.0)] {
            let ray = camera.ray(x, y, [0.0; 2]);
            assert!((ray.o.x - 6.0_f32).abs() < 1e-5, "starts at {:?}", ray.o);
        }
    }

    #[test]
    fn an_orthographic_camera_covers_its_height_with_parallel_rays() {
        let camera = CameraSettings { orthographic_height: Some(6.0), ..settings() };
        let film = Camera::new(&camera, 64, 48);
        for (x, y, left, up) in [(32.0, 24.0, 0.0, 0.0), (0.0, 0.0, 4.0, 3.0), (64.0, 48.0, -4.0, -3.0)] {
            let ray = film.ray(x, y, [0.0; 2]);
            close(ray.d, [1.0, 0.0, 0.0]);
            close(ray.o, [1.0, 2.0 + left, 3.0 + up]);
        }
        let near = Camera::new(&CameraSettings { near: 5.0, ..camera.clone() }, 64, 48);
        close(near.ray(0.0, 0.0, [0.0; 2]).o, [6.0, 6.0, 6.0]);
        // A lens is in focus at its focus distance.
        let lens = CameraSettings { aperture_radius: 0.5, focus_distance: 7.0, ..camera };
        let lens = Camera::new(&lens, 64, 48);
        for u in [[0.1, 0.2], [0.9, 0.7]] {
            let ray = lens.ray(10.0_f32, 5.0, u);
            let sharp = ray.o + ray.d * ((8.0 - ray.o.x) / ray.d.x);
            close(sharp - film.ray(10.0_f32, 5.0, [0.0; 2]).o, [7.0, 0.0, 0.0]);
            assert!((ray.d.x - 1.0).abs() > 1e-4);
        }
    }

    #[test]
    fn a_lens_is_in_focus_only_at_its_focus_distance() {
        let lens = CameraSettings { aperture_radius: 0.5, focus_distance: 7.0, ..settings() };
        let camera = Camera::new(&lens, 64, 48);
        let pinhole = Camera::new(&settings(), 64, 48).ray(10.0_f32, 5.0, [0.0; 2]);
        let target = pinhole.o + pinhole.d * (7.0 / pinhole.d.x);
        let mut spread = 0.0_f32;
        for u in [[0.1, 0.2], [0.9, 0.7], [0.5, 0.5]] {
            let ray = camera.ray(10.0_f32, 5.0, u);
            let sharp = ray.o + ray.d * ((8.0 - ray.o.x) / ray.d.x);
            assert!((sharp - target).length() < 1e-5, "{sharp:?} is not {target:?}");
            let blurred = ray.o + ray.d * ((5.0 - ray.o.x) / ray.d.x);
            spread = spread.max((blurred - (pinhole.o + pinhole.d * (4.0 / pinhole.d.x))).length());
        }
        assert!(spread > 0.1, "out of focus, rays spread by {spread}");
    }
}
