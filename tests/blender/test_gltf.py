# SPDX-License-Identifier: GPL-3.0-or-later
"""The glTF export: what stands in the file, and that the user's scene is as before."""

import numpy as np
import pytest

from tests.blender.baked_grids import add_grid, data_of, depsgraph, light_at, light_of, triangles
from tests.blender.building import add_shader, node_material


@pytest.mark.parametrize("domain", ['POINT', 'CORNER'])
def test_colors_in_the_file_are_those_baked_and_clamped(blender, scene, gltf, glb, tmp_path, domain):
    add_grid(blender, scene, domain)
    assert gltf.export_glb(tmp_path / "a.glb", depsgraph(blender), "Radiosity", 0.0) == 0.0
    positions, colors = triangles(glb, tmp_path / "a.glb")
    if domain == 'POINT':
        light = light_at(positions.reshape(-1, 3))
    else:
        light = light_of(np.repeat(np.floor(positions[..., 0].mean(axis=1)), 3))
    assert light.max() > 1.2  # or clamping is not tried
    assert len(positions) == 8
    np.testing.assert_allclose(colors.reshape(-1, 4)[:, :3], np.clip(light, 0.0, 1.0), atol=1.0 / 65535.0)
    assert (colors[..., 3] == 1.0).all()


def test_materials_keep_their_slots_and_become_unlit(blender, scene, gltf, glb, tmp_path):
    add_grid(blender, scene, 'CORNER')
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    primitives = list(glb.mesh_primitives(glb.read_glb(tmp_path / "a.glb")))
    assert [primitive.mesh for primitive in primitives] == ["Wall mesh"] * 3
    assert {primitive.material for primitive in primitives} == {"Plaster", "Radiosity", "Paint"}
    assert all(primitive.unlit for primitive in primitives)
    faces = {p.material: sorted(set(np.floor(p.positions[..., 0].mean(axis=1)))) for p in primitives}
    assert faces == {"Plaster": [0.0, 3.0], "Radiosity": [1.0], "Paint": [2.0]}


def test_a_mesh_without_material_is_exported_too(blender, scene, gltf, glb, tmp_path):
    add_grid(blender, scene, 'CORNER', slots=())
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    (primitive,) = glb.mesh_primitives(glb.read_glb(tmp_path / "a.glb"))
    assert primitive.unlit
    assert len(primitive.positions) == 8


def test_other_color_attributes_are_left_out(blender, scene, gltf, glb, tmp_path):
    mesh = add_grid(blender, scene, 'CORNER').data
    for name, kind, domain in (("A", 'BYTE_COLOR', 'POINT'), ("Z", 'FLOAT_COLOR', 'CORNER')):
        mesh.color_attributes.new(name, kind, domain)
    mesh.color_attributes.active_color = mesh.color_attributes["A"]
    mesh.color_attributes.render_color_index = mesh.color_attributes.find("Z")
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender), "Radiosity", 0.0)
    document = glb.read_glb(tmp_path / "a.glb").document
    for primitive in document["meshes"][0]["primitives"]:
        assert [name for name in primitive["attributes"] if name.startswith("COLOR")] == ["COLOR_0"]
    positions, colors = triangles(glb, tmp_path / "a.glb")
    light = light_of(np.floor(positions[..., 0].mean(axis=1)))
    np.testing.assert_allclose(colors[:, 0, :3], np.clip(light, 0.0, 1.0), atol=1.0 / 65535.0)


def test_exposure_is_what_is_asked_for_or_the_scenes_or_automatic(blender, scene, gltf, glb, tmp_path):
    add_grid(blender, scene, 'CORNER')
    automatic = gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    assert np.isfinite(automatic) and automatic != 0.0
    # Nobody need have chosen 0, but somebody may.
    assert gltf.export_glb(tmp_path / "b.glb", depsgraph(blender), exposure="scene") == 0.0
    scene.view_settings.exposure = -1.25
    assert gltf.export_glb(tmp_path / "b.glb", depsgraph(blender)) == -1.25
    assert gltf.export_glb(tmp_path / "b.glb", depsgraph(blender), exposure="auto") == automatic
    assert gltf.export_glb(tmp_path / "c.glb", depsgraph(blender), exposure=-2.0) == -2.0
    positions, colors = triangles(glb, tmp_path / "c.glb")
    light = light_of(np.floor(positions[..., 0].mean(axis=1)))
    np.testing.assert_allclose(colors[:, 0, :3], light / 4.0, atol=1.0 / 65535.0)


@pytest.mark.parametrize("domain", ['POINT', 'CORNER'])
def test_the_automatic_exposure_is_not_for_the_lamps(blender, scene, gltf, glb, tmp_path, domain):
    for name, light in (("Wall", 0.1), ("Lamp", 50.0)):
        mesh = add_grid(blender, scene, domain, name, slots=(name,)).data
        layer = mesh.color_attributes["Radiosity"]
        layer.data.foreach_set("color", np.full(4 * len(layer.data), light, np.float32))
    lamp = blender.data.materials["Lamp"]
    if lamp.node_tree is None:
        lamp.use_nodes = True
    lamp.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 50.0
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender))
    shown = {p.mesh: p.colors[..., :3].max() for p in glb.mesh_primitives(glb.read_glb(tmp_path / "a.glb"))}
    assert shown["Lamp mesh"] == 1.0
    assert 0.5 < shown["Wall mesh"] < 1.0


@pytest.mark.parametrize("domain", ['POINT', 'CORNER'])
def test_lighting_is_multiplied_with_textures_and_all_else_is_in_the_colors(
    blender, scene, gltf, glb, tmp_path, domain
):
    obj = add_grid(blender, scene, domain, slots=("Image", "Paint", "Lamp"))
    image = blender.data.images.new("Bricks", 4, 4)
    image.pixels.foreach_set(np.full(64, 0.5, np.float32))
    image.pack()
    for index, name in enumerate(("Image", "Paint", "Lamp")):
        material, output = node_material(f"{name} nodes")
        emission = 2.0 if name == "Lamp" else 0.0
        shader = add_shader(
            material,
            'ShaderNodeBsdfPrincipled',
            output.inputs["Surface"],
            Base_Color=(0.5, 0.25, 0.75, 1.0),
            Emission_Color=(1.0, 1.0, 1.0, 1.0),
            Emission_Strength=emission,
        )
        if name == "Image":
            material.node_tree.nodes.new('ShaderNodeTexImage').image = image
            add_shader(material, 'ShaderNodeMapping').inputs["Scale"].default_value = (2.0, 2.0, 2.0)
            nodes = {node.type: node for node in material.node_tree.nodes}
            material.node_tree.links.new(nodes['MAPPING'].outputs[0], nodes['TEX_IMAGE'].inputs["Vector"])
            material.node_tree.links.new(nodes['TEX_IMAGE'].outputs["Color"], shader.inputs["Base Color"])
        obj.data.materials[index] = material
    obj.data.uv_layers.new(name="UVMap")
    before = data_of(blender)
    notes = []
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender), "Radiosity", 0.0, lighting=True, notes=notes)
    # Blender 4.2 counts the users of images wrongly when a material is copied.
    assert data_of(blender) | {"images": []} == before | {"images": []} and list(blender.data.images) == [image]

    file = glb.read_glb(tmp_path / "a.glb")
    primitives = {primitive.material: primitive for primitive in glb.mesh_primitives(file)}
    assert set(primitives) == {"Image nodes", "Paint nodes", "Lamp nodes"}
    albedo = {"Image nodes": 1.0, "Paint nodes": (0.5, 0.25, 0.75), "Lamp nodes": (0.5, 0.25, 0.75)}
    for name, primitive in primitives.items():
        assert primitive.unlit and primitive.textured == (name == "Image nodes")
        x, _, z = primitive.positions.reshape(-1, 3).T
        place = np.stack([x, -z], axis=1)
        if domain == 'POINT':
            light = light_at(place)
        else:
            light = light_of(np.floor(primitive.positions[..., 0].mean(axis=1)).repeat(3))
        shown = np.clip(albedo[name] * light + (2.0 if name == "Lamp nodes" else 0.0), 0.0, 1.0)
        np.testing.assert_allclose(primitive.colors.reshape(-1, 4)[:, :3], shown, atol=2.0 / 65535.0)
    (material,) = [one for one in file.document["materials"] if one["name"] == "Image nodes"]
    texture = material["pbrMetallicRoughness"]["baseColorTexture"]
    assert texture["extensions"]["KHR_texture_transform"]["scale"] == [2, 2]
    assert file.document["images"][0]["name"] == "Bricks"
    # What the file has to clip is told, and what would keep it.
    ((note, fits),) = [(note, float(note.split("--exposure ")[1].split()[0])) for note in notes]
    assert "brighter than 1" in note
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender), "Radiosity", fits, lighting=True, notes=notes)
    assert len(notes) == 1
    gltf.export_glb(tmp_path / "a.glb", depsgraph(blender), "Radiosity", fits + 0.2, lighting=True, notes=notes)
    assert len(notes) == 2
