# SPDX-License-Identifier: GPL-3.0-or-later
"""The radiosity method on NumPy arrays; nothing here knows Blender.

One street, one direction: polygons (`scene`, or `scene_text` from the thesis's file) are cut into patches (`meshing`),
the light between the patches is described (`visibility`, `form_factors`, `transport`), solved for (`gathering`,
`shooting`, or `hierarchy` without a matrix), and brought to the corners of the mesh (`shading`). `bake` walks the whole
street. Lengths are metres, radiosity B and emission E radiant exitance [W/m^2], reflectance rho and form factors F
plain ratios; a colour is the radiance L = B / pi.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .errors import RadiosityError
    from .exact.view_factors import form_factor_matrix
    from .scene import Scene
    from .settings import Settings

__all__ = ["RadiosityError", "Scene", "Settings", "form_factor_matrix"]

_HOMES = {
    "RadiosityError": "errors",
    "Scene": "scene",
    "Settings": "settings",
    "form_factor_matrix": "exact.view_factors",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: Blender starts without waiting for any of this."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
