// A step of `path` and `path-naive`, around the recorded `step_path`.

// How far a path has come.
struct Progress {
    state: State,
    // Rays traced for this slot so far.
    rays: u32,
}

// A path at the camera.
fn start(id: PathId, centre: vec2f, rays: u32) -> Progress {
    return Progress(start_path(id, centre), rays);
}

// Takes a path to its next surface and, from there, into its next direction. Returns whether it goes on.
fn advance(progress: ptr<function, Progress>, lane: Lane) -> bool {
    let stepped = step_path((*progress).state);
    (*progress).state = stepped.state;
    (*progress).rays += 1u + u32(stepped.shadows);
    return stepped.going;
}
