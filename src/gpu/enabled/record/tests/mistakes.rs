//! Invalid programs are rejected with a reason.

use super::super::*;
use super::{Scene, named, valid};
use crate::math::{Float, Mask, Uint, function, value};

type F = RecordedFloat;

fn error_of(recording: Recording<'_>) -> String {
    recording.finish().expect_err("a mistake goes unnoticed").to_string()
}

#[test]
fn numbers_of_other_functions_are_rejected() {
    let scene = Scene::new();
    let record = |captures: bool| {
        let mut recording = scene.recording();
        recording.function(named!(outer(x, y)), |(x, y): (F, F)| {
            let inner = |x: F| if captures { x * y } else { x * F::splat(2.0) + F::given(&scene.near) };
            function!(F, inner(x), { inner(x) })
        });
        recording
    };
    valid(record(false));
    let error = error_of(record(true));
    assert_eq!(error, "outer > inner: a number of another function is used that is no argument");
}

#[test]
fn constants_and_numbers_of_the_scene_may_come_from_another_function() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(outer(x)), |(x,): (F,)| {
        let (two, near) = (F::splat(2.0), -F::given(&scene.near));
        function!(F, inner(x), { x * two - near })
    });
    assert!(valid(recording).contains("return x * 2.0f + scene.near;"));
}

#[test]
fn numbers_leave_branches_and_loops_only_as_results() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(leaking(x)), |(x,): (F,)| {
        let mut leak = x;
        let y = F::branch(x.lt(F::zero()), x, || {
            leak = x.sqrt();
            leak
        });
        y + leak
    });
    assert_eq!(error_of(recording), "leaking: a number leaves a branch or a loop other than in its result");
}

fn two_bodies(scene: &Scene, second: f32) -> Recording<'_> {
    let mut recording = scene.recording();
    let half = |x: F, k: f32| function!(F, half(x), { x * k });
    recording.function(named!(caller(x)), move |(x,): (F,)| half(x, 0.5) + half(x + 1.0, second));
    recording
}

#[test]
fn functions_with_one_name_must_be_identical() {
    let scene = Scene::new();
    valid(two_bodies(&scene, 0.5));
    let error = error_of(two_bodies(&scene, 0.25));
    for part in ["two functions are called half", "return x * 0.5f;", "return x * 0.25f;"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn functions_with_one_name_must_have_the_same_parameters() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(caller(x, i)), |(x, i): (F, RecordedUint)| {
        let one = function!(F, same(x), { x * 2.0 });
        let x = i;
        one + function!(F, same(x), { x.to_float() })
    });
    assert!(error_of(recording).contains("two functions of other parameters are called same"));
}

#[test]
fn structures_with_one_name_must_be_identical() {
    mod other {
        use crate::math::value;
        #[derive(Clone, Copy)]
        pub(super) struct Pair<F: crate::math::Float> {
            pub(super) a: F,
            pub(super) b: F::Uint,
        }
        value!(Pair { a, b });
    }
    #[derive(Clone, Copy)]
    struct Pair<F> {
        a: F,
        b: F,
    }
    value!(Pair { a, b });
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(first(x)), |(x,): (F,)| Pair { a: x, b: x });
    recording.function(named!(second(x, i)), |(x, i): (F, RecordedUint)| other::Pair { a: x, b: i });
    assert_eq!(error_of(recording), "two structures are called Pair");
}

#[test]
#[should_panic(expected = "a number of the scene that no one registered is used in outer > inner")]
fn numbers_of_the_scene_must_be_registered() {
    let (scene, number) = (Scene::new(), 1.0);
    let mut recording = scene.recording();
    recording.function(named!(outer(x)), |(x,): (F,)| function!(F, inner(x), { x * F::given(&number) }));
}

#[test]
#[should_panic(expected = "a table of the scene that no one registered is read in outer")]
fn tables_must_be_registered() {
    let scene = Scene::new();
    let table = vec![1, 2];
    let mut recording = scene.recording();
    recording.function(named!(outer(i)), |(i,): (RecordedUint,)| RecordedUint::gather(&table, i));
}

#[test]
#[should_panic(expected = "the same memory is registered as")]
fn memory_must_be_registered_once() {
    let number = 1.0;
    Registry::new().number(&number, "scene.near").number(&number, "scene.near").number(&number, "scene.far");
}

#[test]
#[should_panic(expected = "outer > again > again: WGSL has no recursion")]
fn recursion_is_rejected() {
    fn again(x: F, left: u32) -> F {
        function!(F, again(x), { if left == 0 { x } else { again(x, left - 1) } })
    }
    let scene = Scene::new();
    scene.recording().function(named!(outer(x)), |(x,): (F,)| again(x, 1));
}

#[test]
fn a_panic_ends_the_recording() {
    let scene = Scene::new();
    let attempt = || {
        let mut recording = scene.recording();
        recording.function(named!(wrong(x)), |(x,): (F,)| x * F::given(&1.0));
    };
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(attempt)).expect_err("no one registered it");
    let outside = std::panic::catch_unwind(|| RecordedMask::splat(true));
    outside.expect_err("nothing is recorded here");
    let mut recording = scene.recording();
    recording.function(named!(right(x)), |(x,): (F,)| x * 2.0);
    valid(recording);
}
