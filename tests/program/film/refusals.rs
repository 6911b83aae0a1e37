//! Films that are rejected: those of other renders, and damaged ones.

use super::{bytes, cover, folder, refused, render, succeed};
use rand::RngExt;
use std::fs;
use stride::sampling::Stream;

#[test]
fn films_that_do_not_belong_together_are_refused_with_the_reason() {
    let dir = folder();
    fs::copy(cover(), dir.path().join("scene.toml")).unwrap();
    let base = |more: &[&'static str]| render("scene.toml", &[&["-o", "a.exr", "--spp", "6"], more].concat());
    succeed(dir.path(), &base(&["--film", "a.film"]));
    let before = bytes(dir.path(), "a.film");
    let resume = |more: &[&'static str]| {
        let said = refused(dir.path(), 1, &base(&[&["--resume", "a.film"], more].concat()));
        assert!(bytes(dir.path(), "a.film") == before, "a refused film is changed");
        said
    };
    for (more, reason) in [
        (&["--seed", "2"][..], "its seed is 0, not 2"),
        (&["--integrator", "path-naive"], "its integrator is path, not path-naive"),
        (&["--sampler", "independent"], "its sampler is sobol, not independent"),
        (&["--max-depth", "2"], "its max depth is 5, not 2"),
        (&["--filter", "box"], "its filter is tent 1, not box 0.5"),
        (&["--crop", "1,1,5,5"], "its crop is 0,0,40,30, not 1,1,5,5"),
        (&["--dump-at", "5"], "it already has 6 samples per pixel"),
        (
            &["--layers", "depth,uv"],
            "the film was begun without --layers depth,uv; omit these, or begin another film with them",
        ),
    ] {
        let said = resume(more);
        assert!(said.contains(reason), "{more:?}: {said}");
    }
    let fewer = render("scene.toml", &["--resume", "a.film", "--spp", "5"]);
    let said = refused(dir.path(), 1, &fewer);
    assert!(said.contains("it already has the samples up to 6, and 0 to 5 are requested"), "{said}");
    let size = ["render", "scene.toml", "--headless", "-q", "--size", "30x40", "--resume", "a.film"];
    assert!(refused(dir.path(), 1, &size).contains("its size is 40x30, not 30x40"));
    let shifted = render("scene.toml", &["--resume", "a.film", "--range", "3..9"]);
    assert!(refused(dir.path(), 1, &shifted).contains("continue without a gap from sample 3"));
    let missing = render("scene.toml", &["--resume", "no.film"]);
    assert!(refused(dir.path(), 1, &missing).contains("there is no such file"));
    let both = render("scene.toml", &["--spp", "4", "--range", "0..4"]);
    assert!(refused(dir.path(), 2, &both).contains("--range"));
    let named = render("scene.toml", &["--spp", "4", "--film", "a.exr2"]);
    assert!(refused(dir.path(), 2, &named).contains(".film"));

    // Merging: the same samples twice, another seed, another format.
    succeed(dir.path(), &render("scene.toml", &["--film", "b.film", "--range", "5..9", "-o", "b.exr"]));
    let said = refused(dir.path(), 1, &["merge", "a.film", "b.film", "-o", "m.film"]);
    assert!(said.contains("a.film") && said.contains("b.film") && said.contains("5..6"), "{said}");
    let other = ["--film", "c.film", "--range", "6..9", "--seed", "2", "-o", "c.exr"];
    succeed(dir.path(), &render("scene.toml", &other));
    let said = refused(dir.path(), 1, &["merge", "a.film", "c.film", "-o", "m.exr"]);
    assert!(said.contains("different renders") && said.contains("seed"), "{said}");
    let other = ["--film", "c.film", "--range", "6..9", "--layers", "depth", "-o", "c.exr"];
    succeed(dir.path(), &render("scene.toml", &other));
    let said = refused(dir.path(), 1, &["merge", "a.film", "c.film", "-o", "m.exr"]);
    assert!(
        said.contains(
            "of the first, its set of layers is depth, not none; only films with the same --layers"
        ),
        "{said}"
    );
    assert!(refused(dir.path(), 1, &["merge", "a.film", "a.exr", "-o", "m.exr"]).contains("not a film"));
    refused(dir.path(), 2, &["merge", "a.film", "-o", "m.jpg"]);
    refused(dir.path(), 2, &["merge", "a.film"]);
    assert!(!dir.path().join("m.film").exists() && !dir.path().join("m.exr").exists());

    // Settings that do not affect samples may differ: threads, exposure, comments.
    let text = fs::read_to_string(dir.path().join("scene.toml")).unwrap();
    fs::write(dir.path().join("scene.toml"), format!("# The same scene.\n{text}")).unwrap();
    succeed(dir.path(), &base(&["--resume", "a.film", "--threads", "3", "--exposure", "2"]));
    let text = text.replacen("radius = 2", "radius = 1.9", 1);
    fs::write(dir.path().join("scene.toml"), text).unwrap();
    let said = refused(dir.path(), 1, &base(&["--resume", "a.film"]));
    assert!(said.contains("its scene differs in the shape of ") && said.contains("has changed"), "{said}");
}

#[test]
fn a_damaged_film_is_always_detected() {
    let dir = folder();
    let scene = cover();
    succeed(dir.path(), &render(&scene, &["--spp", "2", "--film", "a.film", "-o", "a.exr"]));
    let good = bytes(dir.path(), "a.film");
    let stream = &mut Stream::new(7, 0, 0);
    for round in 0..24_u32 {
        let mut bad = good.clone();
        match round {
            0 => bad.clear(),
            1..6 => bad.truncate(stream.random_range(1..good.len())),
            6 => bad.push(0),
            7..12 => bad[stream.random_range(0..700)] ^= 1 << (round % 8),
            _ => bad[stream.random_range(0..good.len())] ^= 1 << (round % 8),
        }
        fs::write(dir.path().join("bad.film"), &bad).unwrap();
        let commands = [
            render(&scene, &["--resume", "bad.film", "--spp", "3", "-o", "bad.exr"]),
            vec!["merge", "bad.film", "-o", "bad.exr"],
            vec!["info", "bad.film"],
        ];
        for arguments in commands {
            let said = refused(dir.path(), 1, &arguments);
            assert!(said.contains("bad.film") && !said.contains("panicked"), "round {round}: {said}");
        }
        assert!(!dir.path().join("bad.exr").exists() && bytes(dir.path(), "bad.film") == bad);
    }
    // Negative control: the film itself is valid.
    succeed(dir.path(), &["info", "a.film"]);
}
