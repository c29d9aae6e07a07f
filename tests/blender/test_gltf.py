# SPDX-License-Identifier: GPL-3.0-or-later
"""The glTF export: what stands in the file, and that the user's scene is as before."""

import numpy as np
import pytest

from tests.blender.building import add_shader, node_material


@pytest.fixture
def gltf(addon):
    return addon("gltf")


@pytest.fixture
def glb(addon):
    return addon("glb")


def light_at(positions):
    """Colors that say where they are, from 0 to far above 1."""
    return np.stack([positions[:, 0] / 2, positions[:, 1], 0.5 * positions[:, 0] * positions[:, 1]], axis=1)


def light_of(faces):
    """Colors that say which face they are of."""
    return np.stack([0.1 * faces, 1.3 - 0.2 * faces, np.full(len(faces), 0.25)], axis=1)


def add_grid(bpy, scene, domain, name="Wall", slots=("Plaster", None, "Paint")):
    """Add a row of four unit quads in the xy plane, with a baked attribute and a material slot for each name."""
    mesh = bpy.data.meshes.new(f"{name} mesh")
    points = [(x, y, 0.0) for y in (0.0, 1.0) for x in range(5)]
    mesh.from_pydata(points, [], [(x, x + 1, x + 6, x + 5) for x in range(4)])
    for slot in slots:
        mesh.materials.append(slot and (bpy.data.materials.get(slot) or bpy.data.materials.new(slot)))
    mesh.polygons.foreach_set("material_index", [number % max(len(slots), 1) for number in range(4)])
    layer = mesh.color_attributes.new("Radiosity", 'FLOAT_COLOR', domain)
    colors = np.ones((len(layer.data), 4), np.float32)
    colors[:, :3] = light_at(np.array(points)) if domain == 'POINT' else light_of(np.repeat(np.arange(4), 4))
    layer.data.foreach_set("color", colors.ravel())
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def depsgraph(bpy):
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def triangles(glb, path):
    """Return all triangles of a file: positions in Blender's axes (t, 3, 3) and colors (t, 3, 4)."""
    primitives = list(glb.mesh_primitives(glb.read_glb(path)))
    x, y, z = np.concatenate([primitive.positions for primitive in primitives]).transpose(2, 0, 1)
    return np.stack([x, -z, y], axis=-1), np.concatenate([primitive.colors for primitive in primitives])


def data_of(bpy):
    """Return everything in the file by kind, with how often it is used."""
    kinds = ("objects", "meshes", "materials", "scenes", "cameras", "images", "collections", "node_groups", "worlds")
    found = {kind: [(item.name, item.users) for item in getattr(bpy.data, kind)] for kind in kinds}
    found["nodes"] = [len(material.node_tree.nodes) if material.node_tree else 0 for material in bpy.data.materials]
    found["slots"] = [[slot.material for slot in obj.material_slots] for obj in bpy.data.objects]
    found["selected"] = [obj.name for obj in bpy.context.view_layer.objects if obj.select_get()]
    found["active"] = bpy.context.view_layer.objects.active
    found["scene"] = (bpy.context.window.scene, bpy.context.window.view_layer)
    found["layers"] = [
        ([layer.name for layer in mesh.color_attributes], mesh.color_attributes.render_color_index)
        for mesh in bpy.data.meshes
    ]
    return found


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
