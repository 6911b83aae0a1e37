// Twin of `light`: how to sample a direction towards a light, and with what density.

// A point on a light, seen from a point in the scene.
struct LightSample {
    wi: vec3f,
    // The point on the light, moved off its surface by its error bound.
    target_point: vec3f,
    // Radiance from there; for a point light, irradiance on a surface that faces it.
    radiance: vec3f,
    // Density of `wi` by solid angle; 1 for a point light, zero where the light doesn't shine.
    pdf: f32,
}

// A light that cannot be seen from here.
fn dark() -> LightSample {
    return LightSample(vec3f(0.0, 0.0, 1.0), vec3f(0.0), vec3f(0.0), 0.0);
}

fn sample_point(light: Light, p: vec3f) -> LightSample {
    let to_light = light.origin - p;
    let distance2 = dot(to_light, to_light);
    return LightSample(to_light * (1.0 / sqrt(distance2)), light.origin, light.emission * (1.0 / distance2), 1.0);
}

// The cone of directions in which a point sees a sphere.
struct Cone {
    axis: vec3f,
    distance: f32,
    // 1 − cos of half the opening angle.
    versine: f32,
    pdf: f32,
    // Whether the point is outside the sphere; if not, nothing else here means anything.
    outside: bool,
}

fn cone_of(to_centre: vec3f, radius: f32) -> Cone {
    let distance2 = dot(to_centre, to_centre);
    let distance = sqrt(distance2);
    let sin2 = radius * radius / distance2;
    let cos = sqrt(float_max(1.0 - sin2, 0.0));
    // 1 − cos without cancellation, for a sphere that is far away.
    let versine = sin2 / (cos + 1.0);
    return Cone(to_centre * (1.0 / distance), distance, versine, 0.5 * FRAC_1_PI / versine, sin2 < 1.0);
}

// The point of a sphere with this outward normal, moved off it to the side that emits, as seen from `p`.
fn on_sphere(light: Light, p: vec3f, normal: vec3f) -> vec3f {
    let on_light = light.origin + normal * light.radius;
    let off = float_max(max_abs(on_light), max_abs(p)) * POSITION_ERROR + light.error;
    return on_light + normal * select(off, -off, light.inward > 0.0);
}

// A sphere seen from outside, uniformly within the cone that it fills; seen from inside, uniformly by area.
fn sample_sphere(light: Light, p: vec3f, u: vec2f) -> LightSample {
    let cone = cone_of(light.origin - p, light.radius);
    if light.inward > 0.0 {
        // A point on the inner side itself may round to the outside: only what lies there by more than the
        // errors of both is dark.
        if cone.distance > light.radius + light.error * 4.0 {
            return dark();
        }
        let outwards = uniform_sphere(u);
        let to_light = light.origin + outwards * light.radius - p;
        let distance2 = dot(to_light, to_light);
        let wi = to_light * (1.0 / sqrt(distance2));
        let cos = dot(wi, outwards);
        if !(cos > 0.0) {
            return dark();
        }
        let pdf = distance2 / (cos * (light.radius * light.radius * (4.0 * PI)));
        return LightSample(wi, on_sphere(light, p, outwards), light.emission, pdf);
    }
    if !cone.outside {
        return dark();
    }
    // 1 − cos θ is uniform; from it sin² θ without cancellation.
    let versine = u.x * cone.versine;
    let cos = 1.0 - versine;
    let sin2 = versine * (2.0 - versine);
    let sin = sqrt(float_max(sin2, 0.0));
    let wi = to_world(frame_around(cone.axis), vec3f(sin * sin_cos_turns(u.y).yx, cos));
    let half_chord2 = light.radius * light.radius - cone.distance * cone.distance * sin2;
    let near = cone.distance * cos - sqrt(float_max(half_chord2, 0.0));
    let normal = normalized(p + wi * near - light.origin);
    return LightSample(wi, on_sphere(light, p, normal), light.emission, cone.pdf);
}

// A quad: a rectangle uniformly by the solid angle that it fills, unless that is small; others, triangles and disks
// uniformly by area.
fn sample_flat(light: Light, p: vec3f, u: vec2f) -> LightSample {
    var at = u;
    var by_angle = 0.0;
    if light.kind == LIGHT_TRIANGLE {
        at = triangle_weights(u);
    }
    if light.kind == LIGHT_DISK {
        at = disk(u);
    }
    if light.square > 0.0 {
        let seen = rectangle_seen(light.origin - p, light.edge_u, light.edge_v);
        if seen.solid_angle >= LEAST_SOLID_ANGLE {
            at = rectangle_sample(seen, u);
            by_angle = 1.0 / seen.solid_angle;
        }
    }
    let on_light = light.origin + light.edge_u * at.x + light.edge_v * at.y;
    let to_light = on_light - p;
    let distance2 = dot(to_light, to_light);
    let wi = to_light * (1.0 / sqrt(distance2));
    let cos = -dot(wi, light.normal);
    if !(cos > 0.0) {
        return dark();
    }
    let off = float_max(max_abs(on_light), max_abs(p)) * POSITION_ERROR + light.error;
    let pdf = select(distance2 / (cos * light.area), by_angle, by_angle > 0.0);
    return LightSample(wi, on_light + light.normal * off, light.emission, pdf);
}

// A point on a light as seen from `p`.
fn sample_light(light: Light, p: vec3f, u: vec2f) -> LightSample {
    switch light.kind {
        case LIGHT_SPHERE: {
            return sample_sphere(light, p, u);
        }
        case LIGHT_QUAD, LIGHT_TRIANGLE, LIGHT_DISK: {
            return sample_flat(light, p, u);
        }
        case LIGHT_CYLINDER: {
            return sample_cylinder(light, p, u);
        }
        default: {
            return sample_point(light, p);
        }
    }
}

// Density by solid angle with which `sample_light` from `p` would have drawn the direction of a ray that met
// the light at distance `t`, on the side that emits, with the cosine `cos_light` there.
fn light_pdf(light: Light, p: vec3f, t: f32, cos_light: f32) -> f32 {
    if light.kind == LIGHT_SPHERE && light.inward == 0.0 {
        let cone = cone_of(light.origin - p, light.radius);
        if cone.outside {
            return cone.pdf;
        }
    }
    if light.square > 0.0 {
        let seen = rectangle_seen(light.origin - p, light.edge_u, light.edge_v);
        if seen.solid_angle >= LEAST_SOLID_ANGLE {
            return 1.0 / seen.solid_angle;
        }
    }
    if light.kind == LIGHT_CYLINDER && light.inward == 0.0 {
        let seen = cylinder_seen(light, p);
        if seen.distance > light.radius {
            return cylinder_pdf(seen, light, t, cos_light);
        }
    }
    return t * t / (cos_light * light.area);
}

// Whether nothing stands between `o` and a light.
fn is_visible(light: LightSample, o: vec3f) -> bool {
    let segment = light.target_point - o;
    let length = sqrt(dot(segment, segment));
    return !occluded(Ray(o, segment * (1.0 / length)), length * SHADOW_LENGTH);
}
