# SPDX-License-Identifier: GPL-3.0-or-later
"""Why Blender cannot read a file, and what to do about it."""

import gzip
import re
from pathlib import Path

import bpy

# "BLENDER", how large pointers are, "V" where the highest byte is first, the version; "17-01" in the middle since 5.0.
_HEADER = re.compile(rb"BLENDER(?:[-_]|\d\d-\d\d)([vV])(\d+)")
_GZIP, _ZSTANDARD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"
_MOST = 32  # bytes of a header


def why_unreadable(path: Path, error: RuntimeError) -> str:
    """Tell in a line what is wrong with a file that Blender refused.

    Parameters
    ----------
    path : Path
        The file.
    error : RuntimeError
        What Blender said of it.

    Returns
    -------
    str
        The reason and, where the file's header tells that another Blender reads it, which.
    """
    start = _start(path)
    header = _HEADER.match(start)
    version = (int(header[2]) // 100, int(header[2]) % 100) if header else (0, 0)
    here = "{}.{}".format(*bpy.app.version)
    if version > bpy.app.version[:2]:
        return f"Blender {version[0]}.{version[1]} saved it and this is {here}: bake it there"
    if header and header[1] == b"V" and bpy.app.version[0] >= 5:
        return "its bytes are big-endian, which Blender reads up to 4.5: open it there, save it, and bake that"
    reason = blenders_reason(error)
    newer = start.startswith(_ZSTANDARD) and "not a blend file" in reason
    return reason + (f"; it may be one of a newer Blender than {here}" if newer else "")


def blenders_reason(error: RuntimeError) -> str:
    """Return what Blender says last about a file, without the words and the names around it."""
    return blenders_reasons(error)[-1]


def blenders_reasons(error: RuntimeError) -> list[str]:
    """Return all that Blender says about a file, without the words and the names around it."""
    return [_bare(line.strip().split(": ", 1)[-1]) for line in str(error).strip().splitlines()]


def _bare(reason: str) -> str:
    """Leave out which file it is about."""
    reason = re.sub(r'^Loading ".*?" failed: ', "", reason)
    return re.sub(r"^(Failed to read blend file) '.*?'(?:[:,] )", r"\1: ", reason)


def _start(path: Path) -> bytes:
    """Return the first bytes of a file, unpacked where Blender before 3.0 compressed it."""
    with path.open("rb") as file:
        start = file.read(_MOST)
    if not start.startswith(_GZIP):
        return start
    try:
        with gzip.open(path) as packed:
            return packed.read(_MOST)
    except (OSError, EOFError):
        return b""
