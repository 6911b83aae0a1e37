"""Reads the mattes of an OpenEXR file by the two specifications alone: OpenEXR's file layout (scan lines, ZIP, 32-bit
floats) and Psyop's Cryptomatte 1.2.0. Prints, as JSON, the size, and for each layer of mattes each name of its manifest
with the coverage of all pixels. Whatever contradicts a specification ends it."""

import json
import struct
import sys
import zlib

import numpy


def murmur3(data):
    """MurmurHash3_x86_32, seed 0."""
    mask, h = 0xFFFFFFFF, 0

    def mix(k):
        k = k * 0xCC9E2D51 & mask
        k = (k << 15 | k >> 17) & mask
        return k * 0x1B873593 & mask

    whole = len(data) // 4 * 4
    for at in range(0, whole, 4):
        h ^= mix(int.from_bytes(data[at : at + 4], "little"))
        h = (h << 13 | h >> 19) & mask
        h = h * 5 + 0xE6546B64 & mask
    h ^= mix(int.from_bytes(data[whole:], "little"))
    h ^= len(data)
    h = (h ^ h >> 16) * 0x85EBCA6B & mask
    h = (h ^ h >> 13) * 0xC2B2AE35 & mask
    return h ^ h >> 16


def id_of(name):
    h = murmur3(name.encode("utf-8"))
    return h ^ 1 << 23 if (h >> 23 & 255) in (0, 255) else h


def read(path):
    """The attributes and the channels of a file."""
    data = open(path, "rb").read()
    assert data[:4] == b"\x76\x2f\x31\x01" and data[4] == 2, "no OpenEXR file"
    at, attributes = 8, {}
    while data[at]:
        end = data.index(0, at)
        name = data[at:end].decode("ascii")
        at, end = end + 1, data.index(0, end + 1)
        kind, size = data[at:end].decode("ascii"), struct.unpack_from("<i", data, end + 1)[0]
        attributes[name] = (kind, data[end + 5 : end + 5 + size])
        at = end + 5 + size
    at += 1
    assert attributes["compression"][1] == b"\x03", "not ZIP"
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    names, listed, pos = [], attributes["channels"][1], 0
    while listed[pos]:
        end = listed.index(0, pos)
        names.append(listed[pos:end].decode("ascii"))
        assert struct.unpack_from("<i", listed, end + 1)[0] == 2, "not 32-bit floats"
        pos = end + 17
    assert names == sorted(names)
    picture = numpy.zeros((height, len(names), width), "<u4")
    blocks = -(-height // 16)
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        rows = min(16, height - (y - y0))
        packed, expected = data[offset + 8 : offset + 8 + size], rows * len(names) * width * 4
        if size < expected:
            # Differences to the byte before, of the even bytes and then the odd ones.
            raw = numpy.frombuffer(zlib.decompress(packed), "u1").astype("i8")
            raw[1:] -= 128
            raw = (numpy.cumsum(raw) & 255).astype("u1")
            half, unpacked = -(-expected // 2), numpy.empty(expected, "u1")
            unpacked[0::2], unpacked[1::2] = raw[:half], raw[half:]
            packed = unpacked.tobytes()
        lines = numpy.frombuffer(packed, "<u4").reshape(rows, len(names), width)
        picture[y - y0 : y - y0 + rows] = lines
    return attributes, {name: picture[:, i, :] for i, name in enumerate(names)}


def mattes(attributes, channels):
    text = {name: value.decode("ascii") for name, (kind, value) in attributes.items() if kind == "string"}
    found = {}
    for attribute, layer in text.items():
        if not (attribute.startswith("cryptomatte/") and attribute.endswith("/name")):
            continue
        key = attribute[len("cryptomatte/") : -len("/name")]
        assert key == f"{murmur3(layer.encode()):08x}"[:7], "the key is not the layer's"
        assert text[f"cryptomatte/{key}/hash"] == "MurmurHash3_32"
        assert text[f"cryptomatte/{key}/conversion"] == "uint32_to_float32"
        manifest = json.loads(text[f"cryptomatte/{key}/manifest"])
        ids = {int(digits, 16): name for name, digits in manifest.items()}
        assert all(id_of(name) == i for i, name in ids.items()), "a hash is not that of its name"
        ranks = []
        while f"{layer}{len(ranks) // 2:02}.R" in channels:
            level = f"{layer}{len(ranks) // 2:02}."
            ranks += [(channels[level + a], channels[level + b].view("<f4")) for a, b in ("RG", "BA")]
        assert ranks, "no ranks"
        total, last = 0, numpy.inf
        for rank, coverage in ranks:
            assert (coverage <= last).all() and (coverage >= 0).all(), "ranks are out of order"
            assert set(numpy.unique(rank[coverage > 0])) <= set(ids), "an id is not in the manifest"
            assert not rank[coverage == 0].any()
            total, last = total + coverage, coverage
        assert (total <= 1.0001).all(), "more than all is covered"
        cover = lambda i: sum(numpy.where(rank == i, coverage, 0) for rank, coverage in ranks)
        found[layer] = {name: cover(i).flatten().tolist() for i, name in ids.items()}
    return found


attributes, channels = read(sys.argv[1])
height, width = channels["R"].shape
print(json.dumps({"width": width, "height": height, "mattes": mattes(attributes, channels)}))
