//! `stride info` of films, samples and pictures.

use super::{bytes, cover, folder, refused, render, succeed};
use std::fs;

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
