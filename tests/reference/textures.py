#!/usr/bin/env python3
"""Makes the pictures of wraps.toml, and renders it with Mitsuba 3: textures.py [SPP]. posed.py says what
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


if __name__ == "__main__":
    keep("wraps.png", bytes_of(*colours(8, 12)))
    keep("wraps-glow.exr", np.stack(colours(6, 8), -1).astype(np.float32) ** 2 * 6)
    spp = int(sys.argv[1]) if len(sys.argv) > 1 else 8192
    render("wraps", spp)
