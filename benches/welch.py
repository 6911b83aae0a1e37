"""Tests of whether pictures have the same means, for the scripts beside this file: see tests/common/tiles.rs."""

import math

import numpy as np

# The probability that a comparison of equals fails, all tests of it together.
LEVEL = 0.01
# Two means without any noise are equal if they differ only by this, relatively.
ROUNDING = 1e-5
# Replicates of a picture, each with another seed.
REPLICATES = 16
# Pixels along the side of a tile.
SIDE = 8


def read(path):
    """The red, green and blue of an EXR file."""
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        for name in ("RGB", "RGBA"):
            if name in channels:
                return np.asarray(channels[name].pixels, np.float64)[..., :3]
        return np.stack([np.asarray(channels[name].pixels, np.float64) for name in "RGB"], -1)


def sidak(level, tests):
    return -math.expm1(math.log1p(-level) / tests)


def incomplete_beta(a, b, x):
    """The regularised incomplete beta function, by a continued fraction (Press et al. 2007, section 6.4)."""
    if x <= 0 or x >= 1:
        return float(x >= 1)
    if x >= (a + 1) / (a + b + 2):
        return 1 - incomplete_beta(b, a, 1 - x)
    tiny = 1e-300
    c, d = 1.0, 1 / ((1 - (a + b) * x / (a + 1)) or tiny)
    h = d
    for m in range(1, 10_000):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        for step in (even, odd):
            d = 1 / ((1 + step * d) or tiny)
            c = (1 + step / c) or tiny
            h *= c * d
        if abs(c * d - 1) < 1e-15:
            break
    front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    return math.exp(front) * h / a


def student(t, degrees):
    """The probability that a Student variable is below t."""
    tail = 0.5 * incomplete_beta(degrees / 2, 0.5, degrees / (degrees + t * t))
    return tail if t < 0 else 1 - tail


def uniformity(p):
    """Kolmogorov and Smirnov's test with Stephens' correction."""
    p = np.sort(p)
    n = len(p)
    distance = max(np.max(p - np.arange(n) / n), np.max(np.arange(1, n + 1) / n - p))
    x = (math.sqrt(n) + 0.12 + 0.11 / math.sqrt(n)) * distance
    if x < 0.3:
        return 1.0
    return min(1.0, max(0.0, sum((2 if k % 2 else -2) * math.exp(-2 * k * k * x * x) for k in range(1, 101))))


def moments(replicates):
    """The mean of each number in replicates, the variance of that mean, and its degrees of freedom."""
    replicates = np.asarray(replicates)
    n = len(replicates)
    return replicates.mean(0), replicates.var(0, ddof=1) / n, n - 1


def welch(ours, theirs):
    """One-sided p-values of Welch's test for each number of two `moments`: none without noise, 0 or 1 if those differ."""
    (mean, spread, degrees), (reference, noise, degrees_of_reference) = ours, theirs
    p = []
    for a, b, of_a, of_b in zip(mean, reference, spread, noise):
        difference, both = a - b, of_a + of_b
        rounding = ROUNDING * max(abs(a), abs(b))
        if math.sqrt(both) > rounding:
            freedom = both**2 / (of_a**2 / degrees + of_b**2 / degrees_of_reference)
            p.append(student(difference / math.sqrt(both), freedom))
        elif abs(difference) > rounding:
            p.append(float(difference > 0))
    return np.array(p)


def least(p):
    """The least two-sided p-value of all, 1 without any."""
    return float(np.min(2 * np.minimum(p, 1 - p))) if len(p) else 1.0


def tiles(picture):
    """The means of whole tiles, all channels added up."""
    height, width = (extent // SIDE * SIDE for extent in picture.shape[:2])
    whole = picture[:height, :width].sum(-1)
    return whole.reshape(height // SIDE, SIDE, width // SIDE, SIDE).mean((1, 3)).ravel()
