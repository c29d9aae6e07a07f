# SPDX-License-Identifier: GPL-3.0-or-later
"""Images as light sees them: linear, reduced, and averaged over as much of them as a point stands for."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Single = NDArray[np.float32]

# Pixels along an edge that are kept, at most.
LARGEST = 1024
# Images that are kept at a time.
_KEPT = 8
# Pixels that are turned linear at a time.
_AT_ONCE = 1 << 20
# Of an image that is not there.
NEUTRAL = 0.5
_AS_IT_IS = ("Non-Color", "Linear", "Raw", "scene_linear", "data", "Generic Data")


@dataclass(frozen=True, eq=False)
class Picture:
    """An image with smaller and smaller copies of it.

    Attributes
    ----------
    levels : tuple of ndarray of shape (h, w, 4)
        Linear color times alpha, and alpha, from below to above; each half as large as the one before.
    packed : bool
        Whether alpha is a picture of its own, which the color does not depend on.
    encoded : bool
        Whether its file holds 8 bits that are not linear.
    broken : int
        Pixels that are no finite numbers; what is none counts as 0.
    """

    levels: tuple[Single, ...]
    packed: bool
    encoded: bool
    broken: int

    def at(self, uv: Array, extension: str, closest: bool) -> Array:
        """Return color and alpha at points, each averaged over as much as it stands for.

        Parameters
        ----------
        uv : ndarray of shape (n, 2)
            Three points a cell follow each other; one alone is a point.
        extension : {'REPEAT', 'EXTEND', 'CLIP', 'MIRROR'}
            What is outside 0 to 1.
        closest : bool
            Whether pixels have edges.

        Returns
        -------
        ndarray of shape (n, 4)
        """
        level = self._level(uv)
        values = np.zeros((len(uv), 4))
        for index in np.unique(level):
            here = level == index
            values[here] = _looked_up(self.levels[index], uv[here], extension, closest and index == 0)
        return values

    def _level(self, uv: Array) -> NDArray[np.int64]:
        """Return the copy whose pixels are as large as what each point stands for."""
        if len(uv) % 3:
            return np.zeros(len(uv), np.int64)
        height, width = self.levels[0].shape[:2]
        a, b, c = uv.reshape(-1, 3, 2).transpose(1, 0, 2) * (width, height)
        # The three are half a cell apart, and each has a third of it.
        area = 4.0 / 3.0 * 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        level = np.round(0.5 * np.log2(np.clip(area, 1.0, 1e30))).astype(np.int64)
        return np.repeat(np.minimum(level, len(self.levels) - 1), 3)


def _looked_up(pixels: Single, uv: Array, extension: str, closest: bool) -> Array:
    """Return the values of one level at points, shape (n, 4)."""
    height, width = pixels.shape[:2]
    x, y = uv[:, 0] * width, uv[:, 1] * height
    if closest:
        return _fetched(pixels, np.floor(x), np.floor(y), extension)
    left, low = np.floor(x - 0.5), np.floor(y - 0.5)
    s, t = (x - 0.5 - left)[:, None], (y - 0.5 - low)[:, None]
    below = (1.0 - s) * _fetched(pixels, left, low, extension) + s * _fetched(pixels, left + 1, low, extension)
    above = (1.0 - s) * _fetched(pixels, left, low + 1, extension) + s * _fetched(pixels, left + 1, low + 1, extension)
    return (1.0 - t) * below + t * above


def _fetched(pixels: Single, column: Array, row: Array, extension: str) -> Array:
    """Return pixels by number, wherever they are."""
    height, width = pixels.shape[:2]
    index = []
    for place, size in ((row, height), (column, width)):
        if extension == 'REPEAT':
            index.append(np.mod(place, size))
        elif extension == 'MIRROR':
            turn = np.mod(place, 2 * size)
            index.append(np.where(turn < size, turn, 2 * size - 1 - turn))
        else:
            index.append(place.clip(0, size - 1))
    values = pixels[index[0].astype(np.int64), index[1].astype(np.int64)].astype(np.float64)
    if extension == 'CLIP':
        values[(column < 0) | (column >= width) | (row < 0) | (row >= height)] = 0.0
    return values


class Images:
    """The pictures that were used last."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, Picture | None] = OrderedDict()

    def get(self, image: bpy.types.Image) -> Picture | None:
        """Return the picture of an image, or None where its file is missing.

        Parameters
        ----------
        image : bpy.types.Image
        """
        if image.name_full not in self._known:
            self._known[image.name_full] = _read(image)
        self._known.move_to_end(image.name_full)
        while len(self._known) > _KEPT:
            self._known.popitem(last=False)
        return self._known[image.name_full]


def _read(image: bpy.types.Image) -> Picture | None:
    """Read an image, and leave as much of it in Blender's memory as there was."""
    loaded = image.has_data
    width, height = image.size
    channels = image.channels
    if not (width and height and channels):
        return None
    values = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(values)
    pixels, linear = values.reshape(height, width, channels), is_linear(image)
    # Bytes are always numbers.
    broken = _mended(pixels) if image.is_float else 0
    levels = [_reduced(pixels, image)]
    encoded = not image.is_float and not linear
    packed = image.alpha_mode == 'CHANNEL_PACKED' or linear
    if not loaded and image.source == 'FILE' and not image.is_dirty:
        image.buffers_free()
    while max(levels[-1].shape[:2]) > 1:
        levels.append(_shrunk(levels[-1], (levels[-1].shape[0] + 1) // 2, (levels[-1].shape[1] + 1) // 2))
    return Picture(tuple(levels), packed, encoded, broken)


def _mended(pixels: Single) -> int:
    """Set what is no finite number to 0, and return in how many pixels there was any; few at a time."""
    broken = 0
    rows = max(1, _AT_ONCE // pixels.shape[1])
    for first in range(0, len(pixels), rows):
        part = pixels[first : first + rows]
        finite = np.isfinite(part)
        if not finite.all():
            broken += int(np.count_nonzero(~finite.all(axis=2)))
            part[~finite] = 0.0
    return broken


def _reduced(pixels: Single, image: bpy.types.Image) -> Single:
    """Return pixels linear, with alpha, and not more than `LARGEST` along an edge; bit by bit, for they may be many."""
    height, width = pixels.shape[:2]
    rows, columns = min(height, LARGEST), min(width, LARGEST)
    edges = np.linspace(0, height, rows + 1).astype(np.int64)
    step = max(1, _AT_ONCE * rows // (height * width))
    small = np.zeros((rows, columns, 4), np.float32)
    for first in range(0, rows, step):
        last = min(first + step, rows)
        part = _linear(pixels[edges[first] : edges[last]], image)
        small[first:last] = _shrunk(part, last - first, columns, edges[first:last] - edges[first])
    return small


def _linear(pixels: Single, image: bpy.types.Image) -> Single:
    """Return pixels as linear color times alpha, and alpha."""
    channels = pixels.shape[2]
    whole = np.ones((*pixels.shape[:2], 4), np.float32)
    color = pixels[..., :1] if channels < 3 else pixels[..., :3]
    # What has more than 8 bits is linear already.
    encoded = not image.is_float and not is_linear(image)
    if encoded:
        # 8 bits as single precision are between 0 and 1.
        color = _SRGB[(color * np.float32(255.0) + np.float32(0.5)).astype(np.uint8)]
    whole[..., :3] = color
    if channels in {2, 4} and image.alpha_mode != 'NONE':
        whole[..., 3] = pixels[..., channels - 1]
        # Those with more bits have the color times alpha already, too.
        if encoded and image.alpha_mode != 'CHANNEL_PACKED':
            whole[..., :3] *= whole[..., 3:]
    return whole


def is_linear(image: bpy.types.Image) -> bool:
    """Tell whether an image's values count as they are, like those of a mask."""
    return image.colorspace_settings.name.startswith(_AS_IT_IS)


def _shrunk(pixels: Single, rows: int, columns: int, starts: NDArray[np.int64] | None = None) -> Single:
    """Return the means of blocks of pixels."""
    for axis, count in ((0, rows), (1, columns)):
        size = pixels.shape[axis]
        if size % count == 0:
            ways = (count, size // count)
            shape = (*ways, *pixels.shape[1:]) if axis == 0 else (len(pixels), *ways, pixels.shape[2])
            pixels = pixels.reshape(shape).sum(axis=axis + 1) / np.float32(size // count)
            continue
        begin = starts if axis == 0 and starts is not None else np.linspace(0, size, count + 1).astype(np.int64)[:-1]
        lengths = np.diff(np.append(begin, size)).astype(np.float32)
        shape = (-1, 1, 1) if axis == 0 else (1, -1, 1)
        pixels = np.add.reduceat(pixels, begin, axis=axis) / lengths.reshape(shape)
    return pixels


_STEPS = np.arange(256) / 255.0
_SRGB = np.where(_STEPS <= 0.04045, _STEPS / 12.92, ((_STEPS + 0.055) / 1.055) ** 2.4).astype(np.float32)
