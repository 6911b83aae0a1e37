//! The observer and the illuminant that convert spectra to colours, as formulas.
//!
//! The x̄, ȳ and z̄ of the CIE 1931 standard colorimetric observer of 2° are sums of Gaussians with different widths on
//! the left and on the right of the peak: the form of Wyman, Sloan and Shirley, "Simple Analytic Approximations to the
//! CIE XYZ Color Matching Functions", Journal of Computer Graphics Techniques 2(2), 2013. Their coefficients have
//! errors of up to 1.6% of the brightest channel (for a black body of 2000 K). The sums here have more terms, which
//! were fitted for this program, as was the series for the relative power of the CIE standard illuminant D65. The
//! tables of the CIE are not included, because their licence would extend to works that contain them.

use std::sync::LazyLock;

/// The shortest and the longest wavelength in nm.
pub(super) const WAVELENGTHS: [f64; 2] = [360.0, 830.0];

/// The number of wavelengths at which a spectrum is evaluated.
const STEPS: usize = 1000;

/// ∫ ȳ dλ, with Mitsuba's value.
const Y_INTEGRAL: f64 = 106.750_259_399_414_06;

/// Terms of x̄: height, wavelength of the peak in nm, and widths in nm below and above it.
const X: [[f64; 4]; 6] = [
    [0.265021, 456.428, 22.8204, 15.3925],
    [0.71231, 608.822, 46.3577, 27.9192],
    [-0.0812571, 513.496, 15.8067, 14.9388],
    [0.154077, 433.46, 9.95021, 13.8858],
    [0.340881, 594.437, 28.1182, 20.4609],
    [0.0371837, 638.532, 85.9763, 35.0644],
];

/// Terms of ȳ.
const Y: [[f64; 4]; 5] = [
    [0.931218, 567.198, 35.9692, 39.8187],
    [0.319133, 525.495, 17.0776, 21.3252],
    [0.0789111, 486.52, 16.327, 16.9043],
    [-0.0371914, 593.019, 16.3677, 14.5323],
    [0.0287854, 456.034, 18.4366, 14.7663],
];

/// Terms of z̄.
const Z: [[f64; 4]; 5] = [
    [0.342302, 430.202, 7.62868, 10.072],
    [0.856486, 460.192, 24.2878, 13.9623],
    [0.857547, 443.466, 15.3217, 22.5246],
    [0.193, 486.046, 36.1165, 18.1016],
    [0.0925958, 483.282, 7.22247, 31.1476],
];

/// The relative power of D65, 1 at 560 nm: coefficients of Chebyshev polynomials from 360 to 830 nm.
const D65: [f64; 25] = [
    0.7561, -0.0786, -0.2262, 0.1618, -0.0401, -0.0131, 0.0418, -0.0325, 0.0212, -0.005, 0.0094, 0.0041,
    0.0036, -0.0026, -0.0061, 0.0017, -0.0254, -0.0127, 0.0115, -0.0269, 0.0412, -0.0212, 0.0099, -0.0199,
    -0.0154,
];

/// X, Y and Z of a reflectance of one under D65: the white of Rec. 709, up to Mitsuba's rounding.
const WHITE: [f64; 3] = [0.949418, 0.998892, 1.087462];

/// The factors of a spectrum for X, Y and Z.
pub(super) struct Weights {
    /// For light, at each wavelength.
    pub(super) light: Vec<[f64; 3]>,
    /// For reflectances, under D65.
    pub(super) reflectance: Vec<[f64; 3]>,
}

/// The weights at all [`wavelength`]s.
pub(super) static WEIGHTS: LazyLock<Weights> = LazyLock::new(|| {
    let step = (WAVELENGTHS[1] - WAVELENGTHS[0]) / STEPS as f64 / Y_INTEGRAL;
    let light: Vec<_> = (0..STEPS).map(|i| observer(wavelength(i)).map(|value| value * step)).collect();
    let under = |(i, weight): (usize, &[f64; 3])| weight.map(|value| value * d65(wavelength(i)));
    let mut reflectance: Vec<_> = light.iter().enumerate().map(under).collect();
    for channel in 0..3 {
        let sum: f64 = reflectance.iter().map(|weight| weight[channel]).sum();
        reflectance.iter_mut().for_each(|weight| weight[channel] *= WHITE[channel] / sum);
    }
    Weights { light, reflectance }
});

/// The wavelength of a row of the weights, in nm.
pub(super) fn wavelength(row: usize) -> f64 {
    WAVELENGTHS[0] + row as f64 / (STEPS - 1) as f64 * (WAVELENGTHS[1] - WAVELENGTHS[0])
}

/// x̄, ȳ and z̄.
fn observer(wavelength: f64) -> [f64; 3] {
    let term = |[height, peak, below, above]: &[f64; 4]| {
        let width = if wavelength < *peak { below } else { above };
        let distance = (wavelength - peak) / width;
        height * libm::exp(-0.5 * distance * distance)
    };
    [X.iter().map(term).sum(), Y.iter().map(term).sum(), Z.iter().map(term).sum()]
}

/// The relative power of D65, by Clenshaw's recurrence.
fn d65(wavelength: f64) -> f64 {
    let [low, high] = WAVELENGTHS;
    let x = (2.0 * wavelength - low - high) / (high - low);
    let [first, rest @ ..] = &D65;
    let (b1, b2) = rest.iter().rev().fold((0.0, 0.0), |(b1, b2), a| (a + 2.0 * x * b1 - b2, b1));
    first + x * b1 - b2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of the tables of CIE 018:2019.
    #[test]
    fn formulas_are_near_to_the_tables() {
        let observer_at = [
            (450.0, [0.3362, 0.038, 1.77211]),
            (500.0, [0.0049, 0.323, 0.272]),
            (555.0, [0.51205, 1.0, 0.00575]),
            (600.0, [1.0622, 0.631, 0.0008]),
            (700.0, [0.011359, 0.004102, 0.0]),
        ];
        for (wavelength, row) in observer_at {
            let near = observer(wavelength);
            assert!(near.iter().zip(row).all(|(a, b)| (a - b).abs() < 0.012), "{wavelength}: {near:?}");
        }
        for (wavelength, power) in
            [(400.0, 0.8275), (460.0, 1.1781), (560.0, 1.0), (640.0, 0.837), (700.0, 0.716)]
        {
            assert!((d65(wavelength) - power).abs() < 0.05, "{wavelength}: {}", d65(wavelength));
        }
    }
}
