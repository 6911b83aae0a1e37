// Twin of `film::splat` and `film::weights`: samples count in every pixel within the filter's radius. All arithmetic is
// in integers, so the sums are those of the CPU.

// The taps of a sample along an axis.
struct Taps {
    // The pixel of the first tap, modulo 2³²: it may be left of the film or above it.
    first: u32,
    // The first word of the table's row in the heap, and the position of the sample between that row and the next.
    row: u32,
    part: i32,
}

// The taps of a position. All positions are multiples of 2^−CHANCE_BITS of a pixel.
fn taps_at(at: f32) -> Taps {
    // No operation rounds.
    let pixel = floor(at);
    let shifted = i32((at - pixel) * f32(1u << CHANCE_BITS)) + scene.tap_shift;
    // Rounded to the nearest multiple of 2^−POSITION_BITS. Ties, if the filter's radius allows any, go to even.
    let by = CHANCE_BITS - POSITION_BITS;
    let up = select(1, (shifted >> by) & 1, scene.tap_ties != 0u);
    let position = (shifted + i32((1u << (by - 1u)) - 1u) + up) >> by;
    let between = u32(position) & ((1u << POSITION_BITS) - 1u);
    let within = POSITION_BITS - CELL_BITS;
    let row = scene.weights_from + (between >> within) * TAP_WORDS;
    return Taps(u32(pixel) + u32(position >> POSITION_BITS), row, i32(between & ((1u << within) - 1u)));
}

// Four taps, from tap 4 · `word` on, in multiples of 2^−TAP_BITS.
fn four_taps(taps: Taps, word: u32) -> vec4i {
    let within = POSITION_BITS - CELL_BITS;
    let by = TABLE_BITS + within - TAP_BITS;
    let from_row = bitcast<vec4i>(heap_word(taps.row + word));
    let to_row = bitcast<vec4i>(heap_word(taps.row + TAP_WORDS + word));
    let mixed = from_row * (i32(1u << within) - taps.part) + to_row * taps.part;
    return (mixed + i32(1u << (by - 1u))) >> vec4u(by);
}

// The channels of a sample, prepared for multiplication by weights.
struct Factors {
    mantissa: vec3u,
    // The right shift, in bits, from the product of mantissa and weight to the unit of the sums: 1 to 53.
    shift: vec3u,
    // Half the unit of the sums in units of the product, less one: low and high word.
    half_low: vec3u,
    half_high: vec3u,
}

// The factors of a radiance of at most 1024, the limit of these sums.
fn factors(radiance: vec3f) -> Factors {
    let bits = bitcast<vec3u>(radiance) & vec3u(0x7fffffffu);
    let exponent = max(bits >> vec3u(23u), vec3u(1u));
    let mantissa = (bits & vec3u(0x7fffffu)) | select(vec3u(0u), vec3u(0x800000u), bits >= vec3u(0x800000u));
    let shift = vec3u(150u + WEIGHT_BITS - FRACTION_BITS) - exponent;
    // A product has at most 53 bits. Fainter channels round to zero.
    let faint = shift > vec3u(53u);
    let by = select(shift, vec3u(53u), faint);
    let ones = vec3u(0xffffffffu);
    // The lowest `by` − 1 bits are set.
    let low = select((vec3u(1u) << ((by - 1u) & vec3u(31u))) - 1u, ones, by > vec3u(32u));
    let high = select(vec3u(0u), (vec3u(1u) << ((by - 33u) & vec3u(31u))) - 1u, by > vec3u(32u));
    return Factors(select(mantissa, vec3u(0u), faint), by, low, high);
}

// Adds 64 bits to a word of a pixel. The sum is exact even if other invocations add to it at the same time.
fn add_word(word: u32, low: u32, high: u32) {
    var upper = high;
    if low != 0u {
        let before = atomicAdd(&splats.words[word], low);
        upper += select(0u, 1u, before + low < low);
    }
    if upper != 0u {
        atomicAdd(&splats.words[word + 4u * dispatch.band_pixels], upper);
    }
}

// Adds a sample to a pixel of the band. Each product of channel and weight is rounded to the nearest integer, ties to
// even.
fn add_tap(pixel: u32, weight: i32, sample: Factors) {
    if weight == 0 {
        return;
    }
    let size = u32(abs(weight));
    // The product of 24 and 29 bits, in two words.
    let upper = sample.mantissa >> vec3u(16u);
    let lower = sample.mantissa & vec3u(0xffffu);
    let lowest = lower * (size & 0xffffu);
    let middle = lower * (size >> 16u) + upper * (size & 0xffffu) + (lowest >> vec3u(16u));
    let low = (middle << vec3u(16u)) | (lowest & vec3u(0xffffu));
    let high = upper * (size >> 16u) + (middle >> vec3u(16u));
    // Half a unit is added for odd quotients, and one bit less for even ones: ties round to even.
    let by = sample.shift & vec3u(31u);
    let far = sample.shift > vec3u(31u);
    let odd = (select(low, high, far) >> by) & vec3u(1u);
    let half_low = sample.half_low + odd;
    let half_high = sample.half_high + select(vec3u(0u), vec3u(1u), half_low < odd);
    let sum_low = low + half_low;
    let sum_high = high + half_high + select(vec3u(0u), vec3u(1u), sum_low < low);
    // WGSL takes shifts modulo 32. `select` discards the results of shifts by 32.
    let near_low = (sum_low >> by) | (sum_high << ((32u - by) & vec3u(31u)));
    var rounded_low = select(near_low, sum_high >> by, far);
    var rounded_high = select(sum_high >> by, vec3u(0u), far);
    if weight < 0 {
        rounded_low = ~rounded_low + 1u;
        rounded_high = ~rounded_high + select(vec3u(0u), vec3u(1u), rounded_low == vec3u(0u));
    }
    let pixels = dispatch.band_pixels;
    add_word(pixel, rounded_low.x, rounded_high.x);
    add_word(pixel + pixels, rounded_low.y, rounded_high.y);
    add_word(pixel + 2u * pixels, rounded_low.z, rounded_high.z);
    add_word(pixel + 3u * pixels, u32(weight), u32(weight >> 31u));
}

// Adds a sample to all pixels within the filter's radius, or counts it as rejected. A sample that is too bright for the
// sums goes to the list of samples.
fn add_splats(to: ptr<function, SlotSums>, id: PathId, at: vec2f, radiance: vec3f) {
    if is_rejected(to, id.sample, radiance) {
        return;
    }
    if any((bitcast<vec3u>(radiance) & vec3u(0x7fffffffu)) > vec3u(MAX_SUMMED_BITS)) {
        let place = atomicAdd(&splats.bright, 1u);
        // If the list is full, the count tells the host, which repeats the dispatch in parts.
        if place < dispatch.most_bright {
            samples[place] = sample_words(id, at, radiance);
        }
        return;
    }
    let sample = factors(radiance);
    let across = taps_at(at.x);
    let down = taps_at(at.y);
    let width = dispatch.band_width;
    // The band contains every pixel within the radius, so the difference is not negative.
    let corner = (down.first - u32(dispatch.band_top)) * width + (across.first - u32(dispatch.band_left));
    for (var i = 0u; i < TAP_WORDS; i++) {
        let columns = four_taps(across, i);
        for (var j = 0u; j < TAP_WORDS; j++) {
            var rows = four_taps(down, j);
            var pixel = corner + 4u * (j * width + i);
            for (var k = 0u; k < min(TAPS, 4u); k++) {
                let weights = columns * rows.x;
                add_tap(pixel, weights.x, sample);
                if TAPS > 1u {
                    add_tap(pixel + 1u, weights.y, sample);
                }
                if TAPS > 2u {
                    add_tap(pixel + 2u, weights.z, sample);
                }
                if TAPS > 3u {
                    add_tap(pixel + 3u, weights.w, sample);
                }
                rows = rows.yzwx;
                pixel += width;
            }
        }
    }
}
