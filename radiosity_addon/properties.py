# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user chooses, kept with the scene, and how the running or last bake stands, kept with the window manager."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..core.settings import Settings
from .destination import Destination

DEFAULTS, DESTINATION = Settings(), Destination()


class RADIOSITY_PG_settings(bpy.types.PropertyGroup):
    """How a scene is baked"""

    method: EnumProperty(
        name="Method",
        description="How light is passed on between surfaces",
        items=(
            ('hierarchical', "Hierarchical", "Take far patches together; for scenes of any size"),
            ('gathering', "Gathering", "Gather light over all pairs of patches; memory grows with their square"),
            ('shooting', "Shooting", "Shoot light from the brightest patch first; needs little memory"),
        ),
        default=DEFAULTS.method,
    )
    quality: EnumProperty(
        name="Quality",
        description="Trade time for precision in the hierarchical method",
        items=(
            ('preview', "Preview", "For a first look"),
            ('medium', "Medium", "For everyday work"),
            ('high', "High", "For close views"),
            ('production', "Production", "For the final bake"),
        ),
        default=DEFAULTS.quality,
    )
    form_factors: EnumProperty(
        name="Form Factors",
        description="How the light between two patches is computed by gathering and shooting",
        items=(
            ('exact', "Exact", "Integrate exactly over the patch that shines"),
            ('centre', "Center to Center", "Take all rays between two patches as equal; wrong where they are close"),
            ('hemicube', "Hemicube", "Project the patches on the pixels of half a cube"),
        ),
        default=DEFAULTS.form_factors,
    )
    sides: EnumProperty(
        name="Sides",
        description="Which sides of faces have light and show it",
        items=(
            ('auto', "Auto", "Where light can reach: front, back or both, for each set of connected faces"),
            ('front', "Front", "The sides that normals point to; the others are black"),
            ('back', "Back", "The sides that normals point away from; the others are black"),
        ),
        default=DEFAULTS.sides,
    )
    max_edge: FloatProperty(
        name="Patch Size",
        description="Longest edge of the patches that faces are split into for the bake; 0 keeps faces whole, "
        "but for large ones of a baked copy",
        default=0.0,
        min=0.0,
        soft_max=10.0,
        unit='LENGTH',
        subtype='DISTANCE',
    )
    subdivide: IntProperty(
        name="Subdivisions",
        description="Split each face into this many patches along each edge",
        default=DEFAULTS.subdivide,
        min=1,
        soft_max=8,
    )
    iterations: IntProperty(
        name="Iterations",
        description="Most times that light is passed on; with few the light of late bounces is missing",
        default=DEFAULTS.iterations,
        min=1,
        soft_max=500,
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="Stop when the light changes by less than this fraction",
        default=DEFAULTS.tolerance,
        min=0.0,
        max=0.5,
        precision=6,
        step=0.001,
    )
    seed: IntProperty(
        name="Seed",
        description="Start of the random numbers; the same seed gives the same colors",
        default=DEFAULTS.seed,
        min=0,
    )
    light: EnumProperty(
        name="Light",
        description="What the colors tell",
        items=(
            ('combined', "Combined", "All light that leaves a surface, emitted and reflected"),
            ('lighting', "Lighting Only", "What a white surface would reflect; multiply it with textures"),
            ('direct', "Direct", "Emitted light, and what is reflected at once from emitters, lights and world"),
            ('indirect', "Indirect", "Light that was reflected before; Combined is Direct plus Indirect"),
        ),
        default=DEFAULTS.light,
    )
    attribute: StringProperty(
        name="Attribute",
        description="Name of the color attribute that is written; an existing one of this name is replaced",
        # No `maxlen`, by which Blender 4.2 would cut inside of letters: `Destination` refuses what is too long.
        default=DESTINATION.attribute,
    )
    target: EnumProperty(
        name="Target",
        description="Which meshes get the colors",
        items=(
            ('IN_PLACE', "In Place", "The meshes of the scene, whose faces stay as they are"),
            (
                'COPY',
                "Baked Copy",
                "New objects in the collection Radiosity, one for each object and instance, with modifiers applied and "
                "faces as fine as the patches",
            ),
        ),
        default=DESTINATION.target,
    )
    hide_originals: BoolProperty(
        name="Hide Originals",
        description="Hide objects that have a copy, in the viewport and in renders; they still count for bakes",
        default=DESTINATION.hide_originals,
    )
    cut_large: BoolProperty(
        name="Cut Large Faces",
        description="Cut the large faces of copies where light changes on them, if no Patch Size is chosen",
        default=DESTINATION.cut_large,
    )
    domain: EnumProperty(
        name="Domain",
        description="What carries a color",
        items=(
            ('CORNER', "Face Corner", "Keep hard edges: each corner of a face has its own color"),
            ('POINT', "Vertex", "Store one color for each vertex; hard edges become soft"),
        ),
        default=DESTINATION.domain,
    )
    data_type: EnumProperty(
        name="Data Type",
        description="How a color is stored",
        items=(
            ('FLOAT_COLOR', "Float", "Linear and exact, also above 1"),
            ('BYTE_COLOR', "Byte", "A quarter of the memory; 256 steps from 0 to 1, and what is brighter is clipped"),
        ),
        default=DESTINATION.data_type,
    )


class RADIOSITY_PG_status(bpy.types.PropertyGroup):
    """How the running or the last bake of this session stands"""

    running: BoolProperty(options={'SKIP_SAVE'})
    stage: StringProperty(options={'SKIP_SAVE'})
    fraction: FloatProperty(min=0.0, max=1.0, options={'SKIP_SAVE'})
    figures: StringProperty(options={'SKIP_SAVE'})
    warnings: StringProperty(options={'SKIP_SAVE'})
    gathered: StringProperty(options={'SKIP_SAVE'})


def core_settings(scene: bpy.types.Scene) -> Settings:
    """Return the scene's choices as the core takes them.

    Parameters
    ----------
    scene : bpy.types.Scene
        Its `radiosity` settings; lengths are in its units and are returned in metres.

    Returns
    -------
    core.settings.Settings
        Checked settings.
    """
    chosen = scene.radiosity
    metres = 1.0 if scene.unit_settings.system == 'NONE' else scene.unit_settings.scale_length
    return Settings(
        method=chosen.method,
        form_factors=chosen.form_factors,
        quality=chosen.quality,
        sides=chosen.sides,
        light=chosen.light,
        max_edge=chosen.max_edge * metres or None,
        subdivide=chosen.subdivide,
        iterations=chosen.iterations,
        tolerance=chosen.tolerance,
        seed=chosen.seed,
    )


def chosen_destination(scene: bpy.types.Scene) -> Destination:
    """Return where the scene's choices want the colors.

    Parameters
    ----------
    scene : bpy.types.Scene

    Returns
    -------
    Destination
        Checked.
    """
    chosen = scene.radiosity
    return Destination(
        chosen.attribute, chosen.domain, chosen.data_type, chosen.target, chosen.hide_originals, chosen.cut_large
    )


CLASSES = (RADIOSITY_PG_settings, RADIOSITY_PG_status)


def register() -> None:
    """Add `scene.radiosity` and `window_manager.radiosity`."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.radiosity = PointerProperty(type=RADIOSITY_PG_settings)
    bpy.types.WindowManager.radiosity = PointerProperty(type=RADIOSITY_PG_status)


def unregister() -> None:
    """Take both away."""
    del bpy.types.WindowManager.radiosity
    del bpy.types.Scene.radiosity
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
