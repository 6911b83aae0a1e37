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

// Floats in [0, 1): the upper 24 bits over 2²⁴.
fn to_unit(words: vec4u) -> vec4f {
    return vec4f(words >> vec4u(8u)) * (1.0 / 16777216.0);
}

fn draw_independent(path: PathId, block: u32) -> vec4f {
    return to_unit(pcg4d(vec4u(path.pixel, path.sample, block, scene.seed)));
}

// Nested uniform scrambling of the mirrored number.
fn scramble(mirrored: u32, key: u32) -> u32 {
    var x = mirrored ^ (mirrored * 0x3d20adeau);
    x += key;
    x *= (key >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ (x * 0x53a22864u);
}

// The second dimension of Sobol's sequence, mirrored.
fn second_dimension(index: u32) -> u32 {
    var x = index ^ ((index >> 1u) & 0x55555555u);
    x ^= (x >> 2u) & 0x33333333u;
    x ^= (x >> 4u) & 0x0f0f0f0fu;
    x ^= (x >> 8u) & 0x00ff00ffu;
    return x ^ (x >> 16u);
}

// A pair of the sample whose index is given mirrored, in an order and with scrambles of these two keys.
fn scrambled_pair(mirrored: u32, order: u32, key: u32) -> vec2u {
    let index = reverseBits(scramble(mirrored, order));
    return reverseBits(vec2u(scramble(index, key), scramble(second_dimension(index), order + key)));
}

fn draw_sobol(path: PathId, block: u32) -> vec4f {
    let keys = pcg4d(vec4u(path.pixel, SOBOL_SALT, block, scene.seed));
    let mirrored = reverseBits(path.sample);
    return to_unit(vec4u(
        scrambled_pair(mirrored, keys.x, keys.y),
        scrambled_pair(mirrored, keys.z, keys.w),
    ));
}

// The four numbers of a block, in [0, 1).
fn draw(path: PathId, block: u32) -> vec4f {
    if SAMPLER == SAMPLER_SOBOL {
        return draw_sobol(path, block);
    }
    return draw_independent(path, block);
}

// A block's number at hit `depth`.
fn block_at(block: u32, depth: u32) -> u32 {
    return depth * BLOCK_STRIDE + block;
}

// A path's numbers one after the other, for code that draws as it goes: blocks from the top down.
struct Stream {
    words: vec4u,
    left: u32,
    block: u32,
}

fn fresh_stream() -> Stream {
    return Stream(vec4u(0u), 0u, 0xffffffffu);
}

fn next_random(stream: ptr<function, Stream>, path: PathId) -> f32 {
    if (*stream).left == 0u {
        (*stream).words = pcg4d(vec4u(path.pixel, path.sample, (*stream).block, scene.seed));
        (*stream).block -= 1u;
        (*stream).left = 4u;
    }
    let number = to_unit((*stream).words).x;
    (*stream).words = (*stream).words.yzwx;
    (*stream).left -= 1u;
    return number;
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

fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    return float_max(cos_theta, 0.0) * FRAC_1_PI;
}

// The weights of a triangle's second and third corners at a uniform point of it.
fn triangle_weights(u: vec2f) -> vec2f {
    let upper = u.x < u.y;
    let half = select(u.y, u.x, upper) * 0.5;
    let rest = select(u.x, u.y, upper) - half;
    return select(vec2f(rest, half), vec2f(half, rest), upper);
}

fn uniform_sphere(u: vec2f) -> vec3f {
    let r = sqrt(u.x * (1.0 - u.x)) * 2.0;
    return vec3f(r * sin_cos_turns(u.y).yx, 1.0 - u.x * 2.0);
}

fn offset_node(i: u32) -> f32 {
    return scene.offset_nodes[i >> 2u][i & 3u];
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
        case OFFSET_DRAWN: {
            let side = u * 2.0 - 1.0;
            let at = sqrt(1.0 - abs(side)) * 64.0;
            let node = min(u32(at), 63u);
            let near = offset_node(node);
            let offset = near + (offset_node(node + 1u) - near) * (at - f32(node));
            return select(offset, -offset, side < 0.0);
        }
        default: {
            return 0.0;
        }
    }
}
