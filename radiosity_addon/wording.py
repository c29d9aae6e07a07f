# SPDX-License-Identifier: GPL-3.0-or-later
"""Words of messages: counts, and lists of names that stay short."""

from collections.abc import Iterable

MOST_NAMES = 3


def listed(names: Iterable[str]) -> str:
    """Return the first few names in quotes, with a mark where there are more."""
    everything = list(dict.fromkeys(names))
    more = ", …" if len(everything) > MOST_NAMES else ""
    return ", ".join(f"'{name}'" for name in everything[:MOST_NAMES]) + more


def counted(count: int, what: str) -> str:
    """Return a count with its noun."""
    return f"1 {what}" if count == 1 else f"{count} {what}s"
