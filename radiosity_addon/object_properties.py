# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user chooses for each object, kept with the object."""

import bpy
from bpy.props import BoolProperty, FloatProperty, PointerProperty


class RADIOSITY_PG_object(bpy.types.PropertyGroup):
    """How an object takes part in a bake"""

    exclude: BoolProperty(
        name="Exclude",
        description="Leave the object out of bakes, as if it were not there",
        default=False,
    )
    receive: BoolProperty(
        name="Receive",
        description="Write colors to the object",
        default=True,
    )
    occlude: BoolProperty(
        name="Block Light",
        description="Let the object hide light from others and cast shadows",
        default=True,
    )
    reflect: BoolProperty(
        name="Reflect",
        description="Let light that the object reflects light others; its own colors show it anyway",
        default=True,
    )
    emit: BoolProperty(
        name="Emit",
        description="Let what the object emits light others; its own colors show it anyway",
        default=True,
    )
    max_edge: FloatProperty(
        name="Patch Size",
        description="Longest edge of the patches of this object, in place of the scene's; 0 takes the scene's",
        default=0.0,
        min=0.0,
        soft_max=10.0,
        unit='LENGTH',
        subtype='DISTANCE',
    )


def register() -> None:
    """Add `object.radiosity`."""
    bpy.utils.register_class(RADIOSITY_PG_object)
    bpy.types.Object.radiosity = PointerProperty(type=RADIOSITY_PG_object)


def ensure() -> None:
    """Register in a process that runs the command without the add-on enabled: files keep what was chosen in them."""
    if not hasattr(bpy.types.Object, "radiosity"):
        register()


def unregister() -> None:
    """Take it away."""
    del bpy.types.Object.radiosity
    bpy.utils.unregister_class(RADIOSITY_PG_object)
