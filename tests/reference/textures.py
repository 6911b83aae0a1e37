#!/usr/bin/env python3
"""Makes the pictures of wraps.toml and maps.toml, and renders these with Mitsuba 3: textures.py [SPP]. posed.py says what
it needs."""
import os, sys

import numpy as np
from posed import HERE, mi, render


def grid(height, width):
    """u to the right and v upwards, at the centres of texels; row 0 is the top."""
    v, u = np.meshgrid(1 - (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    return u, v


def bytes_of(*channels):
    channels = [np.clip(np.broadcast_to(c, channels[0].shape), 0, 1) for c in channels]
    return np.round(np.stack(channels, -1).squeeze() * 255).astype(np.uint8)


def keep(name, picture):
    mi.Bitmap(np.ascontiguousarray(picture)).write(os.path.join(HERE, name))


def colours(height, width):
    """Colours that differ at all four edges, and an L: any mirroring or turning shows."""
    u, v = grid(height, width)
    is_l = (u < 0.45) & (v > 0.1) & (v < 0.3) | (u > 0.15) & (u < 0.3) & (v > 0.1) & (v < 0.9)
    r, g, b = 0.35 + 0.5 * u, 0.3 + 0.6 * v, 0.75 - 0.5 * u * v
    return [np.where(is_l, a, b) for a, b in ((0.95, r), (0.15, g), (0.1, b))]


def normals():
    u, v = grid(32, 32)
    slope_u = 0.5 * np.cos(4 * np.pi * u) * (0.6 + 0.4 * np.sin(2 * np.pi * v))
    slope_v = 0.35 * np.cos(6 * np.pi * v + 1) + 0.1
    n = np.stack([-slope_u, -slope_v, np.ones_like(u)], -1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return bytes_of(*np.moveaxis(n / 2 + 0.5, -1, 0))


def holes():
    u, v = grid(32, 32)
    distance = np.minimum(np.hypot(u - 0.3, v - 0.3) / 0.2, np.hypot(u - 0.65, v - 0.68) / 0.26)
    return bytes_of((distance - 1) * 4 + 0.5)


def worn():
    u, v = grid(24, 32)
    return bytes_of(0.5 + 0.6 * np.sin(2 * np.pi * (2 * u + v)) * (0.4 + 0.6 * v))


if __name__ == "__main__":
    keep("wraps.png", bytes_of(*colours(8, 12)))
    keep("wraps-glow.exr", np.stack(colours(6, 8), -1).astype(np.float32) ** 2 * 6)
    keep("maps-normals.png", normals())
    # As other programs have it, with +Y down.
    keep("maps-normals-down.png", normals() * np.uint8([1, 0, 1]) + (255 - normals()) * np.uint8([0, 1, 0]))
    keep("maps-holes.png", holes())
    keep("maps-worn.png", worn())
    spp = int(sys.argv[1]) if len(sys.argv) > 1 else 8192
    render("wraps", spp)
    # Its `path` lets the light of a sun and of a spot through no cut-out.
    render("maps", spp, "volpath")
