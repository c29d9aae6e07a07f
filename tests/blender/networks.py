# SPDX-License-Identifier: GPL-3.0-or-later
"""Networks of nodes as materials, and meshes to see them on; `bpy` is there once the `scene` fixture is."""

import numpy as np

from tests.blender.building import add_mesh, node_material

SIZE = 12


def grid(scene, material, size=SIZE):
    """Add a unit square of size x size faces with UV coordinates from 0 to 1, and colors."""
    steps = np.arange(size + 1) / size
    vertices = [(x, y, 0.0) for y in steps for x in steps]
    corner = np.arange(size)[:, None] * (size + 1) + np.arange(size)
    faces = np.stack([corner, corner + 1, corner + size + 2, corner + size + 1], axis=-1).reshape(-1, 4)
    obj = add_mesh(scene, "Grid", vertices, faces.tolist(), material)
    at = np.array(vertices)[faces.ravel(), :2]
    # Off the borders of images, where one end runs into the other.
    obj.data.uv_layers.new(name="UV").uv.foreach_set("vector", (0.03 + 0.94 * at).astype(np.float32).ravel())
    color = np.ones((len(at), 4), np.float32)
    color[:, :3] = np.stack([at[:, 0], at[:, 1] ** 2, 0.5 * at[:, 0] * at[:, 1]], axis=1)
    obj.data.color_attributes.new("Paint", 'FLOAT_COLOR', 'CORNER').data.foreach_set("color", color.ravel())
    obj.data.color_attributes.render_color_index = 0
    share = obj.data.attributes.new("share", 'FLOAT', 'FACE')
    share.data.foreach_set("value", (np.arange(size * size) % 5 / 4).astype(np.float32))
    return obj


def picture(bpy, name="Picture", width=48, height=32, alpha=False, float_buffer=False, space=None):
    """Make an image of smooth colors, and of smooth alpha if asked for."""
    image = bpy.data.images.new(name, width, height, alpha=alpha, float_buffer=float_buffer)
    if space is not None:
        image.colorspace_settings.name = space
    y, x = np.mgrid[0:height, 0:width]
    values = np.ones((height, width, 4), np.float32)
    values[..., 0] = 0.2 + 0.7 * x / width
    values[..., 1] = 0.5 + 0.4 * np.sin(2 * np.pi * y / height)
    values[..., 2] = 0.9 - 0.8 * x / width * y / height
    if alpha:
        values[..., 3] = 0.3 + 0.6 * y / height
    image.pixels.foreach_set(values.ravel())
    image.update()
    return image


class Network:
    """Builds a material: nodes by their kind, linked as their inputs are given."""

    def __init__(self, bpy, name="Network"):
        self.bpy = bpy
        self.material, self.output = node_material(name)
        self.tree = self.material.node_tree

    def __call__(self, kind, /, out=0, properties=None, **inputs):
        """Add a node and return one of its outputs; inputs are values, or outputs of other nodes."""
        node = self.tree.nodes.new(kind)
        for name, value in (properties or {}).items():
            setattr(node, name, value)
        for name, value in inputs.items():
            socket = self.socket(node.inputs, name)
            if isinstance(value, self.bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return self.socket(node.outputs, out)

    @staticmethod
    def socket(sockets, name):
        """Return a socket by number or identifier."""
        if isinstance(name, int):
            return sockets[name]
        return next(s for s in sockets if s.identifier == name.replace("__", " ") or s.identifier == name)

    def shown(self, shader):
        self.tree.links.new(shader, self.output.inputs[0])
        return self.material

    def diffuse(self, color):
        return self.shown(self('ShaderNodeBsdfDiffuse', Color=color))

    def principled(self, **inputs):
        return self.shown(self('ShaderNodeBsdfPrincipled', Specular__IOR__Level=0.0, **inputs))

    def image(self, out="Color", image=None, **inputs):
        properties = {"image": image or picture(self.bpy)}
        return self('ShaderNodeTexImage', out, properties, **inputs)

    def paint(self, out="Color"):
        return self('ShaderNodeVertexColor', out, {"layer_name": "Paint"})


def mapped(n):
    uv = n('ShaderNodeTexCoord', "UV")
    moved = n('ShaderNodeMapping', Vector=uv, Location=(0.3, 0.1, 0), Rotation=(0, 0, 0.7), Scale=(2, 1.5, 1))
    return n.diffuse(n.image(Vector=moved))


def extended(n, kind):
    uv = n('ShaderNodeUVMap', properties={"uv_map": "UV"})
    moved = n('ShaderNodeMapping', Vector=uv, Location=(-0.4, -0.3, 0), Scale=(2, 2, 1))
    color = n.image(Vector=moved)
    color.node.extension = kind
    return n.diffuse(color)


def mixed(n, mode):
    grey = n('ShaderNodeRGB')
    grey.default_value = (0.7, 0.3, 0.5, 1)
    properties = {"data_type": 'RGBA', "blend_type": mode}
    factor = n.image("Alpha", picture(n.bpy, "Mask", alpha=True))
    color = n('ShaderNodeMix', "Result_Color", properties, Factor_Float=factor, A_Color=n.paint(), B_Color=grey)
    return n.diffuse(color)


def math(n):
    x = n('ShaderNodeSeparateXYZ', "X", Vector=n('ShaderNodeTexCoord', "UV"))
    wave = n('ShaderNodeMath', **math_of('SINE', n('ShaderNodeMath', **math_of('MULTIPLY', x, 9.0)), 0.0))
    power = n('ShaderNodeMath', **math_of('POWER', n('ShaderNodeMath', **math_of('ABSOLUTE', wave, 0.0)), 1.7))
    ranged = n('ShaderNodeMapRange', "Result", {"interpolation_type": 'SMOOTHSTEP'}, Value=power, To__Min=0.1)
    return n.diffuse(ranged)


def math_of(operation, first, second):
    return {"properties": {"operation": operation}, "Value": first, "Value_001": second}


def changed(n):
    color = n('ShaderNodeHueSaturation', Hue=0.7, Saturation=0.8, Value=0.9, Fac=0.8, Color=n.image())
    color = n('ShaderNodeBrightContrast', Color=color, Bright=0.05, Contrast=0.2)
    color = n('ShaderNodeGamma', Color=color, Gamma=1.3)
    return n.diffuse(n('ShaderNodeInvert', Fac=0.6, Color=color))


def ramped(n, interpolation):
    ramp = n('ShaderNodeValToRGB', Fac=n.paint())
    ramp.node.color_ramp.interpolation = interpolation
    ramp.node.color_ramp.elements[0].color = (0.8, 0.1, 0.0, 1)
    ramp.node.color_ramp.elements.new(0.3).color = (0.1, 0.7, 0.2, 0.5)
    return n.diffuse(ramp)


def curved(n):
    color = n('ShaderNodeRGBCurve', Fac=0.9, Color=n.paint())
    curves = color.node.mapping.curves
    curves[3].points.new(0.4, 0.7)
    curves[1].points.new(0.6, 0.2)
    return n.diffuse(color)


def parted(n):
    parts = n('ShaderNodeSeparateColor', "Red", {"mode": 'HSV'}, Color=n.image()).node
    whole = n('ShaderNodeCombineColor', 0, {"mode": 'HSL'}, Red=parts.outputs[0], Green=parts.outputs[1], Blue=0.4)
    return n.diffuse(whole)


def grouped(n):
    group = n.bpy.data.node_groups.new("Inside", 'ShaderNodeTree')
    group.interface.new_socket("Color", in_out='INPUT', socket_type='NodeSocketColor')
    group.interface.new_socket("Power", in_out='INPUT', socket_type='NodeSocketFloat')
    group.interface.new_socket("Shader", in_out='OUTPUT', socket_type='NodeSocketShader')
    begin, end = group.nodes.new('NodeGroupInput'), group.nodes.new('NodeGroupOutput')
    diffuse, glow = group.nodes.new('ShaderNodeBsdfDiffuse'), group.nodes.new('ShaderNodeEmission')
    add = group.nodes.new('ShaderNodeAddShader')
    for one, other in (
        (begin.outputs[0], diffuse.inputs[0]),
        (begin.outputs[1], glow.inputs[1]),
        (diffuse.outputs[0], add.inputs[0]),
        (glow.outputs[0], add.inputs[1]),
        (add.outputs[0], end.inputs[0]),
    ):
        group.links.new(one, other)
    node = n.tree.nodes.new('ShaderNodeGroup')
    node.node_tree = group
    n.tree.links.new(n.image(), node.inputs[0])
    node.inputs[1].default_value = 1.5
    return n.shown(node.outputs[0])


def layered(n):
    diffuse = n('ShaderNodeBsdfDiffuse', Color=n.paint())
    glow = n('ShaderNodeEmission', Color=n.image(), Strength=3.0)
    factor = n('ShaderNodeAttribute', "Fac", {"attribute_name": "share"})
    mix = n('ShaderNodeMixShader')
    for source, target in ((factor, 0), (diffuse, 1), (glow, 2)):
        n.tree.links.new(source, mix.node.inputs[target])
    return n.shown(mix)


def cut_out(n):
    image = picture(n.bpy, "Leaf", alpha=True)
    color = n.image("Color", image)
    return n.principled(Base__Color=color, Alpha=color.node.outputs["Alpha"])


def noisy(n):
    noise = n('ShaderNodeTexNoise', 0, Scale=4.0)
    ramp = n('ShaderNodeValToRGB', Fac=noise)
    ramp.node.color_ramp.elements[0].color = (0.6, 0.2, 0.1, 1)
    return n.principled(Base__Color=ramp, Emission__Color=n.paint(), Emission__Strength=0.5)


NETWORKS = {
    "image": lambda n: n.diffuse(n.image()),
    "image as principled": lambda n: n.principled(Base__Color=n.image()),
    "float image": lambda n: n.diffuse(n.image(image=picture(n.bpy, float_buffer=True))),
    "non-color image": lambda n: n.diffuse(n.image(image=picture(n.bpy, space="Non-Color"))),
    "image with alpha, color alone": lambda n: n.diffuse(n.image(image=picture(n.bpy, alpha=True))),
    "cut out": cut_out,
    "mapped": mapped,
    "repeat": lambda n: extended(n, 'REPEAT'),
    "extend": lambda n: extended(n, 'EXTEND'),
    "clip": lambda n: extended(n, 'CLIP'),
    "mirror": lambda n: extended(n, 'MIRROR'),
    "color attribute": lambda n: n.diffuse(n.paint()),
    "named attribute": lambda n: n.diffuse(n('ShaderNodeAttribute', "Color", {"attribute_name": "Paint"})),
    "attribute of faces": lambda n: n.diffuse(n('ShaderNodeAttribute', "Fac", {"attribute_name": "share"})),
    "math": math,
    "color changes": changed,
    "ramp": lambda n: ramped(n, 'LINEAR'),
    "ramp of steps": lambda n: ramped(n, 'CONSTANT'),
    "curves": curved,
    "hsv and hsl": parted,
    "group": grouped,
    "shaders mixed by an attribute": layered,
    "glowing image": lambda n: n.principled(Emission__Color=n.image(), Emission__Strength=4.0),
    "blackbody": lambda n: n.shown(n('ShaderNodeEmission', Color=n('ShaderNodeBlackbody', Temperature=2700.0))),
    "metal and coat": lambda n: n.principled(
        Base__Color=n.image(), Metallic=n.paint(), Coat__Weight=0.8, Coat__Tint=(0.5, 0.7, 0.9, 1), Coat__IOR=1.0001
    ),
    "checker": lambda n: n.diffuse(n('ShaderNodeTexChecker', Scale=5.0)),
    "gradient": lambda n: n.diffuse(n('ShaderNodeTexGradient', properties={"gradient_type": 'EASING'})),
    "noise": noisy,
    "voronoi in object space": lambda n: n.diffuse(
        n('ShaderNodeTexVoronoi', "Color", Vector=n('ShaderNodeTexCoord', "Object"), Scale=3.0)
    ),
    **{f"mix {mode.lower()}": lambda n, mode=mode: mixed(n, mode) for mode in (
        'MIX', 'MULTIPLY', 'SCREEN', 'OVERLAY', 'DODGE', 'BURN', 'SOFT_LIGHT', 'LINEAR_LIGHT', 'DIFFERENCE', 'DIVIDE',
        'SUBTRACT', 'EXCLUSION', 'HUE', 'SATURATION', 'COLOR', 'VALUE', 'DARKEN', 'LIGHTEN', 'ADD',
    )},
}  # fmt: skip


def square(scene, material, name="Square"):
    """Add a unit square of one face with UV coordinates from 0 to 1."""
    obj = grid(scene, material, 1)
    obj.name = name
    return obj
