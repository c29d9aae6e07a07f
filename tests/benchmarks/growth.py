# SPDX-License-Identifier: GPL-3.0-or-later
"""How time and memory grow with the number of patches of the thesis's room."""

from argparse import Namespace
from collections.abc import Sequence
from math import log

from . import machine, tables
from .one_bake import Figures, in_own_process


def main(options: Namespace) -> None:
    """Bake the room at several sizes and write a table."""
    figures = []
    for factor in options.factors:
        figures.append(in_own_process(options.room, factor, options.method, options.quality))
        print(f"{figures[-1]} ({machine.load()})", flush=True)
    options.output.mkdir(parents=True, exist_ok=True)
    text = f"Machine: {machine.description()}\n\nQuality {options.quality}.\n\n{_table(figures)}\n"
    (options.output / "growth.md").write_text(text)
    print(text)


def _table(figures: Sequence[Figures]) -> str:
    """Return the Markdown table; every exponent is that of the step from the row before."""
    rows = []
    for before, now in zip([None, *figures], figures, strict=False):
        exponent = ""
        if before is not None and before.patches < now.patches:
            exponent = f"{log(now.seconds / before.seconds) / log(now.patches / before.patches):.2f}"
        rows.append([f"{now.patches:_}", exponent, f"{now.seconds:.2f}", f"{now.peak:.0f}", f"{now.peak_before:.0f}"])
    return tables.table(["patches", "exponent", "seconds", "peak memory [MiB]", "of it before the bake"], rows)
