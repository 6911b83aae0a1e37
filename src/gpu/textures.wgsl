// Twin of `texture::fetch`: texels of pictures.

// The `i`th word of 32 bits of a picture that begins at word `first` of the heap.
fn picture_word(first: u32, i: u32) -> u32 {
    let word = heap_word(first + (i >> 2u));
    return word[i & 3u];
}

// The linear value of an sRGB-encoded one.
fn linear_of_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        return encoded / 12.92;
    }
    return pow((encoded + 0.055) / 1.055, 2.4);
}

// The value of a finite 16-bit float. WGSL's `f16` is an optional feature of devices.
fn half_float(bits: u32) -> f32 {
    let magnitude = bits & 0x7fffu;
    // The bias of the exponent is 15, that of an `f32` is 127. Subnormal numbers are multiples of 2^−24.
    let normal = bitcast<f32>((magnitude << 13u) + (112u << 23u));
    let value = select(normal, f32(magnitude) * 5.9604645e-8, magnitude < 0x400u);
    return select(value, -value, bits > 0x7fffu);
}

// The `i`th number of a picture, row by row from the lower left.
fn picture_number(row: PictureRow, i: u32) -> f32 {
    let first = scene.texels_from + row.first;
    var value = 0.0;
    switch row.form & 3u {
        case PICTURE_BITS8: {
            value = f32((picture_word(first, i >> 2u) >> (8u * (i & 3u))) & 0xffu) / 255.0;
        }
        case PICTURE_BITS16: {
            value = f32((picture_word(first, i >> 1u) >> (16u * (i & 1u))) & 0xffffu) / 65535.0;
        }
        case PICTURE_HALF: {
            value = half_float((picture_word(first, i >> 1u) >> (16u * (i & 1u))) & 0xffffu);
        }
        default: {
            value = bitcast<f32>(picture_word(first, i));
        }
    }
    if (row.form & PICTURE_SRGB) != 0u {
        value = linear_of_srgb(value);
    }
    return value;
}

fn texel(row: PictureRow, own_place: u32) -> vec3f {
    let place = min(own_place, row.width * row.height - 1u);
    if (row.form & PICTURE_COLOURED) == 0u {
        return vec3f(picture_number(row, place));
    }
    let i = 3u * place;
    return vec3f(picture_number(row, i), picture_number(row, i + 1u), picture_number(row, i + 2u));
}

// The weighted sum of four texels of a picture.
fn texels(picture: u32, places: vec4u, weights: vec4f, is_active: bool) -> vec3f {
    let row = picture_at(picture);
    var sum = vec3f();
    for (var i = 0u; i < 4u; i++) {
        let weight = weights[i];
        // Most weights are zero with the filter `nearest`, and at clamped edges.
        if weight != 0.0 {
            sum += texel(row, places[i]) * weight;
        }
    }
    return sum;
}
