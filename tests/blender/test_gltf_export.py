# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a scene becomes a glTF file: objects, cameras and modifiers; and that the scene stays as it was."""

import numpy as np
import pytest

from tests.blender.baked_grids import add_grid, data_of, depsgraph, light_at, triangles


def test_only_what_was_baked_and_renders_is_exported_with_the_camera(blender, scene, gltf, glb, tmp_path):
    add_grid(blender, scene, 'CORNER', "Seen")
    add_grid(blender, scene, 'CORNER', "Hidden").hide_render = True
    bare = add_grid(blender, scene, 'CORNER', "Bare")
    bare.data.color_attributes.remove(bare.data.color_attributes["Radiosity"])
    camera = blender.data.objects.new("Eye", blender.data.cameras.new("Lens"))
    camera.location = (1.0, 2.0, 3.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 300, 200
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    document = glb.read_glb(tmp_path / "a.glb").document
    nodes = {node["name"]: node for node in document["nodes"]}
    assert set(nodes) == {"Seen", "Eye"}
    assert document["scenes"][0]["name"] == scene.name
    np.testing.assert_allclose(nodes["Eye"]["translation"], [1.0, 3.0, -2.0], atol=1e-6)
    assert document["cameras"][0]["name"] == "Lens"
    assert document["cameras"][0]["perspective"]["aspectRatio"] == pytest.approx(1.5)


def test_objects_stand_where_they_stood_even_when_sheared_or_mirrored(blender, scene, gltf, glb, tmp_path):
    parent = blender.data.objects.new("Parent", None)
    parent.scale = (1.0, 3.0, -1.0)
    scene.collection.objects.link(parent)
    child = add_grid(blender, scene, 'POINT')
    child.parent = parent
    child.rotation_euler = (0.3, 0.5, 0.7)
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender), "Radiosity", 0.0)
    (node,) = glb.read_glb(tmp_path / "a.glb").document["nodes"]
    assert "scale" not in node
    assert "rotation" not in node
    positions, colors = triangles(glb, tmp_path / "a.glb")
    back = np.array(child.matrix_world.inverted())
    local = positions.reshape(-1, 3) @ back[:3, :3].T + back[:3, 3]
    np.testing.assert_allclose(local[:, 2], 0.0, atol=1e-5)
    np.testing.assert_allclose(colors.reshape(-1, 4)[:, :3], np.clip(light_at(local), 0.0, 1.0), atol=1e-4)
    # The front stays the front: normals go by the inverse transpose.
    normal = np.cross(positions[0, 1] - positions[0, 0], positions[0, 2] - positions[0, 0])
    assert normal @ (back[:3, :3].T @ np.array([0.0, 0.0, 1.0])) > 0.0


def test_modifiers_are_applied(blender, scene, gltf, glb, tmp_path):
    obj = add_grid(blender, scene, 'POINT')
    obj.modifiers.new("Array", 'ARRAY').count = 3
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    positions, _ = triangles(glb, tmp_path / "a.glb")
    assert len(positions) == 3 * 8
    assert positions[..., 0].max() == pytest.approx(12.0)


def test_an_object_that_is_disabled_in_viewports_is_exported(blender, scene, gltf, glb, tmp_path):
    obj = add_grid(blender, scene, 'POINT')
    obj.location.x = 5.0
    obj.hide_viewport = True
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    (node,) = glb.read_glb(tmp_path / "a.glb").document["nodes"]
    assert node["translation"] == pytest.approx([5.0, 0.0, 0.0])


def test_the_users_scene_is_as_before(blender, scene, gltf, tmp_path):
    wall = add_grid(blender, scene, 'CORNER')
    wall.select_set(True)
    blender.context.view_layer.objects.active = wall
    wall.data.color_attributes.new("Other", 'BYTE_COLOR', 'POINT')
    material = blender.data.materials["Paint"]
    if material.node_tree is None:
        material.use_nodes = True
    depsgraph(blender)
    before = data_of(blender)
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    assert data_of(blender) == before


def test_a_failure_leaves_neither_copies_nor_a_file(blender, scene, gltf, error, tmp_path, monkeypatch):
    add_grid(blender, scene, 'CORNER')
    depsgraph(blender)
    before = data_of(blender)

    def explode(*_arguments):
        raise error("full moon")

    monkeypatch.setattr(gltf, "check_colors", explode)
    (tmp_path / "a.glb").write_bytes(b"older")
    with pytest.raises(error, match="full moon"):
        gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    assert data_of(blender) == before
    assert [path.name for path in tmp_path.iterdir()] == ["a.glb"]
    assert (tmp_path / "a.glb").read_bytes() == b"older"


@pytest.mark.parametrize(
    ("problem", "words"),
    [("black", "COLOR_0 is off by"), ("no color", "no COLOR_0"), ("lit", "not unlit"), ("no mesh", "0 triangles")],
)
def test_what_the_exporter_gets_wrong_is_noticed(
    blender, scene, gltf, glb, error, tmp_path, monkeypatch, problem, words
):
    add_grid(blender, scene, 'CORNER')
    export = gltf._run_exporter

    def spoil(path, shown):
        export(path, shown)
        file = glb.read_glb(path)
        primitive = file.document["meshes"][0]["primitives"][1]
        binary = bytearray(file.binary)
        if problem == "black":
            accessor = file.document["accessors"][primitive["attributes"]["COLOR_0"]]
            start = file.document["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
            binary[start : start + 8] = bytes(8)  # at least red and green of one corner
        elif problem == "no color":
            del primitive["attributes"]["COLOR_0"]
        elif problem == "lit":
            del file.document["materials"][primitive["material"]]["extensions"]
        else:
            del file.document["meshes"]
        glb.write_glb(path, glb.Glb(file.document, bytes(binary)))

    monkeypatch.setattr(gltf, "_run_exporter", spoil)
    with pytest.raises(error, match=f'"Wall" as it was baked: .*{words}'):
        gltf.export_glb(tmp_path / "a.glb", depsgraph(blender), "Radiosity", 0.0)
    assert list(tmp_path.iterdir()) == []


def test_nothing_baked_is_said(blender, scene, gltf, error, tmp_path):
    with pytest.raises(error, match='No visible mesh has a color attribute "Radiosity"'):
        gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    assert list(tmp_path.iterdir()) == []
