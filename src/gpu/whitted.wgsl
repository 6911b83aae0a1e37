// Twin of `integrator::whitted`: ray tracing as in the report's chapter 2. A step follows one branch.

// Which invocation this is, of how many: it decides where branches wait.
struct Lane {
    index: u32,
    count: u32,
}

// Lets a branch wait. Branches at one height lie side by side for all invocations.
fn push_branch(state: ptr<function, State>, lane: Lane, branch: Branch) {
    branches[(*state).waiting * lane.count + lane.index] = branch;
    (*state).waiting++;
}

// Takes up the branch that waits last; whether there is one.
fn pop_branch(state: ptr<function, State>, lane: Lane) -> bool {
    if (*state).waiting == 0u {
        return false;
    }
    (*state).waiting--;
    let branch = branches[(*state).waiting * lane.count + lane.index];
    (*state).ray = Ray(branch.o, branch.d);
    (*state).depth = branch.depth;
    (*state).beta = branch.beta;
    return true;
}

fn spawn_ray(point: SurfacePoint, frame: Frame, wi: vec3f) -> Ray {
    let d = normalized(to_world(frame, wi));
    return Ray(offset_origin(point.p, point.n, point.error, d), d);
}

// Whether a branch is worth following: below a rounding error of white it is cut.
fn is_worth(beta: vec3f, chance: f32) -> bool {
    return chance > 0.0 && max_channel(beta) > EPSILON;
}

fn whitted_step(state: ptr<function, State>, lane: Lane) -> bool {
    var vertex: PathVertex;
    if !meet(state, &vertex) {
        return pop_branch(state, lane);
    }
    let point = vertex.point;
    let material = material_at(vertex.material);
    let frame = frame_around(point.shading);
    let wo = to_local(frame, -(*state).ray.d);
    let goes_on = (*state).depth < scene.max_depth;
    var l = vertex.emitted;
    if bsdf_has_non_delta(material) {
        l += material.colour * scene.ambient;
        if goes_on {
            l += light_from_all(state, point, frame, material, wo);
        }
    }
    (*state).l += (*state).beta * l;
    if bsdf_has_non_delta(material) || !goes_on {
        return pop_branch(state, lane);
    }
    if bsdf_transmits(material) {
        return split(state, lane, point, frame, material, wo);
    }
    var stream = (*state).stream;
    let u = next_random(&stream, (*state).id);
    let v = next_random(&stream, (*state).id);
    let lobe = next_random(&stream, (*state).id);
    (*state).stream = stream;
    let sample = bsdf_sample(material, wo, vec2f(u, v), lobe);
    let ray = spawn_ray(point, frame, sample.wi);
    if !passes(point, ray.d, sample.wi) {
        return pop_branch(state, lane);
    }
    (*state).ray = ray;
    (*state).beta *= sample.weight;
    (*state).depth++;
    return true;
}

// Radiance that every lamp sends back along the ray by way of a matte point: points once, areas from one random point
// of each; meshes of many triangles are one lamp.
fn light_from_all(
    state: ptr<function, State>,
    point: SurfacePoint,
    frame: Frame,
    material: Material,
    wo: vec3f,
) -> vec3f {
    var l = vec3f(0.0);
    var stream = (*state).stream;
    var next = 0u;
    while next < scene.lights {
        var light = light_at(next);
        var chance = 1.0;
        next++;
        if light.lamp != 0u {
            next += light_node_at(light.lamp).lights - 1u;
            let choice = next_random(&stream, (*state).id);
            let chosen = choose_light_below(light.lamp, point.p, point.n, choice);
            light = light_at(chosen.light);
            chance = chosen.chance;
        }
        let u = next_random(&stream, (*state).id);
        let v = next_random(&stream, (*state).id);
        let sample = sample_light(light, point.p, vec2f(u, v));
        if !(sample.pdf > 0.0) {
            continue;
        }
        let wi = to_local(frame, sample.wi);
        let share = bsdf_eval(material, wo, wi) * sample.radiance * (1.0 / sample.pdf) * (abs(wi.z) / chance);
        if max_channel(share) > 0.0 && passes(point, sample.wi, wi) {
            (*state).rays++;
            if is_visible(sample, offset_origin(point.p, point.n, point.error, sample.wi)) {
                l += share;
            }
        }
    }
    (*state).stream = stream;
    return l;
}

// Follows the refracted branch and lets the reflected one wait. Where too many wait already, one of the two is
// drawn by its chance and weighted for it: the mean is the same.
fn split(
    state: ptr<function, State>,
    lane: Lane,
    point: SurfacePoint,
    frame: Frame,
    material: Material,
    wo: vec3f,
) -> bool {
    let ways = dielectric_branches(material, wo);
    var reflected = (*state).beta * material.colour * ways.fresnel;
    var refracted = (*state).beta * transmittance(material) * ways.transmitted;
    let back = spawn_ray(point, frame, ways.reflected);
    let through = spawn_ray(point, frame, ways.refracted);
    let reflects = is_worth(reflected, ways.fresnel) && passes(point, back.d, ways.reflected);
    var refracts = is_worth(refracted, 1.0 - ways.fresnel) && passes(point, through.d, ways.refracted);
    let depth = (*state).depth + 1u;
    if reflects && refracts {
        if (*state).waiting < MOST_BRANCHES {
            push_branch(state, lane, Branch(back.o, depth, back.d, reflected));
        } else {
            var stream = (*state).stream;
            let lobe = next_random(&stream, (*state).id);
            (*state).stream = stream;
            refracts = lobe >= ways.fresnel;
            reflected *= 1.0 / ways.fresnel;
            refracted *= 1.0 / (1.0 - ways.fresnel);
        }
    }
    if !reflects && !refracts {
        return pop_branch(state, lane);
    }
    (*state).ray = back;
    if refracts {
        (*state).ray = through;
    }
    (*state).beta = select(reflected, refracted, refracts);
    (*state).depth = depth;
    return true;
}
