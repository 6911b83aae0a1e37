// Twin of `shape::triangle`: intersections are watertight.
//
// Both triangles at an edge must round its terms alike. A compiler may fuse a product with a sum, or reorder sums, for
// one triangle and not for the other. `rounded` prevents that.

// The same number. A compiler cannot fold the exclusive-or, since it does not know that `scene.zero` is 0.
fn rounded(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ scene.zero);
}

fn rounded3(v: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(v) ^ vec3u(scene.zero));
}

// A ray for triangle tests: the axes are permuted so that the direction's largest component is the third, and the ray
// is sheared along it.
struct ShearedRay {
    o: vec3f,
    // dx/dz, dy/dz and 1/dz of the permuted direction.
    shear: vec3f,
    // 1/dx and 1/dy. They are 0 for components near 0, whose axis then bounds nothing.
    inverse: vec2f,
    // Whether x is permuted to the third place, and whether y is.
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

// The hit of a ray and a triangle: the distance, or NOTHING, and the weights of the second and the third corner.
struct TriangleHit {
    t: f32,
    weights: vec2f,
}

// Whether no two of the numbers have different signs.
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

// The value of a·b − c·d if both products round to the same number.
fn exact_difference(ab: vec2f, cd: vec2f) -> f32 {
    return lost(ab.x, ab.y) - lost(cd.x, cd.y);
}

// Whether the triangle with the sides `ab` and `ac` is a needle. `share` scales the threshold NEEDLE.
fn is_needle(ab: vec3f, ac: vec3f, share: f32) -> bool {
    let size = float_max(max_abs(ab), max_abs(ac));
    return size * size > max_abs(cross(ab, ac)) * (NEEDLE * share);
}

// A corner relative to the ray's origin, with permuted axes.
fn corner_of(ray: ShearedRay, corner: vec3f) -> vec3f {
    return rounded3(reorder(ray.x_last, ray.y_last, corner) - ray.o);
}

// The sheared x and y of a corner.
fn flat_corner(ray: ShearedRay, w: vec3f) -> vec2f {
    return vec2f(rounded(w.x - rounded(ray.shear.x * w.z)), rounded(w.y - rounded(ray.shear.y * w.z)));
}

// Twice the signed area of the triangle between the ray and an edge, after shearing.
fn side(p: vec2f, q: vec2f) -> f32 {
    return rounded(p.x * q.y) - rounded(p.y * q.x);
}

// The interval of t in which the ray is within the bounds of three corners along one axis.
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
    // A difference that rounds to zero would place a ray far beside a small triangle on its edge. The differences of a
    // needle consist mostly of rounding errors. Both are computed exactly. The host decides which triangles are needles
    // when it bounds the errors of hits, and may round the test in another way. The threshold is lower here, so that
    // every needle of the host is one here.
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
    // The intervals of t within the triangle's bounds, for the three axes.
    let x = span(vec3f(from_a.x, from_b.x, from_c.x), ray.inverse.x);
    let y = span(vec3f(from_a.y, from_b.y, from_c.y), ray.inverse.y);
    let z = span(along_ray, 1.0);
    let clamped = max(max(x.x, y.x), max(z.x, min(min(x.y, y.y), min(z.y, mean))));
    // A triangle that is seen edge-on has no area, and `mean` is NaN or infinite.
    let is_finite = (bitcast<u32>(mean) & 0x7f800000u) != 0x7f800000u;
    return TriangleHit(select(NOTHING, clamped, is_finite && is_positive_and_finite(clamped)), weights.yz);
}
