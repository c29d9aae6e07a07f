# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: what it writes, what it says, and with which code it ends."""

import json
import os
import shutil
import signal
import subprocess
import sys

import bpy
import numpy as np
import pytest

from tests.blender.building import (
    SCENE_TEXT,
    SQUARE,
    add_mesh,
    add_room,
    add_square,
    colors,
    glowing,
    node_material,
)
from tests.blender.installing import ROOT


def test_everything_is_written_and_the_input_stays(blender, room, run, tmp_path):
    before = room.read_bytes()
    names = {"output": "out.blend", "gltf": "out.glb", "render": "out.png", "report": "out.json"}
    code, out, err = run(room, *(word for key, name in names.items() for word in (f"--{key}", tmp_path / name)))
    assert (code, "error" in err) == (0, False)
    assert room.read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} == {"room.blend", *names.values()}
    for name in names.values():
        assert f"Written:  {tmp_path / name}" in out
    assert "1 objects, 6 faces" in out

    assert (tmp_path / "out.glb").read_bytes()[:4] == b"glTF"
    assert (tmp_path / "out.png").read_bytes()[1:4] == b"PNG"
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    (mesh,) = blender.data.meshes
    # A closed room that reflects half and emits everywhere: every wall has twice the radiance.
    np.testing.assert_allclose(colors(mesh)[:, :3], 2.0, rtol=0.02)


def test_a_write_protected_input_is_baked_and_stays(room, run, tmp_path):
    before = room.read_bytes()
    room.chmod(0o444)
    assert run(room, "--output", tmp_path / "out.blend")[0] == 0
    assert (tmp_path / "out.blend").stat().st_size > 0
    assert (room.read_bytes(), room.stat().st_mode & 0o777) == (before, 0o444)


def test_the_report_has_the_keys_that_are_promised(room, run, tmp_path):
    path = tmp_path / "report.json"
    assert run(room, "--report", path, "--method", "shooting", "--max-edge", "0.5")[0] == 0

    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    report = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    keys = (
        "scene patches links rays iterations converged residual row_sum energy seconds peak_memory_mb objects warnings"
    )
    assert set(keys.split()) | {"settings"} <= set(report)
    assert set(report["scene"]) == {"objects", "faces", "vertices"}
    assert set(report["row_sum"]) == {"min", "mean", "max"}
    assert set(report["energy"]) == {"emitted", "absorbed", "escaped", "error"}
    assert {"read", "mesh", "form_factors", "solve", "shade", "write", "total"} <= set(report["seconds"])
    assert report["objects"] == [{"name": "Room", "corners": 24, "written": True}]
    assert report["settings"]["method"] == "shooting"
    assert report["settings"]["max_edge"] == 0.5
    assert report["patches"] == 6 * 4


def test_attribute_domain_and_exposure_are_followed(blender, room, run, tmp_path):
    out = tmp_path / "out.blend"
    code, said, _ = run(
        room,
        "--output",
        out,
        "--gltf",
        tmp_path / "a.glb",
        "--attribute",
        "Light",
        "--domain",
        "POINT",
        "--exposure",
        "-1",
    )
    assert code == 0
    assert f"Written:  {tmp_path / 'a.glb'} (exposure -1.00 stops)" in said
    blender.ops.wm.open_mainfile(filepath=str(out))
    (layer,) = blender.data.meshes[0].color_attributes
    assert (layer.name, layer.domain, len(layer.data)) == ("Light", 'POINT', 8)


def test_what_is_baked_and_how_it_is_stored_can_be_chosen(blender, room, run, tmp_path):
    out, report = tmp_path / "out.blend", tmp_path / "report.json"
    assert run(room, "--output", out, "--report", report, "--light", "indirect", "--data-type", "byte")[0] == 0
    settings = json.loads(report.read_text(encoding="utf-8"))["settings"]
    assert (settings["light"], settings["data_type"], settings["domain"]) == ("indirect", 'BYTE_COLOR', 'CORNER')
    blender.ops.wm.open_mainfile(filepath=str(out))
    (layer,) = blender.data.meshes[0].color_attributes
    assert layer.data_type == 'BYTE_COLOR'
    # Half of everything is reflected: 1/2 at once, 1/4 + 1/8 + ... after that.
    np.testing.assert_allclose(colors(blender.data.meshes[0])[:, :3], 0.5, atol=0.01)


def test_copies_are_what_is_exported_and_drawn(blender, room, run, tmp_path):
    files = {
        f"--{kind}": tmp_path / name for kind, name in (("output", "o.blend"), ("gltf", "o.glb"), ("render", "o.png"))
    }
    words = [word for pair in files.items() for word in pair]
    code, said, _ = run(room, *words, "--target", "copy", "--hide-originals", "--max-edge", "0.5")
    assert code == 0 and 'Baked:    "Radiosity" on 1 copies' in said
    length = int.from_bytes((tmp_path / "o.glb").read_bytes()[12:16], "little")
    document = json.loads((tmp_path / "o.glb").read_bytes()[20 : 20 + length])
    assert [node["name"] for node in document["nodes"]] == ["Room"]
    (primitive,) = document["meshes"][0]["primitives"]
    assert document["accessors"][primitive["indices"]]["count"] == 6 * 4 * 2 * 3
    assert (tmp_path / "o.png").is_file()
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    original, copy = (blender.data.objects[name] for name in ("Room", "Room Baked"))
    assert original.hide_render and not original.data.color_attributes
    assert len(copy.data.polygons) == 24 and not copy.hide_render


@pytest.mark.parametrize("keep", [True, False])
def test_copies_keep_large_faces_where_that_is_asked_for(blender, room, run, tmp_path, keep):
    out = tmp_path / "o.blend"
    words = ["--output", out, "--target", "copy", "--quality", "preview", *["--keep-faces"] * keep]
    assert run(room, *words)[0] == 0
    blender.ops.wm.open_mainfile(filepath=str(out))
    count = len(blender.data.objects["Room Baked"].data.polygons)
    assert count == 6 if keep else count > 100


def test_the_input_is_overwritten_when_it_is_named(blender, room, run):
    assert run(room, "--output", room)[0] == 0
    blender.ops.wm.open_mainfile(filepath=str(room))
    assert "Radiosity" in blender.data.meshes[0].color_attributes


def test_a_text_scene_is_imported_and_its_divisions_multiplied(blender, run, tmp_path):
    path = tmp_path / "two.txt"
    path.write_text(SCENE_TEXT)
    code, _, _ = run(path, "--subdivide", "3", "--output", tmp_path / "out.blend", "--report", tmp_path / "report.json")
    assert code == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert sorted(len(mesh.polygons) for mesh in blender.data.meshes) == [3 * 3, 6 * 6]
    assert all("Radiosity" in mesh.color_attributes for mesh in blender.data.meshes)
    assert json.loads((tmp_path / "report.json").read_text())["patches"] == 9 + 36


def test_without_a_file_to_write_the_figures_are_given_with_a_warning(room, run):
    code, out, err = run(room)
    assert code == 0
    assert "Row sums:" in out
    assert "radiosity: warning: nothing was written" in err


def test_a_vertex_nowhere_is_told_in_the_report(scene, save, run, tmp_path):
    add_room(scene, material=glowing())
    add_mesh(scene, "Broken", [*SQUARE[:3], (0.0, float("nan"), 0.0)], [(0, 1, 2, 3)])
    path = save()
    assert run(path, "--report", tmp_path / "report.json")[0] == 0
    warnings = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["warnings"]
    assert any("Object 'Broken': 1 face with a vertex at no finite place" in line for line in warnings)


@pytest.mark.skipif(bpy.app.version[0] < 5, reason="Blender 4.2 crashes on such a file")
def test_what_blender_loads_but_for_a_part_is_baked_and_told(scene, run, tmp_path):
    add_square(scene, "Glowing", glowing())
    add_square(scene, "Spoilt", node_material("Spoilt")[0], z=1)
    path, report = tmp_path / "spoilt.blend", tmp_path / "report.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
    nodes = b"NTShader Nodetree"
    start, end = path.read_bytes().split(b"MASpoilt")
    path.write_bytes(start + b"MASpoilt" + end.replace(nodes, b"XX" + nodes[2:], 1))
    code, _, complaints = run(path, "--report", report)
    assert code == 0
    warning = json.loads(report.read_text())["warnings"][0]
    assert warning.startswith(f"A part of {path.name} is lost: ") and "MASpoilt" in warning
    assert warning in complaints


def test_help_ends_with_success(run):
    code, out, err = run("--help")
    assert (code, err) == (0, "")
    assert "--form-factors" in out


def test_the_installed_command_bakes_the_loaded_file(addon, blender, room, capsys, tmp_path):
    command = addon("command")
    assert command.run(["bake"]) == 1
    assert "No .blend is loaded" in capsys.readouterr().err
    blender.ops.wm.open_mainfile(filepath=str(room))
    assert command.run(["bake", "--report", str(tmp_path / "report.json")]) == 0
    assert "room.blend: 1 objects" in capsys.readouterr().out
    assert (tmp_path / "report.json").is_file()
    assert command.run([]) == 2
    assert command.run(["cook"]) == 2


@pytest.fixture
def checkout(tmp_path):
    """Give a checkout in a folder whose name is no Python name."""
    root = tmp_path / "my-radiosity 2.0"
    for part in ("core", "radiosity_addon", "example_blends"):
        shutil.copytree(ROOT / part, root / part, ignore=shutil.ignore_patterns("__pycache__", "*.blend*"))
    shutil.copy(ROOT / "__init__.py", root)
    return root


def test_a_checkout_of_any_name_runs_as_a_script(room, checkout, run_blender, tmp_path):
    script = checkout / "example_blends" / "bake.py"
    done = run_blender(script, str(room), "--gltf", str(tmp_path / "out.glb"), "--report", str(tmp_path / "out.json"))
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == f"Written:  {tmp_path / 'out.json'}"
    assert "Traceback" not in done.stderr
    assert json.loads((tmp_path / "out.json").read_text())["scene"]["faces"] == 6

    failed = run_blender(script, str(tmp_path / "missing.blend"))
    assert failed.returncode == 1
    assert "radiosity: error: There is no file" in failed.stderr


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_a_process_can_be_interrupted(blender, checkout, tmp_path):
    if blender.app.binary_path:
        pytest.skip("starts the bpy wheel's Python")
    room = tmp_path / "large.txt"
    room.write_text(
        "\n".join(line.replace(" 2 ", " 60 ", 1).replace(" 1 ", " 60 ", 1) for line in SCENE_TEXT.splitlines())
    )
    process = subprocess.Popen(
        [
            sys.executable,
            checkout / "example_blends" / "bake.py",
            room,
            "--method",
            "gathering",
            "--output",
            "out.blend",
        ],
        cwd=tmp_path,
        env=os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "user")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        process.stderr.readline()  # it has begun
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert out == ""
    assert err.splitlines()[-1].startswith("radiosity: error: Interrupted")
    assert not list(tmp_path.glob("*out*"))
