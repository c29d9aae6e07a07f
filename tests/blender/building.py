# SPDX-License-Identifier: GPL-3.0-or-later
"""Small things to put into a Blender scene; `bpy` is there once the `scene` fixture is."""

import numpy as np

CUBE_VERTICES = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
# Counter-clockwise seen from outside.
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
# A floor, and a lamp over it that shines down, in the thesis's format.
SCENE_TEXT = """\
R 2 (0,0,0) (1,0,0) (1,1,0) (0,1,0) (0,0,1) (0.5,0.5,0.5,1)
E 1 (0,0,1) (1,0,1) (1,1,1) (0,1,1) (0,0,-1) (1,1,1,10)
"""
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def add_mesh(scene, name, vertices, faces, material=None, collection=None):
    """Add a mesh object to a scene and return it."""
    import bpy

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], faces)
    if material is not None:
        mesh.materials.append(material)
    return add_object(collection or scene.collection, name, mesh)


def add_object(where, name, data=None):
    """Add an object to a collection and return it."""
    import bpy

    made = bpy.data.objects.new(name, data)
    where.objects.link(made)
    return made


def add_square(scene, name="Square", material=None, z=0.0, size=1.0):
    """Add a square that faces upwards."""
    corners = [(size * x, size * y, z) for x, y, _ in SQUARE]
    return add_mesh(scene, name, corners, [(0, 1, 2, 3)], material)


def add_light(scene, kind, location=(0.0, 0.0, 0.0), name="Lamp", **properties):
    """Add a lamp that shines down, with properties of its light."""
    import bpy

    light = bpy.data.lights.new(name, kind)
    for key, value in properties.items():
        setattr(light, key, value)
    obj = add_object(scene.collection, name, light)
    obj.location = location
    return obj


def add_room(scene, name="Room", material=None):
    """Add a closed unit cube whose faces look inwards."""
    return add_mesh(scene, name, CUBE_VERTICES, [face[::-1] for face in CUBE_FACES], material)


def node_material(name="Material"):
    """Return a material with an empty node tree but for the output, and the output."""
    import bpy

    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material, material.node_tree.nodes.new('ShaderNodeOutputMaterial')


def add_shader(material, kind, target=None, **values):
    """Add a node, set its inputs by name, and link its first output to an input if one is given."""
    node = material.node_tree.nodes.new(kind)
    for name, value in values.items():
        node.inputs[name.replace("_", " ")].default_value = value
    if target is not None:
        material.node_tree.links.new(node.outputs[0], target)
    return node


def glowing(reflectance=0.5, radiance=1.0, name="Glowing"):
    """Return a Principled material that reflects and emits grey."""
    material, output = node_material(name)
    add_shader(
        material,
        'ShaderNodeBsdfPrincipled',
        output.inputs["Surface"],
        Base_Color=(reflectance, reflectance, reflectance, 1.0),
        Emission_Color=(1.0, 1.0, 1.0, 1.0),
        Emission_Strength=radiance,
    )
    return material


def positions(scene):
    """Return the position of every corner of a scene of the core, shape (c, 3) [m]."""
    return scene.vertices[scene.corner_vertex]


def colors(mesh, name="Radiosity"):
    """Return an attribute's colors as an array of shape (n, 4)."""
    layer = mesh.color_attributes[name]
    values = np.zeros(4 * len(layer.data), dtype=np.float32)
    layer.data.foreach_get("color", values)
    return values.reshape(-1, 4)


def lit_pair(scene):
    """Add a lamp that shines down on a floor; return both."""
    lamp = add_square(scene, "Lamp", glowing(reflectance=0.0, radiance=5.0), z=1.0)
    lamp.rotation_euler = (np.pi, 0.0, 0.0)
    lamp.location = (0.0, 1.0, 2.0)
    return lamp, add_square(scene, "Floor")


def copy_collection(blender):
    """Return the collection of the baked copies."""
    (found,) = [found for found in blender.data.collections if "radiosity_hidden" in found]
    return found


def lit_floor(scene):
    """Add a lamp that shines down on a floor of 2 x 1 m; return both."""
    lamp = add_square(scene, "Lamp", glowing(reflectance=0.0, radiance=5.0))
    lamp.rotation_euler, lamp.location = (np.pi, 0.0, 0.0), (0.0, 1.0, 1.0)
    floor = add_mesh(scene, "Floor", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    return lamp, floor
