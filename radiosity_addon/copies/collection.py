# SPDX-License-Identifier: GPL-3.0-or-later
"""The collection that baked copies are in, told from the user's own by a mark and not by its name.

It remembers which originals were hidden for the copies: these still count for the next bake, and are shown again when
that does not hide them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import bpy

NAME = "Radiosity"
# Custom properties: of a copy, the name of its original; of the collection, what was hidden for it.
COPY_OF, HIDDEN = "radiosity_copy_of", "radiosity_hidden"


def is_copy(obj: bpy.types.Object) -> bool:
    """Tell whether an object is a baked copy."""
    return COPY_OF in obj


def find_collection(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Return a scene's collection of baked copies, if it has one."""
    return next((child for child in scene.collection.children_recursive if HIDDEN in child), None)


def earlier_copies(scene: bpy.types.Scene) -> list[str]:
    """Tell, for a bake in place, that a scene still has copies of an earlier bake; in one line or none."""
    collection = find_collection(scene)
    if collection is None or not any(is_copy(obj) for obj in collection.objects):
        return []
    return [
        f"Collection '{collection.name}' has the copies of an earlier bake, which stay as they are; delete it, or "
        "choose Baked Copy"
    ]


@contextmanager
def originals_shown() -> Iterator[None]:
    """Let what is disabled in renders only because copies show be enabled while the block runs."""
    hidden = [
        obj
        for collection in bpy.data.collections
        for obj in _objects(_hidden(collection)["render"], bpy.data.objects)
        if obj.hide_render
    ]
    for obj in hidden:
        obj.hide_render = False
    try:
        yield
    finally:
        for obj in hidden:
            obj.hide_render = True


def replace_copies(
    scene: bpy.types.Scene, layer: bpy.types.ViewLayer, copies: Iterable[bpy.types.Object], originals: Iterable[str]
) -> list[str]:
    """Put new copies in the place of a scene's earlier ones.

    Parameters
    ----------
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
        Where originals are hidden from the viewport, too.
    copies : iterable of bpy.types.Object
        In no collection yet; each named as it shall be called.
    originals : iterable of str
        Full names of the objects to hide; what was hidden for earlier copies is shown again first.

    Returns
    -------
    list of str
        What could not be hidden.
    """
    collection = find_collection(scene)
    if collection is None:
        collection = bpy.data.collections.new(NAME)
        scene.collection.children.link(collection)
    _show_originals(collection, layer)
    _remove([obj for obj in collection.objects if is_copy(obj)])
    for copy in copies:
        collection.objects.link(copy)
    # Until then the layer still lists what was removed.
    layer.update()
    return _hide(collection, layer, originals)


def _hidden(collection: bpy.types.Collection) -> dict[str, list[str]]:
    """Return the names of objects hidden for copies: in "render", and in the "viewport"."""
    found: dict[str, list[str]] = json.loads(collection.get(HIDDEN, "{}"))
    return {"render": [], "viewport": []} | found


def _objects(names: Iterable[str], objects: bpy.types.bpy_prop_collection) -> Iterator[bpy.types.Object]:
    """Yield this file's own objects of some names that there still are."""
    own = {obj.name: obj for obj in objects if obj.library is None}
    return (own[name] for name in names if name in own)


def _show_originals(collection: bpy.types.Collection, layer: bpy.types.ViewLayer) -> None:
    """Undo what hiding did."""
    hidden = _hidden(collection)
    for obj in _objects(hidden["render"], bpy.data.objects):
        obj.hide_render = False
    for obj in _objects(hidden["viewport"], layer.objects):
        obj.hide_set(False, view_layer=layer)


def _hide(collection: bpy.types.Collection, layer: bpy.types.ViewLayer, originals: Iterable[str]) -> list[str]:
    """Hide objects in renders and in the viewport, and remember which."""
    objects = {obj.name_full: obj for obj in layer.objects}
    there = [objects[name] for name in dict.fromkeys(originals) if name in objects]
    own = [obj for obj in there if obj.is_editable]
    render = [obj for obj in own if not obj.hide_render]
    viewport = [obj for obj in own if not obj.hide_get(view_layer=layer)]
    for obj in render:
        obj.hide_render = True
    for obj in viewport:
        obj.hide_set(True, view_layer=layer)
    collection[HIDDEN] = json.dumps(
        {"render": [obj.name for obj in render], "viewport": [obj.name for obj in viewport]}
    )
    return [
        f"Object '{obj.name_full}' is linked from a library and cannot be hidden behind its copy"
        for obj in there
        if not obj.is_editable
    ]


def _remove(copies: list[bpy.types.Object]) -> None:
    """Remove earlier copies, and their meshes where nothing else uses them."""
    meshes = {copy.data for copy in copies}
    bpy.data.batch_remove(copies)
    bpy.data.batch_remove([mesh for mesh in meshes if mesh is not None and mesh.users == 0])
