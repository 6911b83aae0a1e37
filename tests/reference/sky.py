#!/usr/bin/env python3
"""Makes the picture of the sky of sky.toml, and renders that with Mitsuba 3: sky.py [SPP]. posed.py says what it needs."""
import os, sys

import numpy as np
from posed import HERE, mi, render


def sky(height, width):
    """A bright spot, dark ground and a red quarter: asymmetric both ways."""
    v, u = np.meshgrid(1 - (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    up = np.sin((v - 0.5) * np.pi)
    grey = np.where(up > 0, 0.3 + 0.5 * up, 0.1 + 0.06 * np.cos(2 * np.pi * u))
    tint = [0.7 + 0.3 * np.cos(2 * np.pi * (u - 0.1)), np.full_like(u, 0.8), 1.1 + 0.2 * np.sin(2 * np.pi * u)]
    base = np.stack(tint, -1) * grey[..., None]
    red = (np.clip(1.5 - np.abs(u - 0.8) * 8, 0, 1) * np.clip(up * 4, 0, 1))[..., None]
    base = base * (1 - red) + red * [0.8, 0.12, 0.1]
    around = (u - 0.3 + 0.5) % 1 - 0.5
    distance = np.hypot(around * width * np.cos((v - 0.5) * np.pi), (v - 0.72) * height) / 2.5
    return (base + np.clip(1.5 - distance, 0, 1)[..., None] * [14, 12, 9]).astype(np.float32)


if __name__ == "__main__":
    mi.Bitmap(sky(32, 64)).write(os.path.join(HERE, "sky.exr"))
    render("sky", int(sys.argv[1]) if len(sys.argv) > 1 else 8192)
