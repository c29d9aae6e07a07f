# SPDX-License-Identifier: GPL-3.0-or-later
"""What strangers' files bring, through the button and through the command: light, or one line that says why not."""

import numpy as np
import pytest

from tests.blender.building import add_light, add_mesh, add_shader, add_square, colors, glowing, node_material

NAN, INF = float("nan"), float("inf")


@pytest.fixture
def cli(addon):
    return addon("cli")


@pytest.fixture(params=["button", "command"])
def bake(request, scene, blender, cli, capsys, tmp_path):
    """Give a function that bakes what is there by either way, and returns complaint or None, and the warnings.

    The command takes it from a file and leaves the result open.
    """

    def press(**settings):
        for name, value in settings.items():
            setattr(scene.radiosity, name, value)
        try:
            assert blender.ops.radiosity.bake() == {'FINISHED'}
        except RuntimeError as error:
            assert "Traceback" not in str(error)
            return str(error).strip().removeprefix("Error: "), []
        return None, blender.context.window_manager.radiosity.warnings.splitlines()

    def command(**settings):
        path, out = tmp_path / "in.blend", tmp_path / "out.blend"
        blender.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
        given = [
            text for name, value in settings.items() for text in (f"--{name.replace('_', '-')}", str(value).lower())
        ]
        before = path.read_bytes()
        capsys.readouterr()
        code = cli.main([str(path), "--output", str(out), *given], prog="bake.py")
        lines = [line.removeprefix("radiosity: ") for line in capsys.readouterr().err.splitlines()]
        assert path.read_bytes() == before and out.exists() == (code == 0)
        if code:
            blender.ops.wm.open_mainfile(filepath=str(path))
            return lines[-1].removeprefix("error: "), []
        blender.ops.wm.open_mainfile(filepath=str(out))
        return None, [line.removeprefix("warning: ") for line in lines if line.startswith("warning: ")]

    return press if request.param == "button" else command


def lit_pair(scene):
    """Add a lamp that shines down on a floor; return both."""
    lamp = add_square(scene, "Lamp", glowing(reflectance=0.0, radiance=5.0), z=1.0)
    lamp.rotation_euler, lamp.location = (np.pi, 0.0, 0.0), (0.0, 1.0, 2.0)
    return lamp, add_square(scene, "Floor")


def baked(blender, name="Floor", attribute="Radiosity"):
    """Return the colors of an object, which are all numbers."""
    found = colors(blender.data.objects[name].data, attribute)[:, :3]
    assert np.isfinite(found).all()
    return found


@pytest.mark.parametrize("max_edge, target", [(1e-9, "in_place"), (1e-5, "in_place"), (1e-9, "copy")])
def test_patches_beyond_count_are_refused_with_their_number(bake, scene, blender, max_edge, target):
    lit_pair(scene)
    settings = {"max_edge": max_edge} if target == "in_place" else {"max_edge": max_edge, "target": "COPY"}
    complaint, _ = bake(**settings)
    count = float(complaint.split("cut into ")[1].removeprefix("some ").split()[0].replace(",", ""))
    assert count == pytest.approx(max_edge**-2, rel=1e-3)
    assert "5,000,000 at most" in complaint
    assert not any(mesh.color_attributes for mesh in blender.data.meshes) and not blender.data.collections


def test_patches_larger_than_everything_are_the_faces(bake, scene, blender):
    lit_pair(scene)
    assert bake(max_edge=1e9) == (None, [])
    assert baked(blender).min() > 0.0


def test_names_that_are_too_long_are_refused_and_those_that_fit_are_not_cut(bake, scene, blender):
    lit_pair(scene)
    assert "64 bytes" in bake(attribute="\u00e4" * 32)[0]
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)
    assert bake(attribute="\u65e5\u672c" * 10) == (None, [])
    assert baked(blender, attribute="\u65e5\u672c" * 10).min() > 0.0


def test_lamps_and_worlds_that_are_no_numbers_are_told_and_left_out(bake, scene, blender):
    lit_pair(scene)
    for name, kind, settings, place in (
        ("Power", 'POINT', {"energy": NAN}, 0.0),
        ("Size", 'AREA', {"size": INF}, 0.0),
        ("Place", 'SUN', {}, NAN),
        ("Bright", 'SPOT', {"energy": 3e38}, 1.0),
    ):
        add_light(scene, kind, (place, 0.0, 1.0), name, **settings)
    world = blender.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = NAN
    complaint, warnings = bake()
    assert complaint is None and baked(blender).min() > 0.0
    warnings = [line for line in warnings if not line.startswith("Object")]
    told = "\n".join(warnings)
    assert len(warnings) == 4
    for start in ("Light 'Power'", "Light 'Size'", "Light 'Place'", "World 'World'"):
        assert start in told


def test_coordinates_that_are_no_numbers_cost_nothing_but_a_warning(bake, scene, blender):
    _, floor = lit_pair(scene)
    image = blender.data.images.new("Red", 4, 4)
    image.pixels.foreach_set(np.tile(np.float32([0.5, 0.0, 0.0, 1.0]), 16))
    image.pack()
    material, output = node_material("Tiles")
    shader = add_shader(material, 'ShaderNodeBsdfDiffuse', output.inputs["Surface"])
    add_shader(material, 'ShaderNodeTexImage', shader.inputs["Color"]).image = image
    floor.data.materials.append(material)
    uv = floor.data.uv_layers.new(name="Map").data
    uv[0].uv, uv[1].uv = (NAN, INF), (-INF, 3e38)
    complaint, (warning,) = bake()
    assert complaint is None and warning.startswith("Material 'Tiles'") and "'Red'" in warning
    assert baked(blender)[:, 0].min() > 0.0 and baked(blender)[:, 1].max() == 0.0


def test_the_same_told_of_many_is_told_once_and_counted(addon):
    gathered = addon("wording").gathered
    same = [f"Object '{name}': {number} faces without area are skipped" for number, name in enumerate("ABCDE", 2)]
    few = [f"Material '{name}': its gloss is ignored" for name in "ABC"]
    others = ["Object 'F': 1 face without area is skipped", "50.0% of the colors are brighter than 1", "One 'A': two"]
    told = gathered([*same[:2], *few, *others, *same[2:]])
    assert told == [
        "Object 'A': 2 faces without area are skipped; likewise 4 more objects: 'B', 'C', 'D', …",
        *few,
        *others,
    ]


def test_nothing_that_receives_is_said(bake, scene, blender):
    for obj in lit_pair(scene):
        obj.radiosity.receive = False
    assert "switch on Receive" in bake()[0]
    assert not any(mesh.color_attributes for mesh in blender.data.meshes)


@pytest.mark.parametrize("hidden", ["", "hide_viewport", "eye"])
def test_what_is_being_edited_is_baked_as_it_is_edited(bake, scene, blender, hidden):
    import bmesh

    _, floor = lit_pair(scene)
    floor.select_set(True)
    blender.context.view_layer.objects.active = floor
    blender.ops.object.mode_set(mode='EDIT')
    edited = bmesh.from_edit_mesh(floor.data)
    edited.verts.ensure_lookup_table()
    edited.faces.new((edited.verts[1], edited.verts[0], edited.verts.new((0.5, -1.0, 0.0))))
    bmesh.update_edit_mesh(floor.data)
    if hidden == "eye":
        floor.hide_set(True)
    elif hidden:
        setattr(floor, hidden, True)
    assert bake() == (None, [])
    # The colors are on the mesh itself, where leaving Edit Mode does not take them away.
    floor = blender.data.objects["Floor"]
    assert floor.mode == 'OBJECT' and len(floor.data.polygons) == 2
    assert len(baked(blender)) == 7 and baked(blender).min() > 0.0


def test_tiny_faces_a_thousand_kilometers_away_do_no_harm(bake, scene, blender):
    lit_pair(scene)
    assert bake()[0] is None
    alone = baked(blender)
    for number in range(3):
        for place, size in (((1e6, 0.0, number), 1.0), ((1e6 + number, 0.0, 0.5), 1e-6), ((0.5, -1.0, number), 1e-6)):
            obj = add_square(blender.context.scene, "Far", size=size)
            obj.location = place
    add_mesh(blender.context.scene, "Nowhere", [(0, 0, 0), (NAN, 0, 0), (0, INF, 0)], [(0, 1, 2)])
    assert bake()[0] is None
    np.testing.assert_allclose(baked(blender), alone, rtol=0.02)
