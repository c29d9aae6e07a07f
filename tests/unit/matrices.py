# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes whose matrix of form factors is made whole, and the factors between their faces."""

import numpy as np

from core.dense.matrix import dense_transport
from core.meshing import mesh
from core.occlusion.brute_force import BruteForceOccluders
from core.occlusion.surfaces import occluder_polygons
from core.progress import exhaust
from core.scene import Scene

OPPOSITE, ADJACENT = 0.199824895698387, 0.200043776075403


class NeverAsked:
    """Rays that nobody should need."""

    def blocked(self, origins, targets):
        raise AssertionError(f"{len(origins)} rays")


def dense(scene, *, subdivide=1, surfaces=True, **options):
    patches = mesh(scene, subdivide=subdivide)
    occluding = occluder_polygons(scene, patches)
    occluders = options.pop("occluders", BruteForceOccluders(occluding))
    built = dense_transport(patches, occluders, surfaces=occluding if surfaces else None, **options)
    return patches, exhaust(built)


def by_face(patches, F):
    """Return the factors between whole faces from those between patches."""
    faces = patches.face.max() + 1
    sums, area = np.zeros((faces, faces)), np.bincount(patches.face, patches.area)
    np.add.at(sums, (patches.face[:, None], patches.face), patches.area[:, None] * F)
    return sums / area[:, None]


def furnished(box, divisions=4):
    """Return a room with a block that stands on its floor, off the patches' borders."""
    polygons = [*box((2.0, 1.5, 1.0)), *box((0.5, 0.4, 0.45), (0.63, 0.52, 0.0), inward=False)]
    return Scene.from_polygons(polygons, 0.5, 1.0, divisions=np.full(12, divisions))
