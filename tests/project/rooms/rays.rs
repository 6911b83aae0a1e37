//! Integrators construct no rays.

use super::sources::{sources, src};
use super::tokens::tokens;
use std::fs;

/// Whether a source constructs a ray from numbers, even if only its origin.
fn makes_rays(source: &str) -> bool {
    let tokens = tokens(source);
    let is_field = |token: &str| ["o", "d", "time", "."].contains(&token);
    tokens.iter().any(|token| token == "offset_origin")
        || tokens.windows(3).any(|three| {
            let [name, then, last] = [0, 1, 2].map(|i| three[i].as_str());
            name == "Ray" && (then == "{" && is_field(last) || then == "::" && last == "new")
        })
}

#[test]
fn integrators_get_their_rays_from_cameras_and_interactions() {
    let mut files = Vec::new();
    sources(&src().join("integrator"), &mut files);
    assert!(files.len() > 8, "only {} files", files.len());
    for file in files {
        assert!(!makes_rays(&fs::read_to_string(&file).unwrap()), "{} makes a ray", file.display());
    }
    for makes in [
        "Ray { o, d }",
        "math::Ray {d: n, o: p}",
        "Ray::new(o, d)",
        "crate::shape::offset_origin(p, n, error, d)",
    ] {
        assert!(makes_rays(makes), "{makes}");
    }
    for does_not in
        ["Event::Ray { depth, origin }", "at.scattered(d)", "// Ray { o, d }", "fn f() -> Ray { at }"]
    {
        assert!(!makes_rays(does_not), "{does_not}");
    }
}
