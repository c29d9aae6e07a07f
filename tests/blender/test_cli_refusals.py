# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command says and ends with when it cannot do what was asked."""

import gzip
import os
import signal

import bpy
import pytest

from tests.blender.building import SCENE_TEXT, add_square


def assert_one_complaint(result, code, words):
    """Check an exit code, and that nothing but the reason was said at the end."""
    assert result[0] == code
    assert result[1] == ""
    *progress, complaint = result[2].splitlines()
    assert complaint.startswith("radiosity: error: ")
    assert words in complaint
    assert "error" not in "".join(progress)
    assert "Traceback" not in result[2]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("missing.blend", None, "There is no file"),
        ("bad.blend", b"this is no blend file", "Blender cannot read"),
        ("short.blend", "cut", "Blender cannot read"),
        ("bad.txt", SCENE_TEXT.encode() + b"R 2 (0,0,0) (1,0,0)\n", "Line 3"),
        ("scene.obj", b"v 0 0 0", "Blender cannot read"),
    ],
)
def test_inputs_that_cannot_be_read(room, run, tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(room.read_bytes()[:20000] if content == "cut" else content)
    before = {path.name for path in tmp_path.iterdir()}
    assert_one_complaint(run(tmp_path / name, "--report", tmp_path / "report.json"), 1, words)
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    ("header", "words"),
    [
        (b"BLENDER-v999", "Blender 9.99 saved it"),
        (b"BLENDER17-01v9907", "Blender 99.7 saved it"),
        pytest.param(
            b"BLENDER_V248",
            "open it there, save it",
            marks=pytest.mark.skipif(bpy.app.version[0] < 5, reason="4.5 and older read it"),
        ),
    ],
)
def test_files_of_another_blender_are_told_apart(run, tmp_path, header, words, packed):
    path = tmp_path / "scene.blend"
    content = header + b"REND" + bytes(200)
    path.write_bytes(gzip.compress(content) if packed else content)
    result = run(path, "--report", tmp_path / "report.json")
    assert_one_complaint(result, 1, words)
    assert result[2].count("scene.blend") == 1


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


def test_a_write_protected_output_is_left_alone(room, run, tmp_path):
    path = tmp_path / "out.blend"
    path.write_bytes(b"older")
    path.chmod(0o444)
    if os.access(path, os.W_OK):
        pytest.skip("this user may write everything")
    assert_one_complaint(run(room, "--output", path), 1, "write-protected")
    assert path.read_bytes() == b"older"


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


def test_an_interruption_is_130_and_writes_nothing(addon, room, run, tmp_path, monkeypatch):
    def interrupted(*_arguments, **_options):
        signal.raise_signal(signal.SIGINT)
        yield

    monkeypatch.setattr(addon("cli"), "bake_scene", interrupted)
    handler = signal.getsignal(signal.SIGINT)
    assert_one_complaint(run(room, "--output", tmp_path / "out.blend"), 130, "Interrupted")
    assert signal.getsignal(signal.SIGINT) is handler
    assert [path.name for path in tmp_path.iterdir()] == ["room.blend"]
