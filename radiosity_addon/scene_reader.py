# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender scene as a `core.scene.Scene`: what renders, evaluated, in world space and metres.

Beside the surfaces it returns `Target`s: which corners of the scene light which object.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.errors import RadiosityError
from ..core.grids import PATCH_LIMIT
from ..core.lighting.lamps import Lamp, SkyLamp
from ..core.occlusion.panes import ior_of
from ..core.occlusion.sieve import blocking, tints
from ..core.scene import AUTO, Scene
from .face_surfaces import FaceSurfaces, SurfaceReader, join_surfaces
from .lamp_pictures import LampPictures
from .lamps import read_lamp
from .objects.evaluation import evaluation
from .objects.instances import read_instances
from .objects.meshes import mirrors, placed
from .objects.roles import excluded, read_roles
from .objects.surfaces import HAVE_SURFACES, NO_SURFACES, Body, read_body, world_matrix
from .objects.targets import Target
from .objects.unread import differences, layer_differences
from .rendered import enabled_objects, renders_itself
from .world import read_world

__all__ = ["Reading", "Target", "read_scene", "world_matrix"]


@dataclass(frozen=True, eq=False)
class Reading:
    """A scene that was read.

    Attributes
    ----------
    scene : core.scene.Scene
        Its surfaces; what could not be read is in its warnings.
    targets : tuple of Target
        One for each object or instance with faces, in the order of the scene's `object_names`.
    """

    scene: Scene
    targets: tuple[Target, ...]


def read_scene(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, depsgraph: bpy.types.Depsgraph) -> Reading:
    """Read the objects and lamps that are visible in renders, their instances, and the world.

    Parameters
    ----------
    scene : bpy.types.Scene
        Gives the unit scale and, where the view layer has none of its own, the world.
    view_layer : bpy.types.ViewLayer
        Gives the objects.
    depsgraph : bpy.types.Depsgraph
        The evaluated state of `view_layer`.

    Returns
    -------
    Reading
        Surfaces, and the objects that they came from.

    Raises
    ------
    RadiosityError
        When nothing with faces renders, when there are too many, or when a mesh has a position that is not finite.
    """
    enabled = [obj for obj in enabled_objects(view_layer) if not excluded(obj)]
    notes = layer_differences(scene, view_layer) + differences(enabled)
    scale = 1.0 if scene.unit_settings.system == 'NONE' else scene.unit_settings.scale_length
    surfaces, pictures = SurfaceReader(), LampPictures()
    bodies: list[Body] = []
    lamps: list[Lamp] = []
    with evaluation(depsgraph) as state:
        instances = read_instances(state, enabled, scale, surfaces, pictures, notes)
        for obj in enabled:
            if renders_itself(obj):
                roles = read_roles(obj)
                if obj.type in HAVE_SURFACES:
                    body = read_body(obj, state, roles, surfaces)
                    bodies += [body] if body is not None else []
                    if body is None and _has_faces(obj) and not instances.bodies[obj.name_full]:
                        notes.append(f"Object '{obj.name_full}': its modifiers leave none of its faces")
                elif obj.type == 'LIGHT' and roles.emits:
                    lamp = read_lamp(obj, depsgraph, state.matrix(obj), scale, pictures, notes)
                    lamps += [lamp] if lamp is not None else []
                elif obj.type in NO_SURFACES and not instances.bodies[obj.name_full]:
                    notes.append(f"Object '{obj.name_full}' is {NO_SURFACES[obj.type]} without faces and left out")
            bodies += instances.bodies[obj.name_full]
    lamps += instances.lamps
    _check_size(scene, bodies)
    # Last, as these may render, which makes the depsgraph old.
    materials = surfaces.finish(notes)
    lamps = pictures.finish(lamps, notes)
    lamps += read_world(view_layer.world_override or scene.world, notes)
    return _joined(bodies, materials, lamps, scale, notes)


def _has_faces(obj: bpy.types.Object) -> bool:
    """Tell whether an object is a mesh that has faces without modifiers."""
    return obj.type == 'MESH' and len(obj.data.polygons) > 0


def _check_size(scene: bpy.types.Scene, bodies: list[Body]) -> None:
    """Refuse a scene without faces, and one with so many that they would not fit into memory."""
    if not bodies:
        raise RadiosityError(
            f"Scene '{scene.name}' has no mesh with faces that is visible in renders: add a mesh, or enable its render "
            "visibility (the camera icon in the Outliner)"
        )
    counts: dict[str, int] = {}
    for body in bodies:
        counts[body.object_name] = counts.get(body.object_name, 0) + len(body.mesh.material)
    total, most = sum(counts.values()), max(counts, key=lambda name: counts[name])
    if total > PATCH_LIMIT:
        raise RadiosityError(
            f"There are {total:,} faces ({PATCH_LIMIT:,} at most), {counts[most]:,} of them in object '{most}' and its "
            "instances: exclude it, or make it simpler"
        )


def _joined(
    bodies: list[Body], materials: list[FaceSurfaces], lamps: list[Lamp], scale: float, notes: list[str]
) -> Reading:
    """Put bodies one after the other into one scene."""
    parts = [placed(body.mesh, body.matrix, scale) for body in bodies]
    first_vertex = np.cumsum([0] + [len(part.vertices) for part in parts])
    first_corner = np.cumsum([0] + [len(part.corner_vertex) for part in parts])
    targets = tuple(
        body.target(int(first), mirrors(body.matrix)) for body, first in zip(bodies, first_corner, strict=False)
    )
    shown = [_shown(body, materials[body.surfaces], scale) for body in bodies]
    of_faces = join_surfaces(shown)
    sizes = [len(body.mesh.material) for body in bodies]
    opaque = blocking(of_faces.passed.mean(axis=1))
    plain_sky = any(isinstance(lamp, SkyLamp) and lamp.radiance.size == 3 for lamp in lamps)
    scene = Scene(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.corner_vertex + first for part, first in zip(parts, first_vertex, strict=False)]),
        np.concatenate(
            [body.mesh.topology.face_start[:-1] + first for body, first in zip(bodies, first_corner, strict=False)]
            + [first_corner[-1:]]
        ),
        of_faces.reflectance,
        of_faces.emission,
        transmittance=of_faces.transmittance,
        corner_normals=np.concatenate([part.corner_normals for part in parts]),
        face_object=np.repeat(np.arange(len(parts)), sizes),
        object_names=[target.name for target in targets],
        max_edge=np.repeat([scale * body.roles.max_edge for body in bodies], sizes),
        occludes=opaque & np.repeat([body.roles.occludes for body in bodies], sizes),
        shades=opaque & np.repeat([body.roles.shades if plain_sky else body.roles.occludes for body in bodies], sizes),
        tint=tints(of_faces.passed, opaque),
        ior=ior_of(of_faces.specular.sum(axis=1) / np.maximum(of_faces.passed.sum(axis=1), 1e-9)),
        reflects=np.repeat([body.roles.reflects for body in bodies], sizes),
        emits=np.repeat([body.roles.emits for body in bodies], sizes),
        lamps=lamps,
        paint=of_faces.paint,
        sides=np.full(sum(sizes), AUTO),
        warnings=notes,
    )
    return Reading(scene, targets)


def _shown(body: Body, surfaces: FaceSurfaces, scale: float) -> tuple[FaceSurfaces, NDArray[np.int64]]:
    """Return the surfaces of a body in the world, and the first corner of each of its faces."""
    face_start = body.mesh.topology.face_start
    if surfaces.paint is None:
        return surfaces, face_start
    order = body.mesh.topology.turned if mirrors(body.matrix) else np.arange(face_start[-1])
    return surfaces.placed(scale * body.matrix[:3, :3], scale * body.matrix[:3, 3], order), face_start
