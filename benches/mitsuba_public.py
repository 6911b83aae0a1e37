#!/usr/bin/env python3
"""Public scene files of Mitsuba in stride and in Mitsuba itself: what they hold, and whether the pictures are equal.

    python3 -m venv peers && peers/bin/pip install 'numpy<2' mitsuba==3.9.1 OpenEXR
    git clone https://github.com/OWNER/REPOSITORY folder/OWNER+REPOSITORY     # for those of benches/mitsuba_public.txt
    peers/bin/python benches/mitsuba_public.py folder [--only NAME] [--results results.json]

STRIDE names the program; it is target/release/stride otherwise. benches/mitsuba_public.txt lists the scenes: repository,
commit, path. Of scenes that are equal to the byte one counts. Files that a checkout lacks have stand-ins (a tetrahedron, a
grey picture): such a scene is read, but not rendered.

A scene is in scope if each of its parts has a counterpart, or is rendered as another model that Mitsuba can render too
(CHANGES in mitsuba_peer.py). Film, sampler, and the integrator around or in place of a path tracer are those of the
comparison. Each program renders 16 pictures of 64 x 48 pixels with 16 seeds, by the first sensor; a margin of 4 pixels is
left out, where filters treat the border of the film differently.

  means    Welch's t-test of the mean of each channel;
  tiles    the same of tiles of 8 x 8 pixels, all channels added up;
  +2%      means of pictures that are 2% too bright, which must fail. A scene in which it passes is too noisy for a verdict.

The level is 0.01 after Sidak's correction for all listed scenes, both tests, and all tiles or channels. Samples are added
until the difference of means has a standard error of 0.25%, or --longest seconds are over. The exit code is 1 if a scene
fails, is not rendered, or is not where it should be.
"""

import argparse
import collections
import hashlib
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
import zlib

import numpy as np

from mitsuba_peer import OfMitsuba, change_for
from welch import LEVEL, REPLICATES, least, moments, read, sidak, tiles, welch

STRIDE = os.environ.get("STRIDE", "target/release/stride")
WIDTH, HEIGHT, MARGIN = 64, 48, 4
ENOUGH = 0.0025
OBJECTS = set("shape bsdf texture emitter sensor film rfilter sampler integrator medium phase volume".split())
# What a film says of its pixels.
SIDES = {"width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y"}
# What has no counterpart, but does not matter to the pictures that are compared: the copies have axes of unit length.
OF_THE_JUDGE = re.compile(
    r'^(film|sampler|integrator|rfilter) "|" of (film|sampler|integrator) "|^hide_emitters |^an axis of a rotation '
)
DEFINES = {"spp": "16", "integrator": "path"}


class Scene:
    """A scene file, the features in it, and a copy with the judge's film and stand-ins for files that are not there."""

    def __init__(self, path, folder):
        self.folder = folder
        self.features = collections.Counter()
        self.missing, self.defaults, self.lacks = [], set(), []
        self.copy = self.copied(path, [path.parent])
        self.path = self.copy if self.missing else path
        # Variables that a file leaves to the command line.
        self.defines = {name: value for name, value in DEFINES.items() if name == "spp" or name not in self.defaults}
        self.arguments = ["--allow-outside"]
        for name, value in self.defines.items():
            self.arguments += ["-D", f"{name}={value}"]

    def copied(self, path, folders):
        """A copy of a file, and of those that it includes, with whole paths."""
        tree = ElementTree.parse(path)
        for element in tree.iter("path"):
            element.set("value", str((path.parent / element.get("value")).resolve()))
            folders.append(pathlib.Path(element.get("value")))
        for element in tree.iter():
            if element.tag == "default":
                self.defaults.add(element.get("name"))
            if element.tag in OBJECTS and element.get("type"):
                self.features[f"{element.tag} {element.get('type')}"] += 1
            if element.tag == "rotate":
                normalise(element)
            if element.tag == "film":
                for child in [child for child in element if child.get("name") in SIDES]:
                    element.remove(child)
                for name, value in (("width", WIDTH), ("height", HEIGHT)):
                    element.append(ElementTree.Element("integer", {"name": name, "value": str(value)}))
            key = "filename" if element.tag in ("include", "spectrum") else "value"
            name = element.get(key)
            named = element.tag == "string" and element.get("name") == "filename" or key == "filename"
            if not named or not name or "$" in name:
                continue
            found = self.find(name, [path.parent, *folders])
            if found is None:
                self.missing.append(name)
                found = stand_in(name, self.folder)
            elif element.tag == "include":
                found = self.copied(found, folders)
            element.set(key, str(found.resolve()))
        copy = self.folder / f"{hashlib.sha256(str(path).encode()).hexdigest()[:16]}.xml"
        tree.write(copy)
        return copy

    @staticmethod
    def find(name, folders):
        """The file of a name, if it is there and not a pointer of Git LFS."""
        for folder in folders:
            path = folder / name
            if path.is_file():
                with path.open("rb") as file:
                    return None if file.read(11) == b"version htt" else path
        return None


def normalise(rotation):
    """Gives the axis of a rotation unit length, which Mitsuba does not do."""
    axis = [rotation.get(name, "0") for name in "xyz"]
    if rotation.get("value"):
        axis = re.split(r"[\s,]+", rotation.get("value").strip())
    if any("$" in number for number in axis):
        return
    axis = np.array(axis if len(axis) == 3 else axis * 3, float)
    length = np.linalg.norm(axis)
    if length > 0:
        rotation.attrib.pop("value", None)
        for name, number in zip("xyz", axis / length):
            rotation.set(name, repr(float(number)))


def stand_in(name, folder):
    suffix = pathlib.PurePath(name).suffix.lower()
    path = folder / f"stand-in{suffix}"
    corners, faces = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    if suffix == ".obj":
        lines = ["v {} {} {}".format(*corner) for corner in corners]
        path.write_text("\n".join(lines + ["f {} {} {}".format(*(i + 1 for i in face)) for face in faces]) + "\n")
    elif suffix == ".ply":
        header = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(f"property float {axis}\n" for axis in "xyz")
        lines = ["{} {} {}".format(*corner) for corner in corners] + ["3 {} {} {}".format(*face) for face in faces]
        path.write_text(header + "element face 4\nproperty list uchar int vertex_indices\nend_header\n" + "\n".join(lines) + "\n")
    elif suffix == ".serialized":
        points = b"".join(struct.pack("<3f", *corner) for corner in corners)
        body = struct.pack("<I", 0x1000) + b"\0" + struct.pack("<QQ", 4, 4) + points
        body += b"".join(struct.pack("<3I", *face) for face in faces)
        # The same mesh under many numbers.
        path.write_bytes(struct.pack("<HH", 0x041C, 4) + zlib.compress(body) + struct.pack("<64QI", *[0] * 64, 64))
    elif suffix == ".exr":
        import OpenEXR

        pixels = np.full((2, 4, 3), 0.5, np.float32)
        OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"RGB": pixels}).write(str(path))
    elif suffix == ".hdr":
        path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + bytes([128, 128, 128, 128]) * 8)
    else:
        # Readers look at what is in a file, not at its name.
        rows = b"".join(b"\0" + b"\x80" * 12 for _ in range(4))
        chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        png = chunk(b"IHDR", struct.pack(">IIBBBBB", 4, 4, 8, 2, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows))
        path = folder / "stand-in.png"
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + png + chunk(b"IEND", b""))
    return path


def checked(scene):
    """What has no counterpart, or none and the error."""
    found = subprocess.run([STRIDE, "check", *scene.arguments, str(scene.path)], capture_output=True, text=True)
    if found.returncode:
        return None, found.stderr.strip()
    lines = (found.stdout + found.stderr).splitlines()
    lacks = [line for line in lines if " has no counterpart" in line]
    return [re.sub(r"^(warning: )?.*?:\d+:\d+: ", "", line).split(" has no counterpart")[0] for line in lacks], None


def of_stride(scene, samples, folder):
    pictures, out = [], folder / "picture.exr"
    for seed in range(REPLICATES):
        command = [STRIDE, "render", str(scene.copy), *scene.arguments, "-o", str(out), "--headless", "--quiet"]
        subprocess.run([*command, "--spp", str(samples), "--seed", str(seed + 1), "--sampler", "independent"], check=True)
        pictures.append(read(out))
    return pictures


def inner(pictures):
    return [picture[MARGIN:-MARGIN, MARGIN:-MARGIN] for picture in pictures]


def compare(ours, theirs, tests):
    means = lambda pictures: moments([picture.mean((0, 1)) for picture in pictures])
    p = welch(means(ours), means(theirs))
    of_tiles = welch(moments([tiles(p) for p in ours]), moments([tiles(p) for p in theirs]))
    enough = lambda p: least(p) > sidak(LEVEL, tests * max(1, len(p)))
    return {"means": enough(p), "p": least(p), "tiles": enough(of_tiles), "p_tiles": least(of_tiles)}


def judge(scene, tests, longest, folder):
    mitsuba = OfMitsuba(scene.copy, scene.lacks, (WIDTH, HEIGHT), **scene.defines)
    samples = 16
    while True:
        began = time.monotonic()
        ours, theirs = inner(of_stride(scene, samples, folder)), inner(mitsuba.pictures(samples, REPLICATES))
        took = time.monotonic() - began
        of_means = [moments([picture.mean((0, 1)) for picture in pictures]) for pictures in (ours, theirs)]
        error = np.sqrt(of_means[0][1] + of_means[1][1])
        error = float(np.max(error / np.maximum(np.maximum(of_means[0][0], of_means[1][0]), 1e-12)))
        more = min((error / ENOUGH) ** 2 * 1.3, longest / took)
        if error <= ENOUGH or more < 1.5:
            break
        samples = int(samples * more)
    row = {"differences": sorted(set(mitsuba.differences)), "samples": samples, "error": error}
    row["ours"] = np.mean(ours, (0, 1, 2)).tolist()
    row["theirs"] = np.mean(theirs, (0, 1, 2)).tolist()
    row |= compare(ours, theirs, tests)
    row["caught"] = not compare([1.02 * picture for picture in ours], theirs, tests)["means"]
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--only", default="", help="scenes whose names contain this")
    parser.add_argument("--results", type=pathlib.Path, help="where results are kept: those that are there stay as they are")
    parser.add_argument("--parse", action="store_true", help="read the scenes, and render none")
    parser.add_argument("--longest", type=float, default=60, help="more samples are taken for at most so many seconds")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no scene after this time")
    options = parser.parse_args()
    began = time.monotonic()

    listed = [line.split(None, 2) for line in pathlib.Path(__file__).with_suffix(".txt").read_text().splitlines()]
    results = json.loads(options.results.read_text()) if options.results and options.results.exists() else {}
    features, lacking, seen = collections.Counter(), collections.Counter(), {}
    count = collections.Counter()
    failed, in_scope = False, []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for repository, _, path in listed:
            name = f"{repository}/{path}"
            file = options.folder / repository.replace("/", "+") / path
            if options.only not in name:
                continue
            if not file.exists():
                print(f"{name}: not there")
                failed = True
                continue
            same = seen.setdefault(hashlib.sha256(file.read_bytes() + str(file.parent.name).encode()).digest(), name)
            if same != name:
                print(f"{name}: the same as {same}")
                continue
            scene = Scene(file, folder)
            count["files"] += 1
            count["stand-ins"] += bool(scene.missing)
            lacks, error = checked(scene)
            if error is not None:
                print(f"{name}: refused: {error}")
                count["refused"] += 1
                continue
            count["parsed"] += 1
            features.update(scene.features.keys())
            lacking.update(set(lacks))
            scene.lacks = [lack for lack in lacks if change_for(lack)]
            strange = [lack for lack in lacks if not OF_THE_JUDGE.search(lack) and not change_for(lack)]
            if strange:
                print(f"{name}: out of scope: {'; '.join(strange)}")
            elif scene.missing:
                count["whole but for files"] += 1
                print(f"{name}: read only: {len(scene.missing)} files are not there, {scene.missing[0]} first")
            else:
                in_scope.append((name, scene))

        print("\nfeature: files with it")
        for feature, number in features.most_common():
            print(f"  {feature}: {number}")
        print("without a counterpart: files with it")
        for lack, number in lacking.most_common():
            print(f"  {lack}: {number}")
        print(f"\n{dict(count)}, {len(in_scope)} in scope\n")
        if options.parse:
            return
        print(f"{'scene':70} {'samples':>8} {'error':>6} {'means':>5} {'tiles':>5} {'+2%':>5} {'ratio':>7}")
        for name, scene in in_scope:
            if name not in results:
                if time.monotonic() - began > options.seconds:
                    continue
                try:
                    results[name] = judge(scene, 2 * len(listed), options.longest, folder)
                except Exception as error:
                    results[name] = {"error": f"Mitsuba: {error}"}
                if options.results:
                    options.results.write_text(json.dumps(results, indent=1) + "\n")
            row = results[name]
            if "means" not in row:
                print(f"{name[-70:]:70} {row['error'].splitlines()[-1][:100]}", flush=True)
                continue
            ratio = sum(row["ours"]) / max(sum(row["theirs"]), 1e-12)
            word = lambda passes: "pass" if passes else "FAIL"
            print(
                f"{name[-70:]:70} {row['samples']:8} {row['error']:6.2%} {word(row['means']):>5} {word(row['tiles']):>5}"
                f" {word(not row['caught']):>5} {ratio:7.4f}  {'; '.join(row['differences'])}",
                flush=True,
            )
    judged = {name: results[name] for name, _ in in_scope if "means" in results.get(name, {})}
    good = [name for name, row in judged.items() if row["means"] and row["tiles"]]
    caught = [name for name, row in judged.items() if row["caught"]]
    print(f"\n{len(judged)} rendered, {len(good)} pass, the planted error is caught in {len(caught)}")
    sys.exit(failed or len(good) < len(judged) or len(judged) < len(in_scope))


if __name__ == "__main__":
    main()
