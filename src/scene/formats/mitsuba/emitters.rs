//! Lights that are not surfaces, and the environment.

use super::builder::Builder;
use super::object::Object;
use super::report::Read;
use super::spectrum::Of;
use super::transform::affine;
use crate::light::Falloff;
use crate::math::{Frame, Vec3, narrow};
use crate::parameter::ImageIndex;
use crate::scene::description::{
    DirectionalLightParameters, EnvironmentPicture, Light, PointLightParameters, SpotLightParameters,
};
use glam::{DAffine3, DVec3};

impl Builder<'_, '_> {
    /// Adds the light of an emitter that is not inside a shape.
    pub(super) fn emitter(&mut self, index: usize) -> Read<()> {
        let object = self.object(index);
        object.ignore(&["sampling_weight"]);
        match object.plugin.as_str() {
            "point" => self.point(object),
            "spot" => self.spot(object),
            "directional" => self.directional(object),
            "constant" => self.constant(object),
            "envmap" => self.environment_map(object),
            // An area light with an id is referred to by shapes.
            "area" => {
                object.read.set(false);
                if object.id.is_empty() {
                    return Err(self.reports.error(object.place, "an area light must be inside a shape"));
                }
                Ok(())
            }
            _ => {
                self.reports.lacks(object.place, object.what(), "it is left out");
                object.ignore_all();
                Ok(())
            }
        }
    }

    fn add_light(&mut self, object: &Object, light: impl Into<Light>) {
        self.scene.lights.push(light.into());
        self.places.lights.push(object.place);
    }

    /// The transform from a light's space to the world.
    fn placement(&mut self, object: &Object) -> Read<DAffine3> {
        match object.transform("to_world", self.reports)? {
            None => Ok(DAffine3::IDENTITY),
            Some((transform, place)) => affine(&transform)
                .ok_or_else(|| self.reports.error(place, "the last row of this transform is not 0 0 0 1")),
        }
    }

    /// The unit vector of a direction in the world.
    fn direction(&mut self, object: &Object, direction: DVec3) -> Read<DVec3> {
        let unit = crate::parameter::unit(direction);
        if unit.is_finite() {
            return Ok(unit);
        }
        Err(self.reports.error(object.place, format!("{} has no direction", object.what())))
    }

    fn point(&mut self, object: &Object) -> Read<()> {
        let position = match object.triple("position", self.reports)? {
            Some(position) => DVec3::from(position),
            None => self.placement(object)?.translation,
        };
        let intensity = Some(self.colour(object, "intensity", 1.0, Of::Light)?);
        self.add_light(object, PointLightParameters { position, intensity, power: None });
        Ok(())
    }

    fn spot(&mut self, object: &Object) -> Read<()> {
        let to_world = self.placement(object)?;
        let direction = self.direction(object, to_world.transform_vector3(DVec3::Z))?;
        let intensity = self.colour(object, "intensity", 1.0, Of::Light)?;
        let cone_angle = object.number("cutoff_angle", 20.0, self.reports)?;
        let beam = object.number("beam_width", cone_angle * 0.75, self.reports)?;
        if let Some(texture) = object.find("texture") {
            self.reports.lacks(
                texture.place,
                "texture of emitter \"spot\"",
                "the light is the same all over its cone",
            );
        }
        let light = SpotLightParameters {
            position: to_world.translation,
            direction,
            intensity: Some(intensity),
            power: None,
            cone_angle,
            penumbra_angle: Some((cone_angle - beam).max(0.0)),
            falloff: Falloff::Angle,
        };
        self.add_light(object, light);
        Ok(())
    }

    fn directional(&mut self, object: &Object) -> Read<()> {
        let direction = match object.triple("direction", self.reports)? {
            Some(direction) => DVec3::from(direction),
            None => self.placement(object)?.transform_vector3(DVec3::Z),
        };
        let direction = self.direction(object, direction)?;
        let irradiance = self.colour(object, "irradiance", 1.0, Of::Light)?;
        self.add_light(object, DirectionalLightParameters { direction, irradiance, angular_diameter: 0.0 });
        Ok(())
    }

    /// Whether the scene already has an environment. A second one is reported.
    fn has_environment(&mut self, object: &Object) -> bool {
        let is_second = self.places.has_environment;
        if is_second {
            self.reports.lacks(object.place, "a second environment", "the first one is used");
        }
        self.places.has_environment = true;
        self.places.environment = object.place;
        is_second
    }

    fn constant(&mut self, object: &Object) -> Read<()> {
        // A constant environment does not depend on its orientation.
        object.ignore(&["to_world"]);
        let radiance = self.colour(object, "radiance", 1.0, Of::Light)?;
        if !self.has_environment(object) {
            self.scene.environment = radiance;
        }
        Ok(())
    }

    /// Adds an environment map. In its space up is y, the middle column is seen along z, and the column a quarter left
    /// of it along x.
    fn environment_map(&mut self, object: &Object) -> Read<()> {
        object.ignore(&["mis_compensation"]);
        let linear = self.placement(object)?.matrix3;
        let file = ImageIndex(self.image(object, "filename")?);
        let scale = object.number("scale", 1.0, self.reports)?;
        if self.has_environment(object) {
            return Ok(());
        }
        let up = self.direction(object, linear * DVec3::Y)?;
        let ahead = self.direction(object, linear * DVec3::Z)?;
        let left = self.direction(object, linear * DVec3::X)?;
        if up.cross(ahead).dot(left) < 0.999 {
            let what = "a to_world of emitter \"envmap\" that mirrors or shears";
            self.reports.lacks(object.place, what, "up and the middle column are right");
        }
        // What a number of degrees becomes, so that there is one to be written in TOML.
        let rotate = turn(up, ahead).to_degrees().to_radians();
        let mut picture = EnvironmentPicture::of(file);
        (picture.scale, picture.rotate, picture.up) = ([scale; 3], rotate, up);
        self.scene.environment_picture = Some(picture);
        Ok(())
    }
}

/// The rotation about `up`, in radians, that moves the middle column of a stride environment to the direction `ahead`.
fn turn(up: DVec3, ahead: DVec3) -> f64 {
    let up: [f32; 3] = narrow((up + DVec3::ZERO).to_array());
    let frame = Frame::<f32>::around(Vec3::splat(up));
    let along = |v: Vec3<f32>| ahead.dot(DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z)));
    libm::atan2(along(frame.t), along(frame.s))
}
