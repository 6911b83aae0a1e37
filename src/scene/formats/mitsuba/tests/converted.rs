//! Every plugin and parameter, converted: the written scene is read as the same scene, without a warning.

use super::super::load;
use crate::scene::formats::LoadOptions;
use crate::scene::{Fingerprint, Scene, Sources, writing};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Plugins with their required properties and optional ones, each of which is in a scene of its own. For each kind of
/// object, with the beginning and the end of the scene.
type Kind = (&'static str, &'static str, &'static [(&'static str, &'static str, &'static [&'static str])]);

const MOVED: &str = "<transform name='to_world'><scale value='0.7'/><rotate x='1' y='0.3' angle='17'/><translate x='0.3' z='-2'/></transform>";
const TURNED: &str =
    "<transform name='to_world'><rotate x='1' y='0.3' angle='17'/><translate x='0.3' z='-2'/></transform>";
const SQUEEZED: &str =
    "<transform name='to_world'><scale x='0.7' y='1.3'/><rotate x='1' y='0.3' angle='17'/></transform>";
const FLIPPED: &str = "<boolean name='flip_normals' value='true'/>";
const BOARD: &str = "<texture type='checkerboard' name='reflectance'/>";
const GGX: &str = "<string name='distribution' value='ggx'/>";
const INNER: &str = "<bsdf type='diffuse'><rgb name='reflectance' value='0.1 0.2 0.3'/></bsdf>";
const OTHER: &str = "<bsdf type='conductor'><string name='material' value='Au'/></bsdf>";
const WIDTH: &str = "<texture type='checkerboard' name='alpha'><float name='color0' value='0.03'/><float name='color1' value='0.2'/></texture>";
const TO_UV: &str = "<transform name='to_uv'><scale x='2' y='3'/><rotate z='1' angle='30'/><translate x='0.3' y='0.1'/></transform>";
const CHECKS: &str = "<transform name='to_uv'><scale x='2.5' y='-3'/><translate x='0.5'/></transform>";

#[rustfmt::skip]
const KINDS: &[Kind] = &[
    ("", "", &[
        ("<shape type='rectangle'>", "</shape>", &["", MOVED, SQUEEZED, FLIPPED, "<float name='silhouette_sampling_weight' value='1'/>"]),
        ("<shape type='sphere'>", "</shape>", &["", MOVED, SQUEEZED, FLIPPED, "<point name='center' x='1' y='0.1'/>", "<float name='radius' value='0.3'/>"]),
        ("<shape type='sphere'><bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf>", "</shape>", &["", MOVED]),
        ("<shape type='disk'>", "</shape>", &["", MOVED, SQUEEZED, FLIPPED]),
        ("<shape type='cylinder'>", "</shape>", &["", MOVED, SQUEEZED, FLIPPED, "<point name='p0' x='1'/>", "<point name='p1' y='0.3'/>", "<float name='radius' value='0.3'/>"]),
        ("<shape type='cylinder'><bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf>", "</shape>", &["", MOVED]),
        ("<shape type='cube'>", "</shape>", &["", MOVED, SQUEEZED, FLIPPED]),
        ("<shape type='obj'><string name='filename' value='m.obj'/>", "</shape>", &["", MOVED, SQUEEZED, FLIPPED, "<boolean name='flip_tex_coords' value='false'/>", "<boolean name='face_normals' value='true'/>"]),
        ("<shape type='ply'><string name='filename' value='m.ply'/>", "</shape>", &["", MOVED, SQUEEZED, "<boolean name='flip_tex_coords' value='true'/>", "<boolean name='face_normals' value='true'/>"]),
        ("<shape type='serialized'><string name='filename' value='m.serialized'/>", "</shape>", &["", MOVED, SQUEEZED, "<integer name='shape_index' value='1'/>", "<boolean name='face_normals' value='true'/>"]),
        ("<shape type='merge'><shape type='cube'/><shape type='sphere'/></shape>", "", &[""]),
        ("<shape type='shapegroup' id='g'><shape type='cube'/><shape type='disk'><transform name='to_world'><scale x='2'/></transform></shape></shape><shape type='cube'/><shape type='instance'><ref id='g'/>", "</shape>", &["", MOVED, SQUEEZED]),
        ("<shape type='shapegroup' id='g'><shape type='cube'/></shape><shape type='merge'><shape type='instance'><ref id='g'/>", "</shape></shape>", &["", MOVED]),
        ("<shape type='cube'/><shape type='linearcurve'>", "</shape>", &[""]),
    ]),
    ("<shape type='sphere'>", "</shape>", &[
        ("<bsdf type='diffuse'>", "</bsdf>", &["", "<rgb name='reflectance' value='0.1 0.2 0.3'/>", "<float name='reflectance' value='0.3'/>", "<spectrum name='reflectance' value='400:0.1, 700:0.9'/>", "<spectrum name='reflectance' filename='s.spd'/>", BOARD]),
        ("<bsdf type='conductor'>", "</bsdf>", &["", "<string name='material' value='Cu'/>", "<string name='material' value='none'/>", "<rgb name='eta' value='0.1 0.2 0.3'/>", "<rgb name='k' value='3 2 1'/>", "<rgb name='specular_reflectance' value='0.9 0.8 0.7'/>"]),
        ("<bsdf type='roughconductor'><string name='distribution' value='ggx'/>", "</bsdf>", &["", "<string name='material' value='Al'/>", "<rgb name='eta' value='0.1 0.2 0.3'/>", "<rgb name='k' value='3 2 1'/>", "<rgb name='specular_reflectance' value='0.9 0.8 0.7'/>", "<rgb name='specular_reflectance' value='0.7'/>", "<float name='alpha' value='0.3'/>", "<float name='alpha_u' value='0.3'/><float name='alpha_v' value='0.1'/>", WIDTH, "<boolean name='sample_visible' value='true'/>"]),
        ("<bsdf type='roughconductor'>", "</bsdf>", &["", GGX, "<string name='distribution' value='beckmann'/>"]),
        ("<bsdf type='dielectric'>", "</bsdf>", &["", "<float name='int_ior' value='1.7'/>", "<string name='int_ior' value='diamond'/>", "<string name='ext_ior' value='water'/>", "<rgb name='specular_reflectance' value='0.9 0.8 0.7'/>", "<rgb name='specular_transmittance' value='0.9 0.8 0.7'/>"]),
        ("<bsdf type='roughdielectric'><string name='distribution' value='ggx'/>", "</bsdf>", &["", "<float name='int_ior' value='1.7'/>", "<float name='ext_ior' value='1.1'/>", "<float name='alpha' value='0.3'/>", WIDTH, "<rgb name='specular_reflectance' value='0.9 0.8 0.7'/>", "<rgb name='specular_transmittance' value='0.9 0.8 0.7'/>"]),
        ("<bsdf type='thindielectric'>", "</bsdf>", &["", "<float name='int_ior' value='1.7'/>", "<rgb name='specular_reflectance' value='0.9 0.8 0.7'/>", "<rgb name='specular_transmittance' value='0.9 0.8 0.7'/>"]),
        ("<bsdf type='twosided'>", "</bsdf>", &[INNER, "<bsdf type='diffuse'/><bsdf type='conductor'/>", "<boolean name='allow_transmission' value='true'/><bsdf type='diffuse'/>"]),
        ("<bsdf type='null'>", "</bsdf>", &[""]),
        ("<bsdf type='mask'><bsdf type='diffuse'/>", "</bsdf>", &["", "<float name='opacity' value='0.3'/>", "<texture type='checkerboard' name='opacity'/>"]),
        ("<bsdf type='bumpmap'><bsdf type='diffuse'/><texture type='checkerboard'/>", "</bsdf>", &["", "<float name='scale' value='0.3'/>", "<boolean name='use_shadowing_function' value='false'/>"]),
        ("<bsdf type='normalmap'><bsdf type='diffuse'/>", "</bsdf>", &["<texture type='rawconstant' name='normalmap'><vector name='value' value='0.5 0.6 1'/></texture>", "<texture type='bitmap' name='normalmap'><string name='filename' value='p.png'/><boolean name='raw' value='true'/></texture><boolean name='flip_invalid_normals' value='false'/>"]),
        ("<bsdf type='blendbsdf'><bsdf type='diffuse'/><bsdf type='conductor'><string name='material' value='Au'/></bsdf>", "</bsdf>", &["", "<float name='weight' value='0.3'/>", "<texture type='checkerboard' name='weight'/>"]),
        ("<bsdf type='plastic'>", "</bsdf>", &["", "<rgb name='diffuse_reflectance' value='0.1 0.2 0.3'/>"]),
        ("<bsdf type='roughplastic'>", "</bsdf>", &[""]),
        ("<bsdf type='pplastic'>", "</bsdf>", &[""]),
        ("<bsdf type='principled'>", "</bsdf>", &["", "<rgb name='base_color' value='0.1 0.2 0.3'/>"]),
        ("<bsdf type='principledthin'>", "</bsdf>", &[""]),
        ("<emitter type='area'>", "</emitter>", &["", "<rgb name='radiance' value='1 2 3'/>", "<float name='sampling_weight' value='1'/>", "<texture type='checkerboard' name='radiance'/>", "<texture type='blackbody' name='radiance'><float name='temperature' value='3000'/></texture>"]),
        ("<bsdf type='diffuse' id='a'/><bsdf type='conductor'/>", "", &[OTHER]),
    ]),
    ("<shape type='rectangle'><bsdf type='diffuse'>", "</bsdf></shape>", &[
        ("<texture type='bitmap' name='reflectance'><string name='filename' value='p.png'/>", "</texture>", &["", "<boolean name='raw' value='true'/>", "<string name='filter_type' value='nearest'/>", "<string name='filter_type' value='bilinear'/>", "<string name='wrap_mode' value='repeat'/>", "<string name='wrap_mode' value='mirror'/>", "<string name='wrap_mode' value='clamp'/>", TO_UV, "<string name='format' value='auto'/>", "<boolean name='accel' value='true'/>"]),
        ("<texture type='checkerboard' name='reflectance'>", "</texture>", &["", "<rgb name='color0' value='0.1 0.2 0.3'/>", "<rgb name='color1' value='0.1 0.2 0.3'/>", CHECKS, "<texture type='bitmap' name='color0'><string name='filename' value='p.png'/></texture>"]),
        ("<texture type='srgb' name='reflectance'>", "</texture>", &["", "<rgb name='color' value='0.1 0.2 0.3'/>"]),
        ("<texture type='uniform' name='reflectance'>", "</texture>", &["", "<float name='value' value='0.3'/>"]),
        ("<texture type='rawconstant' name='reflectance'>", "</texture>", &["<float name='value' value='0.3'/>", "<rgb name='value' value='0.1 0.2 0.3'/>"]),
        ("<texture type='d65' name='reflectance'>", "</texture>", &["", "<float name='scale' value='0.3'/>", "<rgb name='color' value='0.1 0.2 0.3'/>"]),
        ("<texture type='blackbody' name='reflectance'><float name='temperature' value='700'/>", "</texture>", &["", "<float name='wavelength_min' value='500'/>", "<float name='wavelength_max' value='600'/>"]),
        ("<texture type='regular' name='reflectance'>", "</texture>", &["<string name='values' value='0.1, 0.5, 0.2'/>", "<string name='values' value='0.1, 0.5'/><float name='wavelength_min' value='400'/><float name='wavelength_max' value='700'/>", "<spectrum name='value' value='400:0.1, 700:0.9'/>"]),
        ("<texture type='irregular' name='reflectance'>", "</texture>", &["<string name='wavelengths' value='400, 500, 700'/><string name='values' value='0.1, 0.5, 0.2'/>"]),
        ("<texture type='volume' name='reflectance'>", "</texture>", &[""]),
    ]),
    ("<shape type='cube'/>", "", &[
        ("<emitter type='point'>", "</emitter>", &["", "<point name='position' x='1' y='0.1'/>", MOVED, "<rgb name='intensity' value='1 2 3'/>"]),
        ("<emitter type='spot'>", "</emitter>", &["", TURNED, "<rgb name='intensity' value='1 2 3'/>", "<float name='cutoff_angle' value='33.3'/>", "<float name='beam_width' value='7.7'/>", "<texture type='bitmap' name='texture'><string name='filename' value='p.png'/></texture>"]),
        ("<emitter type='directional'>", "</emitter>", &["", "<vector name='direction' x='1' y='0.1'/>", TURNED, "<rgb name='irradiance' value='1 2 3'/>"]),
        ("<emitter type='constant'>", "</emitter>", &["", "<rgb name='radiance' value='1 2 3'/>", TURNED]),
        ("<emitter type='envmap'><string name='filename' value='p.png'/>", "</emitter>", &["", "<float name='scale' value='0.3'/>", TURNED, "<boolean name='mis_compensation' value='true'/>"]),
        ("<emitter type='projector'>", "</emitter>", &[""]),
        ("<integrator type='path'>", "</integrator>", &["", "<integer name='max_depth' value='7'/>", "<integer name='max_depth' value='0'/>", "<integer name='max_depth' value='100000'/>", "<integer name='rr_depth' value='3'/>", "<boolean name='hide_emitters' value='true'/>", "<integer name='block_size' value='8'/>", "<integer name='samples_per_pass' value='8'/>", "<float name='timeout' value='8'/>"]),
        ("<integrator type='direct'>", "</integrator>", &["", "<integer name='shading_samples' value='1'/>", "<integer name='emitter_samples' value='1'/>", "<integer name='bsdf_samples' value='1'/>"]),
        ("<integrator type='moment'><integrator type='path'>", "</integrator></integrator>", &["", "<integer name='max_depth' value='7'/>"]),
        ("<integrator type='aov'><integrator type='path'/>", "</integrator>", &["", "<string name='aovs' value='d:depth'/>"]),
        ("<integrator type='ptracer'>", "</integrator>", &[""]),
        ("<integrator type='volpath'>", "</integrator>", &[""]),
        ("<integrator type='volpathmis'>", "</integrator>", &[""]),
        ("<integrator type='prb'>", "</integrator>", &[""]),
        ("<integrator type='prb_basic'>", "</integrator>", &[""]),
    ]),
];

/// Sensors, which replace the sensor of other scenes.
#[rustfmt::skip]
const SENSORS: Kind = ("<shape type='cube'/>", "", &[
    ("<sensor type='perspective'>", "</sensor>", &["", TURNED, "<float name='fov' value='33.3'/>", "<float name='fov' value='33.3'/><string name='fov_axis' value='x'/>", "<float name='fov' value='33.3'/><string name='fov_axis' value='y'/>", "<float name='fov' value='33.3'/><string name='fov_axis' value='diagonal'/>", "<float name='fov' value='33.3'/><string name='fov_axis' value='smaller'/>", "<float name='fov' value='33.3'/><string name='fov_axis' value='larger'/>", "<string name='focal_length' value='33mm'/>", "<float name='near_clip' value='0.3'/>", "<float name='far_clip' value='30'/>", "<float name='focus_distance' value='3'/>", "<float name='principal_point_offset_x' value='0.1'/>", "<float name='principal_point_offset_y' value='0.1'/>", "<float name='shutter_open' value='0'/>", "<float name='shutter_close' value='1'/>"]),
    ("<sensor type='thinlens'><float name='aperture_radius' value='0.1'/>", "</sensor>", &["", TURNED, "<float name='focus_distance' value='3.3'/>"]),
    ("<sensor type='orthographic'>", "</sensor>", &["", MOVED]),
    ("<sensor type='perspective'><film type='hdrfilm'>", "</film></sensor>", &["", "<integer name='width' value='33'/>", "<integer name='height' value='33'/>", "<integer name='crop_offset_x' value='3'/><integer name='crop_offset_y' value='5'/><integer name='crop_width' value='7'/><integer name='crop_height' value='9'/>", "<string name='file_format' value='openexr'/>", "<string name='pixel_format' value='rgb'/>", "<string name='component_format' value='float32'/>", "<boolean name='banner' value='false'/>", "<boolean name='compensate' value='true'/>", "<boolean name='sample_border' value='true'/>", "<boolean name='high_quality_edges' value='true'/>"]),
    ("<sensor type='perspective'><film type='specfilm'/>", "</sensor>", &[""]),
    ("<sensor type='perspective'><film type='hdrfilm'><rfilter type='box'>", "</rfilter></film></sensor>", &["", "<float name='radius' value='0.7'/>"]),
    ("<sensor type='perspective'><film type='hdrfilm'><rfilter type='tent'>", "</rfilter></film></sensor>", &["", "<float name='radius' value='0.7'/>"]),
    ("<sensor type='perspective'><film type='hdrfilm'><rfilter type='gaussian'>", "</rfilter></film></sensor>", &["", "<float name='stddev' value='0.7'/>"]),
    ("<sensor type='perspective'><film type='hdrfilm'><rfilter type='mitchell'>", "</rfilter></film></sensor>", &["", "<float name='B' value='0.2'/>", "<float name='C' value='0.2'/>"]),
    ("<sensor type='perspective'><film type='hdrfilm'><rfilter type='catmullrom'/>", "</film></sensor>", &[""]),
    ("<sensor type='perspective'><film type='hdrfilm'><rfilter type='lanczos'>", "</rfilter></film></sensor>", &["", "<integer name='lobes' value='2'/>"]),
    ("<sensor type='perspective'><sampler type='independent'>", "</sampler></sensor>", &["", "<integer name='sample_count' value='33'/>", "<integer name='seed' value='33'/>"]),
    ("<sensor type='perspective'><sampler type='stratified'>", "</sampler></sensor>", &["", "<boolean name='jitter' value='true'/>"]),
    ("<sensor type='perspective'><sampler type='multijitter'>", "</sampler></sensor>", &[""]),
    ("<sensor type='perspective'><sampler type='orthogonal'>", "</sampler></sensor>", &["", "<integer name='strength' value='2'/>"]),
    ("<sensor type='perspective'><sampler type='ldsampler'>", "</sampler></sensor>", &[""]),
]);

/// All scenes, each with one property.
fn scenes() -> Vec<String> {
    let mut all = Vec::new();
    let light = "<emitter type='point'><point name='position' z='5'/></emitter>";
    for (kinds, sensor) in [
        (
            KINDS,
            "<sensor type='perspective'><transform name='to_world'><translate z='-7'/></transform></sensor>",
        ),
        (&[SENSORS], ""),
    ] {
        for &(before, after, plugins) in kinds {
            for &(start, end, properties) in plugins {
                all.extend(properties.iter().map(|property| {
                    format!(
                        "<scene version='3.0.0'>{sensor}{light}{before}{start}{property}{end}{after}</scene>"
                    )
                }));
            }
        }
    }
    all
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("written");
    write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0.3\nvt 0 0.25\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    write(
        "m.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float u\nproperty float v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0.25\n1 0 0 1 0\n0 1 0.3 0 1\n3 0 1 2\n",
    );
    write("s.spd", "400 0.1\n500 0.7\n700 0.2\n");
    let meshes = super::super::serialized::example();
    fs::write(folder.path().join("m.serialized"), meshes).expect("written");
    let checks = image::RgbImage::from_fn(8, 4, |x, y| image::Rgb([40 * (x % 5) as u8, 90, 60 * y as u8]));
    checks.save(folder.path().join("p.png")).expect("written");
    folder
}

/// The properties by which two scenes are distinguished.
fn identity(scene: &Scene, sources: &Sources) -> (String, [String; 2]) {
    let digits = Fingerprint::of(scene, sources).digits();
    (digits, [format!("{:?}", scene.film), format!("{:?}", scene.render)])
}

/// Converts the scene in a file. Returns the identities of the scene and of the written one.
fn converted(path: &Path, into: &Path) -> [(String, [String; 2]); 2] {
    let loaded = load(path, &LoadOptions::default(), &mut |_, _, _| {});
    let loaded = loaded.unwrap_or_else(|errors| panic!("{errors}\n{}", fs::read_to_string(path).unwrap()));
    let written =
        writing::write(&loaded.scene, path.parent().unwrap(), Path::new("files")).expect("it can be written");
    fs::create_dir_all(into.join("files")).expect("made");
    for (file, contents) in &written.files {
        contents.write(fs::File::create(into.join(file)).expect("a file")).expect("written");
    }
    let toml = into.join("a.toml");
    fs::write(&toml, &written.text).expect("written");
    let again = crate::scene::load(&toml).unwrap_or_else(|errors| panic!("{errors}\n{}", written.text));
    // A texture of a part that is left out.
    let of_unused = |message: &str| message.starts_with("texture ") && message.ends_with(" is not used");
    let warnings: Vec<_> = again.warnings.iter().filter(|warning| !of_unused(&warning.message)).collect();
    assert!(warnings.is_empty(), "{warnings:?} in {}", written.text);
    [identity(&loaded.scene, &loaded.sources), identity(&again.scene, &again.sources)]
}

#[test]
fn all_that_is_read_is_the_same_when_it_is_converted() {
    let folder = folder();
    let path = folder.path().join("a.xml");
    let mut identities = Vec::new();
    for text in scenes() {
        fs::write(&path, &text).expect("written");
        let [own, again] = converted(&path, &folder.path().join("out"));
        assert_eq!(own, again, "{text}");
        identities.push(own);
    }
    // Negative control: scenes are distinguished. Many differ only in parts that are left out.
    identities.sort();
    identities.dedup();
    assert!(identities.len() > 100, "{} of {}", identities.len(), scenes().len());
}

/// The names of plugins and properties in the source, in all forms in which it reads them.
fn asked_for() -> Vec<(&'static str, String)> {
    const SOURCES: [(&str, &str); 7] = [
        ("camera", include_str!("../camera.rs")),
        ("emitters", include_str!("../emitters.rs")),
        ("integrators", include_str!("../integrators.rs")),
        ("materials", include_str!("../materials.rs")),
        ("meshes", include_str!("../meshes.rs")),
        ("shapes", include_str!("../shapes.rs")),
        ("textures", include_str!("../textures.rs")),
    ];
    const WAYS: [&str; 13] = [
        ".number(",
        ".whole(",
        ".flag(",
        ".text(",
        ".triple(",
        ".transform(",
        ".word(",
        ".find(",
        ".file(object, ",
        ".image(object, ",
        "shade(object, ",
        "colour(object, ",
        "roughness(object, ",
    ];
    let mut all = Vec::new();
    for (file, source) in SOURCES {
        let source = source.split("#[cfg(test)]").next().unwrap_or_default();
        for way in WAYS {
            let names =
                source.split(way).skip(1).filter_map(|rest| rest.strip_prefix('"')?.split('"').next());
            all.extend(names.map(|name| (file, name.to_owned())));
        }
        // Matches with a text: plugins.
        for line in source.lines().map(str::trim_start).filter(|line| line.starts_with('"')) {
            let Some((pattern, _)) = line.split_once(" => ") else { continue };
            all.extend(pattern.split('"').skip(1).step_by(2).map(|name| (file, name.to_owned())));
        }
    }
    all
}

#[test]
fn all_that_is_read_is_enumerated_here() {
    let text: String = scenes().concat();
    let asked_for = asked_for();
    assert!(asked_for.len() > 80, "{asked_for:?}");
    for (file, name) in asked_for {
        let is_there = [format!("='{name}'"), format!("<{name}")].iter().any(|given| text.contains(given));
        assert!(is_there, "{file}.rs reads {name:?}, which no row of KINDS or SENSORS has: add one");
    }
}
