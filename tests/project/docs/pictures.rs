//! Pictures have scenes, are small, and are all shown.

use super::{documents, files, root, stem, text};
use std::collections::BTreeMap;
use std::fs;

/// The pictures that may be large: those of the front page and of the first render.
const LARGE: [&str; 2] = ["cover", "still-life"];

/// The scene of each picture that `docs/pictures/render.py` makes, by the picture's name.
fn scenes() -> BTreeMap<String, String> {
    let own = files("docs/pictures/scenes", "toml").into_iter().map(|path| (stem(&path), path));
    let script = text("docs/pictures/render.py");
    let (_, table) = script.split_once("\nMORE = {\n").expect("a table of pictures");
    let (table, _) = table.split_once("\n}\n").expect("its end");
    let more = table.lines().map(|line| {
        let names: Vec<_> = line.split('"').collect();
        (names[1].to_owned(), format!("scenes/{}.toml", names[3]))
    });
    own.chain(more).collect()
}

/// Width and height of a PNG file.
fn size(png: &[u8]) -> [u32; 2] {
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"), "it is no PNG");
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")))
}

/// What is wrong with the size of a picture of this name.
fn too_large(name: &str, png: &[u8]) -> Option<String> {
    let [width, height] = size(png);
    let is_small = png.len() <= 40_000 && width <= 320 && height <= 240;
    (!LARGE.contains(&name) && !is_small).then(|| format!("{name}: {} bytes, {width}×{height}", png.len()))
}

#[test]
fn every_picture_has_a_scene_and_every_scene_a_picture() {
    let scenes = scenes();
    let pictures: Vec<_> = files("docs/pictures", "png").iter().map(|path| stem(path)).collect();
    for picture in &pictures {
        let scene = scenes.get(picture).unwrap_or_else(|| panic!("no scene makes {picture}.png"));
        assert!(root().join(scene).exists(), "{picture}.png is of {scene}, which is not there");
    }
    let missing: Vec<_> = scenes.keys().filter(|name| !pictures.contains(name)).collect();
    assert!(missing.is_empty(), "run docs/pictures/render.py: there are no pictures of {missing:?}");
    assert!(scenes.len() >= 50);
    assert_eq!(scenes["figure-6-1"], "scenes/figure-6-1-to-6-3.toml");
}

#[test]
fn every_picture_is_shown() {
    let shown: String = documents().iter().map(|path| text(path)).collect();
    for path in files("docs/pictures", "png") {
        assert!(shown.contains(&format!("pictures/{}.png)", stem(&path))), "no chapter shows {path}");
    }
}

#[test]
fn pictures_are_small() {
    let mut total = 0;
    for path in files("docs/pictures", "png") {
        let png = fs::read(root().join(&path)).expect("a picture");
        total += png.len();
        assert_eq!(too_large(&stem(&path), &png), None);
    }
    assert!(total <= 2_000_000, "{total} bytes of pictures");
    let cover = fs::read(root().join("docs/pictures/cover.png")).expect("a picture");
    assert_eq!(size(&cover), [320, 240]);
    assert!(too_large("matte", &cover).is_some(), "a large picture is found");
}
