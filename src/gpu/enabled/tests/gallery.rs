//! Scenes of textures, image-based light, overlapping dielectrics, modified materials, and groups, which the digests
//! test, too.

use super::scenes::{cylinder, disk, plane, quad, scene, sphere};
use crate::scene::{
    BoxParameters, ConductorParameters, Entity, GlassParameters, Material, MatteParameters,
    PointLightParameters, Scene, Shape,
};
use glam::DVec3;

/// Textures of every kind on materials of every kind, on shapes of every kind.
pub(super) fn gallery(width: u32, height: u32) -> Scene {
    let (materials, textures, images) = textured::textured_materials();
    let light =
        Entity { emission: [6.0, 5.0, 4.0], ..quad([4.0, -1.0, 3.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], 6) };
    let entities = vec![
        plane([0.0, 0.0, 1.0], -1.5, 4),
        quad([7.0, 3.0, -1.5], [0.0, -3.0, 0.0], [0.5, 0.0, 3.5], 5),
        quad([7.0, -0.1, -1.5], [0.0, -3.0, 0.0], [0.5, 0.0, 3.5], 1),
        sphere([5.0, 1.8, -0.7], 0.8, 2),
        sphere([4.0, 0.0, -0.7], 0.7, 3),
        sphere([5.0, -1.8, -0.6], 0.9, 1),
        sphere([3.6, 1.1, -1.1], 0.4, 7),
        sphere([3.6, -1.0, -1.1], 0.4, 8),
        quad([2.0, -3.0, -1.4], [5.0, 0.0, 0.0], [0.0, 0.4, 2.0], 9),
        disk([5.5, 0.0, 1.2], [-1.0, 0.0, 0.0], 0.6, 9),
        cylinder([4.5, 2.4, -1.5], [4.5, 2.4, 0.5], 0.3, 9),
        Entity { emission_texture: Some(13), ..quad([3.0, 3.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], 6) },
        light,
    ];
    let mut scene = Scene { textures, images, ..scene(width, height, materials, entities) };
    scene.environment = [0.2, 0.3, 0.4];
    scene.render.max_depth = 6;
    scene
}

/// Rough metal, glass and matte spheres on a floor, under a picture with a sun, beside a lamp.
pub(super) fn sunny(width: u32, height: u32) -> Scene {
    let of = |kind| Material { name: "a material".into(), kind, ..Material::default() };
    let matte = MatteParameters { reflectance: [0.6, 0.5, 0.4], roughness: 0.0 };
    let metal = ConductorParameters {
        metal: None,
        eta: Some([0.2, 0.9, 1.1]),
        k: Some([3.9, 2.4, 2.1]),
        roughness: [0.4; 2],
    };
    let glass = GlassParameters { ior: 1.5, reflectance: [1.0; 3], transmittance: [1.0; 3] };
    let materials = vec![of(matte.into()), of(metal.into()), of(glass.into())];
    let lamp = quad([3.5, -3.5, 1.5], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 0);
    let entities = vec![
        plane([0.0, 0.0, 1.0], -1.0, 0),
        sphere([4.0, 1.4, -0.3], 0.7, 0),
        sphere([4.0, 0.0, -0.3], 0.7, 1),
        sphere([4.0, -1.4, -0.3], 0.7, 2),
        Entity { emission: [5.0; 3], ..lamp },
    ];
    let images = vec![textured::sunny_sky()];
    let environment_picture = Some(textured::sunny());
    Scene { images, environment_picture, ..scene(width, height, materials, entities) }
}

/// Dielectrics with absorption that overlap, with a lamp and a grey sphere inside.
pub(super) fn interiors(width: u32, height: u32) -> Scene {
    let emitting = |emission, entity| Entity { emission: [emission; 3], ..entity };
    let cuboid = |min, max, material| {
        let [min, max] = [min, max].map(DVec3::from_array);
        Entity { shape: Shape::Box(BoxParameters { min, max }), material, ..Entity::default() }
    };
    let entities = vec![
        plane([0.0, 0.0, 1.0], -1.5, 0),
        plane([-1.0, 0.0, 0.0], -8.0, 0),
        cuboid([3.0, -1.6, -1.4], [3.3, 1.6, 0.5], 1),
        cuboid([3.2, -1.5, -1.35], [5.0, 1.5, 0.2], 2),
        sphere([4.0, 0.8, -0.5], 0.5, 1),
        sphere([4.2, -0.8, -0.6], 0.5, 4),
        sphere([4.0, 0.0, -1.0], 0.3, 0),
        sphere([4.2, 0.1, 0.2], 0.35, 3),
        emitting(8.0, sphere([4.6, 0.3, -0.5], 0.2, 5)),
        emitting(5.0, quad([3.0, -1.0, 3.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], 5)),
    ];
    let mut scene = scene(width, height, textured::interior_materials(), entities);
    let position = DVec3::new(4.5, -0.2, -0.3);
    let light = PointLightParameters { position, intensity: Some([1.0; 3]), power: None };
    scene.lights = vec![light.into()];
    scene.environment = [0.2, 0.3, 0.4];
    scene.render.max_depth = 8;
    scene
}

/// Every bounded shape in groups, with materials that use uv and others.
pub(super) fn groups(width: u32, height: u32) -> Scene {
    let (materials, textures, images) = textured::textured_materials();
    let floor = plane([0.0, 0.0, 1.0], -1.8, 6);
    let mut scene = Scene { textures, images, ..scene(width, height, materials, vec![floor]) };
    textured::add_groups(&mut scene);
    scene.environment = [0.2, 0.3, 0.4];
    scene.render.max_depth = 5;
    scene
}

/// Materials with mixes, holes, back sides and maps, on shapes of every kind.
pub(super) fn modified(width: u32, height: u32) -> Scene {
    let (materials, textures, images) = textured::modified_materials();
    let up = [0.0, 0.0, 4.5];
    let emitting = |entity, emission| Entity { emission: [emission; 3], ..entity };
    let entities = vec![
        plane([0.0, 0.0, 1.0], -1.5, 16),
        quad([7.0, 3.0, -1.5], [0.0, -6.0, 0.0], up, 10),
        sphere([5.0, 1.8, -0.6], 0.9, 13),
        sphere([4.0, 0.0, -0.7], 0.7, 15),
        sphere([5.0, -1.8, -0.6], 0.9, 17),
        Entity { flip_normal: true, ..sphere([3.6, 1.1, -1.1], 0.4, 12) },
        quad([2.0, 1.0, -1.4], [0.2, -2.5, 0.0], [0.0, 0.0, 1.2], 11),
        quad([2.4, 0.6, -1.4], [0.0, -2.5, 0.3], [0.0, 0.2, 1.4], 12),
        disk([5.5, 0.0, 1.2], [-1.0, 0.0, 0.0], 0.6, 14),
        cylinder([4.5, 2.4, -1.5], [4.5, 2.4, 0.5], 0.3, 14),
        emitting(quad([4.0, -1.0, 3.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], 11), 4.0),
    ];
    let mut scene = Scene { textures, images, ..scene(width, height, materials, entities) };
    textured::add_mapped_group(&mut scene);
    scene.environment = [0.2, 0.3, 0.4];
    scene.render.max_depth = 6;
    scene
}

/// Shapes of every kind that emit textures, and meshes that use both sets of uv.
pub(super) fn glow(width: u32, height: u32) -> Scene {
    let mut scene = scene(width, height, Vec::new(), Vec::new());
    textured::add_glow(&mut scene);
    scene
}

mod textured {
    use crate::parameter::{ImageIndex, Varying};
    use crate::scene::*;
    use crate::shape::samples::{is_bounded, samples};
    use crate::texture::{ColorSpace, Depth, ImageFile, Picture, TexelFilter, Tile, Wrap};
    use std::sync::Arc;
    include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/common/gallery.rs"));
}
