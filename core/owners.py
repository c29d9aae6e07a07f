# SPDX-License-Identifier: GPL-3.0-or-later
"""`Owners`: which object each face belongs to, so that what is wrong with faces is told by an object's name."""

from dataclasses import dataclass

import numpy as np

from .arrays import BoolArray, IntArray
from .errors import RadiosityError


@dataclass(frozen=True, eq=False)
class Owners:
    """The objects of a scene and their faces.

    Attributes
    ----------
    names : tuple of str
        Of the objects.
    face_object : ndarray of shape (f,)
        Index into `names`.
    """

    names: tuple[str, ...]
    face_object: IntArray

    def counts(self, marked: BoolArray) -> list[tuple[str, int]]:
        """Return the name and the number of marked faces, shape (f,), of the objects that have some."""
        objects, counts = np.unique(self.face_object[marked], return_counts=True)
        return [(self.names[index], int(count)) for index, count in zip(objects, counts, strict=True)]

    def refuse(self, bad: BoolArray, what: str) -> None:
        """Raise `RadiosityError` for the first object with a marked face, if there is one."""
        for line in self.lines(bad, what):
            raise RadiosityError(line)

    def lines(self, bad: BoolArray, what: str) -> list[str]:
        """Return a line for each object with marked faces: its name, what is wrong, and with how many."""
        return [f"Object '{name}': {what} ({faces(count)})" for name, count in self.counts(bad)]


def faces(count: int) -> str:
    """Return a count of faces in words."""
    return f"{count} face" if count == 1 else f"{count} faces"
