# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object does with light: what its owner chose, and what Blender shows to which rays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Roles:
    """What the faces of an object do; see the same names of `core.scene.Scene`.

    Attributes
    ----------
    receives : bool
        Whether colors are written to it.
    occludes, shades : bool
        Whether it blocks the light of other faces and of lamps, and that of a sky of one color.
    reflects, emits : bool
        Whether what it reflects and emits lights others.
    max_edge : float
        Longest edge of its patches [Blender units]; NaN leaves it to the bake.
    """

    receives: bool
    occludes: bool
    shades: bool
    reflects: bool
    emits: bool
    max_edge: float

    def within(self, instancer: Roles) -> Roles:
        """Return what instances of the object do that another one makes: what both may do."""
        return Roles(
            self.receives and instancer.receives,
            self.occludes and instancer.occludes,
            self.shades and instancer.shades,
            self.reflects and instancer.reflects,
            self.emits and instancer.emits,
            self.max_edge if math.isnan(instancer.max_edge) else instancer.max_edge,
        )


def excluded(obj: bpy.types.Object) -> bool:
    """Tell whether an object has no part in bakes."""
    return bool(obj.radiosity.exclude)


def read_roles(obj: bpy.types.Object) -> Roles:
    """Read what an object does with light.

    Parameters
    ----------
    obj : bpy.types.Object
        As in Cycles, what diffuse rays do not see lights nothing, but it is lit. What shadow rays do not see does not
        block light that comes straight from lamps, emitters or a sky with a picture; a sky of one color is found by
        diffuse rays. Light that bounces, which in Cycles follows diffuse rays as well, is taken to go the way of most
        light.

    Returns
    -------
    Roles
    """
    chosen = obj.radiosity
    return Roles(
        receives=chosen.receive,
        occludes=chosen.occlude and obj.visible_shadow,
        shades=chosen.occlude and obj.visible_diffuse,
        reflects=chosen.reflect and obj.visible_diffuse,
        emits=chosen.emit and obj.visible_diffuse,
        max_edge=chosen.max_edge if chosen.max_edge > 0.0 else math.nan,
    )
