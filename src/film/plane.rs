//! One channel of a picture, and filters over it.

/// Values of every pixel, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    /// Pixels in a row.
    pub(super) width: usize,
    /// One per pixel.
    pub(super) values: Vec<f32>,
}

/// Correlates a plane with the product of a horizontal and a vertical kernel, each of odd length and centred.
/// The border is extended by its own pixels.
pub(super) fn convolve(plane: &Plane, across: &[f32], down: &[f32]) -> Plane {
    let width = plane.width;
    let reach = across.len() / 2;
    let mut rows = Vec::with_capacity(plane.values.len());
    let mut padded = Vec::with_capacity(width + 2 * reach);
    for row in plane.values.chunks_exact(width) {
        padded.clear();
        padded.extend(std::iter::repeat_n(row[0], reach));
        padded.extend_from_slice(row);
        padded.extend(std::iter::repeat_n(row[width - 1], reach));
        let weigh =
            |window: &[f32]| window.iter().zip(across).map(|(value, weight)| value * weight).sum::<f32>();
        rows.extend(padded.windows(across.len()).map(weigh));
    }

    let height = rows.len() / width;
    let reach = down.len() / 2;
    let mut values = vec![0.0f32; rows.len()];
    for (y, out) in values.chunks_exact_mut(width).enumerate() {
        for (tap, weight) in down.iter().enumerate() {
            let from = (y + tap).saturating_sub(reach).min(height - 1);
            let row = &rows[from * width..][..width];
            out.iter_mut().zip(row).for_each(|(out, value)| *out += weight * value);
        }
    }
    Plane { width, values }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kernel_is_laid_out_from_left_to_right_and_from_top_to_bottom() {
        let dot = Plane { width: 3, values: vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0] };
        let seen = convolve(&dot, &[1.0, 2.0, 4.0], &[1.0, 10.0, 100.0]);
        // The dot is on the right of the kernel at a pixel to its left.
        assert_eq!(seen.values, [400.0, 200.0, 100.0, 40.0, 20.0, 10.0, 4.0, 2.0, 1.0]);
    }

    #[test]
    fn the_border_is_extended() {
        let kernel = vec![0.2f32; 5];
        for (width, height) in [(1, 1), (1, 7), (7, 1), (2, 3)] {
            let flat = Plane { width, values: vec![3.0; width * height] };
            let seen = convolve(&flat, &kernel, &kernel);
            assert!(seen.values.iter().all(|value| (value - 3.0).abs() < 1e-5), "{width}×{height}");
        }
        let step = Plane { width: 2, values: vec![0.0, 1.0] };
        assert_eq!(convolve(&step, &[0.25, 0.5, 0.25], &[1.0]).values, [0.25, 0.75]);
    }
}
