//! `stride info` of films, samples and pictures.

use super::{bytes, cover, folder, refused, render, succeed};
use std::fs;
use std::path::Path;

#[test]
fn info_describes_dumps_and_films_without_an_end() {
    let dir = folder();
    let scene = cover();
    succeed(dir.path(), &render(&scene, &["--spp", "3", "--samples", "a.npy", "-o", "a.exr"]));
    let told = succeed(dir.path(), &["info", "a.npy"]).0;
    for line in
        ["samples     3600 of 28 bytes", "size        40x30", "asked       0..3", "rendered    0,0,40,30"]
    {
        assert!(told.lines().any(|told| told == line), "no {line:?} in {told}");
    }
    fs::write(dir.path().join("b.npy"), &bytes(dir.path(), "a.npy")[..5000]).expect("written");
    assert!(refused(dir.path(), 1, &["info", "b.npy"]).contains("it is truncated"));
    let endless = ["--time", "50ms", "--range", "7..", "--film", "a.film", "-o", "a.exr"];
    succeed(dir.path(), &render(&scene, &endless));
    let told = succeed(dir.path(), &["info", "a.film"]).0;
    assert!(told.contains("asked       7..\n") && !told.contains("4294967295"), "{told}");
}

#[test]
fn info_describes_films_and_pictures() {
    let dir = folder();
    let scene = cover();
    let common = ["--spp", "4", "--seed", "77", "--exposure", "1.5", "-o", "a.exr", "-o", "a.png"];
    succeed(dir.path(), &render(&scene, &[&common[..], &["--film", "a.film"]].concat()));
    let info = |file: &str| succeed(dir.path(), &["info", file]).0;
    let facts = [
        "program     stride ",
        "size        40x30",
        "filter      tent 1",
        "integrator  path",
        "sampler     sobol",
        "max depth   5",
        "seed        77",
        "device      cpu",
        "samples     0..4",
    ];
    for file in ["a.film", "a.exr"] {
        let told = info(file);
        for fact in facts {
            assert!(told.lines().any(|line| line.starts_with(fact)), "no {fact:?} of {file} in {told}");
        }
        let scene = told.lines().find_map(|line| line.strip_prefix("scene       ")).expect("a scene");
        assert!(scene.len() == 64 && scene.bytes().all(|c| c.is_ascii_hexdigit()), "{scene}");
    }
    assert!(info("a.film").contains("exposure    1.5"));
    // The exposure does not affect samples, and is not stored in an EXR: the file is the same without it.
    let before = bytes(dir.path(), "a.exr");
    succeed(dir.path(), &render(&scene, &["--spp", "4", "--seed", "77", "--threads", "1", "-o", "a.exr"]));
    assert!(bytes(dir.path(), "a.exr") == before);
    assert!(info("a.png").starts_with("picture     40×30 pixels\nformat      PNG: display values"));
    let parts = info("a.film").lines().find(|line| line.starts_with("parts")).expect("parts").to_owned();
    assert!(parts.starts_with("parts       33 of the scene, "), "{parts}");
    assert!(refused(dir.path(), 2, &["info", "a.txt"]).contains(".film"));
    assert!(refused(dir.path(), 1, &["info", "no.exr"]).contains("no such file"));
}

#[test]
fn films_do_not_depend_on_how_the_path_of_the_scene_is_spelt() {
    let dir = folder();
    let scenes = dir.path().join("scenes");
    fs::create_dir(&scenes).expect("made");
    let write = |name: &str, text: &str| fs::write(dir.path().join(name), text).expect("written");
    write("scenes/m.obj", "v 3 0 0\nv 3 1 0\nv 3 0 1\nf 1 2 3\n");
    write("n.obj", "v 3 0 0\nv 3 -1 0\nv 3 0 -1\nf 1 2 3\n");
    image::RgbImage::from_pixel(2, 2, image::Rgb([9, 99, 200])).save(scenes.join("p.png")).expect("written");
    let own = "environment = { radiance = [1, 1, 1] }
        textures.t = { type = \"image\", file = \"p.png\" }
        materials.m = { type = \"matte\", reflectance = \"t\" }
        entities = [{ shape = { type = \"mesh\", file = \"m.obj\" }, material = \"m\" },
            { shape = { type = \"mesh\", file = \"../n.obj\" }, material = \"m\" }]";
    let foreign = "<scene version=\"3.0.0\"><emitter type=\"constant\"/>
        <sensor type=\"perspective\"><float name=\"fov\" value=\"50\"/></sensor>
        <shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/><bsdf type=\"diffuse\">
            <texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"p.png\"/></texture>
        </bsdf></shape></scene>";
    for (name, text, own) in
        [("a.toml", own, &["m.obj;", "../n.obj;", "p.png;"][..]), ("a.xml", foreign, &["m.obj 0;", "p.png;"])]
    {
        write(&format!("scenes/{name}"), text);
        let film = |folder: &Path, scene: &str| {
            let fixed =
                ["render", scene, "--headless", "-q", "--size", "4x3", "--spp", "1", "--film", "a.film"];
            succeed(folder, &fixed);
            bytes(folder, "a.film")
        };
        let inside = film(&scenes, name);
        let relative = format!("scenes/{name}");
        let absolute = scenes.join(name).to_str().expect("UTF-8").to_owned();
        for spelling in [&relative, &format!("./{relative}"), &format!("scenes/../{relative}"), &absolute] {
            assert!(film(dir.path(), spelling) == inside, "{spelling}");
        }
        // The names are there, so that messages about differences have them.
        let text = String::from_utf8_lossy(&inside).into_owned();
        for own in own {
            let at = text.find(own).unwrap_or_else(|| panic!("no {own} in {name}"));
            // Eight digits of the part's digest precede its name.
            assert!(text[..at].ends_with(|c: char| c.is_ascii_hexdigit()), "{own} in {name}");
        }
    }
}
