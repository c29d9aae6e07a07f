# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth things on a cloth before a backdrop: a ball, a ring, a vase, and one cup that is instanced three times."""

from math import pi

import bpy
import numpy as np
from building import add, camera, diffuse, lamp, sky
from grids import Grid, grid, stops
from numpy.typing import ArrayLike, NDArray


def still_life() -> None:
    """Make the still life, in units of 1 m but some ten times as large as life."""
    add("Cloth", diffuse("Linen", (0.72, 0.68, 0.60)), backdrop(), smooth=True)
    ball = add("Ball", diffuse("Red Clay", (0.62, 0.10, 0.07)), turned(arc(0.45, 18), 32), smooth=True)
    ball.location = (-0.15, -0.75, 0.45)
    ring = add("Ring", diffuse("Blue Enamel", (0.08, 0.20, 0.60)), torus(0.42, 0.13, 40, 12), smooth=True)
    ring.location = (0.95, -0.75, 0.13)
    vase = add("Vase", diffuse("Celadon", (0.34, 0.58, 0.44)), turned(vase_profile(), 48), smooth=True)
    vase.location = (-0.95, 0.2, 0.0)

    cup = add("Cup", diffuse("Ochre", (0.76, 0.52, 0.18)), turned(cup_profile(), 40), smooth=True)
    cups = bpy.data.collections.new("Cup")
    cups.objects.link(cup)
    bpy.context.scene.collection.objects.unlink(cup)
    for number, (x, y, size) in enumerate(((0.15, 0.45, 1.2), (0.95, 0.35, 1.0), (1.6, -0.1, 0.8)), start=1):
        instance = bpy.data.objects.new(f"Cup {number}", None)
        instance.instance_type, instance.instance_collection = 'COLLECTION', cups
        instance.location, instance.scale = (x, y, 0.0), (size, size, size)
        bpy.context.scene.collection.objects.link(instance)

    area = lamp('AREA', "Window", (-2.6, -1.6, 3.0), (0.1, 0.0, 0.2), 260.0)
    area.size, area.color = 1.2, (1.0, 0.95, 0.88)
    sky((0.8, 0.9, 1.0), 0.12)
    camera((0.2, -5.4, 1.6), 42.0, (960, 720), shift=-0.12)
    bpy.context.scene.view_settings.exposure = -0.5  # 0 would stand for an automatic one


def backdrop() -> Grid:
    """Mesh a cloth that lies flat and rises in an arc, in large faces: a baked copy cuts them where shadows end."""
    steps, bend = 12, 0.8
    angle = np.linspace(0.0, pi / 2.0, steps + 1)
    flat, rise = stops((-3.0, 1.0, 5))[:-1], stops((bend, 3.2, 3))[1:]
    y = np.concatenate([flat, 1.0 + bend * np.sin(angle), np.full(len(rise), 1.0 + bend)])
    z = np.concatenate([np.zeros(len(flat)), bend - bend * np.cos(angle), rise])
    x = stops((-3.0, 3.4, 8))
    return woven(np.stack(np.broadcast_arrays(x, y[:, None], z[:, None]), axis=-1))


def woven(points: NDArray[np.float64]) -> Grid:
    """Join points of shape (rows, columns, 3) to quads that turn up where x runs along columns and y along rows."""
    rows, columns = points.shape[:2]
    _, faces = grid([(0, 0, 0)] * 4, np.arange(columns, dtype=float), np.arange(rows, dtype=float))
    return points.reshape(-1, 3), faces


def turned(profile: ArrayLike, count: int) -> Grid:
    """Turn a profile of points (radius, z) about the z axis; lit is what lies on the right of the way along it."""
    radius, z = np.asarray(profile, dtype=float).T
    angle = np.linspace(0.0, 2.0 * pi, count + 1)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    return woven(radius[:, None, None] * circle + z[:, None, None] * (0.0, 0.0, 1.0))


def arc(radius: float, count: int) -> NDArray[np.float64]:
    """Return the profile of a ball about the origin, from its lowest point up."""
    angle = np.linspace(-pi / 2.0, pi / 2.0, count + 1)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def torus(major: float, minor: float, around: int, across: int) -> Grid:
    """Turn a circle about the z axis."""
    angle = np.linspace(0.0, 2.0 * pi, across + 1)
    return turned(np.stack([major + minor * np.cos(angle), minor * np.sin(angle)], axis=-1), around)


def vase_profile() -> NDArray[np.float64]:
    """Return a vase's profile: up outside, over the lip, down inside to the axis."""
    outside = [(0.26, 0.0), (0.34, 0.12), (0.48, 0.45), (0.42, 0.80), (0.22, 1.08), (0.17, 1.25), (0.27, 1.45)]
    inside = [(0.24, 1.45), (0.13, 1.25), (0.18, 1.08), (0.37, 0.80), (0.43, 0.45), (0.28, 0.12), (0.0, 0.06)]
    return np.concatenate([through(outside, 3), through(inside, 1)])


def cup_profile() -> NDArray[np.float64]:
    """Return a cup's profile, made as a vase's."""
    outside = [(0.14, 0.0), (0.22, 0.06), (0.27, 0.22), (0.30, 0.42)]
    inside = [(0.275, 0.42), (0.245, 0.22), (0.18, 0.08), (0.0, 0.04)]
    return np.concatenate([through(outside, 2), through(inside, 1)])


def through(points: ArrayLike, count: int) -> NDArray[np.float64]:
    """Return a curve through points (Catmull and Rom's), each piece in so many steps."""
    known = np.asarray(points, dtype=float)
    known = np.concatenate([[2.0 * known[0] - known[1]], known, [2.0 * known[-1] - known[-2]]])
    t = np.linspace(0.0, 1.0, count, endpoint=False)[:, None]
    pieces = [
        b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
        for a, b, c, d in zip(known, known[1:], known[2:], known[3:], strict=False)
    ]
    curve = np.concatenate([*pieces, known[-2:-1]])
    curve[:, 0] = curve[:, 0].clip(0.0)  # the axis is not crossed
    return curve
