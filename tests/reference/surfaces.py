#!/usr/bin/env python3
"""Renders metals.toml and frosted.toml, which lie beside this file, with Mitsuba 3: surfaces.py [SPP]. Needs Python 3.11,
`mitsuba` and `OpenEXR` from PyPI, and LLVM for Mitsuba. Depth is that of the files: a path of one segment more here."""
import glob, os, sys, tomllib

import numpy as np

os.environ.setdefault("DRJIT_LIBLLVM_PATH", (glob.glob("/usr/lib/*/libLLVM*19*") + [""])[0])
import mitsuba as mi
import OpenEXR

mi.set_variant("llvm_ad_rgb")
HERE = os.path.dirname(os.path.abspath(__file__))
T = mi.ScalarTransform4f


def rgb(colour):
    return {"type": "rgb", "value": [float(x) for x in colour]}


def alpha(roughness):
    along = roughness if isinstance(roughness, list) else [roughness] * 2
    return {"distribution": "ggx", "alpha_u": along[0] ** 2, "alpha_v": along[1] ** 2}


def bsdf(m):
    rough = alpha(m["roughness"]) if "roughness" in m else {}
    if m["type"] == "matte":
        return {"type": "twosided", "a": {"type": "diffuse", "reflectance": rgb(m["reflectance"])}}
    if m["type"] == "conductor":
        kind = "roughconductor" if rough else "conductor"
        return {"type": "twosided", "a": {"type": kind, "eta": rgb(m["eta"]), "k": rgb(m["k"]), **rough}}
    kind = "thindielectric" if m.get("thin_walled") else "roughdielectric"
    tint = {"specular_transmittance": rgb(m.get("transmittance", [1, 1, 1]))}
    return {"type": kind, "int_ior": float(m["ior"]), "ext_ior": 1.0, **rough, **tint}


def shape(entity, materials):
    s = entity["shape"]
    if s["type"] == "sphere":
        d = {"type": "sphere", "center": [float(x) for x in s["center"]], "radius": float(s["radius"])}
    else:
        corner, u, v = (np.array(s[key], float) for key in ("corner", "u", "v"))
        n = np.cross(u, v)
        m = np.eye(4)
        m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u / 2, v / 2, n / np.linalg.norm(n), corner + (u + v) / 2
        # Outward is u x v; the lamp shines down.
        d = {"type": "rectangle", "to_world": T(m.tolist())}
    d["bsdf"] = bsdf(materials[entity["material"]])
    if "emission" in entity:
        d["emitter"] = {"type": "area", "radiance": rgb(entity["emission"])}
    return d


def light(l):
    if l["type"] == "directional":
        return {"type": "directional", "direction": l["direction"], "irradiance": rgb(l["irradiance"])}
    assert l["falloff"] == "angle"
    target = (np.array(l["position"]) + l["direction"]).tolist()
    return {
        "type": "spot", "to_world": T().look_at(origin=l["position"], target=target, up=[0, 1, 0]),
        "intensity": rgb(l["intensity"]), "cutoff_angle": float(l["cone_angle"]),
        "beam_width": float(l["cone_angle"] - l["penumbra_angle"]),
    }


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


def render(name, spp):
    with open(os.path.join(HERE, f"{name}.toml"), "rb") as file:
        scene = tomllib.load(file)
    depth = scene["render"]["max_depth"] + 1
    made = {
        "type": "scene", "integrator": {"type": "path", "max_depth": depth, "rr_depth": 1000},
        "sensor": sensor(scene["camera"], scene["film"], spp),
        "environment": {"type": "constant", "radiance": rgb(scene["environment"]["radiance"])},
    }
    for i, entity in enumerate(scene["entities"]):
        made[f"entity{i}"] = shape(entity, scene["materials"])
    for i, l in enumerate(scene.get("lights", [])):
        made[f"light{i}"] = light(l)
    made = mi.load_dict(made)
    passes = max(1, spp // 512)
    total = sum(np.array(mi.render(made, spp=spp // passes, seed=i), np.float64) for i in range(passes))
    width, height = scene["film"]["width"], scene["film"]["height"]
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    picture = {"RGB": np.ascontiguousarray(total / passes, np.float32)}
    OpenEXR.File(header, picture).write(os.path.join(HERE, f"{name}-{width}x{height}.exr"))
    print(name, (total / passes).mean((0, 1)), flush=True)


if __name__ == "__main__":
    for name in ("metals", "frosted"):
        render(name, int(sys.argv[1]) if len(sys.argv) > 1 else 8192)
