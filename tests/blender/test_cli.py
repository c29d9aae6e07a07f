# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: what it writes, what it says, and with which code it ends."""

import json
import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest

from tests.blender.building import SQUARE, add_mesh, add_room, add_square, colors, glowing
from tests.blender.conftest import ROOT

TEXT = """\
R 2 (0,0,0) (1,0,0) (1,1,0) (0,1,0) (0,0,1) (0.5,0.5,0.5,1)
E 1 (0,0,1) (1,0,1) (1,1,1) (0,1,1) (0,0,-1) (1,1,1,10)
"""


@pytest.fixture
def run(addon, scene, capsys):
    """Give a function that runs the command in this process: exit code, stdout, stderr."""
    cli = addon("cli")

    def run(*arguments):
        capsys.readouterr()
        code = cli.main([str(argument) for argument in arguments], prog="bake.py")
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def save(blender, scene, tmp_path):
    """Give a function that saves the scene as a file, then empties it."""

    def save(name="room.blend"):
        path = tmp_path / name
        blender.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
        blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        return path

    return save


@pytest.fixture
def room(scene, save):
    """Give a saved file with a glowing room."""
    add_room(scene, material=glowing())
    return save()


def assert_one_complaint(result, code, words):
    """Check an exit code, and that nothing but the reason was said at the end."""
    assert result[0] == code
    assert result[1] == ""
    *progress, complaint = result[2].splitlines()
    assert complaint.startswith("radiosity: error: ")
    assert words in complaint
    assert "error" not in "".join(progress)
    assert "Traceback" not in result[2]


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


def test_the_input_is_overwritten_when_it_is_named(blender, room, run):
    assert run(room, "--output", room)[0] == 0
    blender.ops.wm.open_mainfile(filepath=str(room))
    assert "Radiosity" in blender.data.meshes[0].color_attributes


def test_a_text_scene_is_imported_and_its_divisions_multiplied(blender, run, tmp_path):
    path = tmp_path / "two.txt"
    path.write_text(TEXT)
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


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("missing.blend", None, "There is no file"),
        ("bad.blend", b"this is no blend file", "Blender cannot read"),
        ("short.blend", "cut", "Blender cannot read"),
        ("bad.txt", TEXT.encode() + b"R 2 (0,0,0) (1,0,0)\n", "Line 3"),
        ("scene.obj", b"v 0 0 0", "Blender cannot read"),
    ],
)
def test_inputs_that_cannot_be_read(room, run, tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(room.read_bytes()[:20000] if content == "cut" else content)
    before = {path.name for path in tmp_path.iterdir()}
    assert_one_complaint(run(tmp_path / name, "--report", tmp_path / "report.json"), 1, words)
    assert {path.name for path in tmp_path.iterdir()} == before


def test_no_file_is_loaded(run, tmp_path):
    assert_one_complaint(run("--report", tmp_path / "report.json"), 1, "No .blend is loaded")


def no_mesh(_scene):
    pass


def no_emitter(scene):
    add_square(scene)


@pytest.mark.parametrize(("build", "words"), [(no_mesh, "has no mesh"), (no_emitter, "emits light")])
def test_scenes_that_cannot_be_baked(scene, save, run, tmp_path, build, words):
    build(scene)
    path = save()
    assert_one_complaint(run(path, "--output", tmp_path / "out.blend"), 1, words)
    assert [found.name for found in tmp_path.iterdir()] == ["room.blend"]


def test_a_vertex_nowhere_is_told_in_the_report(scene, save, run, tmp_path):
    add_room(scene, material=glowing())
    add_mesh(scene, "Broken", [*SQUARE[:3], (0.0, float("nan"), 0.0)], [(0, 1, 2, 3)])
    path = save()
    assert run(path, "--report", tmp_path / "report.json")[0] == 0
    warnings = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["warnings"]
    assert any("Object 'Broken': 1 face with a vertex at no finite place" in line for line in warnings)


def test_a_matrix_that_would_not_fit(room, run, tmp_path):
    result = run(room, "--method", "gathering", "--max-edge", "0.001", "--output", tmp_path / "out.blend")
    assert_one_complaint(result, 1, "")
    assert any(unit in result[2] for unit in ("GB", "GiB", "patches"))
    assert not (tmp_path / "out.blend").exists()


@pytest.mark.parametrize("option", ["--output", "--gltf", "--render", "--report"])
def test_outputs_that_cannot_be_written_are_found_before_the_bake(addon, room, run, tmp_path, option):
    ending = addon("cli_options").ENDINGS[option[2:]]
    folder = tmp_path / f"folder{ending}"
    folder.mkdir()
    for path, words in ((tmp_path / "missing" / f"a{ending}", "there is no folder"), (folder, "it is a folder")):
        result = run(room, option, path)
        assert_one_complaint(result, 1, words)
        assert len(result[2].splitlines()) == 1


def test_an_export_that_fails_leaves_what_was_there(addon, room, run, tmp_path, monkeypatch):
    def fail(_file, _shown):
        raise addon("cli").RadiosityError("the file is wrong")

    monkeypatch.setattr(addon("gltf"), "check_colors", fail)
    (tmp_path / "a.glb").write_bytes(b"older")
    assert_one_complaint(run(room, "--gltf", tmp_path / "a.glb"), 1, "the file is wrong")
    assert (tmp_path / "a.glb").read_bytes() == b"older"
    assert {path.name for path in tmp_path.iterdir()} == {"room.blend", "a.glb"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--method", "magic"], "--method"),
        (["--form-factors", "none"], "--form-factors"),
        (["--quality", "best"], "--quality"),
        (["--domain", "FACE"], "--domain"),
        (["--max-edge", "-1"], "-1.0 m"),
        (["--max-edge", "nan"], "nan m"),
        (["--max-edge", "long"], "--max-edge"),
        (["--iterations", "0"], "iterations"),
        (["--subdivide", "1.5"], "--subdivide"),
        (["--tolerance", "2"], "tolerance"),
        (["--exposure", "bright"], "--exposure"),
        (["--exposure", "inf"], "--exposure"),
        (["--gltf", "a.obj"], "--gltf writes a .glb file"),
        (["--output", "a.txt"], "--output writes a .blend file"),
        (["--qual", "medium"], "--qual"),
        (["another.blend"], "another.blend"),
        (["--light", "all"], "combined"),
        (["--data-type", "half"], "give float or byte"),
        (["--target", "elsewhere"], "give in-place or copy"),
    ],
)
def test_wrong_usage(room, run, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert_one_complaint(run(room, *arguments), 2, words)


def test_a_name_that_blender_needs_is_wrong_usage(room, run):
    assert_one_complaint(run(room, "--attribute", "position"), 2, "'position'")


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


def test_an_interruption_is_130_and_writes_nothing(addon, room, run, tmp_path, monkeypatch):
    def interrupted(*_arguments, **_options):
        signal.raise_signal(signal.SIGINT)
        yield

    monkeypatch.setattr(addon("cli"), "bake_scene", interrupted)
    handler = signal.getsignal(signal.SIGINT)
    assert_one_complaint(run(room, "--output", tmp_path / "out.blend"), 130, "Interrupted")
    assert signal.getsignal(signal.SIGINT) is handler
    assert [path.name for path in tmp_path.iterdir()] == ["room.blend"]


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
    room.write_text("\n".join(line.replace(" 2 ", " 60 ", 1).replace(" 1 ", " 60 ", 1) for line in TEXT.splitlines()))
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
