//! The distributions of test statistics, and the correction for multiple tests.

/// The level of each of `tests` independent tests such that at least one of them rejects a true hypothesis with the
/// probability `level` (Šidák 1967).
pub fn sidak(level: f64, tests: usize) -> f64 {
    -libm::expm1(libm::log1p(-level) / tests as f64)
}

/// The probability that a χ² variable exceeds `chi2`.
pub fn chi_square_tail(chi2: f64, degrees: usize) -> f64 {
    gamma_q(degrees as f64 / 2.0, chi2 / 2.0)
}

/// The probability that |Z| of a standard normal variable exceeds |z|.
pub fn normal_tails(z: f64) -> f64 {
    libm::erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// The probability that a Student variable with `degrees` degrees of freedom is below `t`.
pub fn student(t: f64, degrees: f64) -> f64 {
    let tail = 0.5 * beta_i(degrees / 2.0, 0.5, degrees / (degrees + t * t));
    if t < 0.0 { tail } else { 1.0 - tail }
}

/// The probability that `p`, if independent and uniform on [0, 1], deviated at least as much from uniformity: the
/// Kolmogorov–Smirnov test, with Stephens' (1970) correction for small numbers.
pub fn uniformity(p: &[f64]) -> f64 {
    let mut sorted = p.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let distance = sorted
        .iter()
        .enumerate()
        .map(|(i, &x)| (x - i as f64 / n).max((i + 1) as f64 / n - x))
        .fold(0.0, f64::max);
    kolmogorov_tail((n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance)
}

/// The probability that a Kolmogorov variable exceeds `x`.
fn kolmogorov_tail(x: f64) -> f64 {
    if x < 0.3 {
        return 1.0;
    }
    let term = |k: i32| {
        let sign = if k % 2 == 1 { 2.0 } else { -2.0 };
        sign * libm::exp(-2.0 * f64::from(k * k) * x * x)
    };
    (1..=100).map(term).sum::<f64>().clamp(0.0, 1.0)
}

/// The regularised upper incomplete gamma function: a series below the mean, a continued fraction by
/// Lentz's method above it (Press et al. 2007, "Numerical Recipes", §6.2).
pub fn gamma_q(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        let mut n = a;
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - front * sum
    } else {
        let mut b = x + 1.0 - a;
        let (mut c, mut d) = (1e300, 1.0 / b);
        let mut h = d;
        for i in 1..100_000 {
            let an = -f64::from(i) * (f64::from(i) - a);
            b += 2.0;
            d = 1.0 / nonzero(an * d + b);
            c = nonzero(b + an / c);
            h *= d * c;
            if (d * c - 1.0).abs() < 1e-15 {
                break;
            }
        }
        front * h
    }
}

/// The regularised incomplete beta function, likewise (ibid., §6.4).
fn beta_i(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let log_front = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b);
    let front = libm::exp(log_front + a * libm::log(x) + b * libm::log1p(-x));
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, 1.0 - x) / b
    }
}

fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let (mut c, mut d) = (1.0, 1.0 / nonzero(1.0 - (a + b) * x / (a + 1.0)));
    let mut h = d;
    for i in 1..10_000 {
        let m = f64::from(i);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for step in [even, odd] {
            d = 1.0 / nonzero(1.0 + step * d);
            c = nonzero(1.0 + step / c);
            h *= d * c;
        }
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    h
}

fn nonzero(x: f64) -> f64 {
    if x.abs() < 1e-300 { 1e-300 } else { x }
}

/// Checks these functions against printed tables. Called by the program whose tests use all of them.
pub fn check_against_tables() {
    let close = |got: f64, expected: f64| {
        assert!((got / expected - 1.0).abs() < 2e-3, "{got} is not {expected}");
    };
    // Upper 5% points of χ².
    for (degrees, chi2) in [(1, 3.841_459), (10, 18.307_04), (100, 124.342_1), (1000, 1_074.679_4)] {
        close(chi_square_tail(chi2, degrees), 0.05);
    }
    // The lower 5% point, for which the series is used.
    close(1.0 - chi_square_tail(77.929_5, 100), 0.05);
    // Upper 2.5% points of Student's t.
    for (degrees, t) in [(1.0, 12.706_2), (10.0, 2.228_139), (30.0, 2.042_272)] {
        close(student(-t, degrees), 0.025);
        close(1.0 - student(t, degrees), 0.025);
    }
    close(normal_tails(1.959_964), 0.05);
    close(kolmogorov_tail(1.358_1), 0.05);
    close(kolmogorov_tail(1.627_6), 0.01);
    close(sidak(0.01, 10), 0.001_004_5);
}
