// Twin of `integrator::naive`, and of the step that `integrator::path_tracer` takes for it: the report's path tracer.

fn naive_step(state: ptr<function, State>) -> bool {
    var vertex: PathVertex;
    if !meet(state, &vertex) {
        return false;
    }
    (*state).l += (*state).beta * vertex.emitted;
    if (*state).depth >= scene.max_depth {
        return false;
    }
    let point = vertex.point;
    let material = material_at(vertex.material);
    let frame = frame_around(point.shading);
    let wo = to_local(frame, -(*state).ray.d);
    if scene.point_lights > 0u && bsdf_has_non_delta(material) {
        (*state).rays++;
        (*state).l += (*state).beta * point_light(state, point, frame, material, wo);
    }
    let u = draw((*state).id, block_at(BLOCK_SCATTER, (*state).depth));
    return go_on(state, point, frame, bsdf_sample(material, wo, u.xy, u.z));
}

// Radiance that one point light, all equally likely and weighted for it, sends back along the ray by way of a
// point.
fn point_light(
    state: ptr<function, State>,
    point: SurfacePoint,
    frame: Frame,
    material: Material,
    wo: vec3f,
) -> vec3f {
    let choice = draw((*state).id, block_at(BLOCK_LIGHT, (*state).depth)).z;
    let count = f32(scene.point_lights);
    // A product that rounds up to the count still means the last light.
    let index = min(u32(choice * count), scene.point_lights - 1u);
    let light = sample_point(light_at(index), point.p);
    let wi = to_local(frame, light.wi);
    let visible = is_visible(light, offset_origin(point.p, point.n, point.error, light.wi));
    let share = bsdf_eval(material, wo, wi) * light.radiance * count * abs(wi.z);
    return select(vec3f(0.0), share, visible && passes(point, light.wi, wi));
}
