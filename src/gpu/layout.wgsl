// What the host and the device exchange. `layout.rs` owns these layouts, and a test holds this file to it.

// The camera, the film, the settings, and how much of everything there is.
struct Scene {
    eye: vec3f,
    pixel_side: f32,
    left: vec3f,
    near: f32,
    up: vec3f,
    aperture_radius: f32,
    forward: vec3f,
    focus_distance: f32,
    environment: vec3f,
    seed: u32,
    // The ambient term of `whitted`.
    ambient: vec3f,
    max_depth: u32,
    centre: vec2f,
    offset_kind: u32,
    offset_radius: f32,
    // Surfaces that every ray asks are sorted by shape: planes, then spheres, then quads, then disks and cylinders as
    // they come. Each ends where the next begins; what follows is in the tree, or is a mesh.
    planes_end: u32,
    spheres_end: u32,
    quads_end: u32,
    rare_end: u32,
    // All lights that can be sampled; the points among them are the first.
    lights: u32,
    point_lights: u32,
    film_width: u32,
    region_x: u32,
    region_y: u32,
    region_width: u32,
    // Zero, which no compiler can know.
    zero: u32,
    // The heap's words with which the tables begin.
    surfaces_from: u32,
    materials_from: u32,
    lights_from: u32,
    light_nodes_from: u32,
    tree_nodes_from: u32,
    triangles_from: u32,
    vertices_from: u32,
    places_from: u32,
    // The node with which the tree in the world's own space begins, and the share of a ray's origin by which a ray is
    // moved beside its boxes.
    tree_root: u32,
    tree_share: f32,
    // The heap's word with which the filter's weights begin.
    weights_from: u32,
    // Added to a position in multiples of 2^−CHANCE_BITS, it gives the first tap, rounded down; and whether it was not
    // rounded, so that there may be ties.
    tap_shift: i32,
    tap_ties: u32,
    // Of `FilmOffset::Drawn`: 65 nodes, four a row.
    offset_nodes: array<vec4f, 17>,
}

// One dispatch: the same samples for each of some slots of a stride.
struct Dispatch {
    // The stride: every nth place, or every nth run of places.
    stride_first: u32,
    stride_step: u32,
    stride_run: u32,
    first_slot: u32,
    slots: u32,
    invocations: u32,
    first_sample: u32,
    samples: u32,
    sends_samples: u32,
    // The band that samples are added to: its first column and row, in those of the whole film, and its size.
    band_left: i32,
    band_top: i32,
    band_width: u32,
    band_pixels: u32,
    // The most samples that are sent because they are too bright for the band.
    most_bright: u32,
}

// A row of the surface table.
struct Surface {
    // Of round surfaces and cylinders; zero for flat ones.
    anchor: vec3f,
    // Zero for flat ones; IS_DISK or IS_CYLINDER.
    radius: f32,
    // The normal of flat surfaces, the vector from the anchor to the centre of round ones, a cylinder's axis.
    axis: vec3f,
    // The distance of flat surfaces, the anchor's power of round ones, a cylinder's radius.
    constant: f32,
    u_axis: vec4f,
    v_axis: vec4f,
    emission: vec3f,
    error: f32,
    orientation: f32,
    material: u32,
    // Index into `lights`, or NO_LIGHT.
    light: u32,
    // Its number on the host, which decides ties.
    row: u32,
}

// A node of the light tree.
struct LightNode {
    centre: vec3f,
    radius: f32,
    axis: vec3f,
    power: f32,
    cos_o: f32,
    cos_e: f32,
    spread: f32,
    // Index of the first child, the others follow it, and from bit COUNT_FROM on one less than their number; or the
    // index of the light with LEAF set.
    link: u32,
    // Square of the distance from which on power alone says which of the lights is asked.
    far2: f32,
    // Whole units of power.
    units: u32,
    // Where its lights begin in the order of the tree.
    first: u32,
    // Where a lamp's tree begins, how many lights the lamp has.
    lights: u32,
}

// A node of the tree over surfaces: eight boxes, rounded outwards to 256 steps of a power of two along each axis.
struct TreeNode {
    // The boxes' least coordinates.
    origin: vec3f,
    // The exponents of the steps along x, y and z as floats have them, then which boxes hold nodes.
    scales: u32,
    // The first of those nodes, which stand side by side, and of what the leaves hold; instances are among triangles.
    nodes: u32,
    triangles: u32,
    surfaces: u32,
    // NO_NODE at the beginning of a tree.
    parent: u32,
    // Sixteen bits for each box: see `leaf_at`.
    leaves: vec4u,
    // Eight bits for each box.
    low_x: vec2u,
    low_y: vec2u,
    low_z: vec2u,
    high_x: vec2u,
    high_y: vec2u,
    high_z: vec2u,
}

// A triangle of a mesh.
struct Triangle {
    a: vec3f,
    // Its number on the host, which decides ties.
    number: u32,
    b: vec3f,
    // Its mesh: index into `surfaces`. Of a shared mesh its place tells.
    surface: u32,
    c: vec3f,
    // Index into `lights`, or NO_LIGHT.
    light: u32,
    // Indices into `vertices`.
    vertices: vec3u,
    // Its share of a hit's error bound, in its own space.
    error: f32,
}

// A shared mesh where it stands, as rays come to it. It has the place of a triangle.
struct Instance {
    // The rows of the matrix that takes directions to the mesh's own space.
    to_mesh_x: vec3f,
    // The node with which the mesh's tree begins.
    root: u32,
    to_mesh_y: vec3f,
    // Its number on the host, from one.
    number: u32,
    to_mesh_z: vec3f,
    // Where the mesh's origin is in the world.
    origin: vec3f,
}

// The same as hits look it up: by its number less one.
struct Place {
    // The rows of the matrix that takes directions to the world.
    to_world_x: vec3f,
    // The most by which it lengthens.
    stretch: f32,
    to_world_y: vec3f,
    // The error of a ray that is taken to the mesh, for each unit of its distance from the mesh's origin.
    ray_error: f32,
    to_world_z: vec3f,
    // Index into `surfaces`.
    surface: u32,
    to_mesh_x: vec3f,
    to_mesh_y: vec3f,
    to_mesh_z: vec3f,
    origin: vec3f,
}

// What a mesh says of a vertex.
struct Vertex {
    // Zero where it says nothing; uv then are NaN.
    normal: vec3f,
    u: f32,
    v: f32,
}

// A branch of `whitted` that waits.
struct Branch {
    o: vec3f,
    depth: u32,
    d: vec3f,
    beta: vec3f,
}

// Exact sums of one slot's samples. Radiance: 96 bits a channel, in three words; squares: 128 bits.
struct SlotSums {
    low: vec3u,
    // Zero where the driver ended the work before its end.
    rays: u32,
    middle: vec3u,
    // How many samples were left out, and in the uppermost two bits why the first was.
    rejected: u32,
    high: vec3u,
    first_reject: u32,
    squares: vec4u,
}

// One sample, bit patterns of floats where it holds floats: what is no number must travel as it is.
struct SampleWords {
    pixel: u32,
    sample: u32,
    x: u32,
    y: u32,
    red: u32,
    green: u32,
    blue: u32,
}

// Sums of samples that count in all pixels around them.
struct Splats {
    // How many samples were too bright for that.
    bright: atomic<u32>,
    // Of all pixels of the band the low words of red, then those of green, of blue and of the weight, so that neighbours
    // add side by side; then the high words.
    words: array<atomic<u32>>,
}

@group(0) @binding(0) var<uniform> scene: Scene;
// Of every invocation as many as may wait, those at one height side by side.
@group(0) @binding(1) var<storage, read_write> branches: array<Branch>;
// The tables follow, in one heap: see `heap.rs`.
@group(1) @binding(0) var<uniform> dispatch: Dispatch;
@group(1) @binding(1) var<storage, read_write> sums: array<SlotSums>;
@group(1) @binding(2) var<storage, read_write> samples: array<SampleWords>;
@group(1) @binding(3) var<storage, read_write> splats: Splats;
