//! Workers with wrong results.

use crate::machines::{Place, SIZE, cover, has_server};

#[test]
fn a_worker_that_flips_one_bit_is_named() {
    if !has_server() {
        return;
    }
    if !cfg!(any(debug_assertions, feature = "broken-material")) {
        println!("skipped: this build has no faults on request");
        return;
    }
    let place = Place::start(&[]);
    let _liar = place.worker("liar", |command| {
        command.env("STRIDE_TEST_FLEET_FLIP", "1");
    });
    let _honest = ["a", "b"].map(|name| place.worker(name, |_| ()));
    let scene = cover();
    let job = ["submit", &scene, "--size", SIZE, "--unit", "1ms", "--patience", "1s", "--spp", "12"];
    let outputs = ["--film", "v.film", "-o", "v.exr"];
    let (_, said) = place.succeed(&[&job[..], &["--verify", "1"], &outputs].concat());
    assert!(said.contains("the result of liar is wrong") && said.contains("none of its results"), "{said}");
    assert!(!said.contains("result of a is wrong") && !said.contains("result of b is wrong"), "{said}");
    place.expect_single("v", &["--spp", "12"]);
}
