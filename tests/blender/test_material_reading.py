# SPDX-License-Identifier: GPL-3.0-or-later
"""Node networks read on meshes, beside what Cycles bakes of them."""

from pathlib import Path

import numpy as np
import pytest

from tests.blender.building import add_mesh, add_shader, add_square, colors, node_material

SIZE = 12


@pytest.fixture(scope="module")
def read(addon, blender):
    """Give a function that reads the surfaces of objects, and returns them with what it has to tell."""
    module = addon("face_surfaces")

    def read(*objects):
        depsgraph = blender.context.evaluated_depsgraph_get()
        reader, notes = module.SurfaceReader(), []
        for obj in objects:
            evaluated = obj.evaluated_get(depsgraph)
            reader.add(evaluated.to_mesh(), evaluated)
            evaluated.to_mesh_clear()
        return reader.finish(notes), notes

    return read


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


def bake(bpy, objects, kind):
    """Let Cycles bake diffuse color or emission at the corners of objects; return their means over faces."""
    scene = bpy.data.scenes.new("Reference")
    scene.render.engine = 'CYCLES'
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 4, False, False
    for obj in objects:
        scene.collection.objects.link(obj)
        layer = obj.data.color_attributes.new("Reference", 'FLOAT_COLOR', 'CORNER')
        obj.data.color_attributes.active_color = layer
    chosen = {"scene": scene, "view_layer": scene.view_layers[0], "object": objects[0], "active_object": objects[0]}
    chosen |= {"selected_objects": objects, "selected_editable_objects": objects}
    with bpy.context.temp_override(**chosen):
        bpy.ops.object.bake(type=kind, pass_filter={'COLOR'} if kind == 'DIFFUSE' else set(), target='VERTEX_COLORS')
    faces = []
    for obj in objects:
        layer = obj.data.color_attributes["Reference"]
        values = np.zeros(4 * len(layer.data), np.float32)
        layer.data.foreach_get("color", values)
        obj.data.color_attributes.remove(layer)
        faces.append(values.reshape(-1, 4, 4)[..., :3].mean(axis=1, dtype=float).clip(0.0))
    bpy.data.scenes.remove(scene)
    return faces


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


@pytest.fixture(scope="module")
def both(read, blender):
    """Reflectance and radiance of the faces of grids by name, as they are read and as Cycles bakes them."""
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = blender.context.scene
    grids = [grid(scene, build(Network(blender, name))) for name, build in NETWORKS.items()]
    ours, notes = read(*grids)
    theirs = [bake(blender, grids, kind) for kind in ('DIFFUSE', 'EMIT')]
    # Nothing but metal, holes, and colors below black is worth a word.
    told = {"cut out", "metal and coat", "mix linear_light", "mix subtract"}
    assert {note.split("'")[1] for note in notes} == told
    read_ones = [(surfaces.reflectance, surfaces.emission / np.pi) for surfaces in ours]
    return dict(zip(NETWORKS, zip(read_ones, zip(*theirs, strict=True), strict=True), strict=True))


@pytest.mark.parametrize("name", NETWORKS)
def test_a_network_is_read_as_cycles_bakes_it(both, name):
    # Cycles' corners miss what patterns with edges do between them.
    edged = name in {"repeat", "clip", "mirror", "math", "checker", "voronoi in object space"}
    for ours, theirs in zip(*both[name], strict=True):
        np.testing.assert_allclose(ours.mean(axis=0), theirs.mean(axis=0), rtol=0.12 if edged else 0.015, atol=0.003)
        # Face by face too, but for the edges of patterns.
        assert np.median(np.abs(ours - theirs)) <= (0.1 if edged else 0.02) * theirs.max() + 1e-6


def untouched(bpy):
    """Return what there is in the file, but for the picture that a render leaves."""
    kinds = ("scenes", "objects", "meshes", "materials", "node_groups", "images", "worlds", "cameras")
    return {kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in kinds}


def square(scene, material, name="Square"):
    """Add a unit square of one face with UV coordinates from 0 to 1."""
    obj = grid(scene, material, 1)
    obj.name = name
    return obj


def test_what_cycles_reads_leaves_nothing_behind(read, blender, scene):
    material = noisy(Network(blender, "Noisy"))
    group = blender.data.node_groups.new("Unused inside", 'ShaderNodeTree')
    material.node_tree.nodes.new('ShaderNodeGroup').node_tree = group
    obj = square(scene, material)
    links, users = len(material.node_tree.links), (group.users, material.users)
    before, layers = untouched(blender), [layer.name for layer in obj.data.color_attributes]
    (surfaces,), notes = read(obj)
    assert notes == [] and surfaces.paint.reflectance.std() > 0.05
    assert untouched(blender) == before and [layer.name for layer in obj.data.color_attributes] == layers
    assert len(material.node_tree.links) == links and scene.render.engine != 'CYCLES'
    # Blender 4.2 counts what is inside a material once too often when that is copied.
    assert material.users == users[1] and (group.users == users[0] or blender.app.version < (4, 5, 0))


def test_each_face_has_the_material_of_its_slot(read, blender, scene):
    painted, plain = (Network(blender, name) for name in ("Painted", "Plain"))
    image = painted.diffuse(painted.image())
    obj = grid(scene, image, 4)
    plain.diffuse((0.1, 0.2, 0.3, 1))
    for material in (None, plain.material):
        obj.data.materials.append(material)
    obj.material_slots[2].link = 'OBJECT'
    other = Network(blender, "Other")
    obj.material_slots[2].material = other.diffuse((0.4, 0.5, 0.6, 1))
    # The last is beyond the last slot and has that one's.
    index = np.array([0, 1, 2, 7] * 4, np.int32)
    obj.data.polygons.foreach_set("material_index", index)
    (surfaces,), notes = read(obj)
    assert notes == []
    rho = surfaces.reflectance.reshape(4, 4, 3)
    np.testing.assert_allclose(rho[:, 1], 0.8)
    np.testing.assert_allclose(rho[:, 2:], np.broadcast_to((0.4, 0.5, 0.6), (4, 2, 3)), rtol=1e-6)
    assert np.ptp(rho[:, 0], axis=0).max() > 0.1
    corner = surfaces.paint.corner_reflectance.reshape(4, 4, 4, 3)
    np.testing.assert_allclose(corner[:, 1], 0.8, rtol=1e-6)


def test_a_missing_image_is_named_and_grey(read, blender, scene, tmp_path):
    network = Network(blender, "Torn")
    image = blender.data.images.new("Lost", 8, 8)
    image.filepath_raw, image.source = str(tmp_path / "nowhere.png"), 'FILE'
    (surfaces,), notes = read(square(scene, network.diffuse(network.image(image=image))))
    np.testing.assert_allclose(surfaces.reflectance, 0.5)
    assert len(notes) == 1 and "'Torn'" in notes[0] and "'Lost'" in notes[0]


def test_images_on_disk_and_packed_are_read_alike(read, blender, scene, tmp_path):
    made = picture(blender, "Made")
    made.filepath_raw, made.file_format = str(tmp_path / "made.png"), 'PNG'
    made.save()
    loaded = blender.data.images.load(str(tmp_path / "made.png"))
    objects = []
    for image in (made, loaded):
        network = Network(blender)
        objects.append(square(scene, network.diffuse(network.image(image=image))))
    (from_memory, from_disk), _ = read(*objects)
    np.testing.assert_allclose(from_disk.reflectance, from_memory.reflectance, rtol=0.01)
    assert not loaded.has_data  # Blender holds no more than before


def test_missing_maps_and_attributes_are_told(read, blender, scene):
    network = Network(blender, "Bare")
    color = network.image(Vector=network('ShaderNodeUVMap', properties={"uv_map": "Gone"}))
    material = network.shown(network('ShaderNodeBsdfDiffuse', Color=color))
    other = Network(blender, "Lone")
    other.diffuse(other('ShaderNodeAttribute', "Color", {"attribute_name": "Away"}))
    _, notes = read(square(scene, material), square(scene, other.material, "Second"))
    assert ["'Bare'" in notes[0] and "'Gone'" in notes[0], "'Lone'" in notes[1] and "'Away'" in notes[1]] == [True] * 2


def test_tiles_and_loose_image_nodes_do_not_stop_a_reading(read, blender, scene):
    tiled = blender.data.images.new("Tiles", 16, 16, tiled=True)
    one, other = Network(blender, "Tiled"), Network(blender, "Empty")
    objects = [
        square(scene, one.diffuse(one.image(image=tiled))),
        square(scene, other.diffuse(other('ShaderNodeTexImage', "Color")), "Second"),
    ]
    surfaces, notes = read(*objects)
    assert np.isfinite(surfaces[0].reflectance).all()
    np.testing.assert_allclose(surfaces[1].reflectance, 0.5)
    assert any("'Empty'" in note for note in notes)


def test_a_textured_floor_lights_walls_with_its_colors(extension, blender, scene):
    """Red on one half, green on the other: a wall beside each."""
    network = Network(blender, "Halves")
    image = blender.data.images.new("Halves", 64, 64)
    pixels = np.zeros((64, 64, 4), np.float32)
    pixels[:, :32, 0] = pixels[:, 32:, 1] = pixels[..., 3] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    network.principled(Base__Color=network.image(image=image))
    square(scene, network.material, "Floor")
    white = Network(blender, "White")
    white.diffuse((0.5, 0.5, 0.5, 1))
    for name, x in (("Left", 0.0), ("Right", 1.0)):
        inwards = (0, 1, 2, 3) if x == 0.0 else (3, 2, 1, 0)
        add_mesh(scene, name, [(x, 0, 0), (x, 1, 0), (x, 1, 1), (x, 0, 1)], [inwards], white.material)
    sun = blender.data.objects.new("Sun", blender.data.lights.new("Sun", 'SUN'))
    scene.collection.objects.link(sun)
    assert blender.ops.radiosity.bake() == {'FINISHED'}
    color = {}
    for name in ("Left", "Right", "Floor"):
        layer = scene.objects[name].data.color_attributes["Radiosity"]
        values = np.zeros(4 * len(layer.data), np.float32)
        layer.data.foreach_get("color", values)
        color[name] = values.reshape(-1, 4)[:, :3]
    left, right = (color[name].mean(axis=0) for name in ("Left", "Right"))
    assert left[0] > 1.5 * left[1] and right[1] > 1.5 * right[0]
    # The floor's corners show their own half.
    np.testing.assert_allclose(color["Floor"][[0, 3]].argmax(axis=1), 0)
    np.testing.assert_allclose(color["Floor"][[1, 2]].argmax(axis=1), 1)


def test_without_cycles_a_constant_stands_in_and_is_told(run_blender, extension):
    """Disabling Cycles cannot be undone in one process, so this one has its own."""
    root = str(Path(extension.__file__).resolve().parent)
    done = run_blender(
        f"""
import sys, importlib, pathlib
import bpy, addon_utils
addon_utils.disable("cycles")
root = pathlib.Path({root!r})
sys.path.insert(0, str(root.parent))
module = importlib.import_module(root.name + ".radiosity_addon.face_surfaces")
bpy.ops.mesh.primitive_plane_add()
obj = bpy.context.object
material = bpy.data.materials.new("Noisy")
if material.node_tree is None:
    material.use_nodes = True
tree = material.node_tree
principled = next(node for node in tree.nodes if node.bl_idname == 'ShaderNodeBsdfPrincipled')
principled.inputs["Base Color"].default_value = (0.1, 0.2, 0.3, 1.0)
tree.links.new(tree.nodes.new('ShaderNodeTexNoise').outputs[0], principled.inputs["Base Color"])
obj.data.materials.append(material)
reader, notes = module.SurfaceReader(), []
reader.add(obj.data, obj)
(surfaces,) = reader.finish(notes)
assert abs(surfaces.reflectance - (0.1, 0.2, 0.3)).max() < 1e-6, surfaces.reflectance
assert any("'Noisy'" in note and "Cycles" in note for note in notes), notes
"""
    )
    assert done.returncode == 0, done.stderr


def test_no_node_of_blender_stops_a_reading(read, blender, scene):
    kinds = [kind for kind in dir(blender.types) if kind.startswith("ShaderNode") and kind not in {'ShaderNodeTree'}]
    objects = []
    for kind in kinds:
        network = Network(blender, kind)
        try:
            node = network.tree.nodes.new(kind)
        except RuntimeError:
            continue  # a base class, or of other trees
        for output in node.outputs:
            if output.type == 'SHADER':
                network.shown(output)
            else:
                network.principled(Base__Color=output)
        objects.append(square(scene, network.material, kind))
    surfaces, notes = read(*objects)
    assert len(surfaces) == len(objects) > 70
    for each in surfaces:
        assert np.isfinite(each.reflectance).all() and np.isfinite(each.emission).all()
        assert (each.reflectance >= 0).all() and (each.emission >= 0).all()
    assert all(note.startswith(("Material '", "Node")) for note in notes)


def test_paint_follows_objects_that_are_moved_and_mirrored(addon, blender, scene):
    module = addon("scene_reader")
    network = Network(blender)
    obj = grid(scene, network.diffuse(network.paint()), 3)
    obj.location, obj.scale, obj.rotation_euler = (5.0, 1.0, -2.0), (-2.0, 3.0, 1.0), (0.3, 0.0, 1.0)
    glow = Network(blender, "Glow")
    add_mesh(scene, "Lamp", [(0, 0, 9), (1, 0, 9), (0, 1, 9)], [(0, 1, 2)], glow.shown(glow('ShaderNodeEmission')))
    depsgraph = blender.context.evaluated_depsgraph_get()
    surfaces = module.read_scene(scene, blender.context.view_layer, depsgraph).scene
    matrix = np.array(obj.matrix_world)
    corners = surfaces.face_object[surfaces.corner_face] == list(surfaces.object_names).index("Grid")
    at = (surfaces.vertices[surfaces.corner_vertex[corners]] - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
    # Inside the grid the mean around a vertex is what is painted there.
    inner = ((at[:, :2] > 0.1) & (at[:, :2] < 0.9)).all(axis=1)
    expected = np.stack([at[:, 0], at[:, 1] ** 2, 0.5 * at[:, 0] * at[:, 1]], axis=1)[inner]
    np.testing.assert_allclose(surfaces.corner_reflectance[corners][inner], expected, atol=0.03)
    face = surfaces.face_start[np.flatnonzero(surfaces.face_object == surfaces.face_object[0])]
    quads = surfaces.vertices[surfaces.corner_vertex[face[:, None] + np.arange(4)]]
    known, reflected, _ = surfaces.paint.means(quads, surfaces.corner_face[face])
    assert known.all()
    np.testing.assert_allclose(reflected, surfaces.reflectance[surfaces.corner_face[face]], atol=0.02)


def test_pixels_that_are_no_numbers_or_too_bright_do_no_harm(scene):
    import bpy

    image = bpy.data.images.new("Hot", 4, 4, float_buffer=True, is_data=True)
    pixels = np.full((4, 4, 4), 0.5, np.float32)
    pixels[0, :, 0] = (np.nan, np.inf, -np.inf, -3.0)
    pixels[1, :, 1] = 1e38
    image.pixels.foreach_set(pixels.ravel())
    material, output = node_material("Hot")
    shader = add_shader(material, 'ShaderNodeBsdfPrincipled', output.inputs["Surface"], Emission_Strength=100.0)
    texture = material.node_tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    for socket in ("Base Color", "Emission Color"):
        material.node_tree.links.new(texture.outputs["Color"], shader.inputs[socket])
    square = add_square(scene, material=material)
    square.data.uv_layers.new(name="UVMap")
    assert bpy.ops.radiosity.bake() == {'FINISHED'}
    assert np.isfinite(colors(square.data)).all()
    assert colors(square.data).max() > 1.0
    # 1e38 is finite, but not what becomes of it.
    first, second, *_ = bpy.context.window_manager.radiosity.warnings.splitlines()
    assert first.startswith("Material 'Hot': 3 pixels of image 'Hot' ") and "negative" in second
