#!/usr/bin/env python3
"""Renders every picture of the guide and the README.

    docs/pictures/render.py [NAME...]           renders all pictures, or those of the named scenes
    docs/pictures/render.py --check [NAME...]   fails if one of them is not what its scene renders to
    STRIDE=target/release/stride                the program to render with
    SPP=16                                      samples per pixel instead of those in the scenes, for drafts
    OUT=FOLDER                                  the folder of the pictures instead of docs/pictures

A picture of scenes/NAME.toml is NAME.png, reduced to 256 colours so that the repository stays small. Pictures of fewer
than 128 columns are enlarged four times, so that single pixels can be seen. The script needs Python 3 alone.
"""

import os
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

FOLDER = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(FOLDER))
# Pictures of the scenes in scenes/: the scene, and the options to render it with.
SMALL = ["--size", "160x120"]
MORE = {
    "cover": ("cover", ["--size", "320x240"]),
    "room": ("room", ["--size", "256x192"]),
    "surfaces": ("surfaces", ["--size", "256x160"]),
    "perfume": ("perfume", ["--size", "256x192"]),
    "clock": ("clock", ["--size", "256x192"]),
    "studio": ("studio", ["--size", "256x192"]),
    "figure-1-1-whitted": ("figure-1-1-whitted", SMALL),
    "figure-1-1-path": ("figure-1-1-path", SMALL),
    "figure-2-4-none": ("figure-2-4-none", ["--crop", "300,300,64,48"]),
    "figure-2-4-tent": ("figure-2-4-tent", ["--crop", "300,300,64,48"]),
    "figure-3-1": ("figure-3-1", ["--threads", "25", "--overlay", "owner"]),
    "figure-6-1": ("figure-6-1-to-6-3", [*SMALL, "--spp", "10"]),
    "figure-6-2": ("figure-6-1-to-6-3", [*SMALL, "--spp", "100"]),
    "figure-6-3": ("figure-6-1-to-6-3", SMALL),
    "figure-6-4": ("figure-6-4", SMALL),
    "figure-6-5": ("figure-6-5", SMALL),
    "figure-6-6": ("figure-6-6", SMALL),
    "figure-6-7": ("figure-6-7", SMALL),
}
# Pictures that keep all their colours.
FULL_COLOUR = ("cover", "still-life")


def read_png(path):
    """Width, height and rows of an 8-bit RGB picture without interlacing."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 2), f"{path} is no 8-bit RGB picture"
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    raw, stride = zlib.decompress(packed), 3 * width
    rows, above = [], bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            left, up, corner = row[i - 3] if i >= 3 else 0, above[i], above[i - 3] if i >= 3 else 0
            if kind == 1:
                row[i] = (row[i] + left) & 255
            elif kind == 2:
                row[i] = (row[i] + up) & 255
            elif kind == 3:
                row[i] = (row[i] + (left + up) // 2) & 255
            elif kind == 4:
                p = left + up - corner
                nearest = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))
                row[i] = (row[i] + nearest[2]) & 255
        rows.append(row)
        above = row
    return width, height, rows


def enlarged(width, height, rows, times):
    wide = [b"".join(bytes(row[3 * x : 3 * x + 3]) * times for x in range(width)) for row in rows]
    return width * times, height * times, [row for row in wide for _ in range(times)]


def median_cut(counts, colours):
    """Boxes of colours, each cut in two at the median of its longest side until there are enough."""

    def spread(box):
        sides = [max(c[i] for c in box) - min(c[i] for c in box) for i in range(3)]
        longest = max(range(3), key=lambda i: sides[i] * (2, 4, 1)[i])
        return sides[longest] * sum(counts[c] for c in box) ** 0.5, longest

    boxes = [(spread(list(counts)), list(counts))]
    while len(boxes) < colours:
        boxes.sort(key=lambda entry: entry[0][0] if len(entry[1]) > 1 else -1)
        (_, side), box = boxes.pop()
        if len(box) < 2:
            boxes.append(((0, 0), box))
            break
        box.sort(key=lambda c: c[side])
        half, sofar, cut = sum(counts[c] for c in box) / 2, 0, 1
        for i, c in enumerate(box[:-1]):
            sofar += counts[c]
            cut = i + 1
            if sofar >= half:
                break
        boxes += [(spread(part), part) for part in (box[:cut], box[cut:])]
    return [box for _, box in boxes]


def write_palette_png(path, width, height, rows, colours=256):
    def key(r, g, b):
        return r >> 2, g >> 2, b >> 2

    counts, sums, keys = {}, {}, []
    for row in rows:
        for x in range(width):
            rgb = row[3 * x], row[3 * x + 1], row[3 * x + 2]
            k = key(*rgb)
            keys.append(k)
            counts[k] = counts.get(k, 0) + 1
            total = sums.setdefault(k, [0, 0, 0])
            for i in range(3):
                total[i] += rgb[i]
    palette, index = [], {}
    means = []
    for box in median_cut(counts, colours):
        n = sum(counts[c] for c in box)
        means.append((tuple(round(sum(sums[c][i] for c in box) / n) for i in range(3)), box))
    # In order of brightness, so that neighbours differ little and the file is small.
    for colour, box in sorted(means, key=lambda m: 2 * m[0][0] + 5 * m[0][1] + m[0][2]):
        for c in box:
            index[c] = len(palette)
        palette.append(colour)
    pixels = bytes(index[k] for k in keys)
    raw = b"".join(b"\0" + pixels[y * width : (y + 1) * width] for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0))
    table = chunk(b"PLTE", bytes(x for colour in palette for x in colour))
    data = chunk(b"IDAT", zlib.compress(raw, 9))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + header + table + data + chunk(b"IEND", b""))


def contents(path):
    """The header, the palette and the pixels of a PNG file: they do not depend on how it is compressed."""
    with open(path, "rb") as file:
        data = file.read()
    at, chunks = 8, {}
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        chunks[kind] = chunks.get(kind, b"") + data[at + 8 : at + 8 + length]
        at += 12 + length
    return chunks[b"IHDR"], chunks.get(b"PLTE"), zlib.decompress(chunks[b"IDAT"])


def render(program, scene, options, picture, full_colour):
    """Renders a scene to a picture of the guide. Returns whether that succeeded."""
    with tempfile.TemporaryDirectory() as folder:
        rendered = os.path.join(folder, "picture.png")
        command = [program, "render", scene, "--headless", "--quiet", "-o", rendered, *options]
        if subprocess.run(command).returncode != 0:
            return False
        if full_colour:
            shutil.move(rendered, picture)
            return True
        width, height, rows = read_png(rendered)
    if width < 128:
        width, height, rows = enlarged(width, height, rows, 4)
    write_palette_png(picture, width, height, rows)
    return True


def main(names):
    check = "--check" in names
    names = [name for name in names if name != "--check"]
    program = os.path.abspath(os.environ.get("STRIDE", os.path.join(ROOT, "target/release/stride")))
    own = os.path.join(FOLDER, "scenes")
    scenes = {name[:-5]: (os.path.join(own, name), []) for name in os.listdir(own) if name.endswith(".toml")}
    for name, (scene, options) in MORE.items():
        scenes[name] = (os.path.join(ROOT, "scenes", f"{scene}.toml"), options)
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        out = folder if check else os.environ.get("OUT", FOLDER)
        for name in names or sorted(scenes):
            if name not in scenes:
                sys.exit(f"no scene of that name: {name}")
            scene, options = scenes[name]
            if "SPP" in os.environ and "--spp" not in options:
                options = [*options, "--spp", os.environ["SPP"]]
            picture = os.path.join(out, f"{name}.png")
            if not render(program, scene, options, picture, name in FULL_COLOUR):
                failed.append(name)
            elif check and contents(picture) != contents(os.path.join(FOLDER, f"{name}.png")):
                failed.append(name)
                print(f"{name}.png is not what the scene renders to")
            else:
                print(f"{name}.png: {os.path.getsize(picture)} bytes", flush=True)
    sys.exit(f"failed: {', '.join(failed)}" if failed else 0)


main(sys.argv[1:])
