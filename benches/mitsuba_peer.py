"""Scenes in Mitsuba itself, for the scripts beside this file: with the film that is asked for, and with other models."""

import os
import re
import tempfile

import numpy as np

# What stride says has no counterpart, and the same in Mitsuba: what is changed in objects of a plugin. `to` is the plugin
# that stands in its place, of which the colour is kept; values of properties are set, and of None removed.
CHANGES = [
    (r'the beckmann distribution of bsdf "(\w+)"', {"distribution": "ggx"}),
    (r'specular_reflectance of bsdf "(\w+)"', {"specular_reflectance": None}),
    (r'a texture as specular_reflectance of bsdf "(\w+)"', {"specular_reflectance": None}),
    (r'bsdf "(plastic|roughplastic|pplastic)"', {"to": "diffuse", "colour": "diffuse_reflectance"}),
    (r'bsdf "(principled)"', {"to": "diffuse", "colour": "base_color"}),
    (r'the shadowing function of bsdf "(\w+)"', {"use_shadowing_function": False}),
    (r'texture of emitter "(spot)"', {"texture": None}),
]
# The first and the last row of an environment picture lie on the poles there, and half a row away from them here.
ROWS = 'the rows of emitter "envmap"'
# Integrators that find the light that a path tracer finds, and what they find beside it.
PATHS = {"path", "direct", "aov", "moment"}


def change_for(lack):
    """The plugin that is changed, and how; none if a lack has no equal in Mitsuba."""
    for pattern, change in CHANGES:
        found = re.fullmatch(pattern, lack)
        if found:
            return found[1], change
    return None


class OfMitsuba:
    """A scene in Mitsuba, in which what stride lacks is as stride renders it: these are its differences."""

    # Where Mitsuba looks for its own files.
    places = []

    def __init__(self, path, lacks=(), size=None, **defines):
        import mitsuba

        self.mi = mitsuba
        mitsuba.set_variant("scalar_rgb")
        mitsuba.set_log_level(mitsuba.LogLevel.Error)
        config = mitsuba.parser.ParserConfig("scalar_rgb")
        config.unused_properties = config.unused_parameters = mitsuba.LogLevel.Debug
        # A scene looks for files beside itself, and not where earlier ones did.
        resolver = mitsuba.file_resolver()
        OfMitsuba.places = OfMitsuba.places or [str(place) for place in resolver]
        resolver.clear()
        for place in [os.path.dirname(os.path.abspath(path)), *OfMitsuba.places]:
            resolver.append(place)
        state = mitsuba.parser.parse_file(config, str(path), **defines)
        self.folder, self.differences = tempfile.TemporaryDirectory(), list(lacks)
        for node in state.nodes:
            self.neutral(node, size)
            if node.props.plugin_name() == "bitmap":
                # Halves are exact to 0.05%.
                node.props["format"] = "variant"
            if node.type == mitsuba.ObjectType.Emitter and node.props.plugin_name() == "envmap":
                node.props["filename"] = self.with_rows(node.props["filename"])
                self.differences.append(ROWS)
            for plugin, change in filter(None, map(change_for, lacks)):
                if node.type != mitsuba.ObjectType.Scene and node.props.plugin_name() == plugin:
                    self.change(node.props, change)
        mitsuba.parser.transform_all(config, state)
        scene = mitsuba.parser.instantiate(config, state)
        self.scene = scene[0] if isinstance(scene, list) else scene

    def neutral(self, node, size):
        """Film, sampler and integrator as the judge has them."""
        kind, props = self.mi.ObjectType, node.props
        if node.type == kind.Film and size:
            self.keep(props, "hdrfilm", ())
            props["width"], props["height"] = size
            props["component_format"] = "float32"
        elif node.type == kind.Sampler:
            self.keep(props, "independent", ())
        elif node.type == kind.Integrator and props.plugin_name() not in PATHS:
            if any(self.is_object(props[name]) for name in props.keys()):
                # The light of the integrator in it, which comes first.
                self.keep(props, "aov", ())
                props["aovs"] = "depth:depth"
            else:
                self.keep(props, "path", ("max_depth", "rr_depth"))
        if node.type == kind.Integrator and "hide_emitters" in props:
            del props["hide_emitters"]

    def with_rows(self, name):
        """An environment picture whose rows lie on the poles, and that is the same as one of which they are half a row away.

        Between rows both are straight: with twice as many rows and one more they are equal.
        """
        import OpenEXR

        bitmap = self.mi.Bitmap(str(self.mi.file_resolver().resolve(name)))
        picture = np.asarray(bitmap.convert(self.mi.Bitmap.PixelFormat.RGB, self.mi.Struct.Type.Float32, False))
        around = np.concatenate([picture[:1], picture, picture[-1:]])
        rows = np.empty((2 * len(picture) + 1, *picture.shape[1:]), np.float32)
        rows[1::2], rows[::2] = picture, (around[1:] + around[:-1]) / 2
        path = os.path.join(self.folder.name, f"{abs(hash(name))}.exr")
        OpenEXR.File({"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGB": rows}).write(path)
        return path

    @staticmethod
    def is_object(value):
        """Whether a property is an object or a reference to one, which has a name of its own."""
        return not isinstance(value, (bool, int, float, str))

    @staticmethod
    def keep(props, plugin, names):
        props.set_plugin_name(plugin)
        for name in list(props.keys()):
            if name not in names and not OfMitsuba.is_object(props[name]):
                del props[name]

    @staticmethod
    def change(props, change):
        if "to" in change:
            colour = change["colour"]
            value = props[colour] if colour in props else None
            for name in list(props.keys()):
                del props[name]
            props.set_plugin_name(change["to"])
            if value is not None:
                props["reflectance"] = value
            return
        for name, value in change.items():
            if value is not None:
                props[name] = value
            elif name in props:
                del props[name]

    def pictures(self, samples, replicates):
        """The red, green and blue of pictures with as many seeds."""
        integrator = self.scene.integrator() or self.mi.load_dict({"type": "path"})
        render = lambda seed: self.mi.render(self.scene, integrator=integrator, spp=samples, seed=seed)
        return [np.asarray(render(1001 + seed), np.float64)[..., :3] for seed in range(replicates)]
