# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of a bake add up and can be written down."""

import json

import numpy as np
import pytest

from core.report import Energy, RowSums, energy_balance, object_counts, row_sum_range, scene_counts
from core.scene import Scene
from core.solution import Solution

KEYS = {
    "scene", "islands", "patches", "links", "rays", "iterations", "converged", "residual", "row_sum", "reciprocity",
    "energy", "seconds", "peak_memory_mb", "objects", "warnings", "settings",
}  # fmt: skip


def test_row_sums_leave_out_what_is_not_known():
    sums = row_sum_range(np.array([0.5, np.nan, 1.0, 7.0]), np.array([1.0, 1.0, 3.0, 0.0]))
    assert sums == RowSums(min=0.5, mean=0.875, max=1.0)
    assert row_sum_range(np.array([np.nan]), np.ones(1)) == RowSums(0.0, 0.0, 0.0)


def test_energy_is_watts_over_all_channels():
    area = np.array([2.0, 1.0])
    E, rho = np.array([(1.0, 2.0, 3.0), (0, 0, 0)]), np.full((2, 3), 0.5)
    H = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 2.0)])
    solution = Solution(E + rho * H, H, 1, True, 0.0)
    energy = energy_balance(area, E, rho, solution, np.array([0.25, 1.5]))
    assert energy.emitted == 12.0 and energy.absorbed == 2.0
    # The second patch sends out half as much again as it has.
    assert energy.escaped == 0.75 * 12.0 - 0.5 * 2.0
    assert energy.error == pytest.approx(2.0 / 12.0)
    # Light that has not been shot has not escaped either.
    assert energy_balance(area, E, rho, solution, np.full(2, np.nan)).escaped == 0.0


def test_a_dark_scene_has_no_energy_error():
    nothing = np.zeros((2, 3))
    solution = Solution(nothing, nothing, 1, True, 0.0)
    assert energy_balance(np.ones(2), nothing, nothing, solution, np.ones(2)) == Energy(0.0, 0.0, 0.0, 0.0)


def test_counts_are_of_what_is_there():
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    scene = Scene.from_polygons(
        [square, square[:3] + (1, 0, 0)], 0.5, face_object=[0, 2], object_names=("Floor", "Empty", "Ramp")
    )
    assert scene_counts(scene) == {"objects": 2, "faces": 2, "vertices": 6}
    assert object_counts(scene) == [
        {"name": "Floor", "corners": 4, "written": False},
        {"name": "Empty", "corners": 0, "written": False},
        {"name": "Ramp", "corners": 3, "written": False},
    ]


def test_the_report_of_a_bake_is_json(ceiling_lamp, light):
    report = light(ceiling_lamp(divisions=2)).report
    told = json.loads(json.dumps(report.as_dict(), allow_nan=False))
    assert set(told) == KEYS
    assert told["row_sum"].keys() == {"min", "mean", "max"}
    assert told["energy"].keys() == {"emitted", "absorbed", "escaped", "error"}
    assert told["seconds"].keys() == {"mesh", "form_factors", "solve", "shade", "total"}
    parts = [spent for stage, spent in told["seconds"].items() if stage != "total"]
    assert 0.0 < sum(parts) <= told["seconds"]["total"]
    assert told["patches"] == 24 and told["settings"]["method"] == "gathering"
