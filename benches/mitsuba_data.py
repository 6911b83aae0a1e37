#!/usr/bin/env python3
"""Mitsuba's own test scenes in stride, against Mitsuba's references and variances.

    git clone https://github.com/mitsuba-renderer/mitsuba-data
    python3 benches/mitsuba_data.py mitsuba-data [--only NAME] [--list results.json]

It needs NumPy and OpenEXR from PyPI. STRIDE names the program; it is target/release/stride otherwise.

Every tests/scenes/*/*_INTEGRATOR.xml is checked with --strict. A scene is in scope if everything in it has a counterpart, or
if all that has none is a difference of models that MODELS explains; such scenes are rendered, and may fail. Sixteen pictures
are made of each, with sixteen seeds, by path tracing, and held against the reference of the variant rgb:

  z        Mitsuba's test (src/render/tests/test_renders.py): the first picture, of as many samples as give two million in
           all; a z-test for each pixel and channel in XYZ with the reference's variance, at the level 0.01 after Sidak's
           correction for the pixels; 99.75% of them must pass.
  z16      the same of all sixteen pictures together, with the reference's own noise, of 32000 samples a pixel.
  tiles    this project's test (tests/common/tiles.rs): Welch's t-test of tiles of 8x8 pixels with the spread of the sixteen
           pictures, and the uniformity of all p-values.

z16 and tiles are made again of pictures that are 2% too bright, and must fail. The exit code is 1 if a scene in scope fails
that is not of another model, if a planted error passes, or if fewer than ten scenes are in scope.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

STRIDE = os.environ.get("STRIDE", "target/release/stride")
BUDGET = 2_000_000
REPLICATES = 16
OF_REFERENCE = 32_000
LEVEL = 0.01
SIDE = 8

# What stride says has no counterpart, where it is another model of the same thing.
MODELS = {
    "beckmann": "GGX in place of Beckmann: longer tails",
    "plastic": "matte in place of plastic: no highlight",
    "principled": "matte in place of principled",
    "the shadowing function": "grazing light on tilted normals is not weakened",
}

TO_XYZ = np.array(
    [[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]]
)


def read(path):
    """The red, green and blue of an EXR file."""
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        for name in ("RGB", "RGBA"):
            if name in channels:
                return np.asarray(channels[name].pixels, np.float64)[..., :3]
        return np.stack([np.asarray(channels[name].pixels, np.float64) for name in "RGB"], -1)


def xyz(picture):
    return picture @ TO_XYZ.T


def sidak(level, tests):
    return -math.expm1(math.log1p(-level) / tests)


def z_test(picture, samples, reference, variance, reference_samples=math.inf):
    """Whether a picture passes Mitsuba's test, and the share of pixels that do."""
    variance = np.maximum(xyz(variance), 1e-4)
    spread = np.sqrt(variance * (1 / samples + 1 / reference_samples))
    z = np.abs(xyz(picture) - xyz(reference)) / spread
    p = np.vectorize(math.erfc)(z / math.sqrt(2))
    pixels = picture.shape[0] * picture.shape[1]
    share = np.count_nonzero(p > sidak(LEVEL, pixels)) / (3 * pixels)
    return share >= 0.9975, share


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


def tiles(picture):
    """The means of whole tiles, all channels added up."""
    height, width = (side // SIDE * SIDE for side in picture.shape[:2])
    whole = picture[:height, :width].sum(-1)
    return whole.reshape(height // SIDE, SIDE, width // SIDE, SIDE).mean((1, 3)).ravel()


def tile_test(pictures, reference, variance, scenes):
    """Whether sixteen pictures pass the tile test as one of so many scenes, and the least p-value."""
    ours = np.array([tiles(picture) for picture in pictures])
    theirs = tiles(reference)
    # Channels share their paths: the variance of their sum is at most that of their standard deviations' sum.
    of_sum = np.sqrt(np.maximum(variance, 0)).sum(-1, keepdims=True) ** 2
    mean, spread = ours.mean(0), ours.var(0, ddof=1) / len(ours)
    noise = tiles(of_sum) / (SIDE * SIDE * OF_REFERENCE)
    both = spread + noise
    p = []
    for i in range(len(theirs)):
        rounding = 1e-5 * max(abs(mean[i]), abs(theirs[i]))
        if math.sqrt(both[i]) > rounding:
            degrees = both[i] ** 2 / (spread[i] ** 2 / (len(ours) - 1) + noise[i] ** 2 / (OF_REFERENCE - 1))
            p.append(student((mean[i] - theirs[i]) / math.sqrt(both[i]), degrees))
        elif abs(mean[i] - theirs[i]) > rounding:
            return False, 0.0
    p = np.array(p)
    level = sidak(LEVEL, 2 * scenes)
    least = float(np.min(2 * np.minimum(p, 1 - p))) if len(p) else 1.0
    uniform = uniformity(p) if len(p) else 1.0
    return least > sidak(level, max(1, len(p))) and uniform > level, least


def lacking(scene, arguments):
    """What has no counterpart, or the error that keeps a scene from being read."""
    command = [STRIDE, "check", "--strict", *arguments, str(scene)]
    found = subprocess.run(command, capture_output=True, text=True)
    if found.returncode == 0:
        return []
    lines = found.stderr.removeprefix("error: ").strip().splitlines()
    return [line.split(": ", 1)[-1] for line in lines]


def model_of(line):
    return next((why for word, why in MODELS.items() if word in line), None)


def pictures_of(scene, arguments, samples, folder):
    pictures = []
    for seed in range(1, REPLICATES + 1):
        out = pathlib.Path(folder) / "picture.exr"
        command = [STRIDE, "render", str(scene), *arguments, "-o", str(out), "--spp", str(samples), "--seed", str(seed)]
        subprocess.run([*command, "--headless", "--quiet"], check=True)
        pictures.append(read(out))
    return pictures


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", type=pathlib.Path)
    parser.add_argument("--only", default="", help="scenes whose names contain this")
    parser.add_argument("--list", type=pathlib.Path, help="where to write the results as JSON")
    options = parser.parse_args()

    scenes = sorted((options.checkout / "tests/scenes").glob("*/*.xml"))
    scenes = [scene for scene in scenes if options.only in scene.name]
    known, out_of_scope = [], []
    for scene in scenes:
        name, integrator = scene.stem.rsplit("_", 1)
        # Particle tracing finds the same picture.
        arguments = ["--allow-outside", "-D", f"integrator={'direct' if integrator == 'direct' else 'path'}"]
        reference = scene.parent / "refs" / f"{name}_ref_rgb.exr"
        variance = reference.with_name(f"{name}_ref_rgb_var.exr")
        lacks = lacking(scene, arguments)
        strange = [line for line in lacks if model_of(line) is None]
        if not (reference.exists() and variance.exists()):
            strange.append("there is no reference")
        if strange:
            out_of_scope.append((scene, strange))
        else:
            known.append((scene, arguments, reference, variance, sorted({model_of(line) for line in lacks})))

    results, failed = [], False
    print(f"{'scene':44} {'z':>8} {'z16':>8} {'tiles':>8} {'z16+2%':>8} {'tiles+2%':>9}  models")
    with tempfile.TemporaryDirectory() as folder:
        for scene, arguments, reference, variance, models in known:
            reference, variance = read(reference), read(variance)
            samples = BUDGET // (reference.shape[0] * reference.shape[1])
            pictures = pictures_of(scene, arguments, samples, folder)
            if pictures[0].shape != reference.shape:
                print(f"{scene.stem:44} {pictures[0].shape} pixels, not {reference.shape}")
                failed = True
                continue
            mean, all_samples = np.mean(pictures, 0), REPLICATES * samples
            z = z_test(pictures[0], samples, reference, variance)
            z16 = z_test(mean, all_samples, reference, variance, OF_REFERENCE)
            of_tiles = tile_test(pictures, reference, variance, len(known))
            planted_z = z_test(1.02 * mean, all_samples, reference, variance, OF_REFERENCE)
            planted_tiles = tile_test([1.02 * p for p in pictures], reference, variance, len(known))
            passes = z[0] and of_tiles[0]
            caught = not planted_z[0] and not planted_tiles[0]
            failed |= not caught or not passes and not models
            row = {"scene": scene.stem, "passes": bool(passes), "caught": bool(caught), "models": models}
            row |= {"z": z[1], "z16": z16[1], "least_p": of_tiles[1], "mean": (mean.mean() / reference.mean()).item()}
            results.append(row)
            word = lambda test: ("pass" if test[0] else "FAIL")
            print(
                f"{scene.stem:44} {word(z):>8} {word(z16):>8} {word(of_tiles):>8} {word(planted_z):>8}"
                f" {word(planted_tiles):>9}  {'; '.join(models)}",
                flush=True,
            )
    print()
    for scene, strange in out_of_scope:
        print(f"out of scope: {scene.stem}: {strange[0]}")
    passed = sum(row["passes"] for row in results)
    exact = [row for row in results if not row["models"]]
    print(f"\n{len(scenes)} scenes, {len(known)} in scope, {passed} pass; of {len(exact)} without a difference of")
    print(f"models {sum(row['passes'] for row in exact)} pass; {sum(row['caught'] for row in results)} planted errors are caught")
    if options.list:
        options.list.write_text(json.dumps(results, indent=1) + "\n")
    sys.exit(failed or not options.only and len(known) < 10)


if __name__ == "__main__":
    main()
