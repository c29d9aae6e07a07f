# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading binary glTF: every component type, strides, and files that are broken."""

import json
import struct

import numpy as np
import pytest


def one_accessor(glb, values, component, kind="VEC4", stride=None, **more):
    """Put an array into a file of one accessor, rows `stride` bytes apart."""
    width = values.itemsize * values.shape[1]
    stride = stride or width
    rows = np.zeros((len(values), stride), np.uint8)
    rows[:, :width] = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), width)
    view = {"buffer": 0, "byteOffset": 4, "byteStride": stride}
    accessor = {"bufferView": 0, "componentType": component, "count": len(values), "type": kind, **more}
    return glb.Glb({"bufferViews": [view], "accessors": [accessor]}, b"\1\2\3\4" + rows.tobytes())


@pytest.mark.parametrize(
    ("component", "dtype", "low", "high"),
    [
        (5120, np.int8, -128, 127),
        (5121, np.uint8, 0, 255),
        (5122, np.int16, -32768, 32767),
        (5123, np.uint16, 0, 65535),
        (5125, np.uint32, 0, 4294967295),
    ],
)
def test_integers_are_read_plain_and_normalized(glb, component, dtype, low, high):
    values = np.array([[low, 0, 1, high], [high, 1, 0, low]], dtype)
    plain = glb.read_accessor(one_accessor(glb, values, component), 0)
    np.testing.assert_array_equal(plain, values.astype(float))
    normalized = glb.read_accessor(one_accessor(glb, values, component, normalized=True), 0)
    np.testing.assert_allclose(normalized, np.maximum(values / float(high), -1.0), rtol=1e-15)
    assert normalized.min() == (-1.0 if low else 0.0)
    assert normalized.max() == 1.0


def test_floats_with_other_data_between_them(glb):
    values = np.random.default_rng(1).random((5, 3)).astype("<f4")
    read = glb.read_accessor(one_accessor(glb, values, 5126, "VEC3", stride=32), 0)
    np.testing.assert_array_equal(read, values.astype(float))


def test_a_file_survives_writing_and_reading(glb, tmp_path):
    path = tmp_path / "a.glb"
    glb.write_glb(path, glb.Glb({"asset": {"version": "2.0"}, "name": "Žarulja"}, b"12345"))
    data = path.read_bytes()
    assert len(data) % 4 == 0
    assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))
    read = glb.read_glb(path)
    assert read.document == {"asset": {"version": "2.0"}, "name": "Žarulja"}
    assert read.binary == b"12345\0\0\0"


@pytest.mark.parametrize("data", [b"", b"glTF", b"nothing of that kind", b"glTF" + struct.pack("<II", 1, 12)])
def test_other_files_are_refused(glb, error, tmp_path, data):
    path = tmp_path / "a.glb"
    path.write_bytes(data)
    with pytest.raises(error, match=r"a\.glb is not a binary glTF 2\.0 file"):
        glb.read_glb(path)


@pytest.mark.parametrize("missing", [1, 4, 8, 20])
def test_a_file_cut_short_is_refused(glb, error, tmp_path, missing):
    path = tmp_path / "a.glb"
    glb.write_glb(path, glb.Glb({"asset": {"version": "2.0"}}, b"1234"))
    path.write_bytes(path.read_bytes()[:-missing])
    with pytest.raises(error, match="cut short"):
        glb.read_glb(path)


@pytest.mark.parametrize("change", [{"sparse": {}}, {"type": "MAT4"}, {"count": 99}])
def test_accessors_that_cannot_be_read_are_refused(glb, error, change):
    file = one_accessor(glb, np.zeros((2, 4), "<f4"), 5126)
    file.document["accessors"][0].update(change)
    with pytest.raises(error, match="Accessor 0"):
        glb.read_accessor(file, 0)


def test_primitives_with_and_without_indices_colors_and_materials(glb):
    points = np.arange(12, dtype="<f4").reshape(4, 3)
    colors = np.array([[255, 0, 0, 0], [0, 255, 0, 0], [0, 0, 255, 0], [51, 51, 51, 0]], np.uint8)
    binary = points.tobytes() + colors.tobytes() + np.array([0, 1, 2, 2, 1, 3], "<u2").tobytes()
    views = [{"buffer": 0, "byteOffset": 0}, {"buffer": 0, "byteOffset": 48, "byteStride": 4}, {"byteOffset": 64}]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5121, "count": 4, "type": "VEC3", "normalized": True},
        {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
    ]
    primitives = [
        {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0},
        {"attributes": {"POSITION": 3}},
        {"attributes": {"POSITION": 0}, "mode": 1},
    ]
    document = {
        "meshes": [{"name": "Wall", "primitives": primitives}],
        "materials": [{"name": "Paint", "extensions": {"KHR_materials_unlit": {}}}],
        "bufferViews": views,
        "accessors": accessors,
    }
    painted, bare = glb.mesh_primitives(glb.Glb(json.loads(json.dumps(document)), binary))
    assert (painted.mesh, painted.material, painted.unlit) == ("Wall", "Paint", True)
    np.testing.assert_array_equal(painted.positions, points[[[0, 1, 2], [2, 1, 3]]])
    np.testing.assert_allclose(painted.colors[1], [[0, 0, 1, 1], [0, 1, 0, 1], [0.2, 0.2, 0.2, 1]])
    assert (bare.material, bare.unlit, bare.colors) == (None, False, None)
    assert bare.positions.shape == (1, 3, 3)
