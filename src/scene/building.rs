//! Building scenes in code.

use super::description::{Entity, Group, Instance, Light, Material, MaterialKind, Scene, Shape};
use glam::DAffine3;

impl Scene {
    /// Adds a material. Returns its index, by which entities and other materials refer to it.
    pub fn add_material(&mut self, name: impl Into<String>, kind: impl Into<MaterialKind>) -> usize {
        self.materials.push(Material { name: name.into(), kind: kind.into(), ..Material::default() });
        self.materials.len() - 1
    }

    /// Adds a surface without emission, with the material of this index.
    pub fn add_entity(
        &mut self,
        name: impl Into<String>,
        shape: impl Into<Shape>,
        material: usize,
    ) -> &mut Entity {
        let (name, shape) = (name.into(), shape.into());
        self.entities.push(Entity { name, shape, material, ..Entity::default() });
        let last = self.entities.len() - 1;
        &mut self.entities[last]
    }

    /// Adds an empty group. Returns its index, for the field `within` of entities and instances.
    pub fn add_group(&mut self, name: impl Into<String>) -> usize {
        self.groups.push(Group { name: name.into() });
        self.groups.len() - 1
    }

    /// Adds an instance of the group of this index to the world.
    pub fn add_instance(
        &mut self,
        name: impl Into<String>,
        group: usize,
        transform: DAffine3,
    ) -> &mut Instance {
        self.instances.push(Instance { name: name.into(), group, transform, within: None });
        let last = self.instances.len() - 1;
        &mut self.instances[last]
    }

    /// Adds a light that is not a surface.
    pub fn add_light(&mut self, light: impl Into<Light>) {
        self.lights.push(light.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        CameraSettings, MatteParameters, MirrorParameters, PointLightParameters, SphereParameters, parse,
    };
    use std::path::Path;

    #[test]
    fn scenes_from_code_equal_those_from_files() {
        let text = r#"
            camera = { eye = [0, -6, 2.5], look_at = [0, 0, 0.9] }
            lights = [{ type = "point", position = [0, 0, 9], intensity = [1, 2, 3] }]
            [materials]
            white = { type = "matte", reflectance = [0.8, 0.8, 0.8] }
            silver = { type = "mirror", reflectance = [1, 1, 1] }
            [[entities]]
            name = "ball"
            shape = { type = "sphere", center = [0, 0, 1], radius = 1 }
            material = "silver"
            [[entities]]
            name = "lamp"
            shape = { type = "sphere", center = [2, -2, 4], radius = 0.7 }
            material = "white"
            emission = [12, 11, 9]
        "#;
        let camera = CameraSettings::looking_at([0.0, -6.0, 2.5], [0.0, 0.0, 0.9]);
        let mut scene = Scene { camera, ..Scene::default() };
        let white = scene.add_material("white", MatteParameters { reflectance: [0.8; 3], roughness: 0.0 });
        let silver = scene.add_material("silver", MirrorParameters { reflectance: [1.0; 3] });
        let ball = SphereParameters { center: [0.0, 0.0, 1.0].into(), radius: 1.0 };
        scene.add_entity("ball", ball, silver);
        let lamp = SphereParameters { center: [2.0, -2.0, 4.0].into(), radius: 0.7 };
        scene.add_entity("lamp", lamp, white).emission = [12.0, 11.0, 9.0];
        scene.add_light(PointLightParameters {
            position: [0.0, 0.0, 9.0].into(),
            intensity: Some([1.0, 2.0, 3.0]),
            power: None,
        });
        let mut read = parse(text, Path::new("a.toml")).unwrap().scene;
        // A file's materials are sorted by name, with referenced materials first.
        let place = |scene: &Scene, name: &str| scene.materials.iter().position(|m| m.name == name).unwrap();
        for entity in &mut read.entities {
            entity.material = place(&scene, &read.materials[entity.material].name);
        }
        read.materials.sort_by_key(|material| place(&scene, &material.name));
        assert_eq!(scene.checked(), Ok(read));
    }

    #[test]
    fn a_missing_file_is_an_error() {
        assert!(Scene::load("nowhere.toml").unwrap_err().to_string().contains("nowhere.toml"));
    }
}
