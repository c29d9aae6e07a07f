# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether faces are the flat walls of a room, or rounded like a head or a cup: by the directions that they look in."""

import numpy as np

from ..arrays import FloatArray, IntArray
from ..scene import Scene

# A wall has more of the area than that, with what looks the same or the opposite way; a room is walls for such a share.
_WALL, _ROOM = 0.15, 0.5
# Steps that a component of a normal is told apart by: some seven degrees.
_STEPS = 8


def flattest_share(scene: Scene, faces: IntArray) -> float:
    """Return the largest share of the area of some faces that lies in about one plane's direction."""
    return float(np.max(_shares(scene, faces), initial=0.0))


def are_walls(scene: Scene, faces: IntArray) -> bool:
    """Return whether most of the area of some faces lies in a few planes' directions."""
    share = _shares(scene, faces)
    return bool(share[share > _WALL].sum() > _ROOM)


def _shares(scene: Scene, faces: IntArray) -> FloatArray:
    """Return the shares of the area that look in about the same direction."""
    area = scene.face_area[faces]
    steps = np.rint(_STEPS * scene.face_normal[faces]).astype(np.int64)
    # A floor whose faces are turned anyhow is one floor: of two opposite directions one stands for both.
    code = np.abs(steps @ (289, 17, 1))
    return np.asarray(np.bincount(code, area) / max(float(area.sum()), 1e-300))
