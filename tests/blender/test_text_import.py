# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's scene file as Blender objects and back."""

import importlib

import numpy as np
import pytest

from tests.blender.building import CUBE_FACES, CUBE_VERTICES, add_mesh, add_square, colors, glowing

# A room whose y points upwards, as in the thesis; its lamp hangs under the ceiling.
ROOM = """\
R 4 (0,0,0) (0,0,1) (1,0,1) (1,0,0) (0,1,0) (1,1,1,0.73)
R 3 (0,1,0) (1,1,0) (1,1,1) (0,1,1) (0,-1,0) (1,1,1,0.73)
R 2 (0,0,0) (0,1,0) (0,1,1) (0,0,1) (1,0,0) (1,0.1,0.08,0.63)
R 1 (1,0,0) (1,0,1) (1,1,1) (1,1,0) (-1,0,0) (0.3,1,0.2,0.45)
E 2 (0.35,0.999,0.35) (0.65,0.999,0.35) (0.65,0.999,0.65) (0.35,0.999,0.65) (0,-1,0) (1,1,0.9,12)
"""


@pytest.fixture
def module(extension):
    """Give a function that gives the extension's modules by name."""
    return lambda name: importlib.import_module(f"{extension.__name__}.{name}")


@pytest.fixture
def rectangles(module):
    return module("core.scene_text").parse_scene_text(ROOM)


@pytest.fixture
def build(module, scene, rectangles):
    """Give a function that builds the room."""
    return lambda *args, **options: module("radiosity_addon.text_import").build_objects(
        scene, rectangles, *args, **options
    )


@pytest.fixture
def read(module, blender):
    """Give a function that reads Blender's scene."""

    def read():
        context = blender.context
        depsgraph = context.evaluated_depsgraph_get()
        return module("radiosity_addon.scene_reader").read_scene(context.scene, context.view_layer, depsgraph).scene

    return read


@pytest.fixture
def export(module, blender, tmp_path):
    """Give a function that exports the scene and returns the rectangles in the file."""

    def export(**options):
        path = tmp_path / "exported.txt"
        assert blender.ops.export_scene.radiosity(filepath=str(path), **options) == {'FINISHED'}
        return module("core.scene_text").read_scene_text(path)

    return export


def numbers(rectangle):
    """Return all numbers of a rectangle."""
    parts = (rectangle.corners.ravel(), rectangle.normal, rectangle.colour, [rectangle.factor])
    return np.concatenate(parts)


@pytest.mark.parametrize("subdivide", [1, 3])
def test_every_rectangle_becomes_a_grid(build, rectangles, scene, blender, subdivide):
    objects = build(subdivide, name="Room")
    assert [obj.name for obj in objects] == ["R1", "R2", "R3", "R4", "E5"]
    assert set(scene.collection.children["Room"].objects) == set(objects)
    for obj, rectangle in zip(objects, rectangles, strict=True):
        n = rectangle.divisions * subdivide
        assert (len(obj.data.polygons), len(obj.data.vertices)) == (n * n, (n + 1) ** 2)
        assert not obj.data.validate()
        areas = [polygon.area for polygon in obj.data.polygons]
        sides = rectangle.corners[1] - rectangle.corners[0], rectangle.corners[3] - rectangle.corners[0]
        np.testing.assert_allclose(areas, np.linalg.norm(np.cross(*sides)) / n**2, rtol=1e-4)
        for polygon in obj.data.polygons:
            np.testing.assert_allclose(polygon.normal, rectangle.normal, atol=1e-5)
        vertices = np.array([vertex.co[:] for vertex in obj.data.vertices])
        for corner in rectangle.corners:
            assert np.abs(vertices - corner).max(axis=1).min() < 1e-6


def test_materials_mean_the_light_that_the_file_says(build, read, blender):
    objects = build()
    found = read()
    first = [int(np.flatnonzero(found.face_object == index)[0]) for index in range(5)]
    expected = [[0.73] * 3, [0.73] * 3, [0.63, 0.063, 0.0504], [0.135, 0.45, 0.09], [0.0] * 3]
    np.testing.assert_allclose(found.reflectance[first], expected, rtol=1e-6)
    np.testing.assert_allclose(found.emission[first[4]], [12.0, 12.0, 10.8], rtol=1e-6)
    assert not found.emission[first[:4]].any()
    # Rectangles that are alike share their material.
    assert objects[0].data.materials[0] == objects[1].data.materials[0]
    assert len(blender.data.materials) == 4


def test_y_upwards_can_be_turned_to_blenders_z(build, module):
    objects = build(up='Y')
    lamp = np.array([vertex.co[:] for vertex in objects[4].data.vertices])
    np.testing.assert_allclose(lamp[:, 2], 0.999, atol=1e-6)
    np.testing.assert_allclose(objects[4].data.polygons[0].normal, (0, 0, -1), atol=1e-6)


def test_lengths_are_metres_whatever_the_scenes_unit(build, read, scene):
    scene.unit_settings.scale_length = 0.01
    objects = build()
    assert np.isclose(objects[0].data.vertices[-1].co.length, 100.0 * np.sqrt(2.0))
    found = read()
    assert np.isclose(found.face_area[found.face_object == 0].sum(), 1.0)


@pytest.mark.parametrize("up", ['Z', 'Y'])
def test_the_camera_sees_the_room_upright_through_its_wall(build, scene, blender, up):
    from bpy_extras.object_utils import world_to_camera_view

    objects = build(up=up)
    camera = scene.camera
    blender.context.view_layer.update()
    points = [obj.matrix_world @ vertex.co for obj in objects for vertex in obj.data.vertices]
    seen = np.array([world_to_camera_view(scene, camera, point) for point in points])
    assert seen[:, :2].min() > 0.0 and seen[:, :2].max() < 1.0
    assert np.ptp(seen[:, 1]) > 0.8, "the room should fill the picture"
    # Everything but what lies in the plane of the nearest wall is within the clipping range.
    inside = seen[:, 2] > seen[:, 2].min() + 0.05
    assert seen[:, 2].min() < camera.data.clip_start < seen[inside, 2].min()
    assert seen[:, 2].max() < camera.data.clip_end
    lamp = world_to_camera_view(scene, camera, objects[4].matrix_world @ objects[4].data.vertices[0].co)
    assert lamp[1] > 0.8, "the lamp hangs above"


def test_a_scenes_own_camera_stays(build, scene, blender):
    own = blender.data.objects.new("Own", blender.data.cameras.new("Own"))
    scene.collection.objects.link(own)
    scene.camera = own
    build()
    assert scene.camera == own and len(blender.data.cameras) == 1


def test_a_flat_subject_is_looked_at_from_above(module, scene, blender):
    text = module("core.scene_text").parse_scene_text("R 1 (0,0,0) (9,0,0) (9,9,0) (0,9,0) (0,0,1) (1,1,1,0.5)")
    module("radiosity_addon.text_import").build_objects(scene, text)
    blender.context.view_layer.update()
    assert scene.camera.matrix_world.to_3x3().col[2].z > 0.4


def test_import_bake_and_look(blender, scene, tmp_path):
    path = tmp_path / "thesis room.txt"
    path.write_text(ROOM)
    assert blender.ops.import_scene.radiosity(filepath=str(path)) == {'FINISHED'}
    assert "thesis room" in scene.collection.children
    assert blender.ops.radiosity.bake() == {'FINISHED'}
    floor = colors(blender.data.objects["R1"].data)[:, :3]
    # The lamp is yellowish and so is the light on the white floor, which differs from place to place.
    assert (floor[:, 2] < floor[:, 0]).all() and floor.min() > 0.0
    assert floor[:, 0].max() > 1.05 * floor[:, 0].min()


def test_a_bad_line_is_named_and_nothing_is_loaded(blender, scene, tmp_path):
    path = tmp_path / "bad.txt"
    path.write_text(ROOM + "R 2 (0,0,0) nonsense\n")
    with pytest.raises(RuntimeError, match="Line 6"):
        blender.ops.import_scene.radiosity(filepath=str(path))
    with pytest.raises(RuntimeError, match="Cannot read"):
        blender.ops.import_scene.radiosity(filepath=str(tmp_path / "missing.txt"))
    assert not blender.data.objects and not blender.data.collections


@pytest.mark.parametrize("up", ['Z', 'Y'])
@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_what_is_imported_is_exported_number_by_number(build, export, rectangles, scene, up, unit):
    scene.unit_settings.scale_length = unit
    build(up=up)
    found = export(up=up)
    assert [(r.kind, r.divisions) for r in found] == [(r.kind, r.divisions) for r in rectangles]
    for one, other in zip(found, rectangles, strict=True):
        # Blender keeps single precision; metres survive it, centimetres round once more.
        np.testing.assert_allclose(numbers(one), numbers(other), atol=0 if unit == 1.0 else 1e-6)


def test_an_object_that_is_no_grid_is_written_face_by_face(export, scene):
    add_mesh(scene, "Box", CUBE_VERTICES, CUBE_FACES, glowing(reflectance=0.5, radiance=0.0))
    found = export()
    assert [(r.kind, r.divisions) for r in found] == [("R", 1)] * 6
    np.testing.assert_allclose(found[0].normal, (-1, 0, 0))
    np.testing.assert_allclose([*found[0].colour, found[0].factor], (1, 1, 1, 0.5))


def test_a_grid_of_uneven_cells_or_of_two_materials_is_written_face_by_face(build, export, scene):
    grid = build()[2]
    grid.data.vertices[4].co.y += 0.2
    assert sum(r.divisions == 1 for r in export()) == 1 + 4
    grid.data.vertices[4].co.y -= 0.2
    assert sum(r.divisions == 1 for r in export()) == 1
    grid.data.materials.append(glowing(reflectance=0.25, radiance=0.0))
    grid.data.polygons[3].material_index = 1
    assert sum(r.divisions == 1 for r in export()) == 1 + 4


def test_moved_and_turned_objects_are_exported_where_they_are(build, export, read, scene):
    build()[0].matrix_world = np.array([[0, -2, 0, 5], [2, 0, 0, 6], [0, 0, 2, 7], [0, 0, 0, 1]]).T.tolist()
    found = export()[0]
    assert found.divisions == 4
    np.testing.assert_allclose(found.corners[0], (5, 6, 7))
    np.testing.assert_allclose(np.ptp(found.corners, axis=0), (0, 2, 2), atol=1e-6)


@pytest.mark.parametrize(
    "vertices, face, message",
    [
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], (0, 1, 2), "not quads"),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 1), (0, 1, 0)], (0, 1, 2, 3), "one plane"),
    ],
    ids=["triangle", "not flat"],
)
def test_what_is_no_flat_quad_is_an_error_that_names_the_object(blender, scene, tmp_path, vertices, face, message):
    add_square(scene)
    add_mesh(scene, "Odd", vertices, [face])
    path = tmp_path / "out.txt"
    with pytest.raises(RuntimeError, match=f"'Odd'.*{message}"):
        blender.ops.export_scene.radiosity(filepath=str(path))
    assert not path.exists()


def test_a_surface_that_emits_and_reflects_is_told_what_it_loses(module, read, scene):
    add_square(scene, "Both", glowing(reflectance=0.5, radiance=1.0))
    rectangles, warnings = module("radiosity_addon.text_export").rectangles_from_scene(read())
    assert rectangles[0].kind == "E"
    assert ["'Both'" in warning for warning in warnings] == [True]


def test_a_file_that_cannot_be_written_is_an_error(blender, scene, tmp_path):
    add_square(scene)
    with pytest.raises(RuntimeError, match="Cannot write"):
        blender.ops.export_scene.radiosity(filepath=str(tmp_path / "missing" / "out.txt"))
