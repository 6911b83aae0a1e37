// Twin of `world`: what rays meet, and what it is like there.

struct Hit {
    t: f32,
    // Index into `surfaces`.
    surface: u32,
}

// A point on a surface: where, the outward normal, the error bound, and which surface.
struct SurfacePoint {
    p: vec3f,
    n: vec3f,
    error: f32,
    surface: u32,
}

fn is_some(hit: Hit) -> bool {
    return hit.t < NOTHING;
}

// The nearer of two hits; of equal distances the lower row, as on the host.
fn nearer(a: Hit, b: Hit) -> Hit {
    let b_wins = b.t < a.t || (b.t == a.t && b.t < NOTHING && surfaces[b.surface].row < surfaces[a.surface].row);
    if b_wins {
        return b;
    }
    return a;
}

fn intersect(ray: Ray) -> Hit {
    // Those of one kind stand in the order of their rows: of equal distances the first one counts.
    var plane = Hit(NOTHING, 0u);
    for (var i = 0u; i < scene.planes_end; i++) {
        let t = plane_intersect(surfaces[i], ray);
        if t < plane.t {
            plane = Hit(t, i);
        }
    }
    var sphere = Hit(NOTHING, 0u);
    for (var i = scene.planes_end; i < scene.spheres_end; i++) {
        let t = sphere_intersect(surfaces[i], ray);
        if t < sphere.t {
            sphere = Hit(t, i);
        }
    }
    var quad = Hit(NOTHING, 0u);
    for (var i = scene.spheres_end; i < scene.quads_end; i++) {
        let t = quad_intersect(surfaces[i], ray);
        if t < quad.t {
            quad = Hit(t, i);
        }
    }
    return nearer(nearer(plane, sphere), quad);
}

fn occluded(ray: Ray, t_max: f32) -> bool {
    var i = 0u;
    for (; i < scene.planes_end; i++) {
        if plane_intersect(surfaces[i], ray) < t_max {
            return true;
        }
    }
    for (; i < scene.spheres_end; i++) {
        if sphere_intersect(surfaces[i], ray) < t_max {
            return true;
        }
    }
    for (; i < scene.quads_end; i++) {
        if quad_intersect(surfaces[i], ray) < t_max {
            return true;
        }
    }
    return false;
}

// The point that a ray met, put back onto its surface.
fn surface_point(ray: Ray, hit: Hit) -> SurfacePoint {
    let p = ray.o + ray.d * hit.t;
    let radius = surfaces[hit.surface].radius;
    let axis = surfaces[hit.surface].axis;
    let constant = surfaces[hit.surface].constant;
    var normal = axis;
    var off = dot(p, normal) - constant;
    if radius > 0.0 {
        // The distance to the centre less the radius, as power/(distance + radius).
        let w = p - surfaces[hit.surface].anchor;
        let from_centre = w - axis;
        let length = sqrt(dot(from_centre, from_centre));
        normal = from_centre * (1.0 / length);
        off = (dot(w, from_centre - axis) + constant) / (length + radius);
    }
    let on = p - normal * off;
    return SurfacePoint(
        on,
        normal * surfaces[hit.surface].orientation,
        max_abs(on) * POSITION_ERROR + surfaces[hit.surface].error,
        hit.surface,
    );
}

fn surface_uv(point: SurfacePoint) -> vec2f {
    if surfaces[point.surface].radius > 0.0 {
        // φ/2π and θ/π from +z, of the direction from the centre.
        let d = point.n * surfaces[point.surface].orientation;
        return vec2f(angle_turns(d.y, d.x), angle_turns(sqrt(d.x * d.x + d.y * d.y), d.z) * 2.0);
    }
    return vec2f(along(point.p, surfaces[point.surface].u_axis), along(point.p, surfaces[point.surface].v_axis));
}
