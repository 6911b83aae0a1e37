// Twin of `math`: a ray, frames, trigonometry, and the floats' own functions.

struct Ray {
    o: vec3f,
    d: vec3f,
}

struct Frame {
    s: vec3f,
    t: vec3f,
    n: vec3f,
}

// `a` if it is less than `b`, else `b`: WGSL's own may do as it likes with NaN.
fn float_min(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

fn float_max(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

fn copysign(x: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) & 0x7fffffffu) | (bitcast<u32>(sign) & 0x80000000u));
}

// Above zero and finite. A compiler may assume that there are no NaNs and infinities, and answer any
// question about them by floats as it likes; not so for integers.
fn is_positive_and_finite(x: f32) -> bool {
    return bitcast<u32>(x) - 1u < 0x7f7fffffu;
}

// Whether all of a ray's coordinates are finite, told by their bits for the same reason. Others meet nothing.
fn is_finite_ray(ray: Ray) -> bool {
    let exponent = vec3u(0x7f800000u);
    let o = bitcast<vec3u>(ray.o) & exponent;
    let d = bitcast<vec3u>(ray.d) & exponent;
    return all(o != exponent) && all(d != exponent);
}

// Told by its bits, for the same reason.
fn is_nan(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u;
}

fn max_channel(c: vec3f) -> f32 {
    return float_max(float_max(c.x, c.y), c.z);
}

fn max_abs(v: vec3f) -> f32 {
    let a = abs(v);
    return float_max(float_max(a.x, a.y), a.z);
}

fn normalized(v: vec3f) -> vec3f {
    return v * (1.0 / sqrt(dot(v, v)));
}

fn frame_around(n: vec3f) -> Frame {
    let sign = copysign(1.0, n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    return Frame(
        vec3f(sign * n.x * n.x * a + 1.0, sign * b, -sign * n.x),
        vec3f(b, sign + n.y * n.y * a, -n.y),
        n,
    );
}

fn to_world(frame: Frame, v: vec3f) -> vec3f {
    return frame.s * v.x + frame.t * v.y + frame.n * v.z;
}

fn to_local(frame: Frame, v: vec3f) -> vec3f {
    return vec3f(dot(v, frame.s), dot(v, frame.t), dot(v, frame.n));
}

// (sin 2πu, cos 2πu) for u in [0, 1]. WGSL's own sine promises 2⁻¹¹.
fn sin_cos_turns(u: f32) -> vec2f {
    let quarters = u * 4.0;
    let nearest = floor(quarters + 0.5);
    let r = quarters - nearest;
    let z = r * r;
    let sin = r
        * ((((z * 1.5820653e-4 - 4.6812664e-3) * z + 0.07969258) * z - 0.6459641) * z + 1.5707964);
    let cos = (((z * 9.036299e-4 - 0.02086007) * z + 0.2536692) * z - 1.2337005) * z + 1.0;
    let quadrant = u32(nearest);
    let swap = (quadrant & 1u) == 1u;
    let sin_sign = (quadrant & 2u) << 30u;
    let cos_sign = ((quadrant + 1u) & 2u) << 30u;
    let s = select(sin, cos, swap);
    let c = select(cos, sin, swap);
    return vec2f(bitcast<f32>(bitcast<u32>(s) ^ sin_sign), bitcast<f32>(bitcast<u32>(c) ^ cos_sign));
}

// The angle of (x, y) over 2π, in [0, 1).
fn angle_turns(y: f32, x: f32) -> f32 {
    let ax = abs(x);
    let ay = abs(y);
    let q = float_min(ax, ay) / float_max(float_max(ax, ay), SMALLEST_NORMAL);
    let z = q * q;
    var p = 0.0028340642;
    p = p * z - 0.01600503;
    p = p * z + 0.042587608;
    p = p * z - 0.07495446;
    p = p * z + 0.10636754;
    p = p * z - 0.14202571;
    p = p * z + 0.19992484;
    p = p * z - 0.33333066;
    p = p * z + 1.0;
    let eighth = q * p * FRAC_1_PI * 0.5;
    let first = select(eighth, 0.25 - eighth, ay > ax);
    let upper = select(first, 0.5 - first, x < 0.0);
    let turns = select(upper, 1.0 - upper, y < 0.0);
    return select(0.0, turns, turns < 1.0);
}
