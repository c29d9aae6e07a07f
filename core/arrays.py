# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays that come from outside: copied, with the type and the shape that everything else relies on."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import RadiosityError

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def table(name: str, values: ArrayLike, rows: int | None) -> FloatArray:
    """Copy values into rows of three.

    Parameters
    ----------
    name : str
        What they are, for messages.
    values : array_like
        Numbers; an empty sequence has no rows.
    rows : int or None
        How many there must be; None for any number.

    Returns
    -------
    ndarray of shape (rows, 3)
        Float64.

    Raises
    ------
    RadiosityError
        When they are no numbers or have another shape.
    """
    try:
        copy = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RadiosityError(f"{name} must be numbers in rows of three") from error
    if copy.size == 0:
        copy = copy.reshape(0, 3)
    if copy.ndim != 2 or copy.shape[1] != 3 or (rows is not None and len(copy) != rows):
        expected = "n" if rows is None else rows
        raise RadiosityError(f"{name} must have the shape ({expected}, 3), not {copy.shape}")
    return copy


def indices(name: str, values: ArrayLike, length: int | None) -> IntArray:
    """Copy whole numbers.

    Parameters
    ----------
    name : str
        What they are, for messages.
    values : array_like
        Numbers of any type without a fraction.
    length : int or None
        How many there must be; None for any number.

    Returns
    -------
    ndarray of shape (length,)
        Int64.

    Raises
    ------
    RadiosityError
        When they are no whole numbers or have another shape.
    """
    try:
        numbers = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RadiosityError(f"{name} must be whole numbers") from error
    if numbers.ndim != 1 or (length is not None and len(numbers) != length):
        expected = "n" if length is None else length
        raise RadiosityError(f"{name} must have the shape ({expected},), not {numbers.shape}")
    if not np.all(np.isfinite(numbers)) or np.any(numbers != np.floor(numbers)) or np.any(np.abs(numbers) > 2**53):
        raise RadiosityError(f"{name} must be whole numbers")
    return numbers.astype(np.int64)


def one_each(name: str, values: ArrayLike, length: int) -> FloatArray:
    """Copy one number for each face; NaN is one, too.

    Parameters
    ----------
    name : str
        What they are, for messages.
    values : array_like
        Numbers.
    length : int
        How many there must be.

    Returns
    -------
    ndarray of shape (length,)
        Float64.

    Raises
    ------
    RadiosityError
        When they have another shape.
    """
    numbers = np.array(values, dtype=np.float64)
    if numbers.shape != (length,):
        raise RadiosityError(f"{name} must have one value for each of the {length} faces")
    return numbers
