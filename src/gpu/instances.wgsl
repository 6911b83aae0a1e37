// Twin of `world::instances`: meshes that stand at several places, and are kept once.

// A ray in a mesh's own space. Its direction is of another length, so that distances are the same.
fn ray_from(ray: Ray, x: vec3f, y: vec3f, z: vec3f, origin: vec3f) -> Ray {
    let o = ray.o - origin;
    return Ray(
        vec3f(dot(x, o), dot(y, o), dot(z, o)),
        vec3f(dot(x, ray.d), dot(y, ray.d), dot(z, ray.d)),
        ray.time,
    );
}

// A point of a mesh in the world.
fn place_point(place: Place, p: vec3f) -> vec3f {
    return vec3f(dot(place.to_world_x, p), dot(place.to_world_y, p), dot(place.to_world_z, p)) + place.origin;
}

// A normal of a mesh in the world, of length one; zero stays zero.
fn place_normal(place: Place, n: vec3f) -> vec3f {
    let turned = place.to_mesh_x * n.x + place.to_mesh_y * n.y + place.to_mesh_z * n.z;
    let length2 = dot(turned, turned);
    return turned * select(0.0, 1.0 / sqrt(float_max(length2, SMALLEST_NORMAL)), length2 > 0.0);
}

// What a hit's error bound has to be larger by, where the triangle's own bound in the mesh's space is `error`.
fn place_error(place: Place, p: vec3f, error: f32) -> f32 {
    let away = max_abs(p - place.origin) + max_abs(place.origin) * UNIT_ROUNDOFF;
    return error * place.stretch + away * place.ray_error;
}
