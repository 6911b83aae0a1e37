// Samples for the host, and the nodes of the filter.

// The index of an invocation and their number. They decide where `whitted` keeps its waiting branches.
struct Lane {
    index: u32,
    count: u32,
}

// A node of `FilmOffset::Drawn`.
fn offset_node(i: u32) -> f32 {
    return scene.offset_nodes[i >> 2u][i & 3u];
}

// The words of a sample that the host reads.
fn sample_words(id: PathId, film: vec2f, radiance: vec3f) -> SampleWords {
    let at = bitcast<vec2u>(film);
    let found = bitcast<vec3u>(radiance);
    return SampleWords(id.pixel, id.sample, at.x, at.y, found.x, found.y, found.z);
}
