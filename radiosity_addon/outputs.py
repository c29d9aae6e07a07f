# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are either written whole or not at all."""

import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import RadiosityError


def check_output(path: Path) -> None:
    """Find out whether a file can be written, before an hour has been spent on what shall go into it.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    RadiosityError
        If its folder is missing or does not take files, if it is a folder itself, or is write-protected.
    """
    if path.is_dir():
        raise RadiosityError(f"Cannot write {path}: it is a folder; name a file")
    if not path.parent.is_dir():
        raise RadiosityError(f"Cannot write {path}: there is no folder {path.parent}; make it first")
    if path.exists() and not os.access(path, os.W_OK):
        raise RadiosityError(f"Cannot write {path}: the file is write-protected; name another one")
    try:
        # Permission bits do not tell about read-only disks or network shares: try it.
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise RadiosityError(f"Cannot write {path}: {error.strerror or error}; choose another folder") from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside a file; what stands there at the end takes the file's place.

    Parameters
    ----------
    path : Path
        The file that shall be written. Nothing happens to it if the block fails.

    Yields
    ------
    Path
        Name to write to, in the same folder and with the same ending.

    Raises
    ------
    RadiosityError
        If the folder is missing or does not take the file, or the disk is full.
    """
    check_output(path)
    # In the same folder, not a folder within it: the relative paths inside a .blend have to stay true.
    temporary = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise RadiosityError(f"Cannot write {path}: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)
