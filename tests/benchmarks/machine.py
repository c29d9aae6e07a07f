# SPDX-License-Identifier: GPL-3.0-or-later
"""Say what a benchmark ran on."""

import os
import platform
import sys
from pathlib import Path

import bpy
import numpy as np


def description() -> str:
    """Return one line: processor, cores, memory, system and versions."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    versions = f"Blender {bpy.app.version_string}, Python {sys.version.split()[0]}, NumPy {np.__version__}"
    return f"{_processor()}, {cores} cores{_memory()}, {platform.system()}; {versions}"


def load() -> str:
    """Return how busy the machine was in the last minute, where the system tells."""
    return f"load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "load unknown"


def _processor() -> str:
    """Return the processor's name."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _memory() -> str:
    """Return the size of the memory, where the system tells."""
    if "SC_PHYS_PAGES" not in getattr(os, "sysconf_names", {}):
        return ""
    return f", {os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 2**30:.0f} GiB"
