#!/usr/bin/env python3
"""Mitsuba's own test scenes in stride, against Mitsuba's references and variances.

    python3 -m venv peers && peers/bin/pip install 'numpy<2' mitsuba==3.9.1 OpenEXR
    git clone https://github.com/mitsuba-renderer/mitsuba-data
    peers/bin/python benches/mitsuba_data.py mitsuba-data [--only NAME] [--results results.json]

STRIDE names the program; it is target/release/stride otherwise. Every tests/scenes/*/*_INTEGRATOR.xml is read. A scene is in
scope if each of its parts has a counterpart, or is rendered as another model that Mitsuba can render too (CHANGES in
mitsuba_peer.py); this leaves out media, projectors, textures of spots, attributes of meshes and sdfgrid. The reference is
that of the variant rgb, with 32000 samples per pixel. stride renders 16 pictures with 16 seeds by path tracing, and these
are tested:

  z        Mitsuba's test (src/render/tests/test_renders.py) of the mean of all pictures, with two million samples in all: a
           z-test for each pixel and channel in XYZ with the variance of the reference, at the level 0.01 after Sidak's
           correction for the pixels; 99.75% of them must pass.
  tiles    this project's test (tests/common/tiles.rs): Welch's t-test of tiles of 8x8 pixels with the spread of the
           pictures, and the uniformity of all p-values, at the level 0.01 for all scenes together.
  z+2%, tiles+2%
           the same tests of pictures that are 2% too bright, which must fail. While one passes, the number of samples is
           multiplied by four, up to MOST; with more samples than Mitsuba's, z also counts the noise of the reference.
  own      if tiles fails without a difference of models: the same test of pictures by Mitsuba itself. If these fail too, the
           reference is not what this version of Mitsuba renders, and stride's pictures are not held to it.
  same     if there is a difference of models: tiles of stride's pictures against those of Mitsuba itself with the same
           models, by Welch's t-test at the same level; same+2% is the control. z and tiles may fail then.

The exit code is 1 if a scene fails for which none of this is an excuse, if a planted error passes, or if fewer than ten
scenes are in scope.
"""

import argparse
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import numpy as np

from mitsuba_peer import OfMitsuba, change_for
from welch import LEVEL, REPLICATES, SIDE, least, moments, read, sidak, tiles, uniformity, welch

STRIDE = os.environ.get("STRIDE", "target/release/stride")
BUDGET = 2_000_000
OF_REFERENCE = 32_000
# How many times Mitsuba's samples are taken at most.
MOST = 16

TO_XYZ = np.array(
    [[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]]
)


def xyz(picture):
    return picture @ TO_XYZ.T


def z_test(picture, samples, reference, variance, reference_samples=math.inf):
    """Whether a picture passes Mitsuba's test, and the share of pixels that do."""
    variance = np.maximum(xyz(variance), 1e-4)
    spread = np.sqrt(variance * (1 / samples + 1 / reference_samples))
    z = np.abs(xyz(picture) - xyz(reference)) / spread
    p = np.vectorize(math.erfc)(z / math.sqrt(2))
    pixels = picture.shape[0] * picture.shape[1]
    share = np.count_nonzero(p > sidak(LEVEL, pixels)) / (3 * pixels)
    return share >= 0.9975, share


def tile_test(pictures, reference, variance, scenes):
    """Whether sixteen pictures pass the tile test as one of so many scenes, and the least p-value."""
    # Channels share their paths: the standard deviation of their sum is at most the sum of theirs.
    of_sum = np.sqrt(np.maximum(xyz(variance), 0)).sum(-1, keepdims=True) ** 2
    noise = tiles(of_sum) / (SIDE * SIDE * OF_REFERENCE)
    p = welch(moments([tiles(xyz(picture)) for picture in pictures]), (tiles(xyz(reference)), noise, OF_REFERENCE - 1))
    level = sidak(LEVEL, 2 * scenes)
    uniform = uniformity(p) if len(p) else 1.0
    return least(p) > sidak(level, max(1, len(p))) and uniform > level, least(p)


def lacking(scene, arguments):
    """What has no counterpart, or the error that keeps a scene from being read."""
    command = [STRIDE, "check", "--strict", *arguments, str(scene)]
    found = subprocess.run(command, capture_output=True, text=True)
    if found.returncode == 0:
        return []
    lines = found.stderr.removeprefix("error: ").strip().splitlines()
    return [re.sub(r"^.*?:\d+:\d+: ", "", line).split(" has no counterpart")[0] for line in lines]


def pictures_of(scene, arguments, samples, folder, first):
    pictures = []
    for seed in range(first, first + REPLICATES):
        out = pathlib.Path(folder) / "picture.exr"
        command = [STRIDE, "render", str(scene), *arguments, "-o", str(out), "--spp", str(samples), "--seed", str(seed)]
        subprocess.run([*command, "--headless", "--quiet"], check=True)
        pictures.append(read(out))
    return pictures


def judge(scene, arguments, lacks, scenes, folder):
    """The results of all tests of one scene of so many."""
    name = scene.stem.rsplit("_", 1)[0]
    reference, variance = (read(scene.parent / "refs" / f"{name}_ref_rgb{part}.exr") for part in ("", "_var"))
    of_mitsuba, times = BUDGET // (reference.shape[0] * reference.shape[1]), 1
    peer = OfMitsuba(scene, lacks, integrator=arguments[-1].split("=")[1])
    differences = sorted(set(peer.differences))
    while True:
        each = max(1, times * of_mitsuba // REPLICATES)
        pictures = pictures_of(scene, arguments, each, folder, 1 + 100 * times)
        if pictures[0].shape != reference.shape:
            raise ValueError(f"{pictures[0].shape} pixels, not {reference.shape}")
        of_z = (each * REPLICATES, reference, variance, math.inf if times == 1 else OF_REFERENCE)
        z, of_tiles = z_test(np.mean(pictures, 0), *of_z), tile_test(pictures, reference, variance, scenes)
        if times == 1:
            # Mitsuba's own test.
            row = {"differences": differences, "z": bool(z[0]), "share": z[1]}
        planted_z = z_test(1.02 * np.mean(pictures, 0), *of_z)
        planted_tiles = tile_test([1.02 * picture for picture in pictures], reference, variance, scenes)
        caught = not planted_z[0] and not planted_tiles[0]
        if caught or times >= MOST:
            break
        times *= 4
    row |= {"times": times, "z": bool(row["z"] and z[0]), "tiles": bool(of_tiles[0]), "p": of_tiles[1]}
    row |= {"planted z": bool(planted_z[0]), "planted tiles": bool(planted_tiles[0])}
    row["mean"] = float(np.mean(pictures) / reference.mean())
    if differences:
        theirs = moments([tiles(picture) for picture in peer.pictures(each, REPLICATES)])
        same = lambda factor: welch(moments([factor * tiles(picture) for picture in pictures]), theirs)
        level = lambda p: sidak(LEVEL, 2 * scenes * max(1, len(p)))
        row |= {"same": least(same(1)) > level(same(1)), "p of same": least(same(1))}
        row["planted same"] = least(same(1.02)) > level(same(1.02))
    elif not row["tiles"]:
        theirs = peer.pictures(each, REPLICATES)
        row["tiles of mitsuba"] = bool(tile_test(theirs, reference, variance, scenes)[0])
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", type=pathlib.Path)
    parser.add_argument("--only", default="", help="scenes whose names contain this")
    parser.add_argument("--results", type=pathlib.Path, help="a JSON file of results: those in it stay as they are")
    parser.add_argument("--seconds", type=float, default=math.inf, help="begin no scene after this time")
    options = parser.parse_args()

    began = time.monotonic()
    results = json.loads(options.results.read_text()) if options.results and options.results.exists() else {}
    scenes = sorted((options.checkout / "tests/scenes").glob("*/*.xml"))
    known, out_of_scope, failed = [], [], False
    for scene in [scene for scene in scenes if options.only in scene.stem]:
        # Particle tracing finds the same picture.
        direct = scene.stem.endswith("_direct")
        arguments = ["--allow-outside", "-D", f"integrator={'direct' if direct else 'path'}"]
        lacks = lacking(scene, arguments)
        strange = [lack for lack in lacks if change_for(lack) is None]
        if strange:
            out_of_scope.append((scene.stem, strange))
        else:
            known.append((scene, arguments, lacks))

    word = lambda passes: "" if passes is None else "pass" if passes else "FAIL"
    print(f"{'scene':44} {'times':>5} {'z':>5} {'tiles':>5} {'z+2%':>5} {'t+2%':>5} {'own':>5} {'same':>5} {'s+2%':>5}   mean")
    with tempfile.TemporaryDirectory() as folder:
        for scene, arguments, lacks in known:
            name = scene.stem
            if name not in results and time.monotonic() - began < options.seconds:
                results[name] = judge(scene, arguments, lacks, len(scenes), folder)
                if options.results:
                    options.results.write_text(json.dumps(results, indent=1) + "\n")
            row = results.get(name)
            if not row:
                failed = True
                continue
            columns = ["z", "tiles", "planted z", "planted tiles", "tiles of mitsuba", "same", "planted same"]
            words = " ".join(f"{word(row.get(column)):>5}" for column in columns)
            print(f"{name:44} {row['times']:5} {words} {row['mean']:6.3f} {'; '.join(row['differences'])}", flush=True)
            if row["differences"]:
                failed |= not row["same"] or row["planted same"]
            else:
                failed |= not row["z"] or row["planted z"] or row["planted tiles"]
                failed |= not row["tiles"] and row["tiles of mitsuba"]
    print()
    for name, strange in out_of_scope:
        print(f"out of scope: {name}: {'; '.join(strange)}")
    passed = [name for name, row in results.items() if row["z"] and row["tiles"]]
    exact = [name for name, row in results.items() if not row["differences"]]
    same = [name for name, row in results.items() if row.get("same")]
    print(f"\n{len(scenes)} scenes, {len(known)} in scope, {len(results)} judged: {len(passed)} pass;")
    print(f"{len(exact)} have no difference of models, {len(same)} of the others are the same with the same models")
    sys.exit(failed or not options.only and len(known) < 10)


if __name__ == "__main__":
    main()
