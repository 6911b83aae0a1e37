// Twin of `world::simple`: first hits. And the tables that what is recorded looks them up in.

// The first hit of a ray so far.
struct Met {
    t: f32,
    // What was met, as the host numbers it: of equal distances the lower one counts.
    number: u32,
    // Index into `surfaces`, or into `triangles` with FIRST_TRIANGLE set.
    index: u32,
    // The number of the instance of which it is a surface, from one, or NO_INSTANCE. Lower ones come before lower numbers.
    instance: u32,
}

fn met_nothing() -> Met {
    return Met(NOTHING, 0xffffffffu, 0u, NO_INSTANCE);
}

// The nearer of two hits outside of instances.
fn nearer(a: Met, b: Met) -> Met {
    if b.t < a.t || (b.t == a.t && b.number < a.number) {
        return b;
    }
    return a;
}

// The first of some surfaces of one kind. They stand in the order of their rows: of equal distances the first one
// counts.
fn first_of(kind: u32, first: u32, end: u32, ray: Ray) -> Met {
    var met = met_nothing();
    for (var i = first; i < end; i++) {
        let surface = surface_at(i);
        let t = surface_intersect(kind, surface, ray);
        if t < met.t {
            met = Met(t, surface.row, i, NO_INSTANCE);
        }
    }
    return met;
}

fn first_met(ray: Ray) -> Met {
    if !is_finite_ray(ray) {
        return met_nothing();
    }
    let plane = first_of(PLANES, 0u, scene.planes_end, ray);
    let sphere = first_of(SPHERES, scene.planes_end, scene.spheres_end, ray);
    let quad = first_of(QUADS, scene.spheres_end, scene.quads_end, ray);
    var hit = nearer(nearer(plane, sphere), quad);
    if HAS_CUSTOM {
        hit = nearer(hit, first_of(CUSTOM, scene.quads_end, scene.custom_end, ray));
    }
    if TREE_LEVELS > 0u {
        return tree_intersect(ray, hit, false);
    }
    return hit;
}

// A ray in the own space of a mesh or a group, as `world::instances` has it. Its direction is of another length, so that distances are
// the same.
fn ray_from(ray: Ray, x: vec3f, y: vec3f, z: vec3f, origin: vec3f) -> Ray {
    let o = ray.o - origin;
    return Ray(
        vec3f(dot(x, o), dot(y, o), dot(z, o)),
        vec3f(dot(x, ray.d), dot(y, ray.d), dot(z, ray.d)),
        ray.time,
    );
}

// The first hit of a ray.
fn intersect(ray: Ray, is_active: bool) -> Hit {
    let met = first_met(ray);
    var weights = vec2f(0.0);
    if TREE_TRIANGLES && met.index >= FIRST_TRIANGLE {
        var seen = ray;
        if TREE_INSTANCES && met.instance != NO_INSTANCE {
            let place = place_row_at(met.instance - 1u);
            seen = ray_from(ray, place.to_mesh_x, place.to_mesh_y, place.to_mesh_z, place.origin);
        }
        let triangle = triangle_at(met.index & ~FIRST_TRIANGLE);
        weights = triangle_meet(sheared_ray(seen), triangle.a, triangle.b, triangle.c).weights;
    }
    return Hit(met.t, met.index, met.instance, weights);
}

// Whether a ray meets one of some surfaces of one kind before a distance.
fn meets_any(kind: u32, first: u32, end: u32, ray: Ray, t_max: f32) -> bool {
    for (var i = first; i < end; i++) {
        if surface_intersect(kind, surface_at(i), ray) < t_max {
            return true;
        }
    }
    return false;
}

fn occluded(ray: Ray, t_max: f32, is_active: bool, ignores_meshes: bool) -> bool {
    if !is_finite_ray(ray) {
        return false;
    }
    if meets_any(PLANES, 0u, scene.planes_end, ray, t_max)
        || meets_any(SPHERES, scene.planes_end, scene.spheres_end, ray, t_max)
        || meets_any(QUADS, scene.spheres_end, scene.quads_end, ray, t_max)
        || (HAS_CUSTOM && meets_any(CUSTOM, scene.quads_end, scene.custom_end, ray, t_max)) {
        return true;
    }
    if TREE_LEVELS > 0u {
        // No number is below zero: what is as far does not count.
        return tree_intersect(ray, Met(t_max, 0u, 0u, NO_INSTANCE), true).t < t_max;
    }
    return false;
}

fn triangle_corners(surface: u32) -> Corners {
    let triangle = triangle_at(surface & ~FIRST_TRIANGLE);
    return Corners(triangle.a, triangle.b, triangle.c, triangle.vertices);
}

// Index into `lights`, or NO_LIGHT.
fn triangle_light(point: SurfacePoint) -> u32 {
    return triangle_at(point.surface & ~FIRST_TRIANGLE).light;
}

fn place_of(instance: u32) -> InstanceTransform {
    let row = place_row_at(instance - 1u);
    return InstanceTransform(
        InstanceTransformToWorld(row.to_world_x, row.to_world_y, row.to_world_z),
        InstanceTransformToMesh(row.to_mesh_x, row.to_mesh_y, row.to_mesh_z),
        row.origin,
        row.stretch,
        row.condition,
        row.side,
    );
}
