# SPDX-License-Identifier: GPL-3.0-or-later
"""Words of messages: counts, lists of names that stay short, and the same message about many things told once."""

import re
from collections.abc import Iterable

MOST_NAMES = 3
NOT_CONVERGED = "not converged"
_ABOUT = re.compile(r"(Object|Mesh|Material|Light) '(.*?)'(.*)")
_NUMBER = re.compile(r"\d+(?:[.,]\d+)*")


def listed(names: Iterable[str]) -> str:
    """Return the first few names in quotes, with a mark where there are more."""
    everything = list(dict.fromkeys(names))
    more = ", …" if len(everything) > MOST_NAMES else ""
    return ", ".join(f"'{name}'" for name in everything[:MOST_NAMES]) + more


def counted(count: int, what: str) -> str:
    """Return a count with its noun."""
    return f"1 {what}" if count == 1 else f"{count} {what}s"


def last_line(error: Exception) -> str:
    """Return what a failed operator says after its traceback."""
    return str(error).strip().splitlines()[-1].strip()


def gathered(warnings: Iterable[str]) -> list[str]:
    """Tell once what is told of many objects, meshes, materials or lights.

    Parameters
    ----------
    warnings : iterable of str
        One line each.

    Returns
    -------
    list of str
        Lines that differ in nothing but the name at their beginning and in numbers are one, with the number of the
        others and the names of the first few, where there are more of them than names are listed.
    """
    groups: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for line in warnings:
        about = _ABOUT.fullmatch(line)
        what, name, rest = about.groups() if about else ("", "", line)
        key = (what, _NUMBER.sub("#", rest) if about else line)
        groups.setdefault(key, []).append((name, line))
    lines = []
    for (what, _), group in groups.items():
        if not what or len(group) <= MOST_NAMES:
            lines += [line for _, line in group]
        else:
            others = [name for name, _ in group[1:]]
            lines.append(f"{group[0][1]}; likewise {len(others)} more {what.lower()}s: {listed(others)}")
    return lines
