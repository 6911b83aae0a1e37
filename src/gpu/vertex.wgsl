// Twin of `integrator::vertex`: the state of a path, the surfaces that it meets, and its next direction. The loop over
// paths, which the CPU has in `integrator::path_tracer`, is in `main.wgsl`.

// How far a path has come.
struct State {
    id: PathId,
    ray: Ray,
    // Bounces so far.
    depth: u32,
    // Product of f·|cos θ|/pdf so far.
    beta: vec3f,
    // Radiance found so far.
    l: vec3f,
    // Rays traced for this slot so far.
    rays: u32,
    // What `path` remembers of its last vertex.
    departure: Departure,
    // What `whitted` draws from, and how many branches wait.
    stream: Stream,
    waiting: u32,
}

// A point where a path met a surface.
struct PathVertex {
    point: SurfacePoint,
    t: f32,
    // Radiance emitted back along the ray.
    emitted: vec3f,
    // cos θ between the outward normal and the way back.
    cos_o: f32,
    // Row in the material table, checkerboards resolved.
    material: u32,
}

// Where on the film a path begins.
fn film_position(id: PathId, centre: vec2f) -> vec2f {
    let at = draw(id, BLOCK_CAMERA).xy;
    return centre + vec2f(film_offset(at.x), film_offset(at.y));
}

// A sample as it is sent.
fn sample_words(id: PathId, film: vec2f, radiance: vec3f) -> SampleWords {
    let at = bitcast<vec2u>(film);
    let found = bitcast<vec3u>(radiance);
    return SampleWords(id.pixel, id.sample, at.x, at.y, found.x, found.y, found.z);
}

// A path at the camera.
fn start(id: PathId, centre: vec2f, rays: u32) -> State {
    let lens = draw(id, BLOCK_CAMERA).zw;
    let ray = camera_ray(film_position(id, centre), lens);
    return State(id, ray, 0u, vec3f(1.0), vec3f(0.0), rays, fresh_departure(), fresh_stream(), 0u);
}

// Follows a path's ray. Returns whether it met a surface; what leaves the scene sees the environment.
fn meet(state: ptr<function, State>, vertex: ptr<function, PathVertex>) -> bool {
    (*state).rays++;
    let ray = (*state).ray;
    let hit = intersect(ray);
    if !is_some(hit) {
        (*state).l += (*state).beta * scene.environment;
        return false;
    }
    let point = surface_point(ray, hit);
    let cos_o = -dot(ray.d, point.n);
    let emitted = select(vec3f(0.0), surface_at(point.surface).emission, cos_o > 0.0);
    var material = surface_at(point.surface).material;
    if material_at(material).kind == KIND_CHECKERBOARD {
        material = resolve(material, surface_uv(point));
    }
    *vertex = PathVertex(point, hit.t, emitted, cos_o, material);
    return true;
}

// Whether a direction, in the world and in the frame, is on one side of the surface and of the smooth one that its
// shading normals tell of. No light passes where they differ: it would leak through.
fn passes(point: SurfacePoint, d: vec3f, wi: vec3f) -> bool {
    return !TREE_SMOOTH || dot(d, point.n) * wi.z > 0.0;
}

// Sends a path on in a direction drawn from its BxDF. Returns whether anything is left of its throughput.
fn go_on(state: ptr<function, State>, point: SurfacePoint, frame: Frame, scattered: BxdfSample) -> bool {
    var d = to_world(frame, scattered.wi);
    // One Newton step towards length one: rounding would otherwise add up over many bounces.
    d *= (3.0 - dot(d, d)) * 0.5;
    (*state).beta *= select(vec3f(0.0), scattered.weight, passes(point, d, scattered.wi));
    (*state).ray = Ray(offset_origin(point.p, point.n, point.error, d), d);
    (*state).depth++;
    // A throughput of nothing finds nothing; NaN is no such thing, and its bits aren't all zero.
    let bits = bitcast<vec3u>((*state).beta);
    return ((bits.x | bits.y | bits.z) & 0x7fffffffu) != 0u;
}

// Takes a path to its next surface and, from there, into its next direction. Returns whether it goes on.
fn step_path(state: ptr<function, State>, lane: Lane) -> bool {
    switch INTEGRATOR {
        case INTEGRATOR_WHITTED: {
            return whitted_step(state, lane);
        }
        case INTEGRATOR_PATH: {
            return next_event_step(state);
        }
        default: {
            return naive_step(state);
        }
    }
}
