// Twin of `world::simple`: first hits, and the lookups of triangles and instances that recorded code calls.

// The nearest hit of a ray so far.
struct SurfaceHit {
    t: f32,
    // The host's number of the surface. At equal distances the lower number wins.
    number: u32,
    // Index into `surfaces`, or into `triangles` with FIRST_TRIANGLE set.
    index: u32,
    // The number of the surface's instance, from one, or NO_INSTANCE. At equal distances the lower instance wins,
    // before numbers are compared.
    instance: u32,
}

fn no_hit() -> SurfaceHit {
    return SurfaceHit(NOTHING, 0xffffffffu, 0u, NO_INSTANCE);
}

// The nearer of two hits outside of instances.
fn nearer(a: SurfaceHit, b: SurfaceHit) -> SurfaceHit {
    if b.t < a.t || (b.t == a.t && b.number < a.number) {
        return b;
    }
    return a;
}

// The first hit among surfaces of one kind. They are in the order of their rows, so at equal distances the first one
// wins.
fn first_of(kind: u32, first: u32, end: u32, ray: Ray) -> SurfaceHit {
    var hit = no_hit();
    for (var i = first; i < end; i++) {
        let surface = surface_at(i);
        let t = surface_intersect(kind, surface, ray);
        if t < hit.t {
            hit = SurfaceHit(t, surface.row, i, NO_INSTANCE);
        }
    }
    return hit;
}

fn first_hit(ray: Ray) -> SurfaceHit {
    if !is_finite_ray(ray) {
        return no_hit();
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

// A ray in the space of a mesh or a group, as in `world::instances`. Its direction keeps its transformed length, so
// that distances stay the same.
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
    let hit = first_hit(ray);
    var weights = vec2f(0.0);
    if TREE_TRIANGLES && hit.index >= FIRST_TRIANGLE {
        var seen = ray;
        if TREE_INSTANCES && hit.instance != NO_INSTANCE {
            let place = place_row_at(hit.instance - 1u);
            seen = ray_from(ray, place.to_mesh_x, place.to_mesh_y, place.to_mesh_z, place.origin);
        }
        let triangle = triangle_at(hit.index & ~FIRST_TRIANGLE);
        weights = triangle_meet(sheared_ray(seen), triangle.a, triangle.b, triangle.c).weights;
    }
    return Hit(hit.t, hit.index, hit.instance, weights);
}

// Whether a ray hits a surface of one kind before a distance.
fn any_hit(kind: u32, first: u32, end: u32, ray: Ray, t_max: f32) -> bool {
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
    if any_hit(PLANES, 0u, scene.planes_end, ray, t_max)
        || any_hit(SPHERES, scene.planes_end, scene.spheres_end, ray, t_max)
        || any_hit(QUADS, scene.spheres_end, scene.quads_end, ray, t_max)
        || (HAS_CUSTOM && any_hit(CUSTOM, scene.quads_end, scene.custom_end, ray, t_max)) {
        return true;
    }
    if TREE_LEVELS > 0u {
        // No number is below 0, so a surface at the distance itself does not count.
        return tree_intersect(ray, SurfaceHit(t_max, 0u, 0u, NO_INSTANCE), true).t < t_max;
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
