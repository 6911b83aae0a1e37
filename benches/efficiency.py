#!/usr/bin/env python3
"""Efficiency of stride and of Mitsuba 3 on three scenes: the first table of docs/measurements.md.

    PYTHON benches/efficiency.py                                   # stride on all scenes
    PYTHON benches/efficiency.py --peers stride,llvm_ad_rgb,scalar_rgb --scenes room --threads 2

PYTHON has numpy and OpenEXR, as target/python/bin/python has after ./test; for variants of Mitsuba also `mitsuba`, and
LLVM for llvm_ad_rgb. STRIDE is the program, target/release/stride by default. Measure on a quiet machine.

All render the same scene with a box filter and eight path segments, twice with different seeds. Variance is half the
squared difference of the two pictures, relative to the squared mean plus 0.01, averaged over all pixels and channels.
Efficiency is 1/(variance × seconds). It is also printed without the worst 0.5 % of pixels, because a few bright pixels
can decide the mean. Loading, compilation and a first render of Mitsuba's kernels are not part of the time.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time

import numpy as np

SEEDS = (11, 22)
DEPTH = 8  # path segments; stride counts bounces, one less


# The scenes: a camera and surfaces, each a shape, a material and an emission.


def camera(eye, forward, fov, near):
    return {"eye": eye, "forward": forward, "fov": fov, "near": near}


def matte(*reflectance):
    return ("matte", reflectance)


def quad(corner, u, v, material, emission=None):
    return ("quad", corner, u, v), material, emission


def sphere(centre, radius, material, emission=None):
    return ("sphere", centre, radius), material, emission


def box(low, high, left, right, floor, ceiling, back, front):
    """The inside of a box; sides without a material are left out."""
    (x, y, z), (a, b, c) = low, high
    w, h, d = a - x, b - y, c - z
    sides = [
        quad((x, y, c), (0, 0, -d), (0, h, 0), left),
        quad((a, y, z), (0, 0, d), (0, h, 0), right),
        quad((x, y, c), (w, 0, 0), (0, 0, -d), floor),
        quad((x, b, z), (w, 0, 0), (0, 0, d), ceiling),
        quad((x, y, z), (w, 0, 0), (0, h, 0), back),
        quad((a, y, c), (-w, 0, 0), (0, h, 0), front),
    ]
    return [side for side in sides if side[1]]


def smallpt():
    """Kevin Beason's box, with flat walls and the part of the lamp that is below the ceiling as a mesh."""
    white, black = matte(0.75, 0.75, 0.75), matte(0, 0, 0)
    walls = box((1, 0, 0), (99, 81.6, 170), matte(0.75, 0.25, 0.25), matte(0.25, 0.25, 0.75), white, white, white, black)
    balls = [
        sphere((27, 16.5, 47), 16.5, ("mirror", (0.999,) * 3)),
        sphere((73, 16.5, 78), 16.5, ("glass", (0.999,) * 3)),
    ]
    lamp = ("mesh", cap((50, 681.33, 81.6), 600, 81.6)), black, (12, 12, 12)
    view = camera((50, 52, 295.6), (0, -0.042612, -1), 2 * math.degrees(math.atan(0.5135 / 2)), 130)
    return view, [*walls, *balls, lamp]


def room():
    """scenes/room.toml."""
    white = matte(0.75, 0.75, 0.75)
    tiles = ("tiles", (0.8, 0.8, 0.8), (0.2, 0.2, 0.2), (12, 20))
    walls = box((-6, 0, -8), (6, 10, 12), matte(0.75, 0.15, 0.15), matte(0.15, 0.6, 0.15), tiles, white, white, white)
    balls = [
        sphere((-2.8, 1.8, -3), 1.8, ("mirror", (0.95,) * 3)),
        sphere((0.2, 1.2, 1.6), 1.2, matte(0.2, 0.4, 0.8)),
        sphere((3, 1.6, -1), 1.6, ("glass", (1, 1, 1))),
        sphere((0, 8, 0), 0.8, matte(0, 0, 0), (30, 28, 25)),
    ]
    return camera((0, 4.5, 11), (0, -1, -11), 45, 0), [*walls, *balls]


def mesh():
    """A box with a bumpy ball of 1.3 million triangles."""
    white = matte(0.73, 0.73, 0.73)
    walls = box((-1, 0, -1), (1, 2, 1), matte(0.63, 0.065, 0.05), matte(0.14, 0.45, 0.091), white, None, white, None)
    ceiling = [
        quad((-1, 2, -1), (2, 0, 0), (0, 0, 0.7), white),
        quad((-1, 2, 0.3), (2, 0, 0), (0, 0, 0.7), white),
        quad((-1, 2, -0.3), (0.7, 0, 0), (0, 0, 0.6), white),
        quad((0.3, 2, -0.3), (0.7, 0, 0), (0, 0, 0.6), white),
        quad((-0.3, 2, -0.3), (0.6, 0, 0), (0, 0, 0.6), matte(0, 0, 0), (17, 14, 10)),
    ]
    ball = ("mesh", blob()), matte(0.6, 0.55, 0.5), None
    return camera((0, 1, 3.9), (0, 0, -1), 39, 0), [*walls, *ceiling, ball]


SCENES = {"smallpt": smallpt, "room": room, "mesh": mesh}


def cap(centre, radius, top, rings=2, segments=48):
    """The part of a sphere below a height, as vertices and triangles that face outwards."""
    angle = math.acos((centre[1] - top) / radius)
    vertices, triangles = [(0, -1, 0)], []
    for ring in range(1, rings + 1):
        t = angle * ring / rings
        around = [2 * math.pi * i / segments for i in range(segments)]
        vertices += [(math.sin(t) * math.cos(p), -math.cos(t), math.sin(t) * math.sin(p)) for p in around]
    for i in range(segments):
        j = (i + 1) % segments
        triangles.append((0, 1 + i, 1 + j))
        for ring in range(rings - 1):
            inner, outer = 1 + ring * segments, 1 + (ring + 1) * segments
            triangles += [(inner + i, outer + i, outer + j), (inner + i, outer + j, inner + j)]
    return np.array(vertices) * radius + centre, np.array(triangles)


def blob(levels=8):
    """A sphere with bumps of seven octaves, as vertices and 20·4ⁿ triangles."""
    t = (1 + 5**0.5) / 2
    vertices = np.array(
        [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t)]
        + [(0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    )
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    triangles = np.array(
        [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
        + [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10)]
        + [(8, 6, 7), (9, 8, 1)]
    )
    for _ in range(levels):
        edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        edges, index = np.unique(edges, axis=0, return_inverse=True)
        middles = vertices[edges[:, 0]] + vertices[edges[:, 1]]
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        ab, bc, ca = index.reshape(3, -1) + len(vertices)
        vertices = np.vstack([vertices, middles])
        a, b, c = triangles.T
        corners = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = np.vstack([np.stack(corner, axis=1) for corner in corners])
    random = np.random.default_rng(7)
    height, amplitude, frequency = np.zeros(len(vertices)), 0.16, 2.2
    for _ in range(7):
        for _ in range(4):
            wave = random.normal(size=3)
            wave *= frequency / np.linalg.norm(wave)
            height += amplitude / 4 * np.sin(vertices @ wave * np.pi + random.uniform(0, 2 * np.pi))
        amplitude *= 0.55
        frequency *= 2.05
    return vertices * (0.6 * (1 + height))[:, None] + (0, 0.85, -0.05), triangles


def write_ply(path, vertices, triangles):
    rows = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    with open(path, "wb") as file:
        header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        header += "".join(f"property float {axis}\n" for axis in "xyz")
        header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
        file.write(header.encode() + vertices.astype("<f4").tobytes() + rows.tobytes())


# The programs: each renders a scene with a seed, and returns the picture and the seconds.


def toml(scene, folder):
    """The scene as stride's TOML."""
    view, surfaces = scene
    numbers = lambda values: str([float(value) for value in values])
    text = f"""[film]
filter = "box"
[camera]
eye = {numbers(view["eye"])}
forward = {numbers(view["forward"])}
up = [0, 1, 0]
vertical_fov = {view["fov"]}
near = {float(view["near"])}
"""
    entities = ""
    for i, (shape, material, emission) in enumerate(surfaces):
        kind, *values = material
        if kind == "tiles":
            even, odd, checks = values
            for name, colour in (("even", even), ("odd", odd)):
                text += f'[materials.{name}{i}]\ntype = "matte"\nreflectance = {numbers(colour)}\n'
            keys = f'type = "checkerboard"\neven = "even{i}"\nodd = "odd{i}"\nchecks_per_unit = {numbers(checks)}'
        elif kind == "glass":
            keys = f'type = "glass"\nior = 1.5\nreflectance = {numbers(values[0])}\ntransmittance = {numbers(values[0])}'
        else:
            keys = f'type = "{kind}"\nreflectance = {numbers(values[0])}'
        text += f"[materials.m{i}]\n{keys}\n"
        if shape[0] == "quad":
            keys = 'type = "quad", corner = {}, u = {}, v = {}'.format(*map(numbers, shape[1:]))
        elif shape[0] == "sphere":
            keys = f'type = "sphere", center = {numbers(shape[1])}, radius = {float(shape[2])}'
        else:
            write_ply(os.path.join(folder, f"{i}.ply"), *shape[1])
            keys = f'type = "mesh", file = "{i}.ply"'
        entities += f'[[entities]]\nshape = {{ {keys} }}\nmaterial = "m{i}"\n'
        entities += f"emission = {numbers(emission)}\n" if emission else ""
    path = os.path.join(folder, "scene.toml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(text + entities)
    return path


def read_exr(path):
    import OpenEXR

    channels = OpenEXR.File(path).channels()
    if "RGB" in channels:
        return np.asarray(channels["RGB"].pixels, np.float64)
    return np.stack([np.asarray(channels[name].pixels, np.float64) for name in "RGB"], axis=-1)


def stride(scene, settings, folder):
    path = toml(scene, folder)
    picture, stats = os.path.join(folder, "picture.exr"), os.path.join(folder, "stats.json")
    program = os.environ.get("STRIDE", "target/release/stride")

    def render(seed):
        command = [program, "render", path, "--headless", "--quiet", "--size", settings.size, "--spp", str(settings.spp)]
        command += ["--threads", str(settings.threads), "--max-depth", str(DEPTH - 1), "--seed", str(seed)]
        subprocess.run([*command, "-o", picture, "--stats", stats], check=True)
        with open(stats, encoding="utf-8") as file:
            return read_exr(picture), json.load(file)["seconds"]

    return render


def mitsuba(variant):
    def prepare(scene, settings, folder):
        import drjit
        import mitsuba as mi

        mi.set_variant(variant)
        drjit.set_thread_count(settings.threads)
        view, surfaces = scene
        rgb = lambda values: {"type": "rgb", "value": [float(value) for value in values]}
        transform = mi.ScalarTransform4f
        eye, forward = np.array(view["eye"], float), np.array(view["forward"], float)
        width, height = map(int, settings.size.split("x"))

        def bsdf(kind, *values):
            if kind == "matte":
                return {"type": "diffuse", "reflectance": rgb(values[0])}
            if kind == "mirror":
                return {"type": "conductor", "material": "none", "specular_reflectance": rgb(values[0])}
            if kind == "glass":
                tints = {"specular_reflectance": rgb(values[0]), "specular_transmittance": rgb(values[0])}
                return {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0, **tints}
            even, odd, (across, up) = values
            checks = {"type": "checkerboard", "color0": rgb(even), "color1": rgb(odd)}
            checks["to_uv"] = transform().scale([across / 2, up / 2, 1])
            return {"type": "diffuse", "reflectance": checks}

        def place(shape, i):
            if shape[0] == "quad":
                corner, u, v = (np.array(vector, float) for vector in shape[1:])
                normal = np.cross(u, v)
                matrix = np.eye(4)
                columns = [u / 2, v / 2, normal / np.linalg.norm(normal), corner + (u + v) / 2]
                matrix[:3] = np.stack(columns, axis=1)
                return {"type": "rectangle", "to_world": transform(matrix.tolist())}
            if shape[0] == "sphere":
                return {"type": "sphere", "center": list(shape[1]), "radius": shape[2]}
            path = os.path.join(folder, f"{i}.ply")
            write_ply(path, *shape[1])
            return {"type": "ply", "filename": path, "face_normals": True}

        film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
        film |= {"pixel_format": "rgb", "component_format": "float32"}
        look_at = transform().look_at(origin=eye.tolist(), target=(eye + forward).tolist(), up=[0, 1, 0])
        sensor = {"type": "perspective", "fov": view["fov"], "fov_axis": "y", "to_world": look_at, "film": film}
        sensor |= {"near_clip": max(view["near"], 0.01), "far_clip": 1e5, "sampler": {"type": "independent"}}
        parts = {"type": "scene", "integrator": {"type": "path", "max_depth": DEPTH}, "sensor": sensor}
        for i, (shape, material, emission) in enumerate(surfaces):
            parts[f"shape{i}"] = {**place(shape, i), "bsdf": bsdf(*material)}
            if emission:
                parts[f"shape{i}"]["emitter"] = {"type": "area", "radiance": rgb(emission)}
        loaded = mi.load_dict(parts)
        # Compiles the kernels.
        np.array(mi.render(loaded, spp=settings.spp if "llvm" in variant else 1, seed=1000))

        def render(seed):
            start = time.perf_counter()
            picture = np.array(mi.render(loaded, spp=settings.spp, seed=seed))
            return picture[..., :3].astype(np.float64), time.perf_counter() - start

        return render

    return prepare


def main():
    parser = argparse.ArgumentParser(formatter_class=argparse.RawDescriptionHelpFormatter, description=__doc__)
    parser.add_argument("--peers", default="stride", help="stride, and variants of Mitsuba")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--threads", type=int, default=2)
    settings = parser.parse_args()
    width, height = map(int, settings.size.split("x"))
    unknown = [name for name in settings.scenes.split(",") if name not in SCENES]
    if unknown:
        sys.exit(f"no scene {unknown[0]}; the scenes are {', '.join(SCENES)}")
    for name in settings.scenes.split(","):
        for peer in settings.peers.split(","):
            with tempfile.TemporaryDirectory() as folder:
                prepare = stride if peer == "stride" else mitsuba(peer)
                render = prepare(SCENES[name](), settings, folder)
                (a, first), (b, second) = (render(seed) for seed in SEEDS)
            seconds = (first + second) / 2
            mean = (a + b) / 2
            errors = np.sort(((a - b) ** 2 / 2 / (mean**2 + 0.01)).mean(axis=-1).ravel())
            rate = width * height * settings.spp / seconds / 1e6
            every, most = (1 / (part.mean() * seconds) for part in (errors, errors[: int(len(errors) * 0.995)]))
            figures = f"{seconds:6.2f} s {rate:6.2f} Msamples/s  efficiency {every:7.1f}  without the worst {most:7.1f}"
            colour = " ".join(f"{channel:.4f}" for channel in mean.mean(axis=(0, 1)))
            print(f"{name:8} {peer:12} {figures}  mean {colour}", flush=True)


main()
