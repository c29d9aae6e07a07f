# SPDX-License-Identifier: GPL-3.0-or-later
"""The ways from patches to light: the hierarchy that users run, and the thesis's two as they stand."""

from collections.abc import Callable, Generator
from concurrent.futures import Executor

from ..meshing import Patches
from ..progress import Progress
from ..scene import Scene
from ..settings import Settings
from ..visibility import Surroundings
from .hierarchical import hierarchical
from .matrix import by_gathering, by_shooting
from .solved import Solved

__all__ = ["METHODS", "Method", "Solved"]

Method = Callable[
    [Scene, Patches, Settings, Surroundings, Executor | None],
    Generator[Progress, None, Solved],
]
METHODS: dict[str, Method] = {"hierarchical": hierarchical, "gathering": by_gathering, "shooting": by_shooting}
