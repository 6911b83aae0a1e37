// Strides dealt to invocations (report §3.2, figure 3.1): invocation i of m takes slots i, i + m, i + 2m, …

@compute @workgroup_size(WORKGROUP_SIZE)
fn trace_slots(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.invocations {
        return;
    }
    for (var slot = id.x; slot < dispatch.slots; slot += dispatch.invocations) {
        let place = dispatch.first_place + slot * dispatch.place_step;
        let x = scene.region_x + place % scene.region_width;
        let y = scene.region_y + place / scene.region_width;
        let pixel = y * scene.film_width + x;
        let centre = vec2f(f32(x), f32(y)) + 0.5;
        var slot_sums = SlotSums();
        for (var i = 0u; i < dispatch.samples; i++) {
            let sample = dispatch.first_sample + i;
            let path = trace_path(PathId(pixel, sample), centre);
            slot_sums.rays += path.rays;
            add_sample(&slot_sums, sample, path.radiance);
            if dispatch.sends_samples != 0u {
                let film = bitcast<vec2u>(path.film);
                let found = bitcast<vec3u>(path.radiance);
                samples[slot * dispatch.samples + i] =
                    SampleWords(pixel, sample, film.x, film.y, found.x, found.y, found.z);
            }
        }
        sums[slot] = slot_sums;
    }
}
