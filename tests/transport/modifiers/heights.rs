//! Slopes of height maps, compared with mathematics.

use super::{flats, has_normal, sunlit, textured};
use crate::common::scenes::matte;
use glam::DVec3;
use std::sync::Arc;
use stride::math::Vec3;
use stride::math::lanes::scalar::Wrapping;
use stride::parameter::{ImageIndex, Varying};
use stride::scene::{
    CheckerboardTexture, ImageFile, ImageTexture, NoiseTexture, Scene, Texture, TextureKind,
};
use stride::texture::{ColorSpace, Compiler, Depth, Picture, Site, TexelFilter, Wrap};

/// A ramp of heights along u or v, as a picture of floats without steps between its texels.
fn with_ramp(scene: Scene, along_v: bool) -> Scene {
    const TEXELS: u32 = 64;
    let size = if along_v { [1, TEXELS] } else { [TEXELS, 1] };
    // The first row of a picture is the uppermost.
    let height = |i: u32| if along_v { TEXELS - 1 - i } else { i };
    let texels: Vec<u8> =
        (0..TEXELS).flat_map(|i| (height(i) as f32 / TEXELS as f32).to_le_bytes()).collect();
    let picture = Picture::new(size, [1; 2], Depth::Float, &texels);
    let ramp = ImageTexture {
        file: ImageIndex(0),
        color_space: ColorSpace::Data,
        wrap: [Wrap::Clamp; 2],
        filter: TexelFilter::Linear,
        mipmap: false,
        uv_scale: [1.0; 2],
        uv_offset: [0.0; 2],
        uv_rotate: 0.0,
        uv_set: 0.0,
    };
    let textures = vec![Texture { name: "ramp".into(), kind: ramp.into() }];
    Scene { textures, images: vec![ImageFile::of("ramp".into(), Arc::new(picture))], ..scene }
}

#[test]
fn heights_tilt_normals_by_their_slope_in_world_space() {
    for (name, entity, [u, v, n]) in flats() {
        println!("{name}");
        for (along_v, up) in [(false, u), (true, v)] {
            let mut bumpy = textured(matte([0.5; 3]), "bump_map");
            bumpy.modifiers.bump_scale = 6.0;
            // uv increase by one over a length of 18 on all of them.
            let slope = 6.0 / 18.0;
            has_normal(&with_ramp(sunlit(entity.clone(), bumpy), along_v), n - up * slope, 2e-3);
        }
    }
}

/// Heights of a picture of `count` texels in a row, between 0 and 1.
fn height(i: usize) -> f64 {
    (i * i % 7) as f64 / 7.0
}

/// A picture of [`height`] along u or along v.
fn heights(count: usize, along_v: bool) -> ImageFile {
    let size = if along_v { [1, count as u32] } else { [count as u32, 1] };
    // The first row of a picture is the uppermost.
    let number = |i| if along_v { count - 1 - i } else { i };
    let bytes: Vec<u8> = (0..count).flat_map(|i| (height(number(i)) as f32).to_le_bytes()).collect();
    ImageFile::of("heights".into(), Arc::new(Picture::new(size, [1; 2], Depth::Float, &bytes)))
}

#[test]
fn slopes_are_those_between_texels_at_any_scale_and_size() {
    let (_, entity, [u, v, n]) = flats().remove(0);
    let at = 5;
    for count in [8, 64, 1024] {
        for (scale, along_v, checks) in [
            (1.0, false, None),
            (0.25, false, None),
            (12.0, false, None),
            (-3.0, false, None),
            (12.0, true, None),
            (2.0, false, Some(3.0)),
        ] {
            // The middle of the view has uv of one half, which are moved between the centres of two texels. In the
            // middle of three checks, coordinates are one half as well.
            let between = (at + 1) as f64 / count as f64;
            let ramp = ImageTexture {
                file: ImageIndex(0),
                color_space: ColorSpace::Data,
                wrap: [Wrap::Repeat; 2],
                filter: TexelFilter::Linear,
                mipmap: false,
                uv_scale: [scale; 2],
                uv_offset: [between - scale / 2.0; 2],
                uv_rotate: 0.0,
                uv_set: 0.0,
            };
            let mut textures = vec![Texture { name: "ramp".into(), kind: ramp.into() }];
            let mut per_unit = scale;
            if let Some(checks) = checks {
                per_unit *= checks;
                let (even, odd) = (Varying::Texture(0), Varying::Texture(0));
                let kind = CheckerboardTexture { even, odd, checks_per_unit: [checks; 2] }.into();
                textures.push(Texture { name: "checks".into(), kind });
            }
            let mut bumpy = textured(matte([0.5; 3]), "bump_map");
            bumpy.textures[0].texture = textures.len() - 1;
            // Texels per length, and a scale that makes the slope one third.
            let steepness = (height(at + 1) - height(at)) * per_unit * count as f64 / 18.0;
            bumpy.modifiers.bump_scale = (1.0 / 3.0) / steepness;
            let mut scene =
                Scene { textures, images: vec![heights(count, along_v)], ..sunlit(entity.clone(), bumpy) };
            scene.camera.vertical_fov = 2e-6;
            println!("{count} texels, {scale} times, along v: {along_v}, checks: {checks:?}");
            has_normal(&scene, n - if along_v { v } else { u } / 3.0, 2e-3);
        }
    }
}

#[test]
fn slopes_of_noise_do_not_depend_on_its_scale() {
    let noise = |scale: f64| -> TextureKind {
        let (a, b) = (Varying::Colour([0.0; 3]), Varying::Colour([1.0; 3]));
        NoiseTexture { a, b, scale, octaves: 2.0, roughness: 0.5 }.into()
    };
    for scale in [0.2, 40.0] {
        let kinds = [noise(scale)];
        let mut compiler = Compiler::new(&kinds, &[]);
        let root = compiler.root(0);
        let table = compiler.finish();
        // The middle of the view is at (3, 0, 0), where noise is zero if the scale is whole.
        let at = |p: [f64; 3]| {
            let site = Site::new(Vec3::splat(p.map(|x| x as f32)), [0.0; 2], 0.0);
            f64::from(table.value::<f32>(Wrapping(root), site).r)
        };
        let h = 0.01 / scale;
        let slope = |d: DVec3| {
            (at((DVec3::X * 3.0 + d * h).to_array()) - at((DVec3::X * 3.0 - d * h).to_array())) / (2.0 * h)
        };
        let gradient = DVec3::Y * slope(DVec3::Y) + DVec3::Z * slope(DVec3::Z);
        assert!(gradient.length() > 0.05 * scale, "{gradient}");
        let mut bumpy = textured(matte([0.5; 3]), "bump_map");
        bumpy.modifiers.bump_scale = 0.4 / gradient.length();
        let (_, entity, [_, _, n]) = flats().remove(0);
        let textures = vec![Texture { name: "noise".into(), kind: noise(scale) }];
        let mut scene = Scene { textures, ..sunlit(entity, bumpy) };
        scene.camera.vertical_fov = 2e-6;
        has_normal(&scene, n - gradient * (0.4 / gradient.length()), 5e-3);
    }
}
