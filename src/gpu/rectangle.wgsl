// Twin of `light::rectangle`: the rectangle, sampled by the solid angle that it fills.

// A rectangle seen from a point, in the frame of its sides with the point at the origin.
struct Rectangle {
    // From x₀ to x₁ and from y₀ to y₁, at z < 0.
    x: vec2f,
    y: vec2f,
    z: f32,
    // z components of the unit normals of the planes through the point and the sides at y₀ and y₁.
    b: vec2f,
    // What the two inner angles at the side x₀ exceed right ones by, together.
    excess: f32,
    solid_angle: f32,
}

// The arc sine of a·b, given 1 − a² and 1 − b².
fn excess_of(a: f32, a_rest: f32, b: f32, b_rest: f32) -> f32 {
    let sin = a * b;
    let cos = sqrt(a_rest + a * a * b_rest);
    return copysign(angle_turns(abs(sin), cos) * (2.0 * PI), sin);
}

fn rectangle_seen(corner: vec3f, u: vec3f, v: vec3f) -> Rectangle {
    let width = sqrt(dot(u, u));
    let height = sqrt(dot(v, v));
    let x_axis = u * (1.0 / width);
    let y_axis = v * (1.0 / height);
    let x0 = dot(corner, x_axis);
    let y0 = dot(corner, y_axis);
    let sides = vec4f(y0, x0 + width, y0 + height, x0);
    let z = -abs(dot(corner, cross(x_axis, y_axis)));
    let far2 = sides * sides + z * z;
    let n = sides / sqrt(far2) * vec4f(-1.0, 1.0, 1.0, -1.0);
    // 1 − (ab)² without cancellation, from what each side's 1 − n² is.
    let rest = z * z / far2;
    let left = excess_of(n.z, rest.z, n.w, rest.w) + excess_of(n.w, rest.w, n.x, rest.x);
    let right = excess_of(n.x, rest.x, n.y, rest.y) + excess_of(n.y, rest.y, n.z, rest.z);
    return Rectangle(sides.wy, sides.xz, z, n.xz, left, left + right);
}

// A point of it, as its share of either side, so that its direction is uniform over the solid angle.
fn rectangle_sample(seen: Rectangle, u: vec2f) -> vec2f {
    let z2 = seen.z * seen.z;
    let phi = seen.excess - u.x * seen.solid_angle;
    let sin_cos = sin_cos_turns(abs(phi) * (0.5 * FRAC_1_PI));
    let sin = copysign(sin_cos.x, phi);
    let n = seen.b.x * sin_cos.y + seen.b.y;
    // cos² of the angle between the axis z and the plane through the point and the cut, scaled.
    let y0 = seen.y.x;
    let scaled = sqrt(float_max(n * n - sin * sin * (z2 / (y0 * y0 + z2)), 0.0));
    let cut = seen.z * sin * copysign(1.0, n) / float_max(scaled, SMALLEST_NORMAL);
    let x = float_min(float_max(cut, seen.x.x), seen.x.y);
    // Which y on that line: its sine as seen from the point is uniform.
    let d2 = x * x + z2;
    let h = seen.y / sqrt(d2 + seen.y * seen.y);
    let at = h.x + u.y * (h.y - h.x);
    let line = at * sqrt(d2) / sqrt(float_max(1.0 - at * at, SMALLEST_NORMAL));
    let y = float_min(float_max(line, seen.y.x), seen.y.y);
    return vec2f((x - seen.x.x) / (seen.x.y - seen.x.x), (y - seen.y.x) / (seen.y.y - seen.y.x));
}
