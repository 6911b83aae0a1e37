// Samples as they are sent, and the nodes of the filter.

// Which invocation this is, of how many: it decides where branches of `whitted` wait.
struct Lane {
    index: u32,
    count: u32,
}

// A node of `FilmOffset::Drawn`.
fn offset_node(i: u32) -> f32 {
    return scene.offset_nodes[i >> 2u][i & 3u];
}

// A sample as it is sent.
fn sample_words(id: PathId, film: vec2f, radiance: vec3f) -> SampleWords {
    let at = bitcast<vec2u>(film);
    let found = bitcast<vec3u>(radiance);
    return SampleWords(id.pixel, id.sample, at.x, at.y, found.x, found.y, found.z);
}
