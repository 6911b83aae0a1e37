//! Images compared with those of an independent renderer: `tests/reference/README.md`.

use crate::common::blocks::{Estimate, Noise, Reference, Verdict, compare};
use crate::common::estimate;
use crate::common::scenes::*;
use exr::prelude::read_first_flat_layer_from_file;
use std::fs;
use std::path::Path;
use stride::scene::{Sampler, Scene, parse};

/// The three channels of a reference picture whose names start with `prefix`.
fn channels(name: &str, prefix: &str) -> Option<(u32, Vec<[f64; 3]>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/reference/{name}.exr"));
    let layer = read_first_flat_layer_from_file(path).expect("a reference picture").layer_data;
    let [r, g, b] = ["R", "G", "B"].map(|c| {
        let channel =
            layer.channel_data.list.iter().find(|channel| channel.name.to_string() == format!("{prefix}{c}"));
        channel.map(|channel| channel.sample_data.values_as_f32().map(f64::from).collect::<Vec<_>>())
    });
    let (r, g, b) = (r?, g?, b?);
    Some((layer.size.width() as u32, (0..r.len()).map(|at| [r[at], g[at], b[at]]).collect()))
}

fn picture(name: &str, noise: Noise) -> Reference {
    let (width, rgb) = channels(name, "").expect("a picture in colour");
    Reference { width, height: rgb.len() as u32 / width, rgb, noise }
}

/// A picture with its standard errors.
fn reference(name: &str) -> Reference {
    let (_, errors) = channels(name, "error.").expect("standard errors");
    picture(name, Noise::Measured(errors))
}

/// A picture of which only the number of samples per pixel is known.
fn reference_of(name: &str, spp: u32) -> Reference {
    picture(name, Noise::Samples(spp))
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
    let ours = estimate(scene);
    for (a, b) in ours.mean().into_iter().zip(theirs.mean()) {
        assert!((a / b - 1.0).abs() < 0.003, "means {a} and {b} differ by {:.2}%", (a / b - 1.0) * 100.0);
    }
    let verdict = judge(&ours, theirs);
    println!("{verdict}");
    assert!(verdict.agrees(), "{verdict}");
    // Outside these limits the noise estimate is wrong and the bound is meaningless.
    let limits = match theirs.noise {
        // The rms of about two hundred independent standard normal variables.
        Noise::Measured(_) => 0.85..1.15,
        // The reference samples lights, and so has less noise than the same number of our samples. Without any noise of
        // its own, the rms of these z would be √⅔ or √½.
        Noise::Samples(_) => 0.65..1.05,
    };
    assert!(limits.contains(&verdict.rms), "{verdict}");
}

#[test]
fn the_cover_matches_the_independent_renderer() {
    must_be(&cover_with(4096, |_| {}), &reference_of("cover-160x120", 8192));
}

#[test]
fn the_cover_at_depth_2_matches_the_independent_renderer() {
    must_be(
        &cover_with(4096, |scene| scene.render.max_depth = 2),
        &reference_of("cover-depth2-160x120", 4096),
    );
}

#[test]
fn the_cover_at_depth_3_matches_the_independent_renderer() {
    must_be(
        &cover_with(4096, |scene| scene.render.max_depth = 3),
        &reference_of("cover-depth3-160x120", 4096),
    );
}

#[test]
fn the_cover_with_a_big_light_matches_the_independent_renderer() {
    let big_light = |scene: &mut Scene| {
        scene.entities[COVER_LIGHT] = emitting(sphere(v(7.0, 0.0, 3.0), 2.0, 2), 0.25);
    };
    must_be(&cover_with(2048, big_light), &reference_of("cover-big-light-160x120", 4096));
}

/// Requires that the image of a changed cover differs from the reference.
fn must_not_be(samples: u32, change: impl FnOnce(&mut Scene)) {
    is_told_apart(&cover_with(samples, change), &reference_of("cover-160x120", 8192));
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

#[test]
fn metals_under_a_spot_and_a_sun_match_the_independent_renderer() {
    let theirs = reference("metals-120x90");
    must_be(&described("metals", 2048), &theirs);
    is_told_apart(&changed("metals", 1024, &[("roughness = 0.3 }", "roughness = 0.33 }")]), &theirs);
}

#[test]
fn frosted_glass_and_a_sheet_match_the_independent_renderer() {
    let theirs = reference("frosted-120x90");
    must_be(&described("frosted", 2048), &theirs);
    is_told_apart(&changed("frosted", 1024, &[("roughness = 0.25", "roughness = 0.28")]), &theirs);
}

#[test]
fn textures_in_every_wrap_mode_match_the_independent_renderer() {
    let theirs = reference("wraps-120x90");
    must_be(&described("wraps", 512), &theirs);
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
    let theirs = reference("maps-120x90");
    must_be(&described("maps", 512), &theirs);
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
    let theirs = reference("sky-120x90");
    must_be(&described("sky", 512), &theirs);
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
