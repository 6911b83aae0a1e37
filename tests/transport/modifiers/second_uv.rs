//! The second set of uv, compared with the first.

use super::{INTEGRATORS, bits};
use crate::common::scenes::{emitting, matte, mesh, plane, point_light, scene, sphere, v};
use glam::DVec3;
use std::sync::Arc;
use stride::parameter::ImageIndex;
use stride::scene::{
    Entity, ImageFile, ImageTexture, Material, Mesh, Modifiers, Named, Scene, Shape, Texture, TextureKind,
    Textured,
};
use stride::texture::{ColorSpace, Depth, Picture, TexelFilter, Wrap};

const UV: [[f32; 2]; 4] = [[0.2, 0.1], [1.3, 0.0], [1.1, 0.9], [0.0, 1.2]];
const OTHER: [[f32; 2]; 4] = [[1.0, 0.0], [0.9, 1.0], [0.1, 0.8], [0.0, 0.1]];

/// A wall with both sets of uv.
fn wall(uv: [[f32; 2]; 4], second_uv: [[f32; 2]; 4], material: usize) -> Entity {
    let positions = vec![[4.0, 3.0, -2.0], [4.0, -3.0, -2.0], [4.5, -3.0, 2.0], [4.0, 3.0, 2.5]];
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    let all =
        Mesh { positions, uv: uv.to_vec(), second_uv: second_uv.to_vec(), triangles, ..Mesh::default() };
    mesh(all, material)
}

fn texture(uv_set: f64, mipmap: bool, scale: f64) -> TextureKind {
    ImageTexture {
        file: ImageIndex(0),
        color_space: ColorSpace::Data,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Linear,
        mipmap,
        uv_scale: [scale; 2],
        uv_offset: [0.1; 2],
        uv_rotate: 20.0,
        uv_set,
    }
    .into()
}

/// A scene of the wall, whose parameter is a texture, with a ball before it.
fn before(parameter: &'static str, set: f64, entity: Entity) -> Scene {
    let none = Modifiers::default();
    let modifiers = match parameter {
        "normal_map" => Modifiers { normal_map: Some(Named), normal_scale: 0.4, ..none },
        "bump_map" => Modifiers { bump_map: Some(Named), bump_scale: 0.1, ..none },
        _ => none,
    };
    let is_emission = parameter == "emission";
    let textures = if is_emission { Vec::new() } else { vec![Textured { parameter, texture: 0 }] };
    let material = Material { textures, modifiers, ..matte([0.5; 3]) };
    let emission_texture = is_emission.then_some(0);
    let entities = vec![
        Entity { emission_texture, ..entity },
        plane(DVec3::Z, -2.0, 1),
        sphere(v(2.8, 0.4, -0.5), 0.5, 1),
        emitting(sphere(v(1.0, 0.0, 3.0), 0.4, 1), 9.0),
    ];
    let mut all = scene(vec![material, matte([0.6, 0.5, 0.4])], entities);
    let bytes: Vec<u8> = (0..16 * 12 * 3).map(|i: u32| (i * i * 37 % 251) as u8).collect();
    let picture = Picture::new([16, 12], [3; 2], Depth::Bits8, &bytes);
    all.images = vec![ImageFile::of("picture".into(), Arc::new(picture))];
    let mipmap = parameter == "reflectance";
    let kind = texture(set, mipmap, if mipmap { 9.0 } else { 1.0 });
    all.textures = vec![Texture { name: "texture".into(), kind }];
    all.lights = vec![point_light(v(0.0, 2.0, 1.0), 6.0)];
    all.render.max_depth = 3;
    all.render.samples = 4;
    all
}

#[test]
fn a_second_set_shows_what_the_same_first_set_shows() {
    for parameter in ["reflectance", "opacity", "normal_map", "bump_map", "emission"] {
        for integrator in INTEGRATORS {
            let shown = |set: f64, uv, second_uv| {
                let mut scene = before(parameter, set, wall(uv, second_uv, 0));
                scene.render.integrator = integrator;
                bits(&scene)
            };
            let expected = shown(0.0, OTHER, UV);
            let second = shown(1.0, UV, OTHER);
            assert!(expected == second, "{parameter}, {integrator:?}: another picture");
            // Negative control.
            assert!(shown(0.0, UV, OTHER) != second, "{parameter}, {integrator:?}: no difference");
        }
    }
}

#[test]
fn a_shape_without_a_second_set_is_refused() {
    let problems = |entity: Entity, parameter| {
        let scene = before(parameter, 1.0, entity);
        scene.problems().iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(problems(wall(UV, OTHER, 0), "reflectance"), [""; 0]);
    let ball = || sphere(v(4.0, 0.0, 0.0), 1.0, 0);
    let mut bare = wall(UV, OTHER, 0);
    if let Shape::Mesh { mesh, .. } = &mut bare.shape {
        Arc::make_mut(mesh).second_uv.clear();
    }
    let told = "entity 1 (\"entity\"): \"entity\" has no second set of uv, which its texture \"texture\" needs (uv_set = 1)";
    for parameter in ["reflectance", "opacity", "emission"] {
        assert_eq!(problems(ball(), parameter), [told], "{parameter}");
        assert_eq!(problems(bare.clone(), parameter), [told], "{parameter}");
    }
}
