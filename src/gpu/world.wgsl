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

// A tie goes to the lower row, as on the host.
fn keep_closest(hit: ptr<function, Hit>, row: ptr<function, u32>, t: f32, surface: u32) {
    let its_row = surfaces[surface].row;
    if t < (*hit).t || (t == (*hit).t && its_row < *row) {
        *hit = Hit(t, surface);
        *row = its_row;
    }
}

fn intersect(ray: Ray) -> Hit {
    var hit = Hit(NOTHING, 0u);
    var row = 0u;
    var i = 0u;
    for (; i < scene.planes_end; i++) {
        keep_closest(&hit, &row, plane_intersect(surfaces[i], ray), i);
    }
    for (; i < scene.spheres_end; i++) {
        keep_closest(&hit, &row, sphere_intersect(surfaces[i], ray), i);
    }
    for (; i < scene.quads_end; i++) {
        keep_closest(&hit, &row, quad_intersect(surfaces[i], ray), i);
    }
    return hit;
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
