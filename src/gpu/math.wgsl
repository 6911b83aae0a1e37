// Floating-point functions with the results of `math::lanes`.

// `a` if it is less than `b`, else `b`. The result of WGSL's `min` is not specified for NaN.
fn float_min(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

fn float_max(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

fn copysign(x: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) & 0x7fffffffu) | (bitcast<u32>(sign) & 0x80000000u));
}

// Whether a number is above zero and finite. It is tested by its bits, because a compiler may assume that no float is
// NaN or infinite.
fn is_positive_and_finite(x: f32) -> bool {
    return bitcast<u32>(x) - 1u < 0x7f7fffffu;
}

// Whether all coordinates of a ray are finite, also tested by their bits. Other rays hit nothing.
fn is_finite_ray(ray: Ray) -> bool {
    let exponent = vec3u(0x7f800000u);
    let o = bitcast<vec3u>(ray.o) & exponent;
    let d = bitcast<vec3u>(ray.d) & exponent;
    return all(o != exponent) && all(d != exponent);
}

fn max_channel(c: vec3f) -> f32 {
    return float_max(float_max(c.x, c.y), c.z);
}

fn max_abs(v: vec3f) -> f32 {
    let a = abs(v);
    return float_max(float_max(a.x, a.y), a.z);
}
