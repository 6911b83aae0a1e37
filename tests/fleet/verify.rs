//! Workers with wrong results.

use crate::common::watched::poll;
use crate::machines::{Place, SIZE, cover, has_faults, has_server};

#[test]
fn a_worker_that_flips_one_bit_is_named() {
    if !has_server() || !has_faults() {
        return;
    }
    let place = Place::start(&[]);
    let scene = cover();
    let job = ["submit", &scene, "--size", SIZE, "--unit", "1ms", "--patience", "60s", "--spp", "12"];
    let outputs = ["--verify", "1", "--film", "v.film", "-o", "v.exr"];
    let submit = place.watch(&[&job[..], &outputs].concat());
    let _liar = place.worker("liar", |command| {
        command.env("STRIDE_TEST_FLEET_FLIP", "1");
    });
    // Otherwise the others may have done everything before it comes.
    poll("a result of the liar", || place.said("liar").contains(" samples "));
    let _honest = ["a", "b"].map(|name| place.worker(name, |_| ()));
    let (code, said) = submit.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("the result of liar is wrong") && said.contains("none of its results"), "{said}");
    assert!(!said.contains("result of a is wrong") && !said.contains("result of b is wrong"), "{said}");
    place.expect_single("v", &["--spp", "12"]);
}
