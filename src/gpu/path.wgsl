// One step of `path` and `path-naive`: it calls the recorded `step_path`.

// The state of a path.
struct Progress {
    state: State,
    around: Around,
    // Rays traced for this slot so far.
    rays: u32,
}

// A path that begins at the camera.
fn start(id: PathId, centre: vec2f, rays: u32) -> Progress {
    return Progress(start_path(id, centre), start_around(), rays);
}

// Traces a path to its next surface and scatters it. Returns whether it continues.
fn advance(progress: ptr<function, Progress>, lane: Lane) -> bool {
    let result = step_path((*progress).state, (*progress).around);
    let stepped = result.first;
    (*progress).state = stepped.state;
    (*progress).around = result.second;
    (*progress).rays += 1u + u32(stepped.shadows);
    return stepped.going;
}
