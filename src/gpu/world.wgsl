// Twin of `world::simple` and `world::surfaces`: first hits, and the point, uv and light there.

// The first thing on a ray so far.
struct Met {
    t: f32,
    // What was met, as the host numbers it: of equal distances the lower one counts.
    number: u32,
    // Index into `surfaces`, or into `triangles` with FIRST_TRIANGLE set.
    index: u32,
    // The number of the instance whose triangle it is, from one, or NO_INSTANCE. Lower ones come before lower numbers.
    instance: u32,
}

fn met_nothing() -> Met {
    return Met(NOTHING, 0xffffffffu, 0u, NO_INSTANCE);
}

// The nearer of two hits of no instance.
fn nearer(a: Met, b: Met) -> Met {
    if b.t < a.t || (b.t == a.t && b.number < a.number) {
        return b;
    }
    return a;
}

fn first_met(ray: Ray) -> Met {
    if !is_finite_ray(ray) {
        return met_nothing();
    }
    // Those of one kind stand in the order of their rows: of equal distances the first one counts.
    var plane = met_nothing();
    for (var i = 0u; i < scene.planes_end; i++) {
        let surface = surface_at(i);
        let t = plane_intersect(surface, ray);
        if t < plane.t {
            plane = Met(t, surface.row, i, NO_INSTANCE);
        }
    }
    var sphere = met_nothing();
    for (var i = scene.planes_end; i < scene.spheres_end; i++) {
        let surface = surface_at(i);
        let t = sphere_intersect(surface, ray);
        if t < sphere.t {
            sphere = Met(t, surface.row, i, NO_INSTANCE);
        }
    }
    var quad = met_nothing();
    for (var i = scene.spheres_end; i < scene.quads_end; i++) {
        let surface = surface_at(i);
        let t = quad_intersect(surface, ray);
        if t < quad.t {
            quad = Met(t, surface.row, i, NO_INSTANCE);
        }
    }
    var hit = nearer(nearer(plane, sphere), quad);
    if HAS_RARE {
        var rare = met_nothing();
        for (var i = scene.quads_end; i < scene.rare_end; i++) {
            let surface = surface_at(i);
            let t = rare_intersect(surface, ray);
            if t < rare.t {
                rare = Met(t, surface.row, i, NO_INSTANCE);
            }
        }
        hit = nearer(hit, rare);
    }
    if TREE_LEVELS > 0u {
        return tree_intersect(ray, hit, false);
    }
    return hit;
}

// The first hit of a ray. The weights of a triangle's corners are computed where they are needed.
fn intersect(ray: Ray, asks: bool) -> Hit {
    let met = first_met(ray);
    return Hit(met.t, met.index, met.instance, vec2f(0.0));
}

fn occluded(ray: Ray, t_max: f32, asks: bool, past_triangles: bool) -> bool {
    if !is_finite_ray(ray) {
        return false;
    }
    var i = 0u;
    for (; i < scene.planes_end; i++) {
        if plane_intersect(surface_at(i), ray) < t_max {
            return true;
        }
    }
    for (; i < scene.spheres_end; i++) {
        if sphere_intersect(surface_at(i), ray) < t_max {
            return true;
        }
    }
    for (; i < scene.quads_end; i++) {
        if quad_intersect(surface_at(i), ray) < t_max {
            return true;
        }
    }
    if HAS_RARE {
        for (; i < scene.rare_end; i++) {
            if rare_intersect(surface_at(i), ray) < t_max {
                return true;
            }
        }
    }
    if TREE_LEVELS > 0u {
        // No number is below zero: what is as far does not count.
        return tree_intersect(ray, Met(t_max, 0u, 0u, NO_INSTANCE), true).t < t_max;
    }
    return false;
}

// The point that a ray met.
fn surface_point(ray: Ray, hit: Hit) -> SurfacePoint {
    if TREE_TRIANGLES && hit.surface >= FIRST_TRIANGLE {
        return triangle_point(ray, hit.surface & ~FIRST_TRIANGLE, hit.instance);
    }
    return smooth_point(ray, hit);
}

// Points on all but meshes, put back onto their surfaces.
fn smooth_point(ray: Ray, hit: Hit) -> SurfacePoint {
    let p = ray.o + ray.d * hit.t;
    let surface = surface_at(hit.surface);
    var normal = surface.axis;
    var off = dot(p, normal) - surface.constant;
    if surface.radius > 0.0 {
        // The distance to the centre less the radius, as power/(distance + radius).
        let w = p - surface.anchor;
        let from_centre = w - surface.axis;
        let length = sqrt(dot(from_centre, from_centre));
        normal = from_centre * (1.0 / length);
        off = (dot(w, from_centre - surface.axis) + surface.constant) / (length + surface.radius);
    }
    if HAS_RARE && surface.radius == IS_CYLINDER {
        let from_axis = across(p - surface.anchor, surface.axis);
        let length = sqrt(dot(from_axis, from_axis));
        normal = from_axis * (1.0 / length);
        off = length - surface.constant;
    }
    let on = p - normal * off;
    let n = normal * surface.orientation;
    let error = max_abs(on) * POSITION_ERROR + surface.error;
    return SurfacePoint(on, n, n, vec2f(0.0), error, hit.surface, hit.surface);
}

// Points on triangles: the corners' mean.
fn triangle_point(ray: Ray, index: u32, instance: u32) -> SurfacePoint {
    let triangle = triangle_at(index);
    let is_placed = TREE_INSTANCES && instance != NO_INSTANCE;
    var place = Place();
    var seen = ray;
    if is_placed {
        place = place_at(instance - 1u);
        seen = ray_from(ray, place.to_mesh_x, place.to_mesh_y, place.to_mesh_z, place.origin);
    }
    let weights = triangle_meet(sheared_ray(seen), triangle.a, triangle.b, triangle.c).weights;
    var corner = triangle.a;
    var ab = triangle.b - triangle.a;
    var ac = triangle.c - triangle.a;
    var error = triangle.error;
    var surface = triangle.surface;
    if is_placed {
        corner = place_point(place, triangle.a);
        ab = place_point(place, triangle.b) - corner;
        ac = place_point(place, triangle.c) - corner;
        error = triangle_error(corner, ab, ac) + place_error(place, corner, error);
        surface = place.surface;
    }
    let p = corner + ab * weights.x + ac * weights.y;
    let sides = sides_of(ab, ac);
    // One without area was met within rounding errors, and has no normal of its own.
    let own = sides.across * (surface_at(surface).orientation / float_max(sides.length, SMALLEST_NORMAL));
    let n = select(-ray.d, own, sides.length >= SMALLEST_NORMAL);
    var shading = n;
    if TREE_SMOOTH {
        var a = vertex_at(triangle.vertices.x).normal;
        var b = vertex_at(triangle.vertices.y).normal;
        var c = vertex_at(triangle.vertices.z).normal;
        if is_placed {
            a = place_normal(place, a);
            b = place_normal(place, b);
            c = place_normal(place, c);
        }
        let mean = a + (b - a) * weights.x + (c - a) * weights.y;
        let length2 = dot(mean, mean);
        // Which side is outward the order of the corners says.
        let smooth_n = mean * copysign(1.0 / sqrt(float_max(length2, SMALLEST_NORMAL)), dot(mean, n));
        // Where the ray comes from the one side of the triangle and the other of the smooth surface, there is no
        // smooth surface to speak of.
        if length2 > 0.0 && dot(ray.d, n) * dot(ray.d, smooth_n) > 0.0 {
            shading = smooth_n;
        }
    }
    return SurfacePoint(p, n, shading, weights, error, index | FIRST_TRIANGLE, surface);
}

// Index into `lights`, or NO_LIGHT.
fn light_of(point: SurfacePoint) -> u32 {
    if TREE_TRIANGLES && point.surface >= FIRST_TRIANGLE {
        return triangle_at(point.surface & ~FIRST_TRIANGLE).light;
    }
    return surface_at(point.row).light;
}

fn surface_uv(point: SurfacePoint, wanted: bool) -> vec2f {
    if TREE_TRIANGLES && point.surface >= FIRST_TRIANGLE {
        return triangle_uv(point);
    }
    let surface = surface_at(point.row);
    if surface.radius > 0.0 {
        // φ/2π and θ/π from +z, of the direction from the centre.
        let d = point.n * surface.orientation;
        return vec2f(angle_turns(d.y, d.x), angle_turns(sqrt(d.x * d.x + d.y * d.y), d.z) * 2.0);
    }
    let uv = vec2f(along(point.p, surface.u_axis), along(point.p, surface.v_axis));
    if HAS_RARE && surface.radius == IS_DISK {
        return vec2f(angle_turns(uv.y, uv.x), sqrt(dot(uv, uv)));
    }
    if HAS_RARE && surface.radius == IS_CYLINDER {
        let d = point.n * surface.orientation;
        let side = cross(surface.axis, surface.u_axis.xyz);
        return vec2f(angle_turns(dot(d, side), dot(d, surface.u_axis.xyz)), uv.y);
    }
    return uv;
}

// uv of a vertex, or what stands for it where the mesh has none.
fn vertex_uv(vertex: u32, without: vec2f) -> vec2f {
    let given = vertex_at(vertex);
    return vec2f(
        select(given.u, without.x, is_nan(given.u)),
        select(given.v, without.y, is_nan(given.v)),
    );
}

fn triangle_uv(point: SurfacePoint) -> vec2f {
    let vertices = triangle_at(point.surface & ~FIRST_TRIANGLE).vertices;
    let a = vertex_uv(vertices.x, vec2f(0.0, 0.0));
    let b = vertex_uv(vertices.y, vec2f(1.0, 0.0));
    let c = vertex_uv(vertices.z, vec2f(1.0, 1.0));
    return a + (b - a) * point.weights.x + (c - a) * point.weights.y;
}
