# SPDX-License-Identifier: GPL-3.0-or-later
"""The one error type that the add-on and the command turn into a message."""


class RadiosityError(ValueError):
    """Input or settings that cannot be worked with; the text says what is wrong and what to do."""
