// Twin of `sampling`: the same integers, and the warps that shape them.

struct PathId {
    pixel: u32,
    sample: u32,
}

fn pcg4d(words: vec4u) -> vec4u {
    var v = words * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4u(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The four numbers of a block, in [0, 1).
fn draw(path: PathId, block: u32) -> vec4f {
    let words = pcg4d(vec4u(path.pixel, path.sample, block, scene.seed));
    return vec4f(words >> vec4u(8u)) * (1.0 / 16777216.0);
}

// A block's number at hit `depth`.
fn block_at(block: u32, depth: u32) -> u32 {
    return depth * BLOCK_STRIDE + block;
}

fn tent(u: f32) -> f32 {
    let rising = u < 0.5;
    let x = 1.0 - sqrt(select(1.0 - u, u, rising) * 2.0);
    return select(x, -x, rising);
}

fn disk(u: vec2f) -> vec2f {
    let sin_cos = sin_cos_turns(u.y);
    return sqrt(u.x) * sin_cos.yx;
}

fn cosine_hemisphere(u: vec2f) -> vec3f {
    return vec3f(disk(u), sqrt(1.0 - u.x));
}

// An offset from a pixel's centre along one axis, in pixels.
fn film_offset(u: f32) -> f32 {
    switch scene.offset_kind {
        case OFFSET_UNIFORM: {
            return (u * 2.0 - 1.0) * scene.offset_radius;
        }
        case OFFSET_TENT: {
            return tent(u) * scene.offset_radius;
        }
        default: {
            return 0.0;
        }
    }
}
