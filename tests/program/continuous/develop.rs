//! Films from dumped samples: `stride develop`.

use super::*;

#[test]
fn a_developed_dump_equals_the_file_of_a_render_with_the_filter() {
    let (dir, scene) = (folder(), cover());
    let common = ["--size", "40x30", "--spp", "5", "--threads", "3"];
    // The samples of a continuous film do not depend on its filter, and equal those of a box in importance mode.
    let dumps: [(&str, &[&str]); 3] = [
        ("a.npy", &["--filter", "mitchell"]),
        ("b.npy", &["--filter", "tent", "--film-mode", "continuous"]),
        ("c.npy", &["--filter", "box"]),
    ];
    for (name, film) in dumps {
        let arguments = [&common[..], film, &["--samples", name, "-o", "whole.exr"]].concat();
        succeed(dir.path(), &render(&scene, &arguments));
        if name == "a.npy" {
            succeed(dir.path(), &render(&scene, &[&common[..], film, &["-o", "plain.exr"]].concat()));
            assert!(
                bytes(dir.path(), "whole.exr") == bytes(dir.path(), "plain.exr"),
                "dumping changes nothing"
            );
        }
    }
    for filter in ["box", "tent", "gaussian", "mitchell", "blackman-harris", "lanczos"] {
        let rendered = ["--filter", filter, "--film-mode", "continuous", "-o", "r.exr"];
        succeed(dir.path(), &render(&scene, &[&common[..], &rendered].concat()));
        for (name, _) in dumps {
            succeed(dir.path(), &["develop", "-q", name, "--filter", filter, "-o", "d.exr", "-o", "d.png"]);
            assert!(bytes(dir.path(), "d.exr") == bytes(dir.path(), "r.exr"), "{filter} from {name}");
        }
        // Negative control: another radius.
        succeed(
            dir.path(),
            &["develop", "-q", "a.npy", "--filter", filter, "--radius", "1.7", "-o", "d.exr"],
        );
        assert!(picture(dir.path(), "d.exr") != picture(dir.path(), "r.exr"), "{filter}");
    }
    // A crop, with the filter of the render or a narrower one.
    let crop = ["--crop", "9,8,12,10", "--filter", "mitchell"];
    succeed(
        dir.path(),
        &render(&scene, &[&common[..], &crop, &["--samples", "e.npy", "-o", "r.exr"]].concat()),
    );
    succeed(dir.path(), &["develop", "-q", "e.npy", "--filter", "mitchell", "-o", "d.exr"]);
    assert!(bytes(dir.path(), "d.exr") == bytes(dir.path(), "r.exr"));
    succeed(dir.path(), &["develop", "-q", "e.npy", "--filter", "tent", "-o", "d.exr"]);
    let tent = ["--crop", "9,8,12,10", "--filter", "tent", "--film-mode", "continuous", "-o", "r.exr"];
    succeed(dir.path(), &render(&scene, &[&common[..], &tent].concat()));
    assert!(bytes(dir.path(), "d.exr") == bytes(dir.path(), "r.exr"));
    let said = refused(dir.path(), 1, &["develop", "e.npy", "--filter", "lanczos", "-o", "d.exr"]);
    assert!(said.contains("narrower filter"), "{said}");
}

/// Names and numbers of entities and materials do not affect a dump.
#[test]
fn a_dump_with_many_non_ascii_names_is_developed() {
    let dir = folder();
    let ball = |i: usize| {
        format!(
            "[[entities]]\nname = \"Küche {i} 🫖\"\nmaterial = \"m\"\nemission = [1, 1, 1]\n\
             shape = {{ type = \"sphere\", center = [{i}, 0, -9], radius = 1 }}\n"
        )
    };
    let material = "materials.m = { type = \"matte\", reflectance = [0.5, 0.5, 0.5] }\n";
    let scene = material.to_owned() + &(0..100).map(ball).collect::<String>();
    fs::write(dir.path().join("many.toml"), scene).expect("a scene");
    let dump =
        ["--size", "8x6", "--spp", "4", "--film-mode", "continuous", "--filter", "tent", "-o", "a.exr"];
    let dump = [&["render", "many.toml", "--headless", "-q", "--samples", "a.npy"], &dump[..]].concat();
    succeed(dir.path(), &dump);
    succeed(dir.path(), &["develop", "-q", "a.npy", "--filter", "tent", "-o", "d.exr"]);
    let bytes = |name: &str| fs::read(dir.path().join(name)).expect("a picture");
    assert!(bytes("d.exr") == bytes("a.exr"));
}

#[test]
fn impossible_developments_are_explained() {
    let (dir, scene) = (folder(), cover());
    let tent = ["--size", "40x30", "--spp", "2", "--samples", "tent.npy", "-o", "a.png"];
    succeed(dir.path(), &render(&scene, &tent));
    let develop = |name: &str, more: &[&str]| {
        let arguments = [&["develop", name, "-o", "a.exr"][..], more].concat();
        let output = run(dir.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    let (code, said) = develop("tent.npy", &["--filter", "mitchell"]);
    assert!(code == Some(1) && said.contains("--film-mode continuous"), "{said}");
    let box_film =
        ["--size", "40x30", "--spp", "2", "--filter", "box", "--samples", "box.npy", "-o", "a.png"];
    succeed(dir.path(), &render(&scene, &box_film));
    for (more, code, word) in [
        (&["--filter", "none"][..], 2, "none"),
        (&["--filter", "mitchell", "--radius", "0.2"], 2, "0.5 to 16"),
        (&["--filter", "mitchell", "--size", "40x30"], 2, "omit --size"),
    ] {
        let (exit, said) = develop("box.npy", more);
        assert!(exit == Some(code) && said.contains(word), "{said}");
    }
    // As NumPy saves it: without metadata.
    let whole = bytes(dir.path(), "box.npy");
    let end = 10 + usize::from(u16::from_le_bytes([whole[8], whole[9]])) - 1;
    let hash = 10 + whole[10..end].iter().position(|&byte| byte == b'#').expect("a comment");
    let mut plain = whole.clone();
    plain[hash..end].fill(b' ');
    fs::write(dir.path().join("plain.npy"), &plain).expect("written");
    let (code, said) = develop("plain.npy", &["--filter", "mitchell"]);
    assert!(code == Some(2) && said.contains("--size"), "{said}");
    assert_eq!(develop("plain.npy", &["--filter", "mitchell", "--size", "40x30"]).0, Some(0));
    let developed = picture(dir.path(), "a.exr");
    assert_eq!(develop("box.npy", &["--filter", "mitchell"]).0, Some(0));
    assert!(picture(dir.path(), "a.exr") == developed);
    let (code, said) = develop("plain.npy", &["--filter", "mitchell", "--size", "41x30"]);
    assert!(code == Some(1) && said.contains("is the film's size 41×30?"), "{said}");
    fs::write(dir.path().join("cut.npy"), &whole[..whole.len() - 30]).expect("written");
    let (code, said) = develop("cut.npy", &["--filter", "mitchell"]);
    assert!(code == Some(1) && said.contains("it is truncated"), "{said}");
    let (code, said) = develop("a.png", &["--filter", "mitchell"]);
    assert!(code == Some(1) && said.contains("not a NumPy file"), "{said}");
}

// Tests in `src/gpu` compare a GPU's samples with the CPU's statistically; this test compares its film with its
// samples.
#[test]
fn a_film_of_a_gpu_equals_the_film_of_its_samples() {
    let (dir, scene) = (folder(), cover());
    let film = ["--size", "40x30", "--spp", "4", "--filter", "mitchell", "--device", "gpu"];
    let output =
        run(dir.path(), &render(&scene, &[&film[..], &["--samples", "g.npy", "-o", "r.exr"]].concat()));
    if lacks_a_gpu(&output) {
        return;
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    succeed(dir.path(), &["develop", "-q", "g.npy", "--filter", "mitchell", "-o", "d.exr"]);
    assert!(bytes(dir.path(), "d.exr") == bytes(dir.path(), "r.exr"));
    // The same with the sums for a variance.
    let variance = ["--layers", "variance", "-o", "v.exr"];
    succeed(dir.path(), &render(&scene, &[&film[..], &variance].concat()));
    let layers = ["--layers", "variance", "-o", "d.exr"];
    succeed(dir.path(), &[&["develop", "-q", "g.npy", "--filter", "mitchell"], &layers[..]].concat());
    assert!(bytes(dir.path(), "d.exr") == bytes(dir.path(), "v.exr"));
    assert!(channel(dir.path(), "d.exr", "variance.Y").iter().any(|v| *v > 0.0));
    succeed(dir.path(), &["develop", "-q", "g.npy", "--filter", "lanczos", "-o", "d.exr"]);
    assert!(picture(dir.path(), "d.exr") != picture(dir.path(), "r.exr"));
    // The same random numbers on both devices: the difference from the CPU's picture is rounding.
    let cpu = [&film[..6], &["-o", "c.exr"]].concat();
    succeed(dir.path(), &render(&scene, &cpu));
    let [gpu, cpu] = ["r.exr", "c.exr"].map(|name| picture(dir.path(), name).rgb);
    let differs =
        |a: &[f32; 3], b: &[f32; 3]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.02 * (a + b).abs());
    let different = gpu.iter().zip(&cpu).filter(|(a, b)| differs(a, b)).count();
    assert!(different < gpu.len() / 20, "{different} pixels differ");
}
