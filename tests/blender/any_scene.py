# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of any nodes, lamps, meshes, modifiers and modes, thrown together by a seed."""

import numpy as np

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, add_mesh, node_material

ODD = [0.0, 1.0, -1.0, 1e-6, 1e6, float("nan"), float("inf"), 3e38]
# No nodes, or none that do anything alone.
LEFT_OUT = {'ShaderNode', 'ShaderNodeTree', 'ShaderNodeCustomGroup', 'ShaderNodeGroup', 'ShaderNodeScript'}


def number(rng, odd=0.05):
    """Return a number as people choose them, or now and then an odd one."""
    return float(rng.choice(ODD)) if rng.random() < odd else float(rng.uniform(0.0, 1.5))


def choose(rng, items):
    return items[int(rng.integers(len(items)))]


def images(bpy, rng):
    """Return an image: whole, odd, empty, missing, or tiled."""
    kind = choose(rng, ("plain", "float", "odd", "missing", "tiled", "none"))
    if kind == "none":
        return None
    image = bpy.data.images.new(kind, 4, 4, float_buffer=kind in {"float", "odd"}, alpha=True, tiled=kind == "tiled")
    if kind == "missing":
        image.filepath_raw, image.source = "//nowhere.png", 'FILE'
    elif kind != "tiled":
        pixels = rng.random(64).astype(np.float32)
        if kind == "odd":
            pixels[rng.integers(0, 64, 9)] = np.float32(choose(rng, ODD))
        image.pixels.foreach_set(pixels)
    return image


def fill(bpy, rng, tree, kinds, nodes=8):
    """Add nodes of any kinds to a tree, set what they have to anything, and link what fits."""
    made = []
    for _ in range(int(rng.integers(1, nodes))):
        try:
            node = tree.nodes.new(choose(rng, kinds))
        except RuntimeError:
            continue  # not in this tree, or not in this version
        made.append(node)
        for prop in node.bl_rna.properties:
            if prop.is_readonly or rng.random() < 0.5:
                continue
            try:
                if prop.type == 'ENUM' and prop.identifier not in {"type", "bl_icon"}:
                    setattr(node, prop.identifier, choose(rng, [item.identifier for item in prop.enum_items]))
                elif prop.identifier == "image":
                    node.image = images(bpy, rng)
                elif prop.identifier in {"mute", "use_clamp", "use_alpha", "from_instancer"}:
                    setattr(node, prop.identifier, bool(rng.random() < 0.2))
                elif prop.identifier in {"attribute_name", "layer_name", "uv_map"}:
                    setattr(node, prop.identifier, choose(rng, ["", "Map", "Paint", "Nowhere"]))
            except (TypeError, AttributeError, IndexError):
                continue  # a choice that depends on another one
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            if isinstance(value, float) and rng.random() < 0.5:
                socket.default_value = number(rng)
            elif socket.type in {'RGBA', 'VECTOR'} and value is not None and rng.random() < 0.5:
                socket.default_value = [number(rng) for _ in value]
    for node in tree.nodes:
        for socket in node.inputs:
            wish = 0.9 if socket.type == 'SHADER' else 0.4
            fits = [
                output
                for other in tree.nodes
                for output in other.outputs
                if other != node and (output.type == 'SHADER') == (socket.type == 'SHADER')
            ]
            if fits and rng.random() < wish:
                tree.links.new(choose(rng, fits), socket)


def material(bpy, rng, kinds):
    made, _ = node_material("Any")
    if rng.random() < 0.9:
        fill(bpy, rng, made.node_tree, kinds)
    if rng.random() < 0.1:
        made.node_tree.nodes.clear()
    return made


def mesh(bpy, rng, scene, materials):
    """Add an object of a few faces in any state."""
    vertices = np.array(CUBE_VERTICES, float) * 2 - 1
    faces = [face[:: choose(rng, (1, -1))] for face in CUBE_FACES if rng.random() < 0.8]
    if rng.random() < 0.3:
        vertices += rng.normal(size=vertices.shape) * choose(rng, (1e-7, 1e-3, 0.3))
    if rng.random() < 0.1:
        vertices[rng.integers(8), rng.integers(3)] = choose(rng, ODD[5:])
    if rng.random() < 0.2:
        faces += [faces[0]] if faces else []
    obj = add_mesh(scene, f"Any {len(scene.objects)}", vertices, faces)
    data = obj.data
    for _ in range(int(rng.integers(0, 3))):
        data.materials.append(choose(rng, materials))
    if faces:
        data.polygons.foreach_set("material_index", rng.integers(0, 4, len(faces)).astype(np.int32))
        data.polygons.foreach_set("use_smooth", rng.random(len(faces)) < 0.5)
    if rng.random() < 0.6:
        layer = data.uv_layers.new(name="Map")
        values = rng.uniform(-2, 2, 2 * len(data.loops)).astype(np.float32)
        values[rng.random(len(values)) < 0.05] = np.float32(choose(rng, ODD))
        layer.data.foreach_set("uv", values)
    for name, kind, domain in (
        ("Paint", 'FLOAT_COLOR', 'CORNER'),
        ("Text", 'STRING', 'FACE'),
        ("Heat", 'FLOAT', 'POINT'),
        ("Radiosity", choose(rng, ('FLOAT', 'BYTE_COLOR', 'FLOAT_COLOR')), choose(rng, ('POINT', 'CORNER', 'FACE'))),
    ):
        if rng.random() < 0.15:
            data.attributes.new(name, kind, domain)
    if rng.random() < 0.3:
        obj.vertex_groups.new(name="Group").add([0, 1, 2], 0.5, 'REPLACE')
    if rng.random() < 0.2:
        obj.shape_key_add(name="Basis")
        obj.shape_key_add(name="Key").value = 0.5
    for kind in ('SUBSURF', 'ARRAY', 'MIRROR', 'SOLIDIFY', 'BEVEL', 'DECIMATE', 'TRIANGULATE', 'WIREFRAME', 'MASK'):
        if rng.random() < 0.06:
            obj.modifiers.new(kind, kind)
    return obj


def other(bpy, rng, scene, known):
    """Add a curve, text, metaball, lattice, camera, empty, or a duplicate of what there is."""
    kind = choose(rng, ("curve", "text", "meta", "empty", "duplicate", "instance", "camera"))
    if kind == "duplicate":
        obj = choose(rng, known).copy()
    elif kind == "instance":
        obj = bpy.data.objects.new("Instances", None)
        obj.instance_type, obj.instance_collection = 'COLLECTION', bpy.data.collections.new("Group")
        obj.instance_collection.objects.link(choose(rng, known))
    elif kind == "meta":
        data = bpy.data.metaballs.new("Ball")
        data.elements.new()
        obj = bpy.data.objects.new("Ball", data)
    elif kind in {"curve", "text"}:
        data = bpy.data.curves.new(kind, 'CURVE' if kind == "curve" else 'FONT')
        data.dimensions = '2D' if kind == "curve" else data.dimensions
        if kind == "curve":
            spline = data.splines.new('POLY')
            spline.points.add(4)
            spline.points.foreach_set("co", rng.uniform(-1, 1, 20).astype(np.float32))
            spline.use_cyclic_u = True
            data.fill_mode, data.extrude = 'BOTH', number(rng)
        else:
            data.body = choose(rng, ("", "A", "\u00e4\u00f6"))
        obj = bpy.data.objects.new(kind, data)
    else:
        obj = bpy.data.objects.new(kind, bpy.data.cameras.new(kind) if kind == "camera" else None)
    scene.collection.objects.link(obj)
    return obj


def lamp(bpy, rng, scene):
    light = bpy.data.lights.new("Lamp", choose(rng, ('POINT', 'SUN', 'SPOT', 'AREA')))
    light.energy = 100.0 * number(rng, 0.2)
    for name in ("size", "size_y", "spread", "shadow_soft_size", "spot_size", "spot_blend", "angle", "exposure"):
        if hasattr(light, name) and rng.random() < 0.4:
            setattr(light, name, number(rng))
    if light.type == 'AREA':
        light.shape = choose(rng, ('SQUARE', 'RECTANGLE', 'DISK', 'ELLIPSE'))
    obj = bpy.data.objects.new("Lamp", light)
    scene.collection.objects.link(obj)
    return obj


def any_file(bpy, rng, scene):
    """Fill a scene with anything."""
    kinds = sorted(name for name in dir(bpy.types) if name.startswith("ShaderNode") and name not in LEFT_OUT)
    materials = [material(bpy, rng, kinds) for _ in range(int(rng.integers(1, 4)))] + [None]
    glow, output = node_material("Glow")
    emission = glow.node_tree.nodes.new('ShaderNodeEmission')
    glow.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    materials.append(glow)
    made = [mesh(bpy, rng, scene, materials) for _ in range(int(rng.integers(1, 4)))]
    made += [other(bpy, rng, scene, made) for _ in range(int(rng.integers(0, 3)))]
    made += [lamp(bpy, rng, scene) for _ in range(int(rng.integers(0, 3)))]
    for obj in made:
        obj.location = rng.uniform(-2, 2, 3)
        obj.rotation_euler = rng.uniform(-3, 3, 3)
        if rng.random() < 0.3:
            obj.scale = [choose(rng, (1.0, -1.0, 0.0, 1e-6, 5.0)) for _ in range(3)]
        if rng.random() < 0.05:
            obj.location.x = choose(rng, ODD)
        if rng.random() < 0.2:
            obj.parent = choose(rng, [one for one in made if one != obj and one.parent is None] or [None])
        for name in ("hide_render", "hide_viewport", "visible_diffuse", "visible_shadow"):
            if rng.random() < 0.07:
                setattr(obj, name, not getattr(obj, name))
        for name in ("exclude", "receive", "occlude", "reflect", "emit"):
            if rng.random() < 0.05:
                setattr(obj.radiosity, name, not getattr(obj.radiosity, name))
    if rng.random() < 0.4:
        scene.world = bpy.data.worlds.new("World")
        strength = number(rng, 0.2)
        if scene.world.node_tree is None:
            scene.world.color = [strength] * 3
        else:
            scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = strength
    chosen = scene.radiosity
    chosen.quality, chosen.max_edge = 'preview', choose(rng, (0.0, 0.0, 0.7, 2.0))
    for name in ("target", "domain", "data_type", "light", "sides"):
        items = scene.radiosity.bl_rna.properties[name].enum_items
        setattr(chosen, name, choose(rng, [item.identifier for item in items]))
    chosen.hide_originals = rng.random() < 0.3
    active = choose(rng, [obj for obj in made if obj.type == 'MESH'])
    if active.name in bpy.context.view_layer.objects:
        bpy.context.view_layer.objects.active = active
        if rng.random() < 0.3 and active.visible_get():
            active.select_set(True)
            bpy.ops.object.mode_set(mode=choose(rng, ('EDIT', 'SCULPT', 'VERTEX_PAINT', 'WEIGHT_PAINT')))
