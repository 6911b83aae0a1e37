// Twin of `shape::triangle`: no ray leaks between neighbours.
//
// That rests on roundings: both triangles at an edge must round what they share alike. A compiler may fuse a product
// with a sum, or change the order of sums, here but not there; `rounded` keeps it from that.

// The same number, in a form that no compiler can fold.
fn rounded(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ scene.zero);
}

fn rounded3(v: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(v) ^ vec3u(scene.zero));
}

// A ray in the form that triangle tests use: its longest axis comes third, and the ray is sheared along it.
struct ShearedRay {
    o: vec3f,
    // dx/dz, dy/dz and 1/dz in that order.
    shear: vec3f,
    // 1/dx and 1/dy; zero of what is nearly zero, which bounds nothing.
    inverse: vec2f,
    // Whether the first coordinate comes last, and whether the second does.
    x_last: bool,
    y_last: bool,
}

fn reorder(x_last: bool, y_last: bool, v: vec3f) -> vec3f {
    return select(select(v, v.zxy, y_last), v.yzx, x_last);
}

fn sheared_ray(ray: Ray) -> ShearedRay {
    let a = abs(ray.d);
    let x_longest = a.x > a.y;
    let beyond_z = select(a.y, a.x, x_longest) > a.z;
    let x_last = x_longest && beyond_z;
    let y_last = !x_longest && beyond_z;
    let d = reorder(x_last, y_last, ray.d);
    let shear = vec3f(d.xy, 1.0) / d.z;
    let inverse = select(1.0 / d.xy, vec2f(0.0), abs(d.xy) < vec2f(LEAST_COMPONENT));
    return ShearedRay(reorder(x_last, y_last, ray.o), shear, inverse, x_last, y_last);
}

// Where a ray meets a triangle: the distance, or NOTHING, and the weights of the second and the third corner.
struct TriangleHit {
    t: f32,
    weights: vec2f,
}

// Whether no two numbers have different signs.
fn one_sign(v: vec3f) -> bool {
    return all(v >= vec3f(0.0)) || all(v <= vec3f(0.0));
}

// The rounding error of a product.
fn lost(x: f32, y: f32) -> f32 {
    let big = vec2f(rounded(x * 4097.0), rounded(y * 4097.0));
    let high = vec2f(
        rounded(big.x - rounded(big.x - x)),
        rounded(big.y - rounded(big.y - y)),
    );
    let low = vec2f(rounded(x - high.x), rounded(y - high.y));
    let first = rounded(rounded(high.x * high.y) - rounded(x * y));
    return rounded(rounded(first + rounded(high.x * low.y)) + rounded(low.x * high.y)) + rounded(low.x * low.y);
}

// The value of a·b − c·d where both products round to the same number.
fn exact_difference(ab: vec2f, cd: vec2f) -> f32 {
    return lost(ab.x, ab.y) - lost(cd.x, cd.y);
}

// Whether a triangle of which these are two sides is a needle, or from how flat on, as a share of NEEDLE.
fn is_needle(ab: vec3f, ac: vec3f, share: f32) -> bool {
    let size = float_max(max_abs(ab), max_abs(ac));
    return size * size > max_abs(cross(ab, ac)) * (NEEDLE * share);
}

// A corner from the ray's origin, in the ray's order.
fn corner_of(ray: ShearedRay, corner: vec3f) -> vec3f {
    return rounded3(reorder(ray.x_last, ray.y_last, corner) - ray.o);
}

// Its two sheared coordinates.
fn flat_corner(ray: ShearedRay, w: vec3f) -> vec2f {
    return vec2f(rounded(w.x - rounded(ray.shear.x * w.z)), rounded(w.y - rounded(ray.shear.y * w.z)));
}

// Twice the area between the ray and a side.
fn side(p: vec2f, q: vec2f) -> f32 {
    return rounded(p.x * q.y) - rounded(p.y * q.x);
}

// Where along the ray the box of three corners begins and ends, in one coordinate.
fn span(corners: vec3f, inverse: f32) -> vec2f {
    let t = corners * inverse;
    let ends = vec2f(min(min(t.x, t.y), t.z), max(max(t.x, t.y), t.z));
    return select(ends, vec2f(-NOTHING, NOTHING), inverse == 0.0);
}

fn triangle_meet(ray: ShearedRay, corner_a: vec3f, corner_b: vec3f, corner_c: vec3f) -> TriangleHit {
    let from_a = corner_of(ray, corner_a);
    let from_b = corner_of(ray, corner_b);
    let from_c = corner_of(ray, corner_c);
    let a = flat_corner(ray, from_a);
    let b = flat_corner(ray, from_b);
    let c = flat_corner(ray, from_c);
    var sides = vec3f(side(c, b), side(a, c), side(b, a));
    if !one_sign(sides) {
        return TriangleHit(NOTHING, vec2f(0.0));
    }
    // Where rounding makes a difference zero, a ray far beside a small triangle seems to be on its side; and of a needle
    // little but rounding is left of it. The host, which says how large its error is, may round its form otherwise: here
    // a triangle is a needle a little sooner.
    let needle = is_needle(corner_b - corner_a, corner_c - corner_a, 0.99);
    if needle || any(sides == vec3f(0.0)) {
        let exact = vec3f(
            exact_difference(vec2f(c.x, b.y), vec2f(c.y, b.x)),
            exact_difference(vec2f(a.x, c.y), vec2f(a.y, c.x)),
            exact_difference(vec2f(b.x, a.y), vec2f(b.y, a.x)),
        );
        sides = select(sides, rounded3(sides + exact), vec3<bool>(needle) | (sides == vec3f(0.0)));
        if !one_sign(sides) {
            return TriangleHit(NOTHING, vec2f(0.0));
        }
    }
    let weights = sides * (1.0 / (sides.x + sides.y + sides.z));
    let along_ray = vec3f(from_a.z, from_b.z, from_c.z) * ray.shear.z;
    let mean = dot(weights, along_ray);
    // Where the ray is in the triangle's box, along all three axes.
    let x = span(vec3f(from_a.x, from_b.x, from_c.x), ray.inverse.x);
    let y = span(vec3f(from_a.y, from_b.y, from_c.y), ray.inverse.y);
    let z = span(along_ray, 1.0);
    let clamped = max(max(x.x, y.x), max(z.x, min(min(x.y, y.y), min(z.y, mean))));
    // Seen from its edge a triangle has no area, and `mean` is NaN or infinite.
    let is_finite = (bitcast<u32>(mean) & 0x7f800000u) != 0x7f800000u;
    return TriangleHit(select(NOTHING, clamped, is_finite && is_positive_and_finite(clamped)), weights.yz);
}
