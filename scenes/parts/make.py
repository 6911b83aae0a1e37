#!/usr/bin/env python3
"""Makes the meshes and pictures of perfume.toml and clock.toml, in the folder that it lies in: make.py. Needs Python 3 and
NumPy. Everything is computed from formulas and numbers drawn with fixed seeds; z is up."""
import os
import struct
import zlib

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def keep_mesh(name, positions, normals, uv, triangles):
    """A binary PLY file with 16-bit indices."""
    assert len(positions) < 65536
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\n"
    header += "".join(f"property float {x}\n" for x in ("x", "y", "z", "nx", "ny", "nz", "u", "v"))
    header += f"element face {len(triangles)}\nproperty list uchar ushort vertex_indices\nend_header\n"
    vertices = np.concatenate([positions, normals, uv], 1).astype("<f4")
    faces = np.zeros(len(triangles), [("n", "u1"), ("corners", "<u2", 3)])
    faces["n"], faces["corners"] = 3, triangles
    with open(os.path.join(HERE, name), "wb") as file:
        file.write(header.encode() + vertices.tobytes() + faces.tobytes())


def keep_picture(name, picture):
    """A PNG file of 8 bits: grey or RGB, values 0 to 1."""
    picture = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    height, width = picture.shape[:2]
    rows = picture.reshape(height, -1).astype(np.int16)
    # Each row as its difference from the one above, which packs smooth pictures well.
    rows[1:] = rows[1:] - rows[:-1]
    data = b"".join(b"\2" + row.astype(np.uint8).tobytes() for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">2I5B", width, height, 8, 2 if picture.ndim == 3 else 0, 0, 0, 0)
    with open(os.path.join(HERE, name), "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(data, 9)) + chunk(b"IEND", b""))


def rounded(points, steps=6):
    """An outline of (radius, height, rounding): corners are replaced by arcs of a circle of that radius. Gives its points
    and, at each, the normal to the right of the way; a corner without rounding is two points, so that it stays sharp."""
    points = [np.array(p, float) for p in points]
    out, normals = [], []

    def add(at, direction):
        out.append(at)
        normals.append(np.array([direction[1], -direction[0]]))

    for i, p in enumerate(points):
        before = points[i - 1][:2] if i > 0 else None
        after = points[i + 1][:2] if i + 1 < len(points) else None
        at = p[:2]
        come = (at - before) / np.linalg.norm(at - before) if before is not None else None
        go = (after - at) / np.linalg.norm(after - at) if after is not None else None
        if come is None or go is None:
            add(at, go if come is None else come)
            continue
        turn = np.arctan2(come[0] * go[1] - come[1] * go[0], come @ go)
        if p[2] == 0 or abs(turn) < 1e-6:
            add(at, come)
            add(at, go)
            continue
        start = at - come * p[2] * np.tan(abs(turn) / 2)
        side = np.array([-come[1], come[0]]) * np.sign(turn)
        centre = start + side * p[2]
        for k in range(steps + 1):
            a = turn * k / steps
            rotation = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
            add(centre - rotation @ (side * p[2]), rotation @ come)
    return np.array(out), np.array(normals)


def swept(outline, curve):
    """A surface of an outline of points and normals (radius, height): at each height, the curve of that radius. Outward is
    to the right of the outline."""
    points, normals = outline
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    positions, directions, uv, triangles = [], [], [], []
    for (radius, height), normal, v in zip(points, normals, length / length[-1]):
        xy, across = curve(radius)
        n = len(xy)
        positions.append(np.column_stack([xy, np.full(n, height)]))
        directions.append(np.column_stack([across * normal[0], np.full(n, normal[1])]))
        uv.append(np.column_stack([np.arange(n) / (n - 1), np.full(n, v)]))
    for i in range(len(points) - 1):
        for k in range(n - 1):
            a, b = i * n + k, (i + 1) * n + k
            triangles += [[a, a + 1, b + 1], [a, b + 1, b]]
    positions, directions, triangles = np.concatenate(positions), np.concatenate(directions), np.array(triangles)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # Where the surface closes, triangles have no area.
    sides = positions[triangles[:, 1:]] - positions[triangles[:, :1]]
    has_area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) > 1e-9
    return positions, directions, np.concatenate(uv), triangles[has_area]


def cos_sin(angles):
    """Rounded, so that angles that mirror each other or are a turn apart have the same to the bit: surfaces close."""
    return np.round(np.cos(angles), 12) + 0.0, np.round(np.sin(angles), 12) + 0.0


def circle(segments):
    across = np.column_stack(cos_sin(2 * np.pi * np.arange(segments + 1) / segments))
    return lambda radius: (across * radius, across)


def rectangle(half_x, half_y, rounding, steps=8):
    """A rectangle with round corners. Its radius is one, and less by what it is drawn in."""
    angles = np.concatenate([np.pi / 2 * (corner + np.arange(steps + 1) / steps) for corner in range(4)] + [[2 * np.pi]])
    across = np.column_stack(cos_sin(angles))
    corner = np.repeat([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]], [steps + 1] * 4 + [1], axis=0)

    def curve(radius):
        half = np.maximum(np.array([half_x, half_y]) - (1 - radius), 0)
        r = min(max(rounding - (1 - radius), 0), *half)
        return corner * (half - r) + across * r, across

    return curve


def noise(size, slope, seed, stretch=(1, 1)):
    """Gaussian noise that repeats, whose amplitude falls as the frequency to the power of −slope; of variance one.
    What it shows is drawn out by `stretch` along y and along x."""
    height, width = size
    y = np.fft.fftfreq(height)[:, None] * height * stretch[0]
    x = np.fft.fftfreq(width)[None, :] * width * stretch[1]
    frequency = np.hypot(x, y)
    frequency[0, 0] = np.inf
    spectrum = np.fft.fft2(np.random.default_rng(seed).standard_normal(size)) / frequency**slope
    picture = np.real(np.fft.ifft2(spectrum))
    return picture / picture.std()


def marble():
    """0 where there are veins, 1 in between."""
    size = (320, 448)
    fine = noise(size, 1.9, 1)
    veins = np.abs(noise(size, 1.7, 2) + 0.35 * fine)
    thin = np.abs(noise(size, 1.55, 3) + 0.2 * fine)
    picture = 1 - 0.75 * np.exp(-veins * 9) - 0.35 * np.exp(-thin * 22) + 0.05 * fine
    return np.round(np.clip(picture * 0.9, 0, 1) * 96) / 96


def softbox():
    """A cloth that is lit from behind: brightest in the middle, soft at the edges."""
    x = np.abs((np.arange(48) + 0.5) / 24 - 1)
    edge = np.clip((1 - x) / 0.12, 0, 1) ** 2
    glow = 1 - 0.45 * (x[:, None] ** 2 + x**2)
    return glow * edge[:, None] * edge


def cove():
    """A floor that goes over into a wall, 60 wide: nothing behind the things but a soft gradient."""
    outline = rounded([(-30, 0, 0), (14, 0, 9), (14, 40, 0)], 24)
    (points, normals), n = outline, len(outline[0])
    positions = [(x, y, z) for y, z in points for x in (-30, 30)]
    directions = [(0, -across, -up) for across, up in normals for _ in range(2)]
    uv = [(x, i / (n - 1)) for i in range(n) for x in (0, 1)]
    triangles = [t for i in range(n - 1) for a in [2 * i] for t in ([a, a + 1, a + 3], [a, a + 3, a + 2])]
    return np.array(positions, float), np.array(directions), np.array(uv), np.array(triangles)


def perfume():
    """A bottle of thick glass, what is in it, and its cap. Outlines are drawn in from the walls, at which they are 1."""
    body, hollow, cap = rectangle(2.6, 1.45, 0.55), rectangle(2.1, 0.98, 0.4), rectangle(1.05, 1.05, 0.3)
    keep_mesh("bottle.ply", *swept(rounded([(-1.6, 0, 0), (1, 0, 0.22), (1, 6.2, 0.5), (-1.6, 6.2, 0)], 5), body))
    keep_mesh("liquid.ply", *swept(rounded([(-1.1, 1, 0), (1, 1, 0.38), (1, 4.6, 0)], 5), hollow))
    keep_mesh("surface.ply", *swept(rounded([(1, 4.6, 0), (-1.1, 4.6, 0)]), hollow))
    keep_mesh("air.ply", *swept(rounded([(1, 4.6, 0), (1, 5.5, 0.3), (-1.1, 5.5, 0)], 4), hollow))
    keep_mesh("cap.ply", *swept(rounded([(-0.05, 0, 0), (1, 0, 0.1), (1, 1.9, 0.16), (-0.05, 1.9, 0)], 3), cap))


def grain():
    """Six planks of wood along u: 0 is dark, 1 is light."""
    size, planks = (384, 512), 6
    height = size[0] // planks
    picture = np.empty(size)
    for plank in range(planks):
        rows = slice(plank * height, (plank + 1) * height)
        y = np.arange(height)[:, None] / height
        bend = noise((height, size[1]), 2.1, 20 + plank, (1, 5))
        fibres = noise((height, size[1]), 0.8, 40 + plank, (0.3, 14))
        rings = (y * (3.2 + plank % 3) + 0.5 * bend + 0.37 * plank) % 1
        shade = 0.55 + 0.22 * np.sin(plank * 2.6)
        picture[rows] = shade + 0.28 * (rings**3 - 0.3) + 0.07 * fibres
        picture[rows][:2], picture[rows][-1:] = 0.02, 0.1
    return np.round(np.clip(picture, 0, 1) * 80) / 80


def dial():
    """The face of a clock, on the square of side 2 about it."""
    n = 512
    y, x = np.meshgrid(1 - (np.arange(n) + 0.5) * 2 / n, (np.arange(n) + 0.5) * 2 / n - 1, indexing="ij")
    radius = np.hypot(x, y)

    def soft(distance):
        return np.clip(0.5 - distance * n / 2, 0, 1)

    def bars(count, near, far, width, skip=0):
        """Strokes along radii, at each of `count` equal angles, but for multiples of `skip`."""
        step = 2 * np.pi / count
        turn = np.arctan2(x, y)
        which = np.round(turn / step)
        along, across = radius * np.cos(turn - which * step), radius * np.sin(turn - which * step)
        ink = soft(np.maximum(np.abs(across) - width / 2, np.abs(along - (near + far) / 2) - (far - near) / 2))
        return ink * (which % skip != 0) if skip else ink

    ink = np.maximum(bars(60, 0.86, 0.91, 0.011, 5), bars(12, 0.72, 0.91, 0.035, 3))
    ink = np.maximum(ink, bars(4, 0.66, 0.91, 0.06))
    ink = np.maximum(ink, soft(np.abs(radius - 0.94) - 0.004))
    # A small dial of seconds.
    below = np.hypot(x, y + 0.36)
    turn = np.arctan2(x, y + 0.36)
    marks = np.abs((turn * 12 / (2 * np.pi) + 0.5) % 1 - 0.5) * below * 2 * np.pi / 12
    small = np.maximum(soft(np.abs(below - 0.21) - 0.0035), soft(np.maximum(marks - 0.005, np.abs(below - 0.185) - 0.02)))
    ink = np.maximum(ink, small)[..., None]
    paper = np.array([0.91, 0.88, 0.81]) * (1 - 0.035 * np.clip((0.21 - below) * n / 2 + 0.5, 0, 1))[..., None]
    return paper * (1 - ink) + np.array([0.07, 0.07, 0.085]) * ink


def plate(outline, thickness):
    """A flat piece of an outline of points (x, y), counter-clockwise and convex, from z = 0 up."""
    n, outline = len(outline), np.array(outline, float)
    positions, normals, triangles = [], [], []
    for z, up in ((thickness, 1), (0, -1)):
        first = len(positions)
        positions += [(x, y, z) for x, y in outline]
        normals += [(0, 0, up)] * n
        triangles += [[first, first + k, first + k + 1][::up] for k in range(1, n - 1)]
    for k in range(n):
        a, b = outline[k], outline[(k + 1) % n]
        side = np.array([b[1] - a[1], a[0] - b[0]]) / np.linalg.norm(b - a)
        first = len(positions)
        positions += [(*a, 0), (*b, 0), (*b, thickness), (*a, thickness)]
        normals += [(*side, 0)] * 4
        triangles += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return np.array(positions), np.array(normals, float), np.zeros((len(positions), 2)), np.array(triangles)


def clock():
    """A desk clock that lies on its back: its axis is z, its radius 3.1. And a vase, 7 high."""
    case = [(0, -1, 0), (2.75, -1, 0.4), (3.1, 0.1, 0.1), (3.1, 0.42, 0.14), (2.72, 0.42, 0.1), (2.62, 0.1, 0), (0, 0.05, 0)]
    keep_mesh("case.ply", *swept(rounded(case, 3), circle(80)))
    edge = 2 * np.pi * np.arange(64) / 64
    face = np.concatenate([[[0, 0]], np.column_stack([np.cos(edge), np.sin(edge)])])
    fan = np.array([[0, 1 + k, 1 + (k + 1) % 64] for k in range(64)])
    flat = np.column_stack([face * 2.66, np.full(65, 0.12)])
    keep_mesh("face.ply", flat, np.tile([0.0, 0, 1], (65, 1)), face / 2 + 0.5, fan)
    for name, time, width, length, z in (("hour", 10.15 / 12, 1.5, 1.4, 0.22), ("minute", 9 / 60, 1.2, 2.2, 0.3), ("second", 34 / 60, 0.35, 0.5, 0.16)):
        # A hand that tapers, of length one.
        outline = np.array([(-0.07, -0.22), (0.07, -0.22), (0.09, 0.1), (0.03, 1), (-0.03, 1), (-0.09, 0.1)]) * [width, length]
        c, s = cos_sin(-2 * np.pi * time)
        positions, normals, uv, triangles = plate(outline @ np.array([[c, s], [-s, c]]), 0.04)
        keep_mesh(f"{name}.ply", positions + [0, -0.36 * 2.66 if name == "second" else 0, z], normals, uv, triangles)
    outline = [(0, 0, 0), (1.25, 0, 0.25), (1.75, 2.3, 2.2), (0.55, 5, 2.5), (0.75, 7, 0.09), (0.6, 7, 0.09), (0.42, 5.2, 0), (0, 5.2, 0)]
    keep_mesh("vase.ply", *swept(rounded(outline, 5), circle(48)))


def window():
    """A wall with a window of four panes, which the sun must come through: 30 from the clock, across the way of its light."""
    way = np.array([0.62, 0.66, -0.43])
    way /= np.linalg.norm(way)
    right = np.array([way[1], -way[0], 0]) / np.hypot(way[0], way[1])
    up = np.cross(right, way)
    edges, heights = [-26, -5.6, -0.16, 0.16, 5.6, 26], [-26, -5, -0.16, 0.16, 5, 26]
    positions, triangles = [], []
    for i in range(5):
        for j in range(5):
            if i in (1, 3) and j in (1, 3):
                continue
            first = len(positions)
            corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
            positions += [[-1.6, 2, 4.4] - 30 * way + right * edges[k] + up * heights[l] for k, l in corners]
            triangles += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    n = len(positions)
    keep_mesh("window.ply", np.array(positions), np.tile(-way, (n, 1)), np.zeros((n, 2)), np.array(triangles))


if __name__ == "__main__":
    keep_picture("marble.png", marble())
    keep_picture("softbox.png", softbox())
    keep_mesh("cove.ply", *cove())
    keep_picture("grain.png", grain())
    keep_picture("dial.png", dial())
    perfume()
    clock()
    window()
