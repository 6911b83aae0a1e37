// Twin of `shape`: the distance to the first hit of a surface, or NOTHING.

fn plane_intersect(surface: Surface, ray: Ray) -> f32 {
    let t = (surface.constant - dot(ray.o, surface.axis)) / dot(ray.d, surface.axis);
    return select(NOTHING, t, is_positive_and_finite(t));
}

// The power of a point with respect to the sphere: squared distance from the centre less squared radius. `w` is the
// vector from the anchor to the point.
fn sphere_power(surface: Surface, w: vec3f) -> f32 {
    return dot(w, w - 2.0 * surface.axis) + surface.constant;
}

fn sphere_intersect(surface: Surface, ray: Ray) -> f32 {
    let w = ray.o - surface.anchor;
    let b = dot(w - surface.axis, ray.d);
    let c = sphere_power(surface, w);
    let discriminant = -sphere_power(surface, w - ray.d * b);
    let root = sqrt(float_max(discriminant, 0.0));
    let q = -b - copysign(root, b);
    let t0 = c / q;
    let near = float_min(t0, q);
    let far = float_max(t0, q);
    let t = select(far, near, near > 0.0);
    return select(NOTHING, t, discriminant >= 0.0 && is_positive_and_finite(t));
}

// The distance to a sphere along a ray whose direction need not be a unit vector.
fn sphere_intersect_any_length(surface: Surface, ray: Ray) -> f32 {
    let w = ray.o - surface.anchor;
    let a = dot(ray.d, ray.d);
    let b = dot(w - surface.axis, ray.d);
    let c = sphere_power(surface, w);
    let discriminant = -sphere_power(surface, w - ray.d * (b / a));
    let root = sqrt(float_max(discriminant, 0.0) * a);
    let q = -b - copysign(root, b);
    let t0 = c / q;
    let t1 = q / a;
    let near = float_min(t0, t1);
    let far = float_max(t0, t1);
    let t = select(far, near, near > 0.0);
    return select(NOTHING, t, discriminant >= 0.0 && is_positive_and_finite(t));
}

// The uv of a point in a plane.
fn uv_in_plane(surface: Surface, p: vec3f) -> vec2f {
    return vec2f(dot(p, surface.u_axis), dot(p, surface.v_axis)) + vec2f(surface.u_offset, surface.v_offset);
}

fn quad_intersect(surface: Surface, ray: Ray) -> f32 {
    let t = plane_intersect(surface, ray);
    if t >= NOTHING {
        return NOTHING;
    }
    let uv = uv_in_plane(surface, ray.o + ray.d * t);
    return select(NOTHING, t, all(uv >= vec2f(0.0)) && all(uv <= vec2f(1.0)));
}

fn disk_intersect(surface: Surface, ray: Ray) -> f32 {
    let t = plane_intersect(surface, ray);
    if t >= NOTHING {
        return NOTHING;
    }
    let at = uv_in_plane(surface, ray.o + ray.d * t);
    return select(NOTHING, t, dot(at, at) <= 1.0);
}

// The component of a vector that is perpendicular to a unit axis.
fn across(v: vec3f, axis: vec3f) -> vec3f {
    return v - axis * dot(v, axis);
}

fn cylinder_intersect(surface: Surface, ray: Ray) -> f32 {
    let w = ray.o - surface.anchor;
    let m = across(w, surface.axis);
    let e = across(ray.d, surface.axis);
    let a = dot(e, e);
    let r2 = surface.constant * surface.constant;
    if !(a > 0.0) {
        return NOTHING;
    }
    let b = dot(m, e);
    let c = dot(m, m) - r2;
    let nearest = m - e * (b / a);
    let discriminant = r2 - dot(nearest, nearest);
    let root = sqrt(float_max(discriminant, 0.0) * a);
    let q = -b - copysign(root, b);
    let t0 = c / q;
    let t1 = q / a;
    let near = float_min(t0, t1);
    let far = float_max(t0, t1);
    if !(discriminant >= 0.0) {
        return NOTHING;
    }
    if is_positive_and_finite(near) && is_between_ends(surface, ray, near) {
        return near;
    }
    // A ray through an open end hits the far side.
    return select(NOTHING, far, is_positive_and_finite(far) && is_between_ends(surface, ray, far));
}

fn is_between_ends(surface: Surface, ray: Ray, t: f32) -> bool {
    let from_middle = dot(ray.o - surface.anchor, surface.axis) + dot(ray.d, surface.axis) * t;
    // Scaled to a fraction of the cylinder's length.
    return abs(from_middle) * dot(surface.v_axis, surface.axis) <= 0.5;
}

// The distance to a surface of a kind.
fn surface_intersect(kind: u32, surface: Surface, ray: Ray) -> f32 {
    switch kind {
        case PLANES: {
            return plane_intersect(surface, ray);
        }
        case SPHERES: {
            return sphere_intersect(surface, ray);
        }
        case QUADS: {
            return quad_intersect(surface, ray);
        }
        default: {
            if surface.radius == IS_DISK {
                return disk_intersect(surface, ray);
            }
            return cylinder_intersect(surface, ray);
        }
    }
}
