// Textures of every kind and pictures of every depth, on materials of every kind; dielectrics that absorb and overlap;
// shapes in groups; and materials with modifiers. This file is included in modules with `ColorSpace`, `Depth`,
// `ImageFile`, `ImageIndex`, `Picture`, `TexelFilter`, `Tile`, `Varying`, `Wrap`, all of `scene`, `Arc`, and the samples
// of `shapes.rs`.

/// A picture of pseudorandom numbers, the same in every run.
pub(super) fn speckled(size: [u32; 2], channels: u32, depth: Depth, seed: u32) -> Arc<Picture> {
    let numbers = size[0] * size[1] * channels;
    let random = |i: u32| {
        let mut h = (i + 1).wrapping_mul(0x9e37_79b9) ^ seed.wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
        (h ^ (h >> 15)) >> 8
    };
    let bytes = |i: u32| -> Vec<u8> {
        let x = random(i);
        match depth {
            Depth::Bits8 => vec![x as u8],
            Depth::Bits16 => (x as u16).to_le_bytes().to_vec(),
            // Halves between ¼ and 1.
            Depth::Half => (0x3400 + (x % 0x800) as u16).to_le_bytes().to_vec(),
            Depth::Float => (x as f32 / 16_777_216.0).to_le_bytes().to_vec(),
        }
    };
    Arc::new(Picture::new(size, [channels; 2], depth, &(0..numbers).flat_map(bytes).collect::<Vec<_>>()))
}

pub(super) fn image(file: usize) -> ImageTexture {
    ImageTexture {
        file: ImageIndex(file),
        color_space: ColorSpace::Auto,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Linear,
        mipmap: false,
        uv_scale: [1.0; 2],
        uv_offset: [0.0; 2],
        uv_rotate: 0.0,
        uv_set: 0.0,
    }
}

/// An environment picture with a sun, upwards and to one side.
pub(super) fn sunny_sky() -> ImageFile {
    let texel = |x: u32, y: u32| {
        let sun = if x == 5 && (3..5).contains(&y) { 60.0 } else { 0.0 };
        let sky = 0.3 + 0.02 * ((x * 7 + y * 5) % 11) as f32;
        [0.8 * sky + sun, sky + 0.9 * sun, 1.3 * sky + 0.7 * sun]
    };
    let places = (0..12).flat_map(|y| (0..20).map(move |x| (x, y)));
    let bytes: Vec<u8> = places.flat_map(|(x, y)| texel(x, y)).flat_map(f32::to_le_bytes).collect();
    ImageFile::of("sky".into(), Arc::new(Picture::new([20, 12], [3; 2], Depth::Float, &bytes)))
}

/// The same, rotated, tilted and tinted.
pub(super) fn sunny() -> EnvironmentPicture {
    let up = glam::DVec3::new(0.2, -0.3, 0.9).normalize();
    EnvironmentPicture { scale: [1.0, 0.9, 0.8], rotate: 2.0, up, ..EnvironmentPicture::of(ImageIndex(0)) }
}

/// Materials, textures and image files.
pub(super) fn textured_materials() -> (Vec<Material>, Vec<Texture>, Vec<ImageFile>) {
    let tile = |number, seed| Tile { number, picture: speckled([5, 4], 3, Depth::Bits8, seed) };
    let images = vec![
        ImageFile::of("eight".into(), speckled([9, 6], 3, Depth::Bits8, 1)),
        ImageFile::of("sixteen".into(), speckled([4, 7], 3, Depth::Bits16, 2)),
        ImageFile::of("half".into(), speckled([6, 3], 3, Depth::Half, 3)),
        ImageFile::of("float".into(), speckled([8, 8], 1, Depth::Float, 4)),
        ImageFile::of("mask".into(), speckled([16, 5], 1, Depth::Bits8, 5)),
        // One in the middle is missing.
        ImageFile { name: "tiles".into(), is_tiled: true, tiles: vec![tile(1001, 6), tile(1011, 7), tile(1012, 8)] },
    ];
    let of = Varying::Texture;
    let textures: Vec<TextureKind> = vec![
        ImageTexture { uv_scale: [0.7, 1.1], uv_rotate: 30.0, uv_offset: [0.1, -0.2], ..image(0) }.into(),
        ImageTexture { filter: TexelFilter::Nearest, wrap: [Wrap::Mirror, Wrap::Clamp], ..image(1) }.into(),
        ImageTexture { wrap: [Wrap::Black, Wrap::Mirror], uv_scale: [2.0; 2], ..image(2) }.into(),
        ImageTexture { color_space: ColorSpace::Data, wrap: [Wrap::Clamp, Wrap::Repeat], ..image(4) }.into(),
        ImageTexture { color_space: ColorSpace::Linear, uv_scale: [3.0, 2.0], ..image(3) }.into(),
        NoiseTexture { a: Varying::Colour([0.1, 0.2, 0.5]), b: of(0), scale: 2.0, octaves: 3.0, roughness: 0.6 }.into(),
        // A mix after a check that contains others: uv are saved and restored.
        CheckerboardTexture { even: of(1), odd: Varying::Colour([0.7, 0.3, 0.2]), checks_per_unit: [3.0, 2.0] }.into(),
        CheckerboardTexture { even: of(6), odd: of(0), checks_per_unit: [1.5, 1.0] }.into(),
        MixTexture { a: of(7), b: of(5), amount: of(3) }.into(),
        ScaleTexture { texture: of(2), by: Varying::Colour([0.9, 0.8, 1.5]) }.into(),
        ConstantTexture { value: Varying::Colour([1.5, 0.2, 0.2]) }.into(),
        ImageTexture { uv_scale: [2.0; 2], ..image(5) }.into(),
        ScaleTexture { texture: of(4), by: of(10) }.into(),
        ScaleTexture { texture: of(11), by: Varying::Colour([3.0, 2.0, 1.0]) }.into(),
        // Coarser levels, of a picture and of one within checks.
        ImageTexture { mipmap: true, uv_scale: [4.0, 3.0], ..image(0) }.into(),
        ImageTexture { mipmap: true, ..image(5) }.into(),
        CheckerboardTexture { even: of(14), odd: of(15), checks_per_unit: [2.0, 3.0] }.into(),
    ];
    let textures = textures.into_iter().map(|kind| Texture { name: "a texture".into(), kind }).collect();
    let with = |kind: MaterialKind, textures: &[(&'static str, usize)]| Material {
        name: "a material".into(),
        kind,
        textures: textures.iter().map(|&(parameter, texture)| Textured { parameter, texture }).collect(),
        ..Material::default()
    };
    let reflectance = [0.5; 3];
    let materials = vec![
        with(MatteParameters { reflectance, roughness: 0.0 }.into(), &[("reflectance", 0)]),
        with(MatteParameters { reflectance, roughness: 0.0 }.into(), &[("reflectance", 8)]),
        with(MirrorParameters { reflectance }.into(), &[("reflectance", 9)]),
        with(
            GlassParameters { ior: 1.0, reflectance: [1.0; 3], transmittance: reflectance }.into(),
            &[("transmittance", 11), ("ior", 12)],
        ),
        with(CheckerboardParameters { even: 0, odd: 1, checks_per_unit: [0.5; 2] }.into(), &[]),
        with(MatteParameters { reflectance, roughness: 0.0 }.into(), &[("reflectance", 11)]),
        with(MatteParameters { reflectance: [0.8, 0.7, 0.6], roughness: 0.0 }.into(), &[]),
        with(
            ConductorParameters { metal: None, eta: Some([1.5; 3]), k: Some([1.5; 3]), roughness: [1.0; 2] }.into(),
            &[("eta", 8), ("k", 13), ("roughness", 3)],
        ),
        with(
            DielectricParameters {
                ior: 1.5,
                roughness: [1.0; 2],
                absorption: [0.0; 3],
                priority: 0.0,
                thin_walled: false,
                reflectance: [1.0; 3],
                transmittance: reflectance,
            }
            .into(),
            &[("roughness", 3), ("ior", 12), ("transmittance", 16)],
        ),
        with(MatteParameters { reflectance, roughness: 1.0 }.into(), &[("reflectance", 14), ("roughness", 16)]),
    ];
    (materials, textures, images)
}

/// A material of a dielectric that absorbs and has a priority.
pub(super) fn dielectric(ior: f64, roughness: f64, priority: u32, absorption: [f64; 3]) -> Material {
    let parameters = DielectricParameters {
        ior,
        roughness: [roughness; 2],
        absorption,
        priority: priority.into(),
        thin_walled: false,
        reflectance: [1.0; 3],
        transmittance: [1.0; 3],
    };
    Material { name: "a dielectric".into(), kind: parameters.into(), ..Material::default() }
}

/// Grey, a green glass, water, clear ice (smooth glass), frosted glass, and black.
pub(super) fn interior_materials() -> Vec<Material> {
    let plain = |kind: MaterialKind| Material { name: "a material".into(), kind, ..Material::default() };
    vec![
        plain(MatteParameters { reflectance: [0.6; 3], roughness: 0.0 }.into()),
        dielectric(1.5, 0.0, 2, [0.6, 0.1, 0.4]),
        dielectric(1.33, 0.0, 1, [1.2, 0.5, 0.1]),
        plain(GlassParameters { ior: 1.31, reflectance: [1.0; 3], transmittance: [1.0; 3] }.into()),
        dielectric(1.6, 0.5, 3, [0.0, 0.2, 0.0]),
        plain(MatteParameters { reflectance: [0.0; 3], roughness: 0.0 }.into()),
    ]
}

/// Every bounded shape around the origin, with a size of about one, of consecutive materials.
pub(super) fn bounded_shapes() -> Vec<Entity> {
    let bounded = samples().into_iter().map(|(_, shape)| shape).filter(is_bounded);
    bounded.enumerate().map(|(material, shape)| Entity { shape, material, ..Entity::default() }).collect()
}

/// Adds a group of every bounded shape, a group that contains it twice, and instances of both with uneven scales,
/// rotations and mirroring, to a scene of at least six materials. A quad of them is a sampled light in every instance,
/// and a sphere emits that is not sampled.
pub(super) fn add_groups(scene: &mut Scene) {
    let (things, pair) = (scene.add_group("things"), scene.add_group("pair"));
    let lamp = QuadParameters {
        corner: DVec3::new(-0.2, -0.2, 1.6),
        u: DVec3::new(0.0, 0.4, 0.0),
        v: DVec3::new(0.4, 0.0, 0.0),
    };
    let ball = SphereParameters { center: DVec3::new(0.9, 1.0, -0.2), radius: 0.4 };
    let lamp = Entity { shape: lamp.into(), emission: [6.0, 5.0, 4.0], ..Entity::default() };
    let glow = Entity { shape: ball.into(), emission: [0.3, 0.4, 0.5], ..Entity::default() };
    let shapes = bounded_shapes().into_iter().map(|entity| Entity { material: entity.material % 6, ..entity });
    let all = shapes.chain([lamp, glow]);
    scene.entities.extend(all.map(|entity| Entity { within: Some(things), ..entity }));
    let place = |scale: [f64; 3], angle: f64, at: [f64; 3]| {
        let axis = DVec3::new(0.3, -0.4, 1.0).normalize();
        DAffine3::from_translation(DVec3::from_array(at))
            * DAffine3::from_axis_angle(axis, angle)
            * DAffine3::from_scale(DVec3::from_array(scale))
    };
    for (scale, angle, at) in [([1.0, 0.8, 1.2], 0.4, [-0.9, -1.6, 0.0]), ([0.6, 0.6, -0.7], 2.0, [0.8, 1.7, 0.3])] {
        let transform = place(scale, angle, at);
        scene.instances.push(Instance { group: things, within: Some(pair), transform, ..Instance::default() });
    }
    scene.add_instance("one", things, place([0.9; 3], 1.0, [4.5, 0.2, -0.4]));
    scene.add_instance("two", pair, place([1.0, 0.9, 0.8], 0.2, [6.5, 0.0, 0.3]));
    scene.add_instance("two, mirrored", pair, place([-0.5, 0.5, 0.6], -0.7, [3.6, 0.4, 1.2]));
}

/// Adds a group of shapes with maps and holes, with an uneven scale and mirroring, to a scene of these materials.
pub(super) fn add_mapped_group(scene: &mut Scene) {
    let group = scene.add_group("mapped");
    let v = DVec3::new;
    let shapes: [(Shape, usize); 4] = [
        (SphereParameters { center: v(0.1, 0.0, 0.5), radius: 0.3 }.into(), 13),
        (QuadParameters { corner: v(0.4, -0.5, -0.3), u: v(-0.1, 1.0, 0.1), v: v(0.0, 0.1, 0.9) }.into(), 16),
        (DiskParameters { center: v(-0.2, 0.6, 0.0), normal: v(-0.8, 0.0, 0.6), radius: 0.3 }.into(), 14),
        (CylinderParameters { from: v(0.0, -0.6, -0.4), to: v(0.1, -0.5, 0.4), radius: 0.2 }.into(), 14),
    ];
    let member = |(shape, material)| Entity { shape, material, within: Some(group), ..Entity::default() };
    scene.entities.extend(shapes.map(member));
    let place = DAffine3::from_translation(v(3.2, -0.2, 0.9))
        * DAffine3::from_axis_angle(v(0.3, -0.4, 1.0).normalize(), 0.5)
        * DAffine3::from_scale(v(0.8, -0.7, 0.6));
    scene.add_instance("mapped", group, place);
}

/// Makes a scene of a floor, of shapes of every kind that emit textures, and of meshes whose materials, maps, opacity and
/// emission use the second set of uv, alone and beside the first. The surfaces are around (5, 0, 0).
pub(super) fn add_glow(scene: &mut Scene) {
    let v = DVec3::new;
    scene.images = vec![
        ImageFile::of("colours".into(), speckled([9, 6], 3, Depth::Bits8, 1)),
        ImageFile::of("greys".into(), speckled([7, 8], 1, Depth::Float, 4)),
    ];
    let of = Varying::Texture;
    let second = |file| ImageTexture { uv_set: 1.0, color_space: ColorSpace::Data, ..image(file) };
    let textures: Vec<TextureKind> = vec![
        ImageTexture { uv_scale: [0.8, 1.3], ..image(0) }.into(),
        ImageTexture { uv_scale: [1.5, 2.0], ..second(0) }.into(),
        // 2 to 4: emission by the first set, by the second one, and by both.
        ScaleTexture { texture: of(0), by: Varying::Colour([3.0, 2.0, 1.5]) }.into(),
        ScaleTexture { texture: of(1), by: Varying::Colour([4.0; 3]) }.into(),
        ScaleTexture { texture: of(2), by: of(1) }.into(),
        // 5 and 6: colours and opacities by the second set; 7: heights by both.
        ImageTexture { mipmap: true, uv_scale: [2.0; 2], ..second(0) }.into(),
        second(1).into(),
        ScaleTexture { texture: of(6), by: of(0) }.into(),
    ];
    scene.textures = textures.into_iter().map(|kind| Texture { name: "a texture".into(), kind }).collect();
    let with = |kind: MaterialKind, modifiers: Modifiers, textures: &[(&'static str, usize)]| Material {
        name: "a material".into(),
        kind,
        textures: textures.iter().map(|&(parameter, texture)| Textured { parameter, texture }).collect(),
        modifiers,
    };
    let none = Modifiers::default();
    let matte = |reflectance| -> MaterialKind { MatteParameters { reflectance, roughness: 0.0 }.into() };
    let metal = ConductorParameters { metal: None, eta: Some([0.2; 3]), k: Some([3.0; 3]), roughness: [0.5; 2] };
    let bumps = Modifiers { bump_map: Some(Named), bump_scale: 0.2, ..none };
    scene.materials = vec![
        with(matte([0.6, 0.7, 0.5]), none, &[]),
        with(matte([0.0; 3]), none, &[]),
        with(matte([0.5; 3]), bumps, &[("reflectance", 5), ("opacity", 6), ("bump_map", 7)]),
        with(metal.into(), Modifiers { normal_map: Some(Named), normal_scale: 0.5, ..none }, &[("normal_map", 1)]),
    ];
    let tent = |corners: [[f32; 3]; 4]| Mesh {
        positions: corners.to_vec(),
        uv: vec![[0.0, 0.0], [1.0, 0.2], [0.9, 1.1], [0.1, 0.8]],
        second_uv: vec![[0.3, 1.0], [0.1, 0.1], [1.2, 0.0], [1.0, 0.9]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mesh = |mesh: Mesh| Shape::Mesh { mesh: Arc::new(mesh), transform: DAffine3::IDENTITY };
    let wall = mesh(tent([[7.0, 2.5, -1.4], [7.0, -2.5, -1.4], [7.4, -2.5, 1.6], [7.0, 2.5, 1.8]]));
    let metal = mesh(tent([[5.5, 2.4, -1.2], [4.2, 2.6, -1.2], [4.2, 2.4, 0.4], [5.5, 2.2, 0.2]]));
    let lamp = mesh(tent([[4.0, -0.6, 1.6], [4.0, 0.6, 1.6], [5.2, 0.6, 2.0], [5.2, -0.6, 1.7]]));
    let screen = mesh(tent([[3.8, -1.6, -1.4], [3.4, -0.8, -1.4], [3.4, -0.9, -0.9], [3.7, -1.7, -0.8]]));
    let plane = PlaneParameters { normal: DVec3::Z, distance: -1.5 };
    let plain = |shape: Shape, material| Entity { shape, material, ..Entity::default() };
    let emitting = |shape: Shape, texture| Entity { emission_texture: Some(texture), ..plain(shape, 1) };
    let bowl: Shape = SphereParameters { center: v(6.2, 0.2, 0.9), radius: 0.3 }.into();
    let tube: Shape = CylinderParameters { from: v(4.6, -2.0, -1.3), to: v(4.4, -2.3, 0.2), radius: 0.25 }.into();
    let ring: Shape = CylinderParameters { from: v(3.6, 0.9, -1.2), to: v(3.4, 0.4, -1.0), radius: 0.35 }.into();
    scene.entities = vec![
        plain(plane.into(), 0),
        plain(wall, 2),
        plain(metal, 3),
        Entity { flip_normal: true, ..emitting(lamp, 4) },
        emitting(screen, 3),
        emitting(SphereParameters { center: v(5.0, -0.9, -0.8), radius: 0.45 }.into(), 2),
        Entity { flip_normal: true, ..emitting(bowl, 2) },
        emitting(DiskParameters { center: v(5.0, 1.2, -0.6), normal: v(-0.8, -0.6, 0.0), radius: 0.5 }.into(), 2),
        emitting(tube, 2),
        Entity { flip_normal: true, ..emitting(ring, 2) },
    ];
    scene.render.max_depth = 4;
}

/// [`textured_materials`], followed by mixes, holes, back sides, and normal and height maps.
pub(super) fn modified_materials() -> (Vec<Material>, Vec<Texture>, Vec<ImageFile>) {
    let (mut materials, mut textures, images) = textured_materials();
    let (normals, heights) = (textures.len(), textures.len() + 1);
    let kinds: [TextureKind; 2] = [
        ImageTexture { color_space: ColorSpace::Data, ..image(0) }.into(),
        ImageTexture { color_space: ColorSpace::Data, mipmap: true, uv_scale: [0.5; 2], ..image(4) }.into(),
    ];
    textures.extend(kinds.map(|kind| Texture { name: "a map".into(), kind }));
    let none = Modifiers::default();
    let with = |kind: MaterialKind, modifiers: Modifiers, textures: &[(&'static str, usize)]| Material {
        name: "a modified material".into(),
        kind,
        textures: textures.iter().map(|&(parameter, texture)| Textured { parameter, texture }).collect(),
        modifiers,
    };
    let matte: MaterialKind = MatteParameters { reflectance: [0.6, 0.7, 0.4], roughness: 0.0 }.into();
    let (eta, k) = (Some([0.2, 0.9, 1.1]), Some([3.9, 2.4, 2.2]));
    let metal: MaterialKind = ConductorParameters { metal: None, eta, k, roughness: [0.4, 0.6] }.into();
    let glass: MaterialKind =
        GlassParameters { ior: 1.5, reflectance: [1.0; 3], transmittance: [0.9; 3] }.into();
    let first = materials.len();
    let maps = Modifiers { normal_map: Some(Named), normal_scale: 0.4, bump_map: Some(Named), bump_scale: 0.05, ..none };
    materials.extend([
        // 10: by a texture; 11: opacity by a texture; 12: a back side, and a high opacity.
        with(MixParameters { a: 5, b: 2, amount: 0.5 }.into(), none, &[("amount", 8)]),
        with(matte.clone(), none, &[("opacity", 3)]),
        with(matte.clone(), Modifiers { opacity: 0.7, back: Some(first), ..none }, &[]),
        // 13: a normal map on a bump map; 14: only a bump map; 15: glass with a normal map.
        with(metal, maps, &[("normal_map", normals), ("bump_map", heights)]),
        with(matte, Modifiers { bump_map: Some(Named), bump_scale: -0.1, ..none }, &[("bump_map", 5), ("reflectance", 0)]),
        with(glass, Modifiers { normal_map: Some(Named), normal_scale: 0.2, ..none }, &[("normal_map", normals)]),
        // 16: all modifiers on checks; 17: in a mix of mixes.
        with(
            CheckerboardParameters { even: first + 1, odd: first + 4, checks_per_unit: [2.0, 1.5] }.into(),
            Modifiers { opacity: 0.8, ..maps },
            &[("normal_map", normals), ("bump_map", heights)],
        ),
        with(MixParameters { a: first + 6, b: first + 2, amount: 0.4 }.into(), none, &[]),
    ]);
    (materials, textures, images)
}
