# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes with instances of every kind, and what Blender itself shows of them."""

import numpy as np

from tests.blender.building import (
    CUBE_FACES,
    CUBE_VERTICES,
    SQUARE,
    add_mesh,
    add_object,
    add_room,
    add_square,
    glowing,
)


def add_collection(blender, name, parent=None):
    """Add a collection that is in no scene."""
    made = blender.data.collections.new(name)
    if parent is not None:
        parent.children.link(made)
    return made


def instance(blender, scene, collection, name="Instance", where=None):
    """Add an empty that shows a collection."""
    empty = add_object(where or scene.collection, name)
    empty.instance_type, empty.instance_collection = 'COLLECTION', collection
    return empty


def nodes(blender, obj, build):
    """Add geometry nodes: `build(tree, geometry)` returns the socket that goes to the output."""
    tree = blender.data.node_groups.new("Nodes", 'GeometryNodeTree')
    for way in ('INPUT', 'OUTPUT'):
        tree.interface.new_socket("Geometry", in_out=way, socket_type='NodeSocketGeometry')
    first, last = tree.nodes.new('NodeGroupInput'), tree.nodes.new('NodeGroupOutput')
    tree.links.new(build(tree, first.outputs[0]), last.inputs[0])
    obj.modifiers.new("Nodes", 'NODES').node_group = tree


def on_points(tree, points, what):
    node = tree.nodes.new('GeometryNodeInstanceOnPoints')
    tree.links.new(points, node.inputs["Points"])
    tree.links.new(what, node.inputs["Instance"])
    return node.outputs[0]


def shown_in_renders(blender, scene):
    """Return what Blender itself hands a renderer, as (instancer, object) with faces."""
    found = []

    class Looker(blender.types.RenderEngine):
        bl_idname, bl_label, bl_use_preview = 'LOOKER', "Looker", False

        def render(self, depsgraph):
            for one in depsgraph.object_instances:
                if one.object.type == 'MESH' and one.show_self and len(one.object.data.polygons):
                    found.append(((one.parent or one.object).original.name, one.object.original.name))

    add_object(scene.collection, "Camera", blender.data.cameras.new("Camera"))
    scene.camera = scene.objects["Camera"]
    blender.utils.register_class(Looker)
    engine, scene.render.engine = scene.render.engine, 'LOOKER'
    scene.render.resolution_x = scene.render.resolution_y = 4
    try:
        blender.ops.render.render()
    finally:
        scene.render.engine = engine
        blender.utils.unregister_class(Looker)
    return found


def furnished(blender, scene):
    """Return a room with two chairs in a collection that an instance shows, the second of them mirrored."""
    add_room(scene, material=glowing())
    chairs = add_collection(blender, "Chairs")
    # All numbers are such that nothing has to be rounded.
    for x in (0.0, 0.375):
        chair = add_mesh(scene, "Chair", np.array(CUBE_VERTICES) * 0.25, CUBE_FACES, glowing(0.4, 0.0), chairs)
        chair.location, chair.scale = (
            (x, 0.125 if not x else 0.375, 0.25 if x else 0.0),
            (-1, -1, -1) if x else (1, 1, 1),
        )
    chairs.instance_offset = (-0.125, 0.0, 0.0)
    shown = instance(blender, scene, chairs)
    shown.location, shown.scale = (0.125, 0.25, 0.0625), (1.0, 1.0, 1.5)
    return shown


def everything(blender, scene):
    """Fill a scene with instances of all kinds, some of them hidden in one of the ways there are."""
    forest = collections(blender, scene)
    parents(scene)
    leaf = add_square(scene, "Leaf")
    leaf.hide_render = True
    geometry_nodes(blender, scene, leaf)
    particles(blender, scene, leaf)
    words = blender.data.curves.new("Words", 'FONT')
    words.body = "I"
    add_object(forest, "Words", words)
    add_object(scene.collection, "More words", words)
    add_object(scene.collection, "Ball", blender.data.metaballs.new("Ball")).data.elements.new()


def collections(blender, scene):
    """Add empties that show collections, of which one is in another; return that."""
    tree = add_collection(blender, "Tree")
    add_mesh(scene, "Trunk", SQUARE, [(0, 1, 2, 3)], collection=tree)
    add_mesh(scene, "Not rendered", SQUARE, [(0, 1, 2, 3)], collection=tree).hide_render = True
    below = add_collection(blender, "Below", tree)
    below.hide_render = True
    add_mesh(scene, "Below", SQUARE, [(0, 1, 2, 3)], collection=below)
    forest = add_collection(blender, "Forest")
    instance(blender, scene, tree, "Nested", forest)
    instance(blender, scene, tree, "One tree")
    instance(blender, scene, forest, "One forest")
    instance(blender, scene, tree, "No tree").hide_render = True
    return forest


def parents(scene):
    """Add objects that show their children at their vertices and faces."""
    for kind in ('VERTS', 'FACES'):
        for name, shows in (("shown", True), ("not shown", False)):
            parent = add_square(scene, f"{kind} {name}")
            parent.instance_type, parent.show_instancer_for_render = kind, shows
            child = add_square(scene, f"Child of {parent.name}")
            child.parent = parent
            add_square(scene, f"Grandchild of {parent.name}").parent = child
            hidden = add_square(scene, f"Hidden child of {parent.name}")
            hidden.parent, hidden.hide_render = parent, True


def geometry_nodes(blender, scene, leaf):
    """Add geometry nodes that make instances of an object, of collections and of meshes of their own."""

    def object_info(tree, geometry):
        node = tree.nodes.new('GeometryNodeObjectInfo')
        node.inputs["Object"].default_value = leaf
        node.inputs["As Instance"].default_value = True
        return on_points(tree, geometry, node.outputs["Geometry"])

    def collection_info(separate, tree, geometry):
        node = tree.nodes.new('GeometryNodeCollectionInfo')
        node.inputs["Collection"].default_value = blender.data.collections["Tree"]
        node.inputs["Separate Children"].default_value = separate
        return on_points(tree, geometry, node.outputs[0])

    def made(tree, geometry):
        return on_points(tree, geometry, tree.nodes.new('GeometryNodeMeshCube').outputs[0])

    nodes(blender, add_square(scene, "Leaves by nodes"), object_info)
    nodes(blender, add_square(scene, "Trees by nodes"), lambda *these: collection_info(False, *these))
    nodes(blender, add_square(scene, "Branches by nodes"), lambda *these: collection_info(True, *these))
    nodes(blender, add_square(scene, "Cubes by nodes"), made)


def particles(blender, scene, leaf):
    """Add hair that is made of an object, and of a collection."""
    # Of a collection some of whose objects are disabled in renders, the viewport picks others than a render.
    fruit = add_collection(blender, "Fruit")
    for name in ("Apple", "Pear"):
        add_mesh(scene, name, SQUARE, [(0, 1, 2, 3)], collection=fruit)
    for kind in ('OBJECT', 'COLLECTION'):
        emitter = add_square(scene, f"Particles {kind}")
        emitter.modifiers.new("Particles", 'PARTICLE_SYSTEM')
        settings = emitter.particle_systems[0].settings
        settings.type, settings.count, settings.render_type = 'HAIR', 3, kind
        settings.instance_object, settings.instance_collection = leaf, fruit
        emitter.show_instancer_for_render = kind == 'OBJECT'


def hide_instancers(blender, scene, way):
    """Hide what makes instances, in the viewport only."""
    names = (
        "One tree",
        "One forest",
        "VERTS shown",
        "FACES not shown",
        "Trees by nodes",
        "Particles OBJECT",
        "No tree",
    )
    for name in (*names, "Cubes by nodes", "More words"):
        obj = scene.objects[name]
        if way == 'EYE':
            obj.hide_set(True)
        elif way == 'MONITOR':
            obj.hide_viewport = True
