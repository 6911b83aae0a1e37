//! Merging of films, among them shards of a render.

use super::{bytes, cover, folder, refused, render, run, succeed};
use rand::RngExt;
use std::fs;
use stride::sampling::Stream;

// Layers use the first 32 samples, of which some shards have none.
#[test]
fn shards_merged_in_any_order_equal_the_whole() {
    let dir = folder();
    let scene = cover();
    let small = |more: &[&str]| -> Vec<String> {
        let base = ["render", &scene, "--headless", "-q", "--size", "12x9", "--layers", "all"];
        base.iter().chain(more).map(|&word| word.to_owned()).collect()
    };
    let go = |arguments: Vec<String>| {
        succeed(dir.path(), &arguments.iter().map(String::as_str).collect::<Vec<_>>());
    };
    let outputs = ["whole.film", "whole.exr", "whole.png", "whole.hdr"];
    go(small(&[
        "--spp",
        "128",
        "--film",
        "whole.film",
        "-o",
        "whole.exr",
        "-o",
        "whole.png",
        "-o",
        "whole.hdr",
    ]));
    let stream = &mut Stream::new(64, 0, 0);
    let shuffle = |list: &mut Vec<usize>, stream: &mut Stream| {
        (1..list.len()).rev().for_each(|i| list.swap(i, stream.random_range(0..=i)));
    };
    let mut order: Vec<usize> = (0..64).collect();
    shuffle(&mut order, stream);
    for &shard in &order {
        let threads = stream.random_range(1..=3).to_string();
        let range = format!("{}..{}", 2 * shard, 2 * shard + 2);
        let film = format!("{shard}.film");
        go(small(&["--range", &range, "--threads", &threads, "--film", &film, "-o", "shard.exr"]));
    }
    let merge = |order: &[usize], outputs: &[&str]| {
        let films: Vec<String> = order.iter().map(|shard| format!("{shard}.film")).collect();
        let mut arguments = vec!["merge"];
        arguments.extend(films.iter().map(String::as_str));
        outputs.iter().for_each(|output| arguments.extend(["-o", output]));
        run(dir.path(), &arguments)
    };
    for _ in 0..2 {
        shuffle(&mut order, stream);
        let output = merge(&order, &["m.film", "m.exr", "m.png", "m.hdr"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        for whole in outputs {
            let merged = whole.replace("whole", "m");
            assert!(bytes(dir.path(), &merged) == bytes(dir.path(), whole), "{whole} differs");
        }
    }
    // Merged in two steps.
    let (a, b) = order.split_at(17);
    assert!(merge(a, &["a.film"]).status.success() && merge(b, &["b.film"]).status.success());
    succeed(dir.path(), &["merge", "b.film", "a.film", "-o", "m.film", "-q"]);
    assert!(bytes(dir.path(), "m.film") == bytes(dir.path(), "whole.film"));
    // Negative control, and a report of the missing samples.
    order.retain(|&shard| shard != 30 && shard != 31);
    let output = merge(&order, &["m.film", "m.exr"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("missing: 60..64"), "{said}");
    // The command in the message makes a film that can be merged with these.
    assert!(said.contains("(render --range 60..64 --layers albedo,normal,"), "{said}");
    assert!(!said.contains("the layers"), "{said}");
    assert!(bytes(dir.path(), "m.exr") != bytes(dir.path(), "whole.exr"));
    let said = merge(&[1, 2, 9, 40], &["part.exr"]).stderr;
    let said = String::from_utf8_lossy(&said);
    assert!(said.contains("crypto-material lack the samples 0..2, 6..18, 20..32 of 0..32"), "{said}");
    let (told, _) = succeed(dir.path(), &["info", "m.film"]);
    assert!(told.contains("samples     0..60, 64..128") && told.contains("missing     60..64"), "{told}");
    // It cannot be resumed, but the missing samples can be rendered.
    let gap = small(&["--resume", "m.film", "--spp", "200"]);
    let said = refused(dir.path(), 1, &gap.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(said.contains("--range"), "{said}");
    go(small(&["--range", "60..64", "--film", "gap.film", "-o", "shard.exr"]));
    succeed(dir.path(), &["merge", "m.film", "gap.film", "-o", "n.film", "-o", "m.exr"]);
    assert!(bytes(dir.path(), "m.exr") == bytes(dir.path(), "whole.exr"));
    assert!(bytes(dir.path(), "n.film") == bytes(dir.path(), "whole.film"));
    // A complete film can be resumed.
    go(small(&["--resume", "n.film", "--spp", "130", "-o", "m.exr"]));
    go(small(&["--spp", "130", "-o", "longer.exr"]));
    assert!(bytes(dir.path(), "m.exr") == bytes(dir.path(), "longer.exr"));
}

#[test]
fn a_render_without_samples_for_its_layers_warns() {
    let (dir, scene) = (folder(), cover());
    let said = |range: &str, more: &[&str]| {
        let base = ["render", &scene, "--headless", "--size", "4x3", "--range", range, "-o", "a.exr"];
        let output = run(dir.path(), &[&base[..], more].concat());
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let text = said("32..34", &["--layers", "albedo"]);
    let warning = "warning: the layers albedo use only the samples 0 to 31, which this render does not make: they stay empty";
    assert!(text.contains(&format!("{warning}; add --film")), "{text}");
    let text = said("32..34", &["--layers", "albedo", "--film", "a.film"]);
    assert!(
        text.contains(&format!("{warning} until its film is merged with films of these samples\n")),
        "{text}"
    );
    for (range, more) in
        [("31..33", &["--layers", "albedo"][..]), ("32..34", &["--layers", "samples"]), ("32..34", &[])]
    {
        let text = said(range, more);
        assert!(!text.contains("the layers"), "{range} {more:?}: {text}");
    }
}

#[test]
fn merged_films_have_the_rendered_or_requested_view() {
    let (dir, scene) = (folder(), cover());
    let shown = |tone: &str, exposure: &str, name: &str| {
        let view = ["--tone", tone, "--exposure", exposure, "--spp", "4", "-o", name];
        succeed(dir.path(), &render(&scene, &[&view[..], &["--film", "last.film"]].concat()));
        bytes(dir.path(), name)
    };
    let (plain, brighter) = (shown("srgb", "1", "plain.png"), shown("filmic", "2", "brighter.png"));
    let filmic = shown("filmic", "1", "filmic.png");
    let merged = |film: &str, more: &[&str]| {
        succeed(dir.path(), &[&["merge", "-q", film, "-o", "m.png", "-o", "m.film"], more].concat());
        bytes(dir.path(), "m.png")
    };
    assert!(merged("last.film", &[]) == filmic);
    assert!(merged("last.film", &["--exposure", "2"]) == brighter);
    assert!(merged("last.film", &["--tone", "srgb"]) == plain);
    // The merged film stores the view that was requested last.
    fs::rename(dir.path().join("m.film"), dir.path().join("plain.film")).expect("a film");
    assert!(merged("plain.film", &[]) == plain);
    assert!(plain != filmic && filmic != brighter, "negative control: tone and exposure show");
}

#[test]
fn a_merge_does_not_replace_its_inputs() {
    let dir = folder();
    let scene = cover();
    for (range, film) in [("0..1", "a.film"), ("1..2", "b.film")] {
        succeed(dir.path(), &render(&scene, &["--range", range, "--film", film, "-o", "a.exr"]));
    }
    let before = [bytes(dir.path(), "a.film"), bytes(dir.path(), "b.film")];
    let mut others = vec!["b.film", "./b.film"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("b.film", dir.path().join("link.film")).unwrap();
        fs::hard_link(dir.path().join("b.film"), dir.path().join("twin.film")).unwrap();
        others.extend(["link.film", "twin.film"]);
    }
    for other in others {
        let said = refused(dir.path(), 2, &["merge", "a.film", "b.film", "-o", "m.film", "-o", other]);
        assert!(said.contains("replace") && said.contains(other) && said.contains("b.film"), "{said}");
        assert!(!dir.path().join("m.film").exists());
    }
    assert!([bytes(dir.path(), "a.film"), bytes(dir.path(), "b.film")] == before);
    // Negative control.
    succeed(dir.path(), &["merge", "a.film", "b.film", "-o", "m.film"]);
}
