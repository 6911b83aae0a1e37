// Twin of `integrator::naive`: one path at a time, many of them side by side.

// A finished path: where on the film, what it found, and how many rays that took.
struct Path {
    film: vec2f,
    radiance: vec3f,
    rays: u32,
}

// Radiance that one point light sends along `wo` (in the frame) by way of a point.
fn point_light(
    id: PathId,
    depth: u32,
    point: SurfacePoint,
    frame: Frame,
    material: Material,
    wo: vec3f,
) -> vec3f {
    let choice = draw(id, block_at(BLOCK_LIGHT, depth)).z;
    let light = sample_one(point.p, choice);
    let wi = to_local(frame, light.wi);
    let is_visible = visible(light, offset_origin(point.p, point.n, point.error, light.wi));
    return select(vec3f(0.0), bsdf_eval(material, wo, wi) * light.weight * abs(wi.z), is_visible);
}

fn trace_path(id: PathId, centre: vec2f) -> Path {
    let at = draw(id, BLOCK_CAMERA);
    let film = centre + vec2f(film_offset(at.x), film_offset(at.y));
    var ray = camera_ray(film, at.zw);
    var beta = vec3f(1.0);
    var l = vec3f(0.0);
    var rays = 0u;
    for (var depth = 0u; depth <= scene.max_depth; depth++) {
        rays++;
        let hit = intersect(ray);
        if !is_some(hit) {
            l += beta * scene.environment;
            break;
        }
        let point = surface_point(ray, hit);
        let outward = dot(-ray.d, point.n) > 0.0;
        l += beta * select(vec3f(0.0), surfaces[point.surface].emission, outward);
        if depth == scene.max_depth {
            break;
        }
        var row = surfaces[point.surface].material;
        if materials[row].kind == KIND_CHECKERBOARD {
            row = resolve(row, surface_uv(point));
        }
        let material = materials[row];
        let frame = frame_around(point.n);
        let wo = to_local(frame, -ray.d);
        if scene.point_lights > 0u {
            rays++;
            l += beta * point_light(id, depth, point, frame, material, wo);
        }
        let u = draw(id, block_at(BLOCK_SCATTER, depth));
        let scattered = bsdf_sample(material, wo, u.xy, u.z);
        var d = to_world(frame, scattered.wi);
        // One Newton step towards length one.
        d *= (3.0 - dot(d, d)) * 0.5;
        beta *= scattered.weight;
        ray = Ray(offset_origin(point.p, point.n, point.error, d), d);
        // A throughput of nothing finds nothing; NaN is no such thing, and its bits aren't all zero.
        let bits = bitcast<vec3u>(beta);
        if ((bits.x | bits.y | bits.z) & 0x7fffffffu) == 0u {
            break;
        }
    }
    return Path(film, l, rays);
}
