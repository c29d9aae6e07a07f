# SPDX-License-Identifier: GPL-3.0-or-later
"""What is linked from other files gives light, keeps its meshes, and may be missing."""

import pytest

from tests.blender.building import SQUARE, add_mesh, add_object, add_square, glowing


@pytest.fixture
def library(scene, blender, tmp_path):
    """Give a file with a scene in it that links a mesh object, a collection and a mesh from another file."""
    source, path = tmp_path / "library.blend", tmp_path / "scene.blend"
    add_square(scene, "Object", glowing())
    collection = blender.data.collections.new("Collection")
    scene.collection.children.link(collection)
    add_mesh(scene, "Member", SQUARE, [(0, 1, 2, 3)], collection=collection)
    add_square(scene, "Mesh")
    blender.ops.wm.save_as_mainfile(filepath=str(source), check_existing=False)
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    new = blender.context.scene
    with blender.data.libraries.load(str(source), link=True) as (_, linked):
        linked.objects, linked.collections, linked.meshes = ["Object"], ["Collection"], ["Mesh"]
    new.collection.objects.link(linked.objects[0])
    add_object(new.collection, "Own object", linked.meshes[0])
    shown = add_object(new.collection, "Instancer")
    shown.instance_type, shown.instance_collection = 'COLLECTION', linked.collections[0]
    add_square(new, "Own", glowing())
    blender.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    return source, path


def test_what_is_linked_gives_light_and_is_not_written(library, bake, read, blender):
    assert [target.name for target in read().targets] == [
        "Object [library.blend]",
        "Own object",
        "Instancer > Member [library.blend]",
        "Own",
    ]
    warnings = bake()
    assert blender.data.meshes["Own"].color_attributes
    for name in ("Object", "Mesh"):
        assert not blender.data.meshes[name].color_attributes
        assert any(f"Mesh '{name}" in line and "linked from a library" in line for line in warnings)


@pytest.mark.parametrize("hidden", ["Object", "Own object", "Instancer"])
def test_what_is_linked_may_be_hidden_in_the_viewport(library, read, blender, hidden):
    names = [target.name for target in read().targets]
    collection = blender.data.collections.new("Hidden")
    blender.context.scene.collection.children.link(collection)
    obj = blender.context.scene.objects[hidden]
    blender.context.scene.collection.objects.unlink(obj)
    collection.objects.link(obj)
    collection.hide_viewport = True
    assert sorted(target.name for target in read().targets) == sorted(names)


def test_an_override_of_a_library_is_written_where_its_mesh_is_local(library, bake, blender):
    linked = blender.data.objects["Object"]
    override = linked.override_create()
    blender.context.scene.collection.objects.link(override)
    blender.context.scene.collection.objects.unlink(linked)
    override.location = (0, 0, 2)
    override.data = blender.data.meshes["Own"].copy()
    bake()
    assert override.data.color_attributes


def test_a_missing_library_is_named_and_the_rest_is_baked(library, bake, blender):
    source, path = library
    source.unlink()
    blender.ops.wm.open_mainfile(filepath=str(path))
    warnings = bake()
    assert [line for line in warnings if "missing" in line] == [
        "Library '//library.blend' is missing: what 'Object [library.blend]', 'Own object', 'Instancer' would show of "
        "it is left out"
    ]
    assert blender.data.meshes["Own"].color_attributes
