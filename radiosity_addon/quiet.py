# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender talks on the standard streams while it loads, exports and renders: not what a terminal was asked for."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout


@contextmanager
def quiet() -> Iterator[None]:
    """Keep everything that is written to stdout and stderr from being seen, by Python or by Blender itself.

    What matters comes as an exception.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    with open(os.devnull, "w", encoding="utf-8") as sink, redirect_stdout(sink), redirect_stderr(sink):
        copies = [(stream, os.dup(stream)) for stream in (1, 2)]
        try:
            for stream, _ in copies:
                os.dup2(sink.fileno(), stream)
            yield
        finally:
            for stream, copy in copies:
                os.dup2(copy, stream)
                os.close(copy)
