#!/usr/bin/env python3
"""Public model files in stride and in independent readers: triangle counts, bounds and surface areas.

    apt install libassimp5 assimp-testmodels
    PYTHON -m pip install "bpy==4.5.*" pyassimp trimesh pillow
    git clone https://github.com/KhronosGroup/glTF-Validator models/glTF-Validator     # and others like it
    PYTHON benches/models.py /usr/share/assimp models [--cache readers.json] [--list results.json] [--most 400]

PYTHON is a Python 3.11, for which bpy has packages. STRIDE names the program; it is target/release/stride otherwise.
Every .obj, .ply, .gltf and .glb file below the folders is read; of equal files, one. --most limits the files of one
folder of the first level. --cache keeps what the independent readers found, so that a later run asks stride alone.

A file is equal if an independent reader finds the same number of triangles (a polygon of n corners has n - 2),
the same bounds of the corners of faces within 1e-5 of their diagonal, and the same surface area within 0.1%, and if
no more of them agree about something else. Only Blender applies skins, morph targets and EXT_mesh_gpu_instancing. The area of a polygon that is planar is found by Newell's formula, without a triangulation; the area of one that is bent depends on
the triangulation, and must lie between the length of Newell's vector and the largest area of a fan. The other files are
explained by the rules of `explain` and of `REFUSALS`; the rest is listed, and the exit code is 1.
"""
import argparse, collections, ctypes, hashlib, json, os, queue, re, subprocess, sys, threading
import numpy as np

FORMATS = (".obj", ".ply", ".gltf", ".glb")
READERS = ("assimp", "blender", "trimesh")
LONGEST = 120  # seconds that a reader may take for a file


# What readers find: the corners of faces as rows of x, y and z, and how many corners each face has.

def measure(points, counts):
    """The triangles, the bounds and the area of polygons."""
    counts = np.asarray(counts, np.int64)
    points = np.asarray(points, np.float64).reshape(-1, 3)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]) if len(counts) else counts
    found = {"triangles": int(np.sum(np.maximum(counts - 2, 0))), "area": [0.0, 0.0], "bent": 0, "flat": 0}
    keep = np.repeat(counts >= 3, counts)
    if not keep.any():
        return found
    found["bounds"] = [points[keep].min(0).tolist(), points[keep].max(0).tolist()]
    for n in np.unique(counts[counts >= 3]):
        # All polygons of n corners at once.
        faces = points[starts[counts == n][:, None] + np.arange(n)]
        # About their own first corners, so that a place far away takes no digits.
        edges = faces - faces[:, :1]
        vectors = np.cross(edges[:, 1:-1], edges[:, 2:]).sum(1) / 2
        lengths = np.linalg.norm(vectors, axis=1)
        low, high = lengths, lengths
        found["flat"] += int(np.sum(lengths == 0))
        if n > 3:
            sizes = np.linalg.norm(faces.max(1) - faces.min(1), axis=1)
            with np.errstate(all="ignore"):
                heights = np.abs(np.einsum("fnk,fk->fn", edges, vectors / lengths[:, None])).max(1)
            bent = ~(heights <= 1e-4 * sizes)
            if bent.any():
                some = faces[bent]
                fans = np.max([fan(np.roll(some, i, 1)) for i in range(min(n, 32))], axis=0)
                high = lengths.copy()
                high[bent] = np.maximum(fans, lengths[bent])
                found["bent"] += int(bent.sum())
        found["area"][0] += float(low.sum())
        found["area"][1] += float(high.sum())
    return found


def fan(faces):
    edges = faces - faces[:, :1]
    return np.linalg.norm(np.cross(edges[:, 1:-1], edges[:, 2:]), axis=2).sum(1) / 2


def join(pieces):
    """Of (points, counts) of several meshes."""
    pieces = list(pieces)
    if not pieces:
        return np.zeros((0, 3)), np.zeros(0, np.int64)
    return np.concatenate([p for p, _ in pieces]), np.concatenate([c for _, c in pieces])


def read_assimp(path):
    # Its structures as they are: what pyassimp makes of them has no room for faces of different lengths.
    from pyassimp.core import _assimp_lib as assimp
    model = assimp.load(path.encode(), 0)
    if not model:
        raise ValueError("not read")
    scene = model.contents

    def array(pointer, count, width, kind=ctypes.c_float):
        numbers = ctypes.cast(pointer, ctypes.POINTER(kind))
        return np.ctypeslib.as_array(numbers, (count, width)) if count else np.zeros((0, width))

    def pieces(node, above):
        rows = [name + column for name in "abcd" for column in "1234"]
        to_world = above @ np.array([getattr(node.mTransformation, name) for name in rows]).reshape(4, 4)
        for i in range(node.mNumMeshes):
            mesh = scene.mMeshes[node.mMeshes[i]].contents
            vertices = array(mesh.mVertices, mesh.mNumVertices, 3).astype(np.float64)
            faces = [mesh.mFaces[k] for k in range(mesh.mNumFaces)]
            counts = [face.mNumIndices for face in faces]
            if counts:
                corners = np.concatenate([array(f.mIndices, f.mNumIndices, 1, ctypes.c_uint)[:, 0] for f in faces])
                yield vertices[corners.astype(np.int64)] @ to_world[:3, :3].T + to_world[:3, 3], counts
        for i in range(node.mNumChildren):
            yield from pieces(node.mChildren[i].contents, to_world)

    try:
        return measure(*join(pieces(scene.mRootNode.contents, np.eye(4))))
    finally:
        assimp.release(model)


def read_blender(path):
    import bpy
    bpy.ops.wm.read_factory_settings(use_empty=True)
    axes = {"forward_axis": "Y", "up_axis": "Z"}
    suffix = os.path.splitext(path)[1].lower()
    if suffix == ".obj":
        bpy.ops.wm.obj_import(filepath=path, validate_meshes=False, **axes)
    elif suffix == ".ply":
        bpy.ops.wm.ply_import(filepath=path, merge_verts=False, **axes)
    else:
        # Skins and morph targets are as they are without any animation.
        from io_scene_gltf2.io.imp.gltf2_io_gltf import glTFImporter
        if not hasattr(glTFImporter, "read_all"):
            glTFImporter.read_all = glTFImporter.read

            def read(importer):
                importer.read_all()
                importer.data.animations = None
            glTFImporter.read = read
        bpy.ops.import_scene.gltf(filepath=path, merge_vertices=False, bone_heuristic="TEMPERANCE")
    shapes = {bone.custom_shape for ob in bpy.data.objects if ob.type == "ARMATURE" for bone in ob.pose.bones}
    depsgraph = bpy.context.evaluated_depsgraph_get()

    def pieces():
        for ob in bpy.context.scene.objects:
            if ob.type != "MESH" or ob in shapes:
                continue
            evaluated = ob.evaluated_get(depsgraph)
            mesh = evaluated.to_mesh()
            points = np.empty(3 * len(mesh.vertices), np.float32)
            mesh.vertices.foreach_get("co", points)
            corners = np.empty(len(mesh.loops), np.int32)
            mesh.loops.foreach_get("vertex_index", corners)
            counts = np.empty(len(mesh.polygons), np.int32)
            mesh.polygons.foreach_get("loop_total", counts)
            to_world = np.array(evaluated.matrix_world, np.float64)
            points = points.reshape(-1, 3)[corners].astype(np.float64) @ to_world[:3, :3].T + to_world[:3, 3]
            if suffix in (".gltf", ".glb"):
                # Blender turns +y up to +z up.
                points = points[:, [0, 2, 1]] * [1, 1, -1]
            yield points, counts
            evaluated.to_mesh_clear()

    return measure(*join(pieces()))


def read_trimesh(path):
    import trimesh
    loaded = trimesh.load(path, process=False)
    meshes = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    meshes = [mesh for mesh in meshes if isinstance(mesh, trimesh.Trimesh)]
    return measure(*join((np.asarray(m.vertices)[m.faces].reshape(-1, 3), np.full(len(m.faces), 3)) for m in meshes))


def work(name):
    """Answers each path on standard input with a line of JSON."""
    sys.setrecursionlimit(100000)
    answers = os.fdopen(os.dup(1), "w")
    # What the readers print goes elsewhere.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for path in sys.stdin:
        try:
            found = globals()["read_" + name](path.rstrip("\n"))
        except BaseException as error:
            found = {"error": f"{type(error).__name__}: {error}"[:300]}
        answers.write(json.dumps(found) + "\n")
        answers.flush()


class Reader:
    """An independent reader in a process of its own, which may crash or never answer."""

    def __init__(self, name):
        self.name, self.process = name, None

    def read(self, path):
        if self.process is None:
            self.process = subprocess.Popen([sys.executable, __file__, "--worker", self.name], text=True,
                                            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        process, answer = self.process, queue.Queue()
        process.stdin.write(path + "\n")
        process.stdin.flush()
        threading.Thread(target=lambda: answer.put(process.stdout.readline()), daemon=True).start()
        try:
            line = answer.get(timeout=LONGEST)
        except queue.Empty:
            line, why = "", f"no answer within {LONGEST} s"
        else:
            why = "the reader crashed"
        if line:
            return json.loads(line)
        process.kill()
        process.wait()
        self.process = None
        return {"error": why}


NUMBER = r"([-+.\w]+)"
POINT = rf"\({NUMBER}, {NUMBER}, {NUMBER}\)"


def read_stride(path):
    program = os.environ.get("STRIDE", "target/release/stride")
    try:
        run = subprocess.run([program, "info", path], capture_output=True, text=True, timeout=LONGEST, errors="replace")
    except subprocess.TimeoutExpired:
        return {"fault": f"no answer within {LONGEST} s"}
    if run.returncode == 1 and run.stderr.startswith("error: ") and "panicked" not in run.stderr:
        return {"refused": run.stderr.strip().removeprefix("error: ").replace(path, "FILE")}
    if run.returncode != 0:
        return {"fault": f"exit code {run.returncode}: {run.stderr.strip()[-300:]}"}
    mesh = re.search(r"^mesh +(\d+) triangle", run.stdout, re.M)
    low_high = re.search(rf"^bounds +{POINT} to {POINT}$", run.stdout, re.M)
    area = re.search(rf"^area +{NUMBER}", run.stdout, re.M)
    if not (mesh and low_high and area):
        return {"fault": f"unknown facts: {run.stdout}"}
    low_high = [float(x) for x in low_high.groups()]
    return {"triangles": int(mesh[1]), "bounds": [low_high[:3], low_high[3:]], "area": float(area[1]),
            "notes": re.findall(r"^note +(.*)$", run.stdout, re.M)}


def differences(ours, theirs):
    """In what stride's mesh differs from another reader's."""
    found = []
    if ours["triangles"] != theirs["triangles"]:
        found.append(f"{ours['triangles']} triangles, not {theirs['triangles']}")
    if "bounds" not in theirs:
        return found + ["bounds"]
    a, b = np.array(ours["bounds"]), np.array(theirs["bounds"])
    scale = max(np.linalg.norm(b[1] - b[0]), 1e-2 * np.abs(b).max())
    if not np.all(np.abs(a - b) <= 1e-5 * scale):
        found.append(f"bounds {a.tolist()}, not {b.tolist()}")
    low, high = theirs["area"]
    if not low * 0.999 <= ours["area"] <= high * 1.001:
        found.append(f"area {ours['area']}, not {low if low == high else (low, high)}")
    return found


# Why a file may be refused: a part of the message, the reason in the table, and whether other readers may see triangles
# in the file. The first that fits counts.
REFUSALS = [
    ("scenes other than the default one are left out", "its default scene is empty", True),
    ("no triangle in it", "nothing in it has a surface: points, lines, splats, an empty scene", False),
    ("vertices have no x, y and z", "nothing in it has a surface: points, lines, splats, an empty scene", False),
    ("triangles have zero area|all indices would be 0", "no triangle in it has an area", True),
    ("(?i:draco|meshopt|spz)", "its geometry is compressed", True),
    ("may change the triangles", "it requires an extension that may change the geometry", True),
    ("glTF version|version 1|asset.version", "glTF 1.0, or no version", True),
    ("more than one parent|its own", "against the specification: a node with two parents, or a loop", True),
    ("there is no such file", "a file that it names is missing", False),
    ("larger than 10|not finite", "a vertex is not finite", True),
    ("vertices so far|names vertex|has vertex", "a face names a vertex that is not there", True),
    ("is no number|no corner of a face", "a position or a face is no number", True),
    ("UTF-16", "it is UTF-16", True),
    ("cut off|ends before|ends in the middle|bytes follow|but only|fewer numbers|end_header", "a part of it is missing",
     True),
    ("is the default, but", "the scene that it shows is missing", False),
    ("JSON|does not begin with|missing field|invalid type|expected|unknown header|unknown type|out of range|"
     "no length of a list|a length of", "it is damaged, or breaks the format's rules", False),
]


def refusal(message, others):
    seen = any(found.get("triangles") for found in others.values())
    return next((reason for part, reason, may in REFUSALS if re.search(part, message) and (may or not seen)), None)


# Files about which stride is right and the others are not, or which they do not read.
SKINS = "Blender's bones have no uneven scale: the specification's sum of joint matrices, by hand, is stride's"
REASONS = {
    "lumberjack.glb": SKINS,
    "NestedSkeletonReproCase.glb": SKINS,
    "NestedSkeletonReproCase_renamemesh.glb": "a byte too long, which others refuse; the same mesh as the file before it",
}


def explain(path, ours, others):
    """Why no independent reader is right about a file, or nothing."""
    return REASONS.get(os.path.basename(path))


def document(path):
    """The JSON of a glTF file, as far as it is JSON."""
    data = open(path, "rb").read()
    if data[:4] == b"glTF":
        length = int.from_bytes(data[12:16], "little")
        data = data[20:20 + length]
    try:
        found = json.loads(data)
        return found if isinstance(found, dict) else {}
    except ValueError:
        return {}


def is_posed(path):
    """Whether skins or morph targets move its vertices, or copies are made by an extension."""
    return path.lower().endswith((".gltf", ".glb")) and bool(
        re.search(r'"(skin|targets|EXT_mesh_gpu_instancing)"', json.dumps(document(path))))


def models(folders, most):
    """Each different file once, with its digest. Of equal glTF files, one whose buffers are there comes first."""
    seen, found = set(), []
    for folder in folders:
        groups = collections.Counter()
        for parent, below, files in os.walk(folder):
            below.sort()
            for name in sorted(files):
                path = os.path.join(parent, name)
                if not name.lower().endswith(FORMATS) or not os.path.isfile(path):
                    continue
                digest = hashlib.sha256(open(path, "rb").read())
                if name.lower().endswith(".gltf"):
                    # A document and its buffers are one.
                    text = open(path, errors="replace").read()
                    for uri in re.findall(r'"uri"\s*:\s*"([^":]+\.(?:bin|glbin))"', text):
                        beside = os.path.join(parent, uri)
                        digest.update(open(beside, "rb").read() if os.path.isfile(beside) else b"")
                digest = digest.hexdigest()
                group = os.path.relpath(path, folder).split(os.sep)[0]
                if digest in seen or groups[group] >= most:
                    continue
                seen.add(digest)
                groups[group] += 1
                found.append((path, digest))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--cache")
    parser.add_argument("--list", dest="results")
    parser.add_argument("--most", type=int, default=400)
    arguments = parser.parse_args()
    cache = {}
    if arguments.cache and os.path.exists(arguments.cache):
        cache = json.load(open(arguments.cache))
    readers = {name: Reader(name) for name in READERS}
    results = []
    files = models(arguments.folders, arguments.most)
    for i, (path, digest) in enumerate(files):
        if sys.stderr.isatty():
            print(f"\r{i} of {len(files)}", end="", file=sys.stderr)
        found = cache.setdefault(digest, {})
        for name, reader in readers.items():
            if name not in found:
                found[name] = reader.read(os.path.abspath(path))
        if arguments.cache and i % 50 == 0:
            json.dump(cache, open(arguments.cache, "w"))
        results.append(judge(path, read_stride(path), {name: found[name] for name in READERS}))
    if arguments.cache:
        json.dump(cache, open(arguments.cache, "w"))
    if arguments.results:
        json.dump(results, open(arguments.results, "w"), indent=1)
    sys.exit(table(results))


def judge(path, ours, others):
    result = {"path": path, "stride": ours, "others": others, "verdict": "wrong", "why": ""}
    read = {name: found for name, found in others.items() if "error" not in found}
    if is_posed(path):
        read = {name: found for name, found in read.items() if name == "blender"}
    if "fault" in ours:
        result["why"] = ours["fault"]
    elif "refused" in ours:
        reason = refusal(ours["refused"], others)
        result["verdict"], result["why"] = ("refused", reason) if reason else ("unclear", ours["refused"])
    else:
        against = {name: differences(ours, found) for name, found in read.items()}
        equal = [name for name, differs in against.items() if not differs]
        unequal = [found for name, found in read.items() if name not in equal and "bounds" in found]
        together = [sum(not differences({**a, "area": sum(a["area"]) / 2}, b) for b in unequal) for a in unequal]
        if equal and len(equal) >= max(together, default=0):
            result["verdict"], result["why"] = "equal", " ".join(equal)
        elif reason := explain(path, ours, read):
            result["verdict"], result["why"] = "explained", reason
        elif not read:
            result["verdict"], result["why"] = "alone", "no independent reader reads it"
        else:
            result["why"] = "; ".join(f"{name}: {', '.join(differs)}" for name, differs in against.items())
    return result


def table(results):
    """Prints the table as Markdown, and gives the exit code."""
    by_format = collections.defaultdict(collections.Counter)
    for result in results:
        suffix = os.path.splitext(result["path"])[1].lower()
        by_format[suffix][result["verdict"]] += 1
    verdicts = ["equal", "explained", "refused", "alone", "unclear", "wrong"]
    print("\n| format | files | " + " | ".join(verdicts) + " |\n|---|" + "---|" * (len(verdicts) + 1))
    for suffix in sorted(by_format):
        counts = by_format[suffix]
        print(f"| {suffix} | {sum(counts.values())} | " + " | ".join(str(counts[v]) for v in verdicts) + " |")
    for verdict in ("explained", "refused"):
        reasons = collections.Counter(r["why"] for r in results if r["verdict"] == verdict)
        print(f"\n| {verdict} | files |\n|---|---|")
        for reason, count in reasons.most_common():
            print(f"| {reason} | {count} |")
    bad = [r for r in results if r["verdict"] in ("alone", "unclear", "wrong")]
    for result in bad:
        print(f"\n{result['verdict']}: {result['path']}: {result['why']}")
    return 1 if bad else 0


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--worker":
        work(sys.argv[2])
    else:
        main()
