// The entry point. Each invocation follows one path at a time and starts the next when it ends, as lanes do in
// `integrator::path_tracer`. A stride is divided into strides of invocations (report §3.2, figure 3.1): invocation i of
// m takes slots i, i + m, i + 2m, …

// The index in the region of the stride's pixel with the number `slot`.
fn stride_place(slot: u32) -> u32 {
    let run = dispatch.stride_run;
    return dispatch.stride_first + slot / run * dispatch.stride_step + slot % run;
}

// Whether the driver still runs loops. Mesa's llvmpipe ends every loop of an invocation after 65,535 iterations of all
// its loops together. It then ends this loop too.
fn loops_still_turn() -> bool {
    var turns = 0u;
    loop {
        turns++;
        if turns >= 2u + scene.zero {
            break;
        }
    }
    return turns == 2u;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn trace_slots(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.invocations {
        return;
    }
    let lane = Lane(id.x, dispatch.invocations);
    for (var slot = id.x; slot < dispatch.slots; slot += dispatch.invocations) {
        let place = stride_place(dispatch.first_slot + slot);
        let x = scene.region_x + place % scene.region_width;
        let y = scene.region_y + place / scene.region_width;
        let pixel = y * scene.film_width + x;
        let centre = vec2f(f32(x), f32(y)) + 0.5;
        var slot_sums = SlotSums();
        var i = 0u;
        var progress = start(PathId(pixel, dispatch.first_sample), centre, 0u);
        // One step per iteration: short paths do not wait for long ones in neighbouring invocations.
        loop {
            if advance(&progress, lane) {
                continue;
            }
            let state = progress.state;
            if dispatch.sends_samples != 0u {
                add_sample(&slot_sums, state.id.sample, state.l);
                // Neighbouring invocations write to adjacent addresses.
                samples[i * dispatch.slots + slot] =
                    sample_words(state.id, film_position(state.id, centre), state.l);
            } else if TAPS > 0u {
                add_splats(&slot_sums, state.id, film_position(state.id, centre), state.l);
            } else {
                add_sample(&slot_sums, state.id.sample, state.l);
            }
            i++;
            if i == dispatch.samples {
                break;
            }
            progress = start(PathId(pixel, dispatch.first_sample + i), centre, progress.rays);
        }
        slot_sums.rays = select(0u, progress.rays, loops_still_turn());
        sums[slot] = slot_sums;
    }
}
