// Twin of `light::cylinder`: the cylinder, sampled by the directions in which it is seen.

// A cylinder seen from a point outside of it.
struct SeenCylinder {
    // Towards the axis, at a right angle to it, and of length one.
    towards: vec3f,
    // Distance to the axis.
    distance: f32,
    // How far along the axis the ends are.
    ends: vec2f,
    // Half the arc that it fills about the axis, in turns.
    half_arc: f32,
}

// Directions from end to end along one line of a cylinder: 1 − sin β and 1 + sin β at both ends, and the difference of
// the sines, β being the angle by which they rise along the axis.
struct Rise {
    less: vec2f,
    more: vec2f,
    sines: f32,
}

fn cylinder_seen(light: Light, p: vec3f) -> SeenCylinder {
    let to_origin = light.origin - p;
    let low = dot(to_origin, light.normal);
    let away = to_origin - light.normal * low;
    let distance = sqrt(dot(away, away));
    let beyond = sqrt(float_max((distance - light.radius) * (distance + light.radius), 0.0));
    let ends = vec2f(low, low + dot(light.edge_v, light.normal));
    return SeenCylinder(away * (1.0 / distance), distance, ends, angle_turns(light.radius, beyond));
}

fn rise_of(distance: f32, ends: vec2f) -> Rise {
    let lengths = sqrt(ends * ends + distance * distance);
    let sums = lengths + abs(ends);
    let small = (distance / lengths) * (distance / sums);
    let large = sums / lengths;
    let rises = ends > vec2f(0.0);
    let sin = ends / lengths;
    var sines = sin.y - sin.x;
    // Of sines of one sign the difference would cancel; that of their squares, by their sum, does not.
    if ends.x > 0.0 || ends.y < 0.0 {
        let cosines = (distance / lengths.x) * (distance / lengths.y);
        let of_squares = cosines * ((ends.y - ends.x) / lengths.x) * ((ends.x + ends.y) / lengths.y);
        sines = of_squares / (sin.x + sin.y);
    }
    return Rise(select(large, small, rises), select(small, large, rises), sines);
}

fn pdf_along(seen: SeenCylinder, rise: Rise) -> f32 {
    return 0.25 * FRAC_1_PI / (seen.half_arc * rise.sines);
}

// Density of the direction of a point that was met at distance `t`, with the cosine `cos_light` there.
fn cylinder_pdf(seen: SeenCylinder, light: Light, t: f32, cos_light: f32) -> f32 {
    let near = seen.distance - light.radius;
    let far2 = near * (seen.distance + light.radius);
    let distance2 = far2 - light.radius * 2.0 * (t * cos_light);
    let distance = sqrt(float_min(float_max(distance2, near * near), far2));
    return pdf_along(seen, rise_of(distance, seen.ends));
}

// A point of a cylinder with this outward normal, moved off it to the side that emits.
fn on_cylinder(light: Light, p: vec3f, on_axis: vec3f, normal: vec3f) -> vec3f {
    let on_light = on_axis + normal * light.radius;
    let off = float_max(max_abs(on_light), max_abs(p)) * POSITION_ERROR + light.error;
    return on_light + normal * select(off, -off, light.inward > 0.0);
}

// A cylinder seen from outside, by the directions in which it is seen; one that emits inwards, uniformly by area.
fn sample_cylinder(light: Light, p: vec3f, u: vec2f) -> LightSample {
    if light.inward > 0.0 {
        let on_axis = light.origin + light.edge_v * u.y;
        let outwards = to_world(frame_around(light.normal), vec3f(sin_cos_turns(u.x).yx, 0.0));
        let to_light = on_axis + outwards * light.radius - p;
        let distance2 = dot(to_light, to_light);
        let wi = to_light * (1.0 / sqrt(distance2));
        let cos = dot(wi, outwards);
        if !(cos > 0.0) {
            return dark();
        }
        return LightSample(wi, on_cylinder(light, p, on_axis, outwards), light.emission, distance2 / (cos * light.area));
    }
    let seen = cylinder_seen(light, p);
    if !(seen.distance > light.radius) {
        return dark();
    }
    let turn = u.x * 2.0 - 1.0;
    let sin_cos = sin_cos_turns(abs(turn) * seen.half_arc);
    let sin = copysign(sin_cos.x, turn);
    let aside = seen.distance * sin;
    let half_chord = sqrt(float_max(light.radius * light.radius - aside * aside, 0.0));
    let distance = float_max(seen.distance * sin_cos.y - half_chord, seen.distance - light.radius);
    let rise = rise_of(distance, seen.ends);
    let less = rise.less.x * (1.0 - u.y) + rise.less.y * u.y;
    let more = rise.more.x * (1.0 - u.y) + rise.more.y * u.y;
    let sin_b = (more - less) * 0.5;
    let cos_b = sqrt(less * more);
    let level = distance * sin_b / float_max(cos_b, SMALLEST_NORMAL);
    let height = float_max(float_min(level, seen.ends.y), seen.ends.x) - seen.ends.x;
    let sideways = cross(light.normal, seen.towards);
    let normal = normalized(seen.towards * (distance * sin_cos.y - seen.distance) + sideways * (distance * sin));
    let wi = (seen.towards * sin_cos.y + sideways * sin) * cos_b + light.normal * sin_b;
    let target_point = on_cylinder(light, p, light.origin + light.normal * height, normal);
    return LightSample(wi, target_point, light.emission, pdf_along(seen, rise));
}
