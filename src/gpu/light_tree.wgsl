// Twin of `light::tree`: the choice among lights.

// Cosine and sine of max(0, a − b), from (cosine, sine) of a and b in [0, π].
fn less(a: vec2f, b: vec2f) -> vec2f {
    return select(vec2f(a.x * b.x + a.y * b.y, a.y * b.x - a.x * b.y), vec2f(1.0, 0.0), a.x > b.x);
}

// Cosine and sine of a + b, from (cosine, sine) of a and b in [0, π].
fn more(a: vec2f, b: vec2f) -> vec2f {
    return vec2f(a.x * b.x - a.y * b.y, a.y * b.x + a.x * b.y);
}

// The sine of an angle in [0, π], from its cosine.
fn sine_of(cos: f32) -> f32 {
    return sqrt(float_max(1.0 - cos * cos, 0.0));
}

// The result of `light_cosine` for lights that do not emit towards the point: less than any cosine.
const DARK = -2.0;

// The cosine of the least angle between a normal of a node's lights and the direction to a point, or `DARK` if the
// lights do not emit in that direction.
fn light_cosine(node: LightNode, from_centre: vec3f, distance2: f32) -> f32 {
    // θ_b: half the angle that the bounds subtend at p; π inside them.
    let near2 = node.radius * node.radius;
    let sin2_b = near2 / float_max(distance2, SMALLEST_NORMAL);
    let outside = vec2f(sqrt(float_max(1.0 - sin2_b, 0.0)), sqrt(sin2_b));
    let b = select(outside, vec2f(-1.0, 0.0), distance2 <= near2);

    // θ' = max(0, θ_w − θ_o − θ_b): the least angle between a normal and the direction to p.
    let w = from_centre * (1.0 / sqrt(float_max(distance2, SMALLEST_NORMAL)));
    let cos_w = dot(node.axis, w);
    let x = less(vec2f(cos_w, sine_of(cos_w)), vec2f(node.cos_o, sine_of(node.cos_o)));
    let cos_p = less(x, b).x;
    return select(DARK, cos_p, cos_p > node.cos_e);
}

// The importance of a node's lights for a point `p` on a surface with normal `n`, up to a common factor.
fn light_importance(node: LightNode, p: vec3f, n: vec3f) -> f32 {
    let from_centre = p - node.centre;
    let distance2 = dot(from_centre, from_centre);
    let height = dot(from_centre, n);
    // Means of cos² and of distance² over lights with the same variance in all directions.
    let cos2 = (height * height + node.spread * (1.0 / 3.0)) / float_max(distance2 + node.spread, SMALLEST_NORMAL);
    let falloff = float_max(distance2 + node.spread * NEARNESS, SMALLEST_NORMAL);
    let importance = node.power * sqrt(cos2) / falloff;
    let cos_p = light_cosine(node, from_centre, distance2);
    return select(0.0, float_min(float_max(importance * cos_p, 0.0), GREATEST), cos_p > DARK);
}

// Whether some light of a node may illuminate a point, by the directions of emission.
fn light_reaches(node: LightNode, p: vec3f) -> bool {
    let from_centre = p - node.centre;
    return light_cosine(node, from_centre, dot(from_centre, from_centre)) > DARK;
}

// Whether some light of the tree may, by its first lights or groups of lights.
fn lights_reach(p: vec3f) -> bool {
    let root = light_node_at(0u);
    if root.link >= LEAF {
        return light_reaches(root, p);
    }
    let first = root.link & ((1u << COUNT_FROM) - 1u);
    for (var i = 0u; i <= (root.link >> COUNT_FROM); i++) {
        if light_reaches(light_node_at(first + i), p) {
            return true;
        }
    }
    return false;
}

// A step down the tree.
struct LightStep {
    node: LightNode,
    // Its fraction of the importance of all children.
    share: f32,
    // The random number for the next step: the remainder, rescaled to [0, 1).
    u: f32,
}

// The child of an inner node. If `draws`, the child is chosen by the random number `u`; otherwise it is the one that
// contains the light with the index `place`.
fn light_step(link: u32, p: vec3f, n: vec3f, u: f32, place: u32, draws: bool) -> LightStep {
    let first = link & ((1u << COUNT_FROM) - 1u);
    let count = (link >> COUNT_FROM) + 1u;
    var ends: array<f32, 8>;
    var most = 0.0;
    for (var i = 0u; i < count; i++) {
        ends[i] = light_importance(light_node_at(first + i), p, n);
        most = float_max(most, ends[i]);
    }
    // The ends of the children's intervals. If no child has any importance, all have the same probability.
    var end = 0.0;
    for (var i = 0u; i < count; i++) {
        end += select(0.0, float_max(ends[i], most * LEAST_SHARE), ends[i] > 0.0);
        ends[i] = end;
    }
    if !(end > 0.0) {
        for (var i = 0u; i < count; i++) {
            end = f32(i + 1u);
            ends[i] = end;
        }
    }
    let at = float_min(u * end, bitcast<f32>(bitcast<u32>(end) - 1u));
    var child = 0u;
    var begin = 0.0;
    for (var i = 1u; i < count; i++) {
        let is_past = select(place >= light_node_at(first + i).first, ends[i - 1u] <= at, draws);
        begin = select(begin, ends[i - 1u], is_past);
        child = select(child, i, is_past);
    }
    let width = ends[child] - begin;
    let rest = (at - begin) / float_max(width, SMALLEST_NORMAL);
    return LightStep(light_node_at(first + child), width / end, float_min(rest, BELOW_ONE));
}

// Whether the lights of a node are so far from `p` that they are chosen by power alone.
fn lights_are_far(node: LightNode, p: vec3f) -> bool {
    let from_centre = p - node.centre;
    let distance2 = dot(from_centre, from_centre);
    if distance2 <= node.far2 {
        return false;
    }
    if node.cos_o > NARROW {
        return true;
    }
    // θ_w + θ_o + θ_b: the greatest angle between a normal and the direction to p.
    let sin2_b = node.radius * node.radius / distance2;
    let b = vec2f(sqrt(float_max(1.0 - sin2_b, 0.0)), sqrt(sin2_b));
    let o = vec2f(node.cos_o, sine_of(node.cos_o));
    let cos_w = dot(node.axis, from_centre * (1.0 / sqrt(distance2)));
    let cos_s = more(more(o, b), vec2f(cos_w, sine_of(cos_w))).x;
    return node.cos_o > 0.0 && cos_w > 0.0 && cos_s > FACING;
}

// Chooses a light for a point `p` on a surface with normal `n`.
fn choose_light(p: vec3f, n: vec3f, choice: f32, is_active: bool) -> LightChoice {
    return choose_light_below(0u, p, n, choice);
}

// Chooses one of the lights below a node.
fn choose_light_below(root: u32, p: vec3f, n: vec3f, choice: f32) -> LightChoice {
    var node = light_node_at(root);
    var pmf = 1.0;
    var u = choice;
    while node.link < LEAF && !lights_are_far(node, p) {
        let step = light_step(node.link, p, n, u, 0u, true);
        pmf *= step.share;
        u = step.u;
        node = step.node;
    }
    // Distant lights are chosen in proportion to their power, which is counted in integer units.
    let units = node.units;
    var unit = min(u32(f32(units) * u), units - 1u);
    while node.link < LEAF {
        var child = node.link & ((1u << COUNT_FROM) - 1u);
        node = light_node_at(child);
        while unit >= node.units {
            unit -= node.units;
            child++;
            node = light_node_at(child);
        }
    }
    return LightChoice(node.link & ~LEAF, pmf * share_of_power(node.units, units));
}

// `own` as a fraction of `units`; 1 if there are no units.
fn share_of_power(own: u32, units: u32) -> f32 {
    return select(f32(own) / f32(max(units, 1u)), 1.0, units == 0u);
}

// The probability with which `choose_light` chooses a light.
fn light_pmf(p: vec3f, n: vec3f, light: u32, is_active: bool) -> f32 {
    let row = light_at(light);
    var node = light_node_at(0u);
    var pmf = 1.0;
    while node.link < LEAF && !lights_are_far(node, p) {
        let step = light_step(node.link, p, n, 0.0, row.place, false);
        pmf *= step.share;
        node = step.node;
    }
    return pmf * share_of_power(row.units, node.units);
}
