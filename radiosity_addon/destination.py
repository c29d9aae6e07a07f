# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the colors of a bake go and how they are stored: one frozen record, checked when it is made."""

from dataclasses import dataclass

from ..core.errors import RadiosityError

DOMAINS = ('CORNER', 'POINT')
FLOAT, BYTE = 'FLOAT_COLOR', 'BYTE_COLOR'
DATA_TYPES = (FLOAT, BYTE)
IN_PLACE, COPY = 'IN_PLACE', 'COPY'
TARGETS = (IN_PLACE, COPY)
LONGEST_NAME = 63  # bytes: what Blender 4.2 keeps of a name
# Attributes of Blender's own, which need not be there to be missed.
RESERVED = ("position", "material_index", "sharp_face", "sharp_edge", "crease_edge", "custom_normal", "id")


@dataclass(frozen=True)
class Destination:
    """The color attribute that a bake writes.

    Attributes
    ----------
    attribute : str
        Its name; an existing color attribute of that name is replaced.
    domain : {'CORNER', 'POINT'}
        What carries a color.
    data_type : {'FLOAT_COLOR', 'BYTE_COLOR'}
        Floats keep every radiance. Bytes hold 0 to 1 in 256 steps of sRGB; what is brighter becomes 1.
    target : {'IN_PLACE', 'COPY'}
        The user's own meshes, or new objects in a collection of their own, one for each object and instance, with
        modifiers applied and as fine as the patches.
    hide_originals : bool
        Whether what has a copy is hidden behind it.
    cut_large : bool
        Whether large faces of copies are cut where light changes on them, when no size of patches is chosen.

    Raises
    ------
    RadiosityError
        A value outside of what is allowed; the message says what is.
    """

    attribute: str = "Radiosity"
    domain: str = 'CORNER'
    data_type: str = FLOAT
    target: str = IN_PLACE
    hide_originals: bool = False
    cut_large: bool = True

    def __post_init__(self) -> None:
        """Refuse what Blender could not store, or would store under another name."""
        size = len(self.attribute.encode())
        if not self.attribute or size > LONGEST_NAME:
            raise RadiosityError(
                f"The attribute's name has {size} bytes: give one of 1 to {LONGEST_NAME} bytes, such as 'Radiosity'"
            )
        if self.attribute.startswith(".") or self.attribute in RESERVED:
            raise RadiosityError(f"Blender itself uses attributes named '{self.attribute}': choose another name")
        for what, value, allowed in (
            ("domain", self.domain, DOMAINS),
            ("data type", self.data_type, DATA_TYPES),
            ("target", self.target, TARGETS),
        ):
            if value not in allowed:
                raise RadiosityError(f"The {what} cannot be {value!r}: give one of {', '.join(allowed)}")
