// Twin of `light::tree`: which light to ask.

struct LightChoice {
    light: u32,
    // The probability of the choice; zero where no light can matter.
    chance: f32,
}

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

// What a node's lights contribute to a point `p` on a surface with normal `n`, up to a common factor.
fn light_importance(node: LightNode, p: vec3f, n: vec3f) -> f32 {
    let from_centre = p - node.centre;
    let distance2 = dot(from_centre, from_centre);
    let height = dot(from_centre, n);
    // Means of cos² and of distance² over lights that spread alike in all directions.
    let cos2 = (height * height + node.spread * (1.0 / 3.0)) / float_max(distance2 + node.spread, SMALLEST_NORMAL);
    let falloff = float_max(distance2 + node.spread * NEARNESS, SMALLEST_NORMAL);
    let importance = node.power * sqrt(cos2) / falloff;

    // θ_b: half the angle that the bounds fill as seen from p; π inside them.
    let near2 = node.radius * node.radius;
    let sin2_b = near2 / float_max(distance2, SMALLEST_NORMAL);
    let outside = vec2f(sqrt(float_max(1.0 - sin2_b, 0.0)), sqrt(sin2_b));
    let b = select(outside, vec2f(-1.0, 0.0), distance2 <= near2);

    // θ' = max(0, θ_w − θ_o − θ_b): the least angle between p and a normal.
    let w = from_centre * (1.0 / sqrt(float_max(distance2, SMALLEST_NORMAL)));
    let cos_w = dot(node.axis, w);
    let x = less(vec2f(cos_w, sine_of(cos_w)), vec2f(node.cos_o, sine_of(node.cos_o)));
    let cos_p = less(x, b).x;
    return select(0.0, float_max(importance * cos_p, 0.0), cos_p > node.cos_e);
}

// The chance of going left at a node: its children's shares of importance, or half where both have none.
fn left_share(left: u32, right: u32, p: vec3f, n: vec3f) -> f32 {
    let a = light_importance(light_node_at(left), p, n);
    let b = light_importance(light_node_at(right), p, n);
    let sum = a + b;
    let share = select(0.5, a / float_max(sum, SMALLEST_NORMAL), sum > 0.0);
    // Where both have some, neither share rounds to nothing.
    let between = float_min(float_max(share, 1.0 - BELOW_ONE), BELOW_ONE);
    return select(share, between, a > 0.0 && b > 0.0);
}

// Whether a node's lights are so far from `p` that their power alone says which of them is asked.
fn lights_are_far(node: LightNode, p: vec3f) -> bool {
    let from_centre = p - node.centre;
    let distance2 = dot(from_centre, from_centre);
    if distance2 <= node.far2 {
        return false;
    }
    if node.cos_o > NARROW {
        return true;
    }
    // θ_w + θ_o + θ_b: the greatest angle between p and a normal.
    let sin2_b = node.radius * node.radius / distance2;
    let b = vec2f(sqrt(float_max(1.0 - sin2_b, 0.0)), sqrt(sin2_b));
    let o = vec2f(node.cos_o, sine_of(node.cos_o));
    let cos_w = dot(node.axis, from_centre * (1.0 / sqrt(distance2)));
    let cos_s = more(more(o, b), vec2f(cos_w, sine_of(cos_w))).x;
    return node.cos_o > 0.0 && cos_w > 0.0 && cos_s > FACING;
}

// Chooses a light for a point `p` on a surface with normal `n`.
fn choose_light(p: vec3f, n: vec3f, choice: f32) -> LightChoice {
    var index = 0u;
    var node = light_node_at(0u);
    var chance = 1.0;
    var u = choice;
    while node.link < LEAF && !lights_are_far(node, p) {
        let left = index + 1u;
        let share = left_share(left, node.link, p, n);
        let goes_left = u < share;
        let taken = select(1.0 - share, share, goes_left);
        // What is left of u is uniform again.
        let rest = select(u - share, u, goes_left) / float_max(taken, SMALLEST_NORMAL);
        u = float_min(rest, BELOW_ONE);
        chance *= taken;
        index = select(node.link, left, goes_left);
        node = light_node_at(index);
    }
    // Of lights that are far, the one that has some unit of their power.
    let units = node.units;
    var unit = min(u32(f32(units) * u), units - 1u);
    while node.link < LEAF {
        let left = light_node_at(index + 1u);
        if unit < left.units {
            index += 1u;
            node = left;
        } else {
            unit -= left.units;
            index = node.link;
            node = light_node_at(index);
        }
    }
    return LightChoice(node.link & ~LEAF, chance * share_of_power(node, units));
}

// The share that a leaf has in so many units; all of it where there are none.
fn share_of_power(leaf: LightNode, units: u32) -> f32 {
    return select(f32(leaf.units) / f32(max(units, 1u)), 1.0, units == 0u);
}

// The probability with which `choose_light` chooses a light.
fn light_chance(p: vec3f, n: vec3f, light: u32) -> f32 {
    let row = light_at(light);
    var index = 0u;
    var node = light_node_at(0u);
    var chance = 1.0;
    var way = row.way;
    while node.link < LEAF && !lights_are_far(node, p) {
        let left = index + 1u;
        let share = left_share(left, node.link, p, n);
        let goes_right = (way & 1u) == 1u;
        chance *= select(share, 1.0 - share, goes_right);
        index = select(left, node.link, goes_right);
        way >>= 1u;
        node = light_node_at(index);
    }
    return chance * share_of_power(light_node_at(row.leaf), node.units);
}
