"""Poses the scene files that lie beside this one to Mitsuba 3, and keeps its pictures. Needs Python 3.11, `mitsuba` and
`OpenEXR` from PyPI, and LLVM for Mitsuba. Depth is that of the files: a path of one segment more here."""
import glob, os, tomllib

import numpy as np

os.environ.setdefault("DRJIT_LIBLLVM_PATH", (glob.glob("/usr/lib/*/libLLVM*19*") + [""])[0])
import mitsuba as mi
import OpenEXR

mi.set_variant("llvm_ad_rgb")
HERE = os.path.dirname(os.path.abspath(__file__))
T = mi.ScalarTransform4f


def rgb(colour):
    return {"type": "rgb", "value": [float(x) for x in colour]}


def pair(x):
    return x if isinstance(x, list) else [x, x]


def alpha(roughness):
    return dict(zip(("alpha_u", "alpha_v"), (r**2 for r in pair(roughness))), distribution="ggx")


def bitmap(texture, change=lambda picture: picture):
    """A picture. Mitsuba's (0, 0) is the upper left corner of its upper left texel, ours the lower left corner."""
    assert texture["type"] == "image" and texture["mipmap"] is False
    picture = np.array(mi.Bitmap(os.path.join(HERE, texture["file"])))
    is_data = texture.get("color_space") == "data"
    if is_data:
        picture = change(picture.astype(np.float32) / (255 if picture.dtype == np.uint8 else 1))
    wrap = texture.get("wrap", "repeat")
    border = 0
    if wrap == "black":
        # It knows no such mode: a border of black texels that goes on for ever is the same.
        border, wrap = 1, "clamp"
        picture = np.pad(picture, ((1, 1), (1, 1)) + ((0, 0),) * (picture.ndim - 2))
    height, width = picture.shape[:2]
    turn = np.radians(texture.get("uv_rotate", 0))
    ours = np.eye(3)
    ours[:2, :2] = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) * pair(texture.get("uv_scale", 1))
    ours[:2, 2] = pair(texture.get("uv_offset", 0))
    flip = np.array([[1, 0, 0], [0, -1, 1], [0, 0, 1]])
    size = np.array([width, height])
    within = np.diag([*((size - 2 * border) / size), 1])
    within[:2, 2] = border / size
    return {
        "type": "bitmap", "bitmap": mi.Bitmap(np.ascontiguousarray(picture)), "raw": is_data, "wrap_mode": wrap,
        "filter_type": {"linear": "bilinear", "nearest": "nearest"}[texture.get("filter", "linear")],
        "to_uv": mi.ScalarTransform3f((within @ flip @ ours).tolist()),
    }


class Pose:
    """A scene file, and what Mitsuba calls what is in it."""

    def __init__(self, name):
        with open(os.path.join(HERE, f"{name}.toml"), "rb") as file:
            self.scene = tomllib.load(file)
        self.textures, self.materials = self.scene.get("textures", {}), self.scene["materials"]

    def colour(self, value):
        return bitmap(self.textures[value]) if isinstance(value, str) else rgb(value)

    def number(self, value):
        return bitmap(self.textures[value]) if isinstance(value, str) else float(value)

    def reflecting(self, m):
        """A material that transmits nothing, of which one side counts."""
        if m["type"] == "matte":
            d = {"type": "diffuse", "reflectance": self.colour(m["reflectance"])}
        elif m["type"] == "mirror":
            d = {"type": "conductor", "material": "none", "specular_reflectance": rgb(m["reflectance"])}
        elif m["type"] == "mix":
            a, b = (self.reflecting(self.materials[m[x]]) for x in "ab")
            d = {"type": "blendbsdf", "weight": self.number(m["amount"]), "a": a, "b": b}
        else:
            assert m["type"] == "conductor"
            rough = alpha(m["roughness"]) if "roughness" in m else {}
            kind = "roughconductor" if rough else "conductor"
            d = {"type": kind, "eta": rgb(m["eta"]), "k": rgb(m["k"]), **rough}
        if "normal_map" in m:
            # It has no scale of its own; that of x and y of the vector that the numbers stand for is the same.
            scale = np.array([m.get("normal_scale", 1)] * 2 + [1], np.float32)
            normals = bitmap(self.textures[m["normal_map"]], lambda p: ((2 * p - 1) * scale + 1) / 2)
            d = {"type": "normalmap", "normalmap": normals, "a": d, "use_shadowing_function": False}
        return d

    def bsdf(self, name):
        m = self.materials[name]
        if m["type"] in ("glass", "dielectric"):
            rough = alpha(m["roughness"]) if "roughness" in m else {}
            kind = "thindielectric" if m.get("thin_walled") else "roughdielectric" if rough else "dielectric"
            tint = {"specular_transmittance": rgb(m.get("transmittance", [1, 1, 1]))}
            return {"type": kind, "int_ior": float(m["ior"]), "ext_ior": 1.0, **rough, **tint}
        d = {"type": "twosided", "a": self.reflecting(m)}
        if "back" in m:
            d["b"] = self.reflecting(self.materials[m["back"]])
        if "opacity" in m:
            d = {"type": "mask", "opacity": self.number(m["opacity"]), "a": d}
        return d

    def shape(self, entity):
        s = entity["shape"]
        if s["type"] == "sphere":
            d = {"type": "sphere", "center": [float(x) for x in s["center"]], "radius": float(s["radius"])}
        else:
            corner, u, v = (np.array(s[key], float) for key in ("corner", "u", "v"))
            n = np.cross(u, v)
            m = np.eye(4)
            m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u / 2, v / 2, n / np.linalg.norm(n), corner + (u + v) / 2
            d = {"type": "rectangle", "to_world": T(m.tolist())}
        d["bsdf"] = self.bsdf(entity["material"])
        if "emission" in entity:
            d["emitter"] = {"type": "area", "radiance": self.colour(entity["emission"])}
        return d

    def environment(self):
        e = self.scene["environment"]
        if "radiance" in e:
            return {"type": "constant", "radiance": rgb(e["radiance"])}
        # Rows lie at i/(n − 1) in Mitsuba's pictures, at (i + ½)/n in ours: of 2n + 1 rows, of which every second one is
        # halfway between its neighbours, both make the same. Its up is y, its middle column +z, and u grows to −x.
        rows = np.array(mi.Bitmap(os.path.join(HERE, e["file"])).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
        edges = np.concatenate([rows[:1], (rows[1:] + rows[:-1]) / 2, rows[-1:]])
        doubled = np.empty((2 * len(rows) + 1, *rows.shape[1:]), np.float32)
        doubled[0::2], doubled[1::2] = edges, rows
        axes = T([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
        scale = np.array(e.get("scale", 1), np.float32)
        turned = T().rotate([0, 0, 1], float(e.get("rotate", 0))) @ axes
        return {"type": "envmap", "bitmap": mi.Bitmap(doubled * scale), "to_world": turned}


def light(l):
    if l["type"] == "directional":
        return {"type": "directional", "direction": l["direction"], "irradiance": rgb(l["irradiance"])}
    cone, inner = float(l["cone_angle"]), float(l["cone_angle"] - l["penumbra_angle"])
    target = (np.array(l["position"]) + l["direction"]).tolist()
    d = {
        "type": "spot", "to_world": T().look_at(origin=l["position"], target=target, up=[0, 1, 0]),
        "intensity": rgb(l["intensity"]), "cutoff_angle": cone, "beam_width": inner,
    }
    if l["falloff"] != "angle":
        # Its own falloff is linear in the angle; others are pictures that it projects over the square about the cone.
        x = (np.arange(1024) + 0.5) / 512 - 1
        cosine = 1 / np.sqrt(1 + (x[:, None] ** 2 + x**2) * np.tan(np.radians(cone)) ** 2)
        edge, full = np.cos(np.radians([cone, inner]))
        t = np.clip((cosine - edge) / (full - edge), 0, 1)
        t = {"smoothstep": t * t * (3 - 2 * t), "squared": t * t}[l["falloff"]]
        picture = mi.Bitmap(np.repeat(t[..., None], 3, -1).astype(np.float32))
        d |= {"beam_width": cone, "texture": {"type": "bitmap", "bitmap": picture, "raw": True, "wrap_mode": "clamp"}}
    return d


def sensor(camera, film, spp):
    look = T().look_at(origin=camera["eye"], target=camera["look_at"], up=[0, 0, 1])
    if camera.get("type") == "orthographic":
        half = camera["height"] * film["width"] / film["height"] / 2
        kind = {"type": "orthographic", "to_world": look @ T().scale([half, half, 1])}
    else:
        kind = {"type": "perspective", "fov": float(camera["vertical_fov"]), "fov_axis": "y", "to_world": look}
    return {
        **kind, "near_clip": 0.01, "far_clip": 1e4,
        "film": {
            "type": "hdrfilm", "width": film["width"], "height": film["height"], "pixel_format": "rgb",
            "component_format": "float32", "rfilter": {"type": film["filter"]},
        },
        "sampler": {"type": "independent", "sample_count": spp},
    }


def render(name, spp, integrator="path"):
    pose = Pose(name)
    scene = pose.scene
    depth = scene["render"]["max_depth"] + 1
    made = {
        "type": "scene", "integrator": {"type": integrator, "max_depth": depth, "rr_depth": 1000},
        "sensor": sensor(scene["camera"], scene["film"], spp), "environment": pose.environment(),
    }
    for i, entity in enumerate(scene["entities"]):
        made[f"entity{i}"] = pose.shape(entity)
    for i, l in enumerate(scene.get("lights", [])):
        made[f"light{i}"] = light(l)
    made = mi.load_dict(made)
    # Enough passes that their variance is well known.
    passes = 128
    pictures = (np.array(mi.render(made, spp=max(1, spp // passes), seed=i), np.float64) for i in range(passes))
    total = squares = 0
    for picture in pictures:
        total, squares = total + picture, squares + picture**2
    # With a box filter no sample counts in two pixels: the noise of pixels is independent.
    assert scene["film"]["filter"] == "box"
    mean = total / passes
    error = np.sqrt(np.maximum(squares / passes - mean**2, 0) / (passes - 1))
    width, height = scene["film"]["width"], scene["film"]["height"]
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {"RGB": np.ascontiguousarray(mean, np.float32), "error": np.ascontiguousarray(error, np.float16)}
    OpenEXR.File(header, channels).write(os.path.join(HERE, f"{name}-{width}x{height}.exr"))
    print(name, mean.mean((0, 1)), flush=True)
