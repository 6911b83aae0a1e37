#!/usr/bin/env python3
"""Makes the meshes and pictures that the scenes in scenes/ read, by formula: a backdrop, a knot, textures and a sky.

    docs/pictures/inputs.py

The files are kept in the repository, so that the scenes render without this script. It needs Python 3 alone.
"""

import math
import os
import struct
import zlib

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes")


def write(name, data):
    with open(os.path.join(FOLDER, name), "wb") as file:
        file.write(data)


def ply(name, vertices, faces):
    """Vertices are (x, y, z, nx, ny, nz, u, v), faces lists of their indices."""
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {axis}" for axis in ("x", "y", "z", "nx", "ny", "nz", "u", "v")]
    header += [f"element face {len(faces)}", "property list uchar ushort vertex_indices", "end_header", ""]
    data = b"".join(struct.pack("<8f", *vertex) for vertex in vertices)
    data += b"".join(struct.pack(f"<B{len(face)}H", len(face), *face) for face in faces)
    write(name, "\n".join(header).encode() + data)


def normalised(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def backdrop():
    """A floor that curves up into a wall: no edge is seen where they meet."""
    near, far, radius, top, half = -14.0, 5.0, 4.0, 16.0, 20.0
    profile = [(near, 0.0, 0.0, 1.0)]
    for i in range(25):
        angle = math.pi / 2 * i / 24
        y, z = far - radius + radius * math.sin(angle), radius - radius * math.cos(angle)
        profile.append((y, z, -math.sin(angle), math.cos(angle)))
    profile.append((far, top, -1.0, 0.0))
    vertices, faces, v = [], [], 0.0
    for i, (y, z, ny, nz) in enumerate(profile):
        if i:
            v += math.hypot(y - profile[i - 1][0], z - profile[i - 1][1])
        vertices += [(x, y, z, 0.0, ny, nz, x, v) for x in (-half, half)]
    for i in range(len(profile) - 1):
        faces.append([2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2])
    ply("backdrop.ply", vertices, faces)


def knot(along=120, around=16):
    """A tube along a trefoil knot, standing upright and of radius 1."""

    def centre(t):
        ring = 0.62 + 0.25 * math.cos(1.5 * t)
        return [ring * math.cos(t), 0.27 * math.sin(1.5 * t), ring * math.sin(t)]

    vertices, faces = [], []
    for i in range(along + 1):
        t = 4 * math.pi * i / along
        here, ahead, behind = centre(t), centre(t + 1e-4), centre(t - 1e-4)
        tangent = normalised([a - b for a, b in zip(ahead, behind)])
        outward = normalised([here[0], 0, here[2]])
        side = normalised(cross(tangent, outward))
        up = cross(side, tangent)
        for j in range(around + 1):
            angle = 2 * math.pi * j / around
            n = [math.cos(angle) * a + math.sin(angle) * b for a, b in zip(up, side)]
            p = [c + 0.135 * x for c, x in zip(here, n)]
            # The seams have two uv and one position, so that the knot is closed.
            first = j == around and vertices[-around] or i == along and vertices[j]
            vertices.append((*(first[:6] if first else (*p, *n)), 12.0 * i / along, j / around))
    for i in range(along):
        for j in range(around):
            a, b = i * (around + 1) + j, (i + 1) * (around + 1) + j
            faces.append([a, a + 1, b + 1, b])
    ply("knot.ply", vertices, faces)


def png(name, width, height, pixel, channels=3):
    """An 8-bit PNG of `pixel(u, v)`, with u and v in 0…1 and (0, 0) at the lower left."""
    rows = bytearray()
    for y in range(height):
        rows.append(0)
        for x in range(width):
            colour = pixel((x + 0.5) / width, 1 - (y + 0.5) / height)
            rows += bytes(min(255, max(0, round(255 * c))) for c in colour)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 0, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows), 9))
    write(name, data + chunk(b"IEND", b""))


def smoothstep(a, b, x):
    t = min(1.0, max(0.0, (x - a) / (b - a)))
    return t * t * (3 - 2 * t)


def tile(u, v):
    """A glazed tile: quarter circles in the corners, a star in the middle."""
    x, y = abs(2 * u - 1), abs(2 * v - 1)
    blue, cream, ochre = (0.07, 0.2, 0.45), (0.93, 0.9, 0.82), (0.85, 0.55, 0.15)

    def over(below, above, share):
        return tuple(a + (b - a) * share for a, b in zip(below, above))

    soft = 0.02
    colour = cream
    corner = math.hypot(1 - x, 1 - y)
    colour = over(colour, blue, 1 - smoothstep(0.62 - soft, 0.62 + soft, corner))
    colour = over(colour, cream, 1 - smoothstep(0.48 - soft, 0.48 + soft, corner))
    colour = over(colour, ochre, 1 - smoothstep(0.3 - soft, 0.3 + soft, corner))
    radius, angle = math.hypot(2 * u - 1, 2 * v - 1), math.atan2(2 * v - 1, 2 * u - 1)
    petal = 0.36 + 0.14 * math.cos(8 * angle)
    colour = over(colour, blue, 1 - smoothstep(petal - soft, petal + soft, radius))
    colour = over(colour, ochre, 1 - smoothstep(0.16 - soft, 0.16 + soft, radius))
    edge = max(x, y)
    return over(colour, (0.6, 0.58, 0.54), smoothstep(0.95, 0.98, edge))


def bricks(u, v):
    """Heights of four courses of bricks, 0 in the joints and 1 on top."""
    row = math.floor(4 * v)
    x, y = (2 * u + 0.5 * (row % 2)) % 1.0, (4 * v) % 1.0
    dx, dy = min(x, 1 - x) / 2, min(y, 1 - y) / 4
    return smoothstep(0.008, 0.045, min(dx, dy))


def studs(u, v):
    """Heights of round studs in a staggered grid."""
    height = 0.0
    for ox, oy in ((0.25, 0.25), (0.75, 0.75)):
        dx, dy = abs((u - ox + 0.5) % 1.0 - 0.5), abs((v - oy + 0.5) % 1.0 - 0.5)
        r = math.hypot(dx, dy) / 0.24
        height = max(height, math.sqrt(max(0.0, 1 - r * r)) if r < 1 else 0.0)
    return height


def normal_of(height, depth, u, v, step=1 / 256):
    du = (height((u + step) % 1, v) - height((u - step) % 1, v)) / (2 * step) * depth
    dv = (height(u, (v + step) % 1) - height(u, (v - step) % 1)) / (2 * step) * depth
    n = normalised([-du, -dv, 1.0])
    return tuple(0.5 + 0.5 * x for x in n)


def leaves(u, v):
    """An opacity mask: round holes, staggered."""
    nearest = 1.0
    for ox, oy in ((0.25, 0.25), (0.75, 0.75)):
        dx, dy = abs((u - ox + 0.5) % 1.0 - 0.5), abs((v - oy + 0.5) % 1.0 - 0.5)
        nearest = min(nearest, math.hypot(dx, dy))
    return (smoothstep(0.2, 0.22, nearest),)


def sky(width=256, height=128):
    """A studio at dusk as a Radiance picture: a warm window, a cold strip, a glow along the horizon."""
    data = bytearray(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode())
    for y in range(height):
        elevation = 90 - 180 * (y + 0.5) / height
        for x in range(width):
            azimuth = 360 * (x + 0.5) / width
            up = max(0.0, elevation) / 90
            colour = [0.10 + 0.05 * up, 0.14 + 0.12 * up, 0.22 + 0.34 * up]
            glow = math.exp(-((elevation - 2) / 14) ** 2)
            warm = 0.5 + 0.5 * math.cos(math.radians(azimuth - 250))
            colour = [c + glow * w * k for c, w, k in zip(colour, (0.9, 0.5, 0.3), [0.25 + 1.3 * warm] * 3)]
            if elevation < 0:
                colour = [c * 0.35 for c in colour]

            def box(a, e, half_a, half_e):
                da = abs((azimuth - a + 180) % 360 - 180)
                return (1 - smoothstep(half_a - 2, half_a, da)) * (1 - smoothstep(half_e - 2, half_e, abs(elevation - e)))

            for a, e, wa, we, light in ((262, 38, 26, 16, (26, 21, 15)), (128, 45, 7, 32, (7, 9, 13))):
                share = box(a, e, wa, we)
                colour = [c + share * l for c, l in zip(colour, light)]
            mantissa, exponent = math.frexp(max(colour))
            data += bytes([int(c * mantissa * 256 / max(colour)) for c in colour] + [exponent + 128])
    write("studio.hdr", bytes(data))


backdrop()
knot()
png("tile.png", 128, 128, tile)
png("bricks.png", 128, 128, lambda u, v: (bricks(u, v),), channels=1)
png("studs-normals.png", 128, 128, lambda u, v: normal_of(studs, 0.12, u, v))
png("holes.png", 64, 64, leaves, channels=1)
sky()
