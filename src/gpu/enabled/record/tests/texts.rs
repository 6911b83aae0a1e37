//! Programs, compared with the expected WGSL.

use super::super::*;
use super::{Doubled, Marked, Scene, named, valid};
use crate::math::{Float, Frame, Mask, Rgb, Uint, Vec3, function, trig};

type F = RecordedFloat;
type U = RecordedUint;

#[track_caller]
fn reads(recording: Recording<'_>, expected: &str) {
    let text = valid(recording);
    assert!(text == expected, "{text}");
}

fn is(kind: U, k: u32) -> RecordedMask {
    kind.eq(U::splat(k))
}

#[test]
fn vectors_stay_vectors() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.callees(named!(calls(n)), |(n,): (Vec3<F>,)| Frame::around(n));
    recording.function(named!(mixed(v, w, u)), |(v, w, u): (Vec3<F>, Vec3<F>, [F; 2])| {
        let scaled = v.cross(w) * u[0] + Vec3::given(&scene.eye) - -w;
        Vec3::new(scaled.x, scaled.y, u[1])
    });
    reads(
        recording,
        "\
struct Frame {
    s: vec3f,
    t: vec3f,
    n: vec3f,
}

// From `math::frame`.
fn frame_around(n: vec3f) -> Frame {
    let v1 = copysign(1.0f, n.z);
    let v2 = -1.0f / (v1 + n.z);
    let v3 = n.x * n.y * v2;
    return Frame(
        vec3f(v1 * n.x * n.x * v2 + 1.0f, v1 * v3, -v1 * n.x),
        vec3f(v3, v1 + n.y * n.y * v2, -n.y),
        n,
    );
}

// From `some::place`.
fn mixed(v: vec3f, w: vec3f, u: vec2f) -> vec3f {
    let v1 = cross(v, w) * u.x + scene.eye + w;
    return vec3f(v1.xy, u.y);
}
",
    );
}

#[test]
fn forks_chain_and_return() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    let chain = |kind: U, x: F| {
        F::fork(
            is(kind, 0),
            || x.sqrt(),
            || F::fork(is(kind, 1), || x * 2.0, || F::fork(is(kind, 2), || -x, || x / 3.0)),
        )
    };
    recording.function(named!(at_the_end(kind, x)), |(kind, x): (U, F)| chain(kind, x));
    recording.function(named!(inside(kind, x)), |(kind, x): (U, F)| {
        let v = chain(kind, x);
        let v = F::branch(is(kind, 3), v, || x + 1.0);
        let v = F::branch(!is(kind, 4), v, || x + 2.0);
        v * v
    });
    reads(
        recording,
        "\
// From `some::place`.
fn at_the_end(kind: u32, x: f32) -> f32 {
    if kind == 0u {
        return sqrt(x);
    }
    if kind == 1u {
        return x * 2.0f;
    }
    if kind == 2u {
        return -x;
    }
    return x / 3.0f;
}

// From `some::place`.
fn inside(kind: u32, x: f32) -> f32 {
    var v1: f32;
    if kind != 4u {
        v1 = x + 2.0f;
    } else if kind == 3u {
        v1 = x + 1.0f;
    } else if kind == 0u {
        v1 = sqrt(x);
    } else if kind == 1u {
        v1 = x * 2.0f;
    } else if kind == 2u {
        v1 = -x;
    } else {
        v1 = x / 3.0f;
    }
    return v1 * v1;
}
",
    );
}

#[test]
fn rows_are_read_in_the_blocks_that_need_them() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(Light_sample(light, u)), |(light, u): (U, [F; 2])| {
        let origin: Vec3<F> = Vec3::gather(&scene.origin, light);
        let radius = F::gather(&scene.radius, light);
        let to_light = origin - Vec3::given(&scene.eye);
        let far = F::gather(&scene.offsets, light.shr::<1>());
        let unused = radius.sqrt();
        let (sin, cos) = trig::sin_cos_turns(u[0]);
        let is_far = to_light.length().gt(far) & is(U::gather(&scene.kind, light), 1);
        let (at, weight) = F::branch(is_far, (Vec3::zero(), F::zero()), || {
            (Vec3::new(sin * radius, cos * radius, u[1]), F::splat(1.0) / radius)
        });
        let _ = unused;
        Marked { at, weight }
    });
    let text = valid(recording);
    let (_, text) = text.split_once("// From `some::place`.\n").unwrap();
    assert!(
        text == "\
fn light_sample(light: u32, u: vec2f) -> Marked {
    let light_2 = light_at(light);
    let v1 = light_2.origin - scene.eye;
    if sqrt(dot(v1, v1)) > offset_node(light >> 1u) && light_2.kind == 1u {
        let v2 = sin_cos_turns(u.x);
        return Marked(vec3f(v2.x * light_2.radius, v2.y * light_2.radius, u.y), 1.0f / light_2.radius);
    }
    return Marked(vec3f(0.0f), 0.0f);
}
",
        "{text}"
    );
}

#[test]
fn loops_update_their_state_simultaneously() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(fibonacci(n)), |(n,): (U,)| {
        let (zero, one) = (U::splat(0), U::splat(1));
        F::repeat(zero.lt(n), (zero, zero, one, n), |(i, a, b, n)| {
            let next = i + one;
            ((next, b, a + b, n), next.lt(n))
        })
        .1
    });
    recording.function(named!(root(x, rounds)), |(x, rounds): (F, F)| {
        let half = rounds * 0.5;
        let (y, _) = F::repeat(RecordedMask::splat(true), (x, F::zero()), |(y, i)| {
            let i = i + half;
            (((y + x / y) * 0.5, i), i.lt(rounds))
        });
        y
    });
    reads(
        recording,
        "\
// From `some::place`.
fn fibonacci(n: u32) -> u32 {
    var v1 = 0u;
    var v2 = 0u;
    var v3 = 1u;
    var live = n > 0u;
    while live {
        let v4 = v1 + 1u;
        let next_v3 = v2 + v3;
        live = v4 < n;
        v1 = v4;
        v2 = v3;
        v3 = next_v3;
    }
    return v2;
}

// From `some::place`.
fn root(x: f32, rounds: f32) -> f32 {
    let v1 = rounds * 0.5f;
    var v2 = x;
    var v3 = 0.0f;
    loop {
        let v4 = v3 + v1;
        v2 = (v2 + x / v2) * 0.5f;
        v3 = v4;
        if !(v4 < rounds) {
            break;
        }
    }
    return v2;
}
",
    );
}

#[test]
fn structures_pass_through_functions() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(marks(marked, ref)), |(marked, count): (Marked<F>, U)| {
        let moved = function!(F, moved(marked), { Marked { at: marked.at * marked.weight, ..marked } });
        let twice = F::device(&Doubled, (moved, count));
        let best = function!(F, best(twice), { (twice.at, twice.weight.gt(F::zero())) });
        (best.0, Rgb::splat([1.0, 0.5, 0.25]).only(best.1))
    });
    reads(
        recording,
        "\
struct BestResult {
    first: vec3f,
    second: bool,
}

struct MarksResult {
    first: vec3f,
    second: vec3f,
}

// From `gpu::enabled::record::tests::texts`.
fn moved(marked: Marked) -> Marked {
    return Marked(marked.at * marked.weight, marked.weight);
}

// From `gpu::enabled::record::tests::texts`.
fn best(twice: Marked) -> BestResult {
    return BestResult(twice.at, twice.weight > 0.0f);
}

// From `some::place`.
fn marks(marked: Marked, ref_: u32) -> MarksResult {
    let best_result = best(doubled(moved(marked), ref_));
    return MarksResult(best_result.first, select(vec3f(0.0f), vec3f(1.0f, 0.5f, 0.25f), best_result.second));
}
",
    );
}

#[test]
fn constants_are_folded() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(known(x, i)), |(x, i): (F, U)| {
        let (yes, one) = (RecordedMask::splat(true), F::splat(1.0));
        let x = F::fork(yes, || x * 1.0, || x.sqrt());
        let x = F::select(!yes, one, x) / 1.0;
        let bits = (i & U::splat(u32::MAX)) + U::splat(0);
        let large = F::splat(f32::INFINITY).max(one / F::splat(0.0));
        let nothing = F::splat(f32::NAN);
        let third = one / F::splat(3.0);
        (x.min(large), -x.abs() + 1.0, nothing, F::from_bits((x + third).to_bits() | bits))
    });
    reads(
        recording,
        "\
// From `some::place`.
fn known(x: f32, i: u32) -> vec4f {
    return vec4f(
        float_min(x, NOTHING),
        1.0f - abs(x),
        bitcast<f32>(0x7fc00000u | scene.zero),
        bitcast<f32>(bitcast<u32>(x + 0.33333334f) | i),
    );
}
",
    );
}

#[test]
fn blocks_use_known_conditions_and_skip_unchanged_values() {
    let scene = Scene::new();
    let mut recording = scene.recording();
    recording.function(named!(within(x, marked, count)), |(x, marked, count): (F, Marked<F>, U)| {
        let is_far = x.gt(F::splat(1.0));
        let both = is_far & marked.weight.lt(x);
        let changed = F::branch(both, marked, || Marked { weight: x.only(is_far), ..marked });
        F::device(&Doubled, (changed, count))
    });
    reads(
        recording,
        "\
// From `some::place`.
fn within(x: f32, marked: Marked, count: u32) -> Marked {
    var marked_2 = marked;
    if x > 1.0f && marked.weight < x {
        marked_2 = Marked(marked.at, x);
    }
    return doubled(marked_2, count);
}
",
    );
}
