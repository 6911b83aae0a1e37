// Twin of `film::sums`: each sample is rounded once to fixed point, then added as integers.

// The reason why a film rejects a radiance, as a number that the host reads.
fn check(radiance: vec3f) -> u32 {
    let bits = bitcast<vec3u>(radiance);
    let magnitude = bits & vec3u(0x7fffffffu);
    if any(magnitude > vec3u(0x7f800000u)) {
        return REJECT_NOT_A_NUMBER;
    }
    let negative = bits > vec3u(0x80000000u);
    if any((magnitude > vec3u(MAX_RADIANCE_BITS)) & !negative) {
        return REJECT_TOO_BRIGHT;
    }
    return select(REJECT_NONE, REJECT_NEGATIVE, any(negative));
}

// x · 2^FRACTION_BITS rounded to the nearest integer, ties to even, for 0 ≤ x < 2⁶³. The lowest word comes first.
fn fixed_point(x: f32) -> vec3u {
    let bits = bitcast<u32>(x) & 0x7fffffffu;
    let exponent = max(bits >> 23u, 1u);
    let mantissa = (bits & 0x7fffffu) | select(0u, 0x800000u, bits >= 0x800000u);
    // x is mantissa · 2^(exponent − 150).
    let shift = i32(exponent) - 150 + i32(FRACTION_BITS);
    if shift < -24 {
        return vec3u(0u);
    }
    if shift < 0 {
        let by = u32(-shift);
        let whole = mantissa >> by;
        let rest = mantissa & ((1u << by) - 1u);
        let half = 1u << (by - 1u);
        let up = rest > half || (rest == half && (whole & 1u) == 1u);
        return vec3u(whole + select(0u, 1u, up), 0u, 0u);
    }
    let by = u32(shift) & 31u;
    let lower = mantissa << by;
    // In two steps, because a shift by 32 is one by 0 in WGSL.
    let upper = (mantissa >> 1u) >> (31u - by);
    switch u32(shift) >> 5u {
        case 0u: {
            return vec3u(lower, upper, 0u);
        }
        case 1u: {
            return vec3u(0u, lower, upper);
        }
        default: {
            return vec3u(0u, 0u, lower);
        }
    }
}

fn add_radiance(to: ptr<function, SlotSums>, radiance: vec3f) {
    let red = fixed_point(radiance.x);
    let green = fixed_point(radiance.y);
    let blue = fixed_point(radiance.z);
    let low = (*to).low + vec3u(red.x, green.x, blue.x);
    let carry = select(vec3u(0u), vec3u(1u), low < (*to).low);
    // A film accepts radiance below 2³¹ in the middle word, so the carry cannot overflow it.
    let addend = vec3u(red.y, green.y, blue.y) + carry;
    let middle = (*to).middle + addend;
    (*to).high += select(vec3u(0u), vec3u(1u), middle < (*to).middle);
    (*to).middle = middle;
    (*to).low = low;
}

fn add_square(to: ptr<function, SlotSums>, square: f32) {
    let words = fixed_point(square);
    let before = (*to).squares;
    let x = before.x + words.x;
    let carry_x = select(0u, 1u, x < before.x);
    let y = before.y + words.y;
    let y_carried = y + carry_x;
    let carry_y = select(0u, 1u, y < before.y) + select(0u, 1u, y_carried < y);
    let z = before.z + words.z;
    let z_carried = z + carry_y;
    let carry_z = select(0u, 1u, z < before.z) + select(0u, 1u, z_carried < z);
    (*to).squares = vec4u(x, y_carried, z_carried, before.w + carry_z);
}

// Whether a film rejects a sample. A rejected sample is counted.
fn is_rejected(to: ptr<function, SlotSums>, sample: u32, radiance: vec3f) -> bool {
    let reject = check(radiance);
    if reject == REJECT_NONE {
        return false;
    }
    if (*to).rejected == 0u {
        (*to).first_reject = sample;
        (*to).rejected = reject << REJECT_SHIFT;
    }
    (*to).rejected++;
    return true;
}

// Adds a sample, or counts it as rejected.
fn add_sample(to: ptr<function, SlotSums>, sample: u32, radiance: vec3f) {
    if is_rejected(to, sample, radiance) {
        return;
    }
    add_radiance(to, radiance);
    add_square(to, dot(radiance, radiance));
}
