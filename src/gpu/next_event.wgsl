// Twin of `integrator::next_event` and `integrator::roulette`, and of the step that `integrator::path_tracer` takes with
// them: path tracing with next-event estimation.

// What the weight of a light that is met depends on: the vertex that the ray left.
struct Departure {
    p: vec3f,
    // Density of the direction by solid angle; zero where nothing but the BxDF could have found it.
    pdf: f32,
    n: vec3f,
    // Product of (η transmitted/η incident)² along the path.
    eta_scale: f32,
}

fn fresh_departure() -> Departure {
    return Departure(vec3f(0.0), 0.0, vec3f(0.0), 1.0);
}

fn next_event_step(state: ptr<function, State>) -> bool {
    var vertex: PathVertex;
    if !meet(state, &vertex) {
        return false;
    }
    (*state).l += (*state).beta * vertex.emitted * weight_of_met((*state).departure, vertex);
    if (*state).depth >= scene.max_depth {
        return false;
    }
    let point = vertex.point;
    let material = material_at(vertex.material);
    let frame = frame_around(point.shading);
    let wo = to_local(frame, -(*state).ray.d);
    if scene.lights > 0u && bsdf_has_non_delta(material) {
        let direct = direct_light(state, point, frame, material, wo);
        (*state).l += (*state).beta * direct;
    }
    let u = draw((*state).id, block_at(BLOCK_SCATTER, (*state).depth));
    let scattered = bsdf_sample(material, wo, u.xy, u.z);
    if !go_on(state, point, frame, scattered) {
        return false;
    }
    let passes = wo.z * scattered.wi.z < 0.0;
    let eta_scale = (*state).departure.eta_scale * bsdf_eta2_scale(material, wo, passes);
    let pdf = select(scattered.pdf, 0.0, scattered.delta);
    (*state).departure = Departure(point.p, pdf, point.n, eta_scale);
    return survives(state, u.w);
}

// Twin of `integrator::roulette`: from some depth on, paths of low throughput may end; the others gain weight for them.
fn survives(state: ptr<function, State>, survival: f32) -> bool {
    var chance = max_channel((*state).beta) * (*state).departure.eta_scale * ROULETTE_KEEPS;
    if (*state).depth >= ROULETTE_AT_MOST_FROM && chance > ROULETTE_AT_MOST {
        chance = ROULETTE_AT_MOST;
    }
    // NaN survives to be counted.
    if (*state).depth < ROULETTE_FROM || is_nan(chance) || chance >= 1.0 {
        return true;
    }
    if chance <= survival {
        return false;
    }
    (*state).beta *= 1.0 / chance;
    return true;
}

// The power heuristic for one sample of each of two densities: the weight of the first.
fn power_heuristic(first: f32, second: f32) -> f32 {
    let ratio = second / first;
    return 1.0 / (ratio * ratio + 1.0);
}

// The weight of emission that the BxDF's direction found, against having asked for it.
fn weight_of_met(departure: Departure, vertex: PathVertex) -> f32 {
    let light = light_of(vertex.point);
    if light == NO_LIGHT || !(departure.pdf > 0.0) || !(vertex.cos_o > 0.0) {
        return 1.0;
    }
    let asked = light_chance(departure.p, departure.n, light)
        * light_pdf(light_at(light), departure.p, vertex.t, vertex.cos_o);
    return power_heuristic(departure.pdf, asked);
}

// Radiance that a chosen light sends back along the ray by way of a vertex, weighed against the chance that
// the BxDF finds the same light.
fn direct_light(
    state: ptr<function, State>,
    point: SurfacePoint,
    frame: Frame,
    material: Material,
    wo: vec3f,
) -> vec3f {
    let u = draw((*state).id, block_at(BLOCK_LIGHT, (*state).depth));
    let choice = choose_light(point.p, point.n, u.z);
    let light = light_at(choice.light);
    let sample = sample_light(light, point.p, u.xy);
    let pdf = sample.pdf * choice.chance;
    if !(pdf > 0.0) {
        return vec3f(0.0);
    }
    let wi = to_local(frame, sample.wi);
    let share = bsdf_eval(material, wo, wi) * abs(wi.z) * sample.radiance * (1.0 / pdf);
    if !(max_channel(share) > 0.0) || !passes(point, sample.wi, wi) {
        return vec3f(0.0);
    }
    (*state).rays++;
    if !is_visible(sample, offset_origin(point.p, point.n, point.error, sample.wi)) {
        return vec3f(0.0);
    }
    // No BxDF can find a point.
    let found = select(bsdf_pdf(material, wo, wi), 0.0, light.kind == LIGHT_POINT);
    return share * power_heuristic(pdf, found);
}
