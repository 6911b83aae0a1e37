// Twin of `integrator::whitted`: ray tracing as in the report's chapter 2. One step follows one branch to its next
// surface.

// The state of a sample.
struct Progress {
    // The state of the branch that is followed.
    state: State,
    around: Around,
    // Rays traced for this slot so far.
    rays: u32,
    // The source of random numbers, and the number of waiting branches.
    stream: Stream,
    waiting: u32,
}

// A path that begins at the camera.
fn start(id: PathId, centre: vec2f, rays: u32) -> Progress {
    return Progress(start_path(id, centre), start_around(), rays, Stream(vec4u(0u), 0u, 0xffffffffu), 0u);
}

// The random numbers of a path in sequence, for code without a fixed number of decisions. Blocks are used in descending
// order.
struct Stream {
    words: vec4u,
    left: u32,
    block: u32,
}

fn next_random(stream: ptr<function, Stream>, path: PathId) -> f32 {
    if (*stream).left == 0u {
        (*stream).words = pcg4d(vec4u(path.pixel, path.sample, (*stream).block, scene.seed));
        (*stream).block -= 1u;
        (*stream).left = 4u;
    }
    let number = f32((*stream).words.x >> 8u) * (1.0 / 16777216.0);
    (*stream).words = (*stream).words.yzwx;
    (*stream).left -= 1u;
    return number;
}

// Pushes a branch. Branches at the same height of the stack are adjacent for all invocations.
fn push_branch(progress: ptr<function, Progress>, lane: Lane, branch: WaitingBranch) {
    branches[(*progress).waiting * lane.count + lane.index] = branch;
    (*progress).waiting++;
}

// Pops the last branch. Returns whether there is one.
fn pop_branch(progress: ptr<function, Progress>, lane: Lane) -> bool {
    if (*progress).waiting == 0u {
        return false;
    }
    (*progress).waiting--;
    let branch = branches[(*progress).waiting * lane.count + lane.index];
    let interiors = Interiors(vec2u(branch.interiors_x, branch.interiors_y));
    // Holes are counted for all branches together.
    let around = Around(interiors, interiors, 1.0, 0u, (*progress).around.holes);
    follow(progress, Ray(branch.o, branch.d, 0.0), around, branch.beta, branch.depth);
    return true;
}

fn follow(progress: ptr<function, Progress>, ray: Ray, around: Around, beta: vec3f, depth: u32) {
    (*progress).state.ray = ray;
    (*progress).around = around;
    (*progress).state.beta = beta;
    (*progress).state.depth = depth;
}

// Whether a branch is followed. Branches whose throughput is below the rounding error of 1 are cut.
fn is_worth(beta: vec3f, probability: f32) -> bool {
    return probability > 0.0 && max_channel(beta) > EPSILON;
}

// Follows a branch to its next surface. Returns whether there is another to follow.
fn advance(progress: ptr<function, Progress>, lane: Lane) -> bool {
    let ray = (*progress).state.ray;
    let depth = (*progress).state.depth;
    (*progress).rays++;
    let hit = intersect(ray, true);
    let beta = absorbed_along((*progress).around, (*progress).state.beta, hit.t);
    (*progress).state.beta = beta;
    if hit.t >= NOTHING {
        (*progress).state.l += beta * escaped_radiance(ray.d);
        return pop_branch(progress, lane);
    }
    let lit = lit_point((*progress).state, (*progress).around, hit);
    let goes_on = depth < scene.max_depth;
    var l = lit.emitted;
    if lit.is_none || lit.is_hole {
        (*progress).state.l += beta * l;
        let beyond = pass_on(lit, ray);
        if !beyond.passes {
            return pop_branch(progress, lane);
        }
        follow(progress, beyond.ray, beyond.around, beta, depth);
        return true;
    }
    if lit.has_non_delta {
        l += bsdf_albedo(lit.local) * scene.ambient;
        if goes_on {
            l += light_from_all(progress, lit);
        }
    }
    (*progress).state.l += beta * l;
    if !lit.has_delta || !goes_on {
        return pop_branch(progress, lane);
    }
    if lit.transmits && !lit.has_non_delta {
        return split(progress, lane, lit);
    }
    let id = (*progress).state.id;
    var stream = (*progress).stream;
    let u = next_random(&stream, id);
    let v = next_random(&stream, id);
    let choice = next_random(&stream, id);
    (*progress).stream = stream;
    let sampled = bsdf_sample(lit.local, lit.wo, vec2f(u, v), choice);
    let branch = spawn(lit, sampled.wi);
    // If the surface also has lobes that are not delta, only delta directions are followed.
    if !(sampled.delta || !lit.has_non_delta) || !branch.passes {
        return pop_branch(progress, lane);
    }
    follow(progress, branch.ray, branch.around, beta * sampled.weight, depth + 1u);
    return true;
}

// The radiance that all lights scatter at a point into the ray. Each light is sampled once, at a random point if it has
// an area. A mesh of many triangles counts as one light.
fn light_from_all(progress: ptr<function, Progress>, lit: Lit) -> vec3f {
    var l = vec3f(0.0);
    let id = (*progress).state.id;
    var stream = (*progress).stream;
    var next = 0u;
    while next < scene.lights {
        var light = next;
        var pmf = 1.0;
        let lamp = light_at(light).lamp;
        next++;
        if lamp != 0u {
            next += light_node_at(lamp).lights - 1u;
            let chosen = choose_light_below(lamp, lit.at.point.p, lit.at.point.n, next_random(&stream, id));
            light = chosen.light;
            pmf = chosen.pmf;
        }
        let u = next_random(&stream, id);
        let v = next_random(&stream, id);
        let lamp_sample = light_share(lit, light, pmf, vec2f(u, v));
        if lamp_sample.possible {
            (*progress).rays++;
            if !occluded(lamp_sample.shadow, lamp_sample.end, true, false) {
                l += lamp_sample.share;
            } else {
                l += light_through(lamp_sample, (*progress).state, (*progress).around);
            }
        }
    }
    (*progress).stream = stream;
    return l;
}

// Follows the refracted branch and pushes the reflected one. If the stack is full, one of the two is chosen at
// random and weighted by the inverse probability, without bias.
fn split(progress: ptr<function, Progress>, lane: Lane, lit: Lit) -> bool {
    let ways = bsdf_branches(lit.local, lit.wo);
    var reflected = (*progress).state.beta * ways.first.weight;
    var refracted = (*progress).state.beta * ways.second.weight;
    let back = spawn(lit, ways.first.wi);
    let through = spawn(lit, ways.second.wi);
    let reflects = is_worth(reflected, ways.first.probability) && back.passes;
    var refracts = is_worth(refracted, ways.second.probability) && through.passes;
    let depth = (*progress).state.depth + 1u;
    if reflects && refracts {
        if (*progress).waiting < MOST_BRANCHES {
            let inside = back.around.here.words;
            push_branch(progress, lane, WaitingBranch(back.ray.o, depth, back.ray.d, inside.x, reflected, inside.y));
        } else {
            var stream = (*progress).stream;
            let choice = next_random(&stream, (*progress).state.id);
            (*progress).stream = stream;
            refracts = choice >= ways.first.probability;
            reflected *= 1.0 / ways.first.probability;
            refracted *= 1.0 / ways.second.probability;
        }
    }
    if !reflects && !refracts {
        return pop_branch(progress, lane);
    }
    if refracts {
        follow(progress, through.ray, through.around, refracted, depth);
    } else {
        follow(progress, back.ray, back.around, reflected, depth);
    }
    return true;
}
