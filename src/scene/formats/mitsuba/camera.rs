//! Cameras and films.

use super::builder::Builder;
use super::object::{Object, Tag};
use super::report::Read;
use super::transform::affine;
use crate::scene::description::{CameraSettings, Filter, LONGEST_SIDE, Sampler};
use crate::scene::spelling::{instead, quote};
use glam::DVec3;

/// Width and height of a film, and the rendered region unless it is the whole film.
pub(super) type Crop = Option<[u32; 4]>;

impl Builder<'_, '_> {
    /// Reads the camera with a name, or the first one, with its film and sampler. Returns the rendered region.
    pub(super) fn sensor(&mut self, name: Option<&str>) -> Read<Crop> {
        let scene = self.object(0);
        let sensors = self.document.children(scene, Tag::Sensor);
        let of = |&index: &usize| &self.document.objects[index];
        let chosen = match name {
            None => sensors.first().map(of),
            Some(name) => match sensors.iter().map(of).find(|sensor| sensor.id == name) {
                Some(chosen) => Some(chosen),
                None => {
                    let ids: Vec<_> = sensors
                        .iter()
                        .map(|index| of(index).id.as_str())
                        .filter(|id| !id.is_empty())
                        .collect();
                    let message = format!("no sensor has the id {}", quote(name));
                    let help = || instead(name, ids.iter().copied());
                    return Err(self.reports.error_with(scene.place, message, help));
                }
            },
        };
        let Some(sensor) = chosen else {
            let help = || Some("add one, or name a file that includes this one and has one".into());
            return Err(self.reports.error_with(scene.place, "the scene has no sensor", help));
        };
        sensor.read.set(true);
        self.places.camera = sensor.place;
        let film = self.child(sensor, Tag::Film);
        let crop = self.film(film);
        if let Some(sampler) = self.child(sensor, Tag::Sampler) {
            self.sampler(sampler)?;
        }
        sensor.ignore(&["shutter_open", "shutter_close"]);
        for &medium in self.document.children(sensor, Tag::Medium) {
            let medium = &self.document.objects[medium];
            self.reports.lacks(medium.place, medium.what(), "it is left out");
        }
        let crop = crop?;
        match sensor.plugin.as_str() {
            "perspective" | "thinlens" | "orthographic" => self.camera(sensor)?,
            _ => {
                let what = sensor.what();
                return Err(self.reports.error_with(
                    sensor.place,
                    format!("{what} has no counterpart"),
                    || Some("use perspective, thinlens or orthographic".into()),
                ));
            }
        }
        Ok(crop)
    }

    fn camera(&mut self, sensor: &Object) -> Read<()> {
        let (width, height) = (self.scene.film.width, self.scene.film.height);
        let aspect = f64::from(width) / f64::from(height);
        let is_parallel = sensor.plugin == "orthographic";
        let to_world = match sensor.transform("to_world", self.reports)? {
            None => glam::DAffine3::IDENTITY,
            Some((transform, place)) => match affine(&transform) {
                Some(transform) => transform,
                None => {
                    let message = "the last row of this transform is not 0 0 0 1";
                    return Err(self.reports.error(place, message));
                }
            },
        };
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| to_world.transform_vector3(axis));
        if to_world.matrix3.determinant() <= 0.0 {
            let what = "a to_world of a sensor with a reflection";
            self.reports.lacks(sensor.place, what, "the picture is not mirrored");
        }
        let near = sensor.number("near_clip", 1e-2, self.reports)?;
        let far = sensor.number("far_clip", 1e4, self.reports)?;
        let mut camera = CameraSettings {
            eye: to_world.translation,
            forward: crate::parameter::unit(z),
            up: crate::parameter::unit(y),
            near,
            ..CameraSettings::default()
        };
        for name in ["principal_point_offset_x", "principal_point_offset_y"] {
            if sensor.number(name, 0.0, self.reports)? != 0.0 {
                self.reports.lacks(sensor.place, format!("{name} of a sensor"), "the picture is centred");
            }
        }
        if is_parallel {
            // The film is two units of the camera's space wide.
            sensor.ignore(&["focus_distance", "far_clip"]);
            if (x.length() - y.length()).abs() > 1e-4 * x.length() {
                let what = "a to_world of an orthographic sensor that scales x and y differently";
                self.reports.lacks(sensor.place, what, "its pixels are square");
            }
            // The transform also scales lengths along the direction of view.
            camera.near = near * z.length();
            camera.orthographic_height = Some(2.0 * x.length() / aspect);
        } else {
            camera.vertical_fov = self.vertical_fov(sensor, aspect)?;
            // A pinhole camera has no focus distance.
            let focus_distance = sensor.number("focus_distance", far, self.reports)?;
            if sensor.plugin == "thinlens" {
                camera.aperture_radius = sensor.number("aperture_radius", f64::NAN, self.reports)?;
                camera.focus_distance = focus_distance;
                if camera.aperture_radius.is_nan() {
                    let message = "sensor \"thinlens\" has no aperture_radius";
                    return Err(self.reports.error(sensor.place, message));
                }
            }
        }
        self.scene.camera = camera;
        Ok(())
    }

    /// The angle between the top and the bottom of the image, in radians.
    fn vertical_fov(&mut self, sensor: &Object, aspect: f64) -> Read<f64> {
        let half = |degrees: f64| libm::tan(degrees.to_radians() / 2.0);
        let (fov, axis) = match (sensor.find("fov"), sensor.text("focal_length", self.reports)?) {
            (Some(_), Some((_, place))) => {
                return Err(self.reports.error(place, "the sensor has both fov and focal_length"));
            }
            (Some(_), None) => {
                let axes = [
                    ("x", "x"),
                    ("y", "y"),
                    ("diagonal", "diagonal"),
                    ("smaller", "smaller"),
                    ("larger", "larger"),
                ];
                let axis = match sensor.word("fov_axis", &axes, self.reports)? {
                    "smaller" if aspect > 1.0 => "y",
                    "larger" if aspect <= 1.0 => "y",
                    "smaller" | "larger" => "x",
                    axis => axis,
                };
                (sensor.number("fov", 0.0, self.reports)?, axis)
            }
            (None, given) => {
                let (text, place) = given.unwrap_or(("50mm", sensor.place));
                let length =
                    super::text::number(text.trim().trim_end_matches("mm")).filter(|length| *length > 0.0);
                let Some(length) = length else {
                    let message = format!("focal_length must be a length like 50mm, not {}", quote(text));
                    return Err(self.reports.error(place, message));
                };
                // Focal lengths are for a film of 36 mm by 24 mm.
                let diagonal = libm::sqrt(36.0 * 36.0 + 24.0 * 24.0);
                ((2.0 * libm::atan(diagonal / (2.0 * length))).to_degrees(), "diagonal")
            }
        };
        if !(fov > 0.0 && fov < 180.0) {
            return Err(self
                .reports
                .error(sensor.place, format!("fov must be above 0 and below 180, not {fov}")));
        }
        let half_height = match axis {
            "x" => half(fov) / aspect,
            "y" => half(fov),
            _ => half(fov) / libm::sqrt(1.0 + aspect * aspect),
        };
        // What a number of degrees becomes, so that there is one to be written in TOML.
        Ok((2.0 * libm::atan(half_height)).to_degrees().to_radians())
    }

    fn film(&mut self, film: Option<&Object>) -> Read<Crop> {
        // The size without a film.
        let (mut width, mut height) = (768, 576);
        let mut crop = None;
        let mut filter = Filter::Gaussian { radius: 2.0, sigma: 0.5 };
        if let Some(film) = film {
            self.places.film = film.place;
            let formats = ["file_format", "pixel_format", "component_format", "banner", "compensate"];
            film.ignore(&formats);
            film.ignore(&["sample_border", "high_quality_edges"]);
            if film.plugin != "hdrfilm" {
                self.reports.lacks(film.place, film.what(), "a film of colours is rendered instead");
            }
            let mut side = |name: &str, default: u32, least: i64| {
                let given = film.whole(name, default.into(), self.reports)?;
                let side = u32::try_from(given)
                    .ok()
                    .filter(|side| (least..=LONGEST_SIDE.into()).contains(&i64::from(*side)));
                side.ok_or_else(|| {
                    let message = format!("{name} must be from {least} to {LONGEST_SIDE}, not {given}");
                    self.reports.error(film.place, message)
                })
            };
            (width, height) = (side("width", width, 1)?, side("height", height, 1)?);
            let (x, y) = (side("crop_offset_x", 0, 0)?, side("crop_offset_y", 0, 0)?);
            let (w, h) = (side("crop_width", width, 1)?, side("crop_height", height, 1)?);
            if u64::from(x) + u64::from(w) > width.into() || u64::from(y) + u64::from(h) > height.into() {
                let message = format!("the crop of the film reaches beyond its {width}×{height} pixels");
                return Err(self.reports.error(film.place, message));
            }
            if film.plugin != "hdrfilm" {
                film.ignore_all();
            }
            crop = Some([x, y, w, h]).filter(|crop| *crop != [0, 0, width, height]);
            if let Some(own) = self.child(film, Tag::Filter) {
                filter = self.filter(own)?;
            }
        }
        self.scene.film.width = width;
        self.scene.film.height = height;
        self.scene.film.filter = filter;
        Ok(crop)
    }

    fn filter(&mut self, object: &Object) -> Read<Filter> {
        Ok(match object.plugin.as_str() {
            "box" => Filter::Box { radius: object.number("radius", 0.5, self.reports)? },
            "tent" => Filter::Tent { radius: object.number("radius", 1.0, self.reports)? },
            "gaussian" => {
                let sigma = object.number("stddev", 0.5, self.reports)?;
                Filter::Gaussian { radius: 4.0 * sigma, sigma }
            }
            "mitchell" => {
                let b = object.number("B", 1.0 / 3.0, self.reports)?;
                let c = object.number("C", 1.0 / 3.0, self.reports)?;
                Filter::Mitchell { radius: 2.0, b, c }
            }
            "catmullrom" => Filter::Mitchell { radius: 2.0, b: 0.0, c: 0.5 },
            "lanczos" => Filter::Lanczos { radius: object.whole("lobes", 3, self.reports)? as f64 },
            _ => {
                self.reports.lacks(object.place, object.what(), "a gaussian is rendered instead");
                Filter::Gaussian { radius: 2.0, sigma: 0.5 }
            }
        })
    }

    fn sampler(&mut self, object: &Object) -> Read<()> {
        object.ignore(&["jitter", "strength"]);
        let (count, seed) =
            (object.whole("sample_count", 4, self.reports)?, object.whole("seed", 0, self.reports)?);
        let samples = u32::try_from(count).ok().filter(|count| *count > 0);
        let (Some(samples), Ok(seed)) = (samples, u32::try_from(seed)) else {
            let message = "sample_count must be from 1 to 4294967295, and seed from 0";
            return Err(self.reports.error(object.place, message));
        };
        self.scene.render.samples = samples;
        self.scene.render.seed = seed;
        self.scene.render.sampler = match object.plugin.as_str() {
            "independent" => Sampler::Independent,
            // The other samplers are stratified.
            "stratified" | "multijitter" | "orthogonal" | "ldsampler" => Sampler::Sobol,
            _ => {
                self.reports.lacks(object.place, object.what(), "scrambled Sobol points are used instead");
                Sampler::Sobol
            }
        };
        Ok(())
    }
}
