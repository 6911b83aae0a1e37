// Twin of `light`: point lights, which no path can hit.

struct LightSample {
    wi: vec3f,
    target_point: vec3f,
    weight: vec3f,
}

// One point light, all equally likely and weighted for it.
fn sample_one(p: vec3f, choice: f32) -> LightSample {
    let count = f32(scene.point_lights);
    let index = min(u32(choice * count), scene.point_lights - 1u);
    let position = point_lights[index].position;
    let to_light = position - p;
    let distance2 = dot(to_light, to_light);
    return LightSample(
        to_light * (1.0 / sqrt(distance2)),
        position,
        point_lights[index].intensity * count * (1.0 / distance2),
    );
}

// Whether nothing stands between `o` and a light.
fn visible(light: LightSample, o: vec3f) -> bool {
    let segment = light.target_point - o;
    let length = sqrt(dot(segment, segment));
    return !occluded(Ray(o, segment * (1.0 / length)), length);
}
