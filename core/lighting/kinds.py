# SPDX-License-Identifier: GPL-3.0-or-later
"""`Lamp`: every kind of light that comes from no surface."""

from .area_lamps import AreaLamp
from .round_lamps import PointLamp, SunLamp
from .sky import SkyLamp

Lamp = AreaLamp | PointLamp | SunLamp | SkyLamp
