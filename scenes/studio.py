#!/usr/bin/env python3
"""Makes the files of studio.toml: studio.exr, the soft boxes of a photographer's studio as an equirectangular picture, and
studio.ply, the paper that runs from the floor up behind the objects. It needs nothing but Python, and says how large
they are.

    python3 scenes/studio.py
"""

import math
import struct
import sys
import zlib
from pathlib import Path

WIDTH, HEIGHT = 512, 256

# Azimuth from +x to +y and elevation of the middle in degrees; half the width and height as seen from one unit away; the
# share of them over which an edge falls off; radiance.
BOXES = [
    # The key light: large and warm, from the front left.
    (-140, 32, 0.46, 0.36, 0.10, (5.2, 4.8, 4.2)),
    # A tall strip at the right, cool, which draws the edge of what is round.
    (-22, 26, 0.10, 0.62, 0.12, (4.6, 5.0, 5.6)),
    # A narrow one at the left, nearly behind.
    (164, 24, 0.06, 0.50, 0.15, (3.6, 3.5, 3.4)),
    # Over the table.
    (-90, 82, 0.60, 0.34, 0.20, (2.0, 2.0, 2.0)),
    # A white reflector beside the camera.
    (-68, 8, 0.30, 0.26, 0.30, (0.55, 0.54, 0.52)),
]


def direction(azimuth, elevation):
    a, e = math.radians(azimuth), math.radians(elevation)
    return (math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)


def edge(x, half, soft):
    """1 within, 0 outside, smooth over the edge."""
    t = min(max((1 - abs(x) / half) / soft, 0.0), 1.0)
    return t * t * (3 - 2 * t)


def studio():
    """Rows of texels, the uppermost first."""
    boxes = []
    for azimuth, elevation, half_width, half_height, soft, radiance in BOXES:
        middle = direction(azimuth, elevation)
        right = unit(cross(middle, (0, 0, 1)))
        boxes.append((middle, right, cross(right, middle), half_width, half_height, soft, radiance))
    rows = []
    for y in range(HEIGHT):
        polar = math.pi * (y + 0.5) / HEIGHT
        row = []
        for x in range(WIDTH):
            azimuth = 2 * math.pi * (0.5 - (x + 0.5) / WIDTH)
            d = (math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar))
            # A dark room, a little lighter above.
            room = 0.045 + 0.03 * max(d[2], 0)
            texel = [room, room, 1.05 * room]
            for middle, right, up, half_width, half_height, soft, radiance in boxes:
                ahead = dot(d, middle)
                if ahead <= 0:
                    continue
                s, t = dot(d, right) / ahead, dot(d, up) / ahead
                cover = edge(s, half_width, soft) * edge(t, half_height, soft)
                # The lamp inside shows a little in the middle of the cloth.
                glow = 0.8 + 0.2 * math.exp(-2 * ((s / half_width) ** 2 + (t / half_height) ** 2))
                texel = [own * (1 - cover) + cover * glow * c for own, c in zip(texel, radiance)]
            row.append(texel)
        rows.append(row)
    return rows


def attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def zipped(data):
    """The ZIP compression of OpenEXR: even bytes before odd ones, each as its difference from the last."""
    data = data[0::2] + data[1::2]
    differences = bytes([data[0]]) + bytes((b - a + 128) & 255 for a, b in zip(data, data[1:]))
    packed = zlib.compress(differences, 9)
    return packed if len(packed) < len(data) else None


def exr(rows):
    """An OpenEXR file of half floats."""
    height, width = len(rows), len(rows[0])
    channels = b"".join(name + b"\0" + struct.pack("<iiii", 1, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute("channels", "chlist", channels) + attribute("compression", "compression", b"\3")
    header += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    header += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    blocks = []
    for first in range(0, height, 16):
        data = b"".join(
            struct.pack(f"<{width}e", *(texel[channel] for texel in row))
            for row in rows[first : first + 16]
            for channel in (2, 1, 0)
        )
        data = zipped(data) or data
        blocks.append(struct.pack("<ii", first, len(data)) + data)
    offsets, at = [], len(header) + 8 * len(blocks)
    for block in blocks:
        offsets.append(at)
        at += len(block)
    return header + struct.pack(f"<{len(offsets)}Q", *offsets) + b"".join(blocks)


def paper():
    """A PLY file of a floor that bends into a wall, with the normals of a smooth surface."""
    left, right, front, back, top, radius, steps = -9.0, 9.0, -6.0, 4.5, 7.0, 2.5, 24
    profile = [(front, 0.0, 0.0, 1.0)]
    for i in range(steps + 1):
        a = math.pi / 2 * i / steps
        y, z = back - radius + radius * math.sin(a), radius - radius * math.cos(a)
        profile.append((y, z, -math.sin(a), math.cos(a)))
    profile.append((back, top, -1.0, 0.0))
    vertices = [f"{x:g} {y:.6g} {z:.6g} 0 {ny:.6g} {nz:.6g}" for y, z, ny, nz in profile for x in (left, right)]
    faces = [f"4 {2 * i} {2 * i + 1} {2 * i + 3} {2 * i + 2}" for i in range(len(profile) - 1)]
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(header + vertices + faces) + "\n"


folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
for name, content in (("studio.exr", exr(studio())), ("studio.ply", paper().encode())):
    (folder / name).write_bytes(content)
    print(f"{folder / name}: {len(content)} bytes")
