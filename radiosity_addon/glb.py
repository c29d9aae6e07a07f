# SPDX-License-Identifier: GPL-3.0-or-later
"""A binary glTF 2.0 file read back and, where names have to change, written again: NumPy only, no bpy.

Only what an export has to be checked for is understood: meshes, their materials' names, and accessors that stand in
the file's own binary chunk. Numbers in brackets are sections of the glTF 2.0 specification.
"""

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import RadiosityError

_MAGIC = 0x46546C67  # "glTF", 4.4
_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}  # 3.6.2.2
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_TRIANGLES = 4  # 3.7.2.1, also the default mode


@dataclass(frozen=True, eq=False)
class Glb:
    """The two chunks of a file.

    Attributes
    ----------
    document : dict
        The JSON chunk.
    binary : bytes
        The binary chunk, empty where the file has none.
    """

    document: dict[str, Any]
    binary: bytes


@dataclass(frozen=True, eq=False)
class Primitive:
    """The triangles of one mesh that share a material.

    Attributes
    ----------
    mesh : str
        Name of the mesh.
    material : str or None
        Name of the material.
    unlit : bool
        Whether that material is shown without lighting (KHR_materials_unlit).
    textured : bool
        Whether it has an image for its color (baseColorTexture).
    positions : ndarray of shape (t, 3, 3)
        Corners of the triangles in glTF's own axes, y up [m].
    colors : ndarray of shape (t, 3, 4) or None
        COLOR_0 at these corners, linear; alpha 1 where the file stores none.
    """

    mesh: str
    material: str | None
    unlit: bool
    textured: bool
    positions: NDArray[np.float64]
    colors: NDArray[np.float64] | None


def read_glb(path: Path) -> Glb:
    """Read the chunks of a binary glTF file (4.4).

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Glb
        Its JSON and its binary chunk.

    Raises
    ------
    RadiosityError
        If it is not a complete binary glTF 2.0 file.
    """
    data = path.read_bytes()
    if len(data) < 12 or struct.unpack_from("<II", data) != (_MAGIC, 2):
        raise RadiosityError(f"{path.name} is not a binary glTF 2.0 file")
    length = struct.unpack_from("<I", data, 8)[0]
    chunks: dict[int, bytes] = {}
    start = 12
    while start + 8 <= min(length, len(data)):
        size, kind = struct.unpack_from("<II", data, start)
        # Only the first chunk of a kind counts; unknown kinds are for others.
        chunks.setdefault(kind, data[start + 8 : start + 8 + size])
        start += 8 + size
    if length != len(data) or start != length or _JSON_CHUNK not in chunks:
        raise RadiosityError(f"{path.name} is cut short: its header promises {length} bytes")
    return Glb(json.loads(chunks[_JSON_CHUNK]), chunks.get(_BINARY_CHUNK, b""))


def write_glb(path: Path, glb: Glb) -> None:
    """Write chunks as a binary glTF file (4.4), padded to multiples of four bytes as the format wants.

    Parameters
    ----------
    path : Path
        The file, replaced if it exists.
    glb : Glb
        What it shall hold.
    """
    text = json.dumps(glb.document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    chunks = [(_JSON_CHUNK, text + b" " * (-len(text) % 4))]
    if glb.binary:
        chunks.append((_BINARY_CHUNK, glb.binary + b"\0" * (-len(glb.binary) % 4)))
    body = b"".join(struct.pack("<II", len(content), kind) + content for kind, content in chunks)
    path.write_bytes(struct.pack("<III", _MAGIC, 2, 12 + len(body)) + body)


def read_accessor(glb: Glb, index: int) -> NDArray[np.float64]:
    """Read one accessor (3.6.2), normalised integers as the fractions they stand for.

    Parameters
    ----------
    glb : Glb
        The file.
    index : int
        Index of the accessor.

    Returns
    -------
    ndarray of shape (count, width)
        Its values; integers up to 32 bits are exact.

    Raises
    ------
    RadiosityError
        If the accessor is sparse, compressed, of a matrix type, or reaches beyond its buffer.
    """
    accessor = glb.document["accessors"][index]
    width = _WIDTHS.get(accessor["type"])
    if width is None or "sparse" in accessor or "bufferView" not in accessor:
        raise RadiosityError(f"Accessor {index} of the glTF file is sparse, compressed or a matrix")
    kind = np.dtype(_COMPONENTS[accessor["componentType"]])
    view = glb.document["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", kind.itemsize * width)
    count = accessor["count"]
    if start + stride * (count - 1) + kind.itemsize * width > len(glb.binary):
        raise RadiosityError(f"Accessor {index} of the glTF file reaches beyond the file's binary chunk")
    # Strides let attributes of a vertex stand side by side.
    values = np.ndarray((count, width), kind, glb.binary, start, (stride, kind.itemsize)).astype(np.float64)
    if accessor.get("normalized", False):
        # 3.6.2.2: signed types reach -1 at both of their lowest values.
        values = np.maximum(values / np.iinfo(kind).max, -1.0)
    return values


def mesh_primitives(glb: Glb) -> Iterator[Primitive]:
    """Yield every triangle primitive of every mesh, corner by corner.

    Parameters
    ----------
    glb : Glb
        The file.

    Yields
    ------
    Primitive
        In the order of the file; points and lines are left out.
    """
    materials = glb.document.get("materials", [])
    for mesh in glb.document.get("meshes", []):
        for primitive in mesh["primitives"]:
            if primitive.get("mode", _TRIANGLES) != _TRIANGLES:
                continue
            attributes = primitive["attributes"]
            positions = read_accessor(glb, attributes["POSITION"])
            corners = np.arange(len(positions))
            if "indices" in primitive:
                corners = read_accessor(glb, primitive["indices"])[:, 0].astype(np.int64)
            corners = corners.reshape(-1, 3)
            colors = None
            if "COLOR_0" in attributes:
                colors = read_accessor(glb, attributes["COLOR_0"])
                alpha = np.ones((len(colors), 4 - colors.shape[1]))
                colors = np.concatenate([colors, alpha], axis=1)[corners]
            material = materials[primitive["material"]] if "material" in primitive else {}
            yield Primitive(
                mesh=mesh.get("name", ""),
                material=material.get("name"),
                unlit="KHR_materials_unlit" in material.get("extensions", {}),
                textured="baseColorTexture" in material.get("pbrMetallicRoughness", {}),
                positions=positions[corners],
                colors=colors,
            )
