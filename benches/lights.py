#!/usr/bin/env python3
"""The scene of benches/lights.rs in stride and in Cycles (with its light tree), side by side in one run.

    cargo bench --bench lights -- --write lamps.toml
    PYTHON benches/lights.py lamps.toml [--peers stride,cycles] [--spp 64] [--threads 2]

PYTHON has numpy, OpenEXR, and bpy for Cycles, which takes minutes. Lamps are Cycles' own spheres, which cast no shadows
there. Only light from surfaces counts: Cycles hides its lamps from the camera, and of stride's pictures what is seen of
the lamps is taken away. Prints seconds, relative variance without the worst 0.5% of pixels, and efficiency =
1/(variance × seconds).
"""
import argparse, json, os, subprocess, sys, tempfile, time, tomllib
import numpy as np

parser = argparse.ArgumentParser()
parser.add_argument("scene")
parser.add_argument("--peers", default="stride,cycles")
parser.add_argument("--spp", type=int, default=64)
parser.add_argument("--threads", type=int, default=2)
arguments = parser.parse_args()
scene = tomllib.load(open(arguments.scene, "rb"))
width, height = scene["film"]["width"], scene["film"]["height"]


def read_exr(path):
    import OpenEXR
    channels = OpenEXR.File(path).channels()
    for name in ("RGB", "RGBA"):
        if name in channels:
            return np.asarray(channels[name].pixels, np.float64)[..., :3]
    return np.stack([np.asarray(channels[name].pixels, np.float64) for name in "RGB"], -1)


def stride(seed, folder):
    picture, stats = os.path.join(folder, "p.exr"), os.path.join(folder, "s.json")
    program = os.environ.get("STRIDE", "target/release/stride")

    def render(*more):
        subprocess.run([program, "render", arguments.scene, "--headless", "--quiet", "--threads", str(arguments.threads),
                        "--seed", str(seed), "--spp", str(arguments.spp), "--stats", stats, "-o", picture, *more], check=True)
        return read_exr(picture), json.load(open(stats))["seconds"]

    (everything, seconds), (lamps, _) = render(), render("--max-depth", "0")
    return everything - lamps, seconds


def pose_cycles(bpy):
    import mathutils
    bpy.ops.wm.read_factory_settings(use_empty=True)
    world = bpy.context.scene
    world.render.engine = "CYCLES"
    cycles = world.cycles
    cycles.device, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", False, False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0
    cycles.use_light_tree = True
    for key in ("max_bounces", "diffuse_bounces"):
        setattr(cycles, key, scene["render"]["max_depth"] - 1)
    cycles.pixel_filter_type, cycles.filter_width, cycles.use_auto_tile = "BOX", 1.0, False
    render = world.render
    render.threads_mode, render.threads = "FIXED", arguments.threads
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.use_persistent_data, render.use_compositing, render.use_sequencer = True, False, False
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    world.view_settings.view_transform = "Raw"
    world.world = bpy.data.worlds.new("black")
    world.world.use_nodes = True
    world.world.node_tree.nodes.clear()
    materials = {}
    for name, row in scene["materials"].items():
        material = materials[name] = bpy.data.materials.new(name)
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        bsdf, out = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
        bsdf.inputs["Color"].default_value = (*row["reflectance"], 1)
        tree.links.new(bsdf.outputs[0], out.inputs["Surface"])
    for i, entity in enumerate(scene["entities"]):
        shape = entity["shape"]
        if shape["type"] == "quad":
            p, u, v = (np.array(shape[key], float) for key in ("corner", "u", "v"))
            mesh = bpy.data.meshes.new(f"quad {i}")
            mesh.from_pydata([tuple(x) for x in (p, p + u, p + u + v, p + v)], [], [(0, 1, 2, 3)])
            mesh.materials.append(materials[entity["material"]])
            world.collection.objects.link(bpy.data.objects.new(f"quad {i}", mesh))
        else:
            lamp = bpy.data.lights.new(f"lamp {i}", "POINT")
            emission = np.array(entity["emission"], float)
            lamp.shadow_soft_size = shape["radius"]
            lamp.energy = float(emission.max() * 4 * np.pi**2 * shape["radius"] ** 2)
            lamp.color = (emission / emission.max()).tolist()
            if hasattr(lamp, "use_soft_falloff"):
                lamp.use_soft_falloff = False
            thing = bpy.data.objects.new(f"lamp {i}", lamp)
            thing.location = shape["center"]
            thing.visible_camera = False
            world.collection.objects.link(thing)
    camera = bpy.data.cameras.new("camera")
    eye, target = (np.array(scene["camera"][key], float) for key in ("eye", "look_at"))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3] = right, np.cross(back, right), back, eye
    thing = bpy.data.objects.new("camera", camera)
    thing.matrix_world = mathutils.Matrix(frame.tolist())
    camera.sensor_fit, camera.angle = "VERTICAL", np.radians(scene["camera"]["vertical_fov"])
    world.collection.objects.link(thing)
    world.camera = thing
    cycles.samples = 1
    bpy.ops.render.render()  # builds what persistent data keep
    return world


def cycles(seed, folder):
    import bpy
    if not hasattr(cycles, "world"):
        # Blender says a line for every object.
        sys.stdout.flush()
        sys.stdout = os.fdopen(os.dup(1), "w")
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        cycles.world = pose_cycles(bpy)
    world = cycles.world
    world.cycles.samples, world.cycles.seed = arguments.spp, seed
    world.update_tag()
    bpy.context.view_layer.update()
    start = time.perf_counter()
    bpy.ops.render.render()
    seconds = time.perf_counter() - start
    picture = os.path.join(folder, "c.exr")
    bpy.data.images["Render Result"].save_render(picture)
    return read_exr(picture), seconds


with tempfile.TemporaryDirectory() as folder:
    for name in arguments.peers.split(","):
        runs = [dict(stride=stride, cycles=cycles)[name](seed, folder) for seed in (11, 22)]
        (a, b), seconds = (run[0] for run in runs), np.mean([run[1] for run in runs])
        mean = (a + b) / 2
        errors = np.sort(((a - b) ** 2 / 2 / (mean**2 + 0.01)).mean(-1).ravel())
        variance = errors[: int(len(errors) * 0.995)].mean()
        print(f"{name:<8} {seconds:7.2f} s  variance {variance:.5f}  efficiency {1 / (variance * seconds):8.2f}  "
              f"mean {np.round(mean.mean((0, 1)), 4)}", flush=True)
    sys.stdout.flush()
    os._exit(0)
