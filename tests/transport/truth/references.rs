//! Images compared with those of an independent renderer: `tests/reference/README.md`.

use crate::common::blocks::{Estimate, Reference, Verdict, compare};
use crate::common::estimate;
use crate::common::scenes::*;
use exr::prelude::read_first_rgba_layer_from_file;
use std::fs;
use std::path::Path;
use stride::scene::{Sampler, Scene, parse};

fn reference(name: &str, spp: u32) -> Reference {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/reference/{name}.exr"));
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width() as u32, vec![[0.0; 3]; size.area()]),
        |(width, rgb), at, (r, g, b, _): (f32, f32, f32, f32)| {
            rgb[at.y() * *width as usize + at.x()] = [r, g, b].map(f64::from);
        },
    );
    let (width, rgb) = image.expect("a reference picture").layer_data.channel_data.pixels;
    Reference { width, height: rgb.len() as u32 / width, rgb, spp }
}

fn cover_with(samples: u32, change: impl FnOnce(&mut Scene)) -> Scene {
    let mut scene = cover(160, 120);
    scene.render.samples = samples;
    change(&mut scene);
    scene
}

fn judge(ours: &Estimate, theirs: &Reference) -> Verdict {
    compare(&ours.blocks(), &theirs.blocks(ours))
}

/// Requires that an image agrees with the reference: in the mean within 0.3%, in blocks at the level of
/// `common::blocks`.
fn must_be(scene: &Scene, theirs: &Reference) {
    must_be_with(scene, theirs, 1.05);
}

/// The same with limits for the root mean square of all z.
fn must_be_with(scene: &Scene, theirs: &Reference, limit: f64) {
    let ours = estimate(scene);
    for (a, b) in ours.mean().into_iter().zip(theirs.mean()) {
        assert!((a / b - 1.0).abs() < 0.003, "means {a} and {b} differ by {:.2}%", (a / b - 1.0) * 100.0);
    }
    let verdict = judge(&ours, theirs);
    println!("{verdict}");
    assert!(verdict.agrees(), "{verdict}");
    // The reference samples lights, and so has less noise than the same number of our samples. Without any noise of its
    // own, the rms of these z would be √⅔ or √½. Outside these limits the noise estimate is wrong and the bound is
    // meaningless.
    assert!((0.65..limit).contains(&verdict.rms), "{verdict}");
}

#[test]
fn the_cover_matches_the_independent_renderer() {
    must_be(&cover_with(4096, |_| {}), &reference("cover-160x120", 8192));
}

#[test]
fn the_cover_at_depth_2_matches_the_independent_renderer() {
    must_be(&cover_with(4096, |scene| scene.render.max_depth = 2), &reference("cover-depth2-160x120", 4096));
}

#[test]
fn the_cover_at_depth_3_matches_the_independent_renderer() {
    must_be(&cover_with(4096, |scene| scene.render.max_depth = 3), &reference("cover-depth3-160x120", 4096));
}

#[test]
fn the_cover_with_a_big_light_matches_the_independent_renderer() {
    let big_light = |scene: &mut Scene| {
        scene.entities[COVER_LIGHT] = emitting(sphere(v(7.0, 0.0, 3.0), 2.0, 2), 0.25);
    };
    must_be(&cover_with(2048, big_light), &reference("cover-big-light-160x120", 4096));
}

/// Requires that the image of a changed cover differs from the reference.
fn must_not_be(samples: u32, change: impl FnOnce(&mut Scene)) {
    is_told_apart(&cover_with(samples, change), &reference("cover-160x120", 8192));
}

fn is_told_apart(scene: &Scene, theirs: &Reference) {
    let verdict = judge(&estimate(scene), theirs);
    println!("{verdict}");
    // With a margin: another seed must not change the result.
    assert!(verdict.worst > 1.3 * verdict.bound, "{verdict}");
}

#[test]
fn a_mirror_sphere_moved_by_a_twentieth_is_detected() {
    must_not_be(2048, |scene| {
        scene.entities[COVER_WHITE_SPHERE] = sphere(v(6.0, -2.05, -1.0), 2.0, COVER_WHITE_MIRROR);
    });
}

#[test]
fn a_mirror_darker_by_a_twentieth_is_detected() {
    must_not_be(2048, |scene| scene.materials[COVER_WHITE_MIRROR] = mirror([0.95; 3]));
}

#[test]
fn one_bounce_too_few_is_detected() {
    must_not_be(1024, |scene| scene.render.max_depth = 4);
}

/// A scene that is described beside the references, with parts of its text replaced.
fn changed(name: &str, samples: u32, changes: &[(&str, &str)]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/reference/{name}.toml"));
    let text = fs::read_to_string(&path).expect("a scene");
    let text = changes.iter().fold(text, |text, (right, wrong)| {
        assert_eq!(text.matches(right).count(), 1, "{right:?} in {name}");
        text.replace(right, wrong)
    });
    let mut scene = parse(&text, &path).unwrap_or_else(|errors| panic!("{errors}")).scene;
    scene.render.sampler = Sampler::Independent;
    scene.render.samples = samples;
    scene
}

fn described(name: &str, samples: u32) -> Scene {
    changed(name, samples, &[])
}

/// Requires that each of these changes to a scene is detected with few samples.
fn each_is_told_apart(name: &str, theirs: &Reference, changes: &[(&str, &str)]) {
    for change in changes {
        println!("{change:?}");
        is_told_apart(&changed(name, 64, &[*change]), theirs);
    }
}

/// The number of our samples with the noise of the references' 8192: Mitsuba chooses one of all lights, including the
/// environment, and its samples have 1.7 times the variance.
const AS_MANY_OF_OURS: u32 = 4800;

/// The same with four lights: it has 2.7 times the variance.
const AS_MANY_OF_FOUR_LIGHTS: u32 = 3000;

/// The same with an environment only.
const AS_MANY_OF_ONE_LIGHT: u32 = 8192;

/// The limit if both sample lights: an rms of one is expected, for about two hundred independent z.
const OF_ONE_METHOD: f64 = 1.15;

#[test]
fn metals_under_a_spot_and_a_sun_match_the_independent_renderer() {
    let theirs = reference("metals-120x90", AS_MANY_OF_OURS);
    must_be_with(&described("metals", 4096), &theirs, OF_ONE_METHOD);
    is_told_apart(&changed("metals", 1024, &[("roughness = 0.3 }", "roughness = 0.33 }")]), &theirs);
}

#[test]
fn frosted_glass_and_a_sheet_match_the_independent_renderer() {
    let theirs = reference("frosted-120x90", AS_MANY_OF_OURS);
    must_be_with(&described("frosted", 4096), &theirs, OF_ONE_METHOD);
    is_told_apart(&changed("frosted", 1024, &[("roughness = 0.25", "roughness = 0.28")]), &theirs);
}

#[test]
fn textures_in_every_wrap_mode_match_the_independent_renderer() {
    let theirs = reference("wraps-120x90", AS_MANY_OF_FOUR_LIGHTS);
    must_be_with(&described("wraps", 512), &theirs, OF_ONE_METHOD);
    each_is_told_apart(
        "wraps",
        &theirs,
        &[
            ("wrap = \"repeat\"", "wrap = \"mirror\""),
            ("wrap = \"mirror\"", "wrap = [\"mirror\", \"repeat\"]"),
            ("wrap = \"clamp\", uv", "wrap = \"repeat\", uv"),
            ("wrap = \"black\"", "wrap = \"clamp\""),
            ("filter = \"nearest\"", "filter = \"linear\""),
            ("uv_rotate = -15", "uv_rotate = -12"),
            // The emissive texture is mirrored.
            ("glow.exr\",", "glow.exr\", uv_scale = [-1, 1], uv_offset = [1, 0],"),
            ("penumbra_angle = 18", "penumbra_angle = 14"),
        ],
    );
}

#[test]
fn normal_maps_mixes_opacity_and_back_sides_match_the_independent_renderer() {
    let theirs = reference("maps-120x90", AS_MANY_OF_FOUR_LIGHTS);
    must_be_with(&described("maps", 512), &theirs, OF_ONE_METHOD);
    each_is_told_apart(
        "maps",
        &theirs,
        &[
            ("maps-normals.png", "maps-normals-down.png"),
            ("normal_scale = 0.4", "normal_scale = 0.6"),
            ("a = \"gold\", b = \"paint\"", "a = \"paint\", b = \"gold\""),
            ("amount = 0.3", "amount = 0.4"),
            (", opacity = \"holes\"", ""),
            ("opacity = 0.6", "opacity = 0.75"),
            (", back = \"paper\"", ""),
            ("falloff = \"squared\"", "falloff = \"smoothstep\""),
        ],
    );
}

#[test]
fn image_based_light_is_the_independent_renderers() {
    let theirs = reference("sky-120x90", AS_MANY_OF_ONE_LIGHT);
    must_be_with(&described("sky", 512), &theirs, OF_ONE_METHOD);
    each_is_told_apart(
        "sky",
        &theirs,
        &[
            ("rotate = 40", "rotate = 38"),
            ("rotate = 40", "rotate = -40"),
            ("scale = [1, 0.9, 0.8]", "scale = [1, 0.9, 0.82]"),
            // A sphere under the sky, not the sky itself.
            ("roughness = 0.35", "roughness = 0.5"),
        ],
    );
}

#[test]
fn the_block_test_accepts_two_seeds_and_rejects_swapped_mirrors() {
    let (a, b) = (cover_with(64, |_| {}), cover_with(64, |scene| scene.render.seed = 1));
    let (a, b) = (estimate(&a), estimate(&b));
    let same = compare(&a.blocks(), &b.blocks());
    // The rms of 900 standard normal variables is one within 0.024·√3, because the channels are correlated.
    assert!(same.agrees() && (0.85..1.15).contains(&same.rms), "{same}");
    let mut swapped = cover_with(64, |scene| scene.render.seed = 2);
    let (first, second) = (COVER_COLOURED_SPHERE, COVER_WHITE_SPHERE);
    let materials = [swapped.entities[first].material, swapped.entities[second].material];
    [swapped.entities[second].material, swapped.entities[first].material] = materials;
    assert!(!compare(&a.blocks(), &estimate(&swapped).blocks()).agrees());
}
