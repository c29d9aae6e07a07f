# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's materials reflect diffusely and what they emit, on the faces of meshes.

`network` walks a node tree and asks `shaders`, and `nodes` for what goes into them, for their values at many points at
once; `images` and `points` hold what the values come from. What cannot be read is left to Cycles, in `cycles_bake`.
"""

from .reading import Surface, read_material

__all__ = ["Surface", "read_material"]
