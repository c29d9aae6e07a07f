# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory is free, and how much was used at most, in the words of each operating system."""

import ctypes
import os
import sys
from pathlib import Path


def available_memory() -> int:
    """Return how much memory can still be taken without swapping [bytes].

    Returns
    -------
    int
        On Linux what the kernel and the control group leave, on Windows free physical memory; elsewhere, where only
        the memory that is built in is told, three quarters of that.
    """
    if sys.platform == "win32":  # pragma: no cover
        return _windows_available()
    if sys.platform == "linux":
        return _linux_available(Path("/proc/meminfo"), Path("/sys/fs/cgroup"))
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") * 3 // 4  # pragma: no cover


def peak_memory() -> int:
    """Return the most memory this process has held since it started [bytes]."""
    if sys.platform == "win32":  # pragma: no cover
        return _windows_peak()
    if sys.platform == "linux":
        # What getrusage tells is inherited from whoever started the process.
        return 1024 * _kilobytes(Path("/proc/self/status"), "VmHWM")
    import resource  # pragma: no cover

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # pragma: no cover


def _kilobytes(file: Path, name: str) -> int:
    """Read one number from a table of the kernel's."""
    lines = dict(line.split(":", 1) for line in file.read_text(encoding="utf-8").splitlines())
    return int(lines[name].split()[0])


def _linux_available(meminfo: Path, group: Path) -> int:
    """Read what the kernel says, and what is left under a container's limit where there is one."""
    available = 1024 * _kilobytes(meminfo, "MemAvailable")
    limit, used = group / "memory.max", group / "memory.current"
    if limit.is_file() and used.is_file():
        most = limit.read_text(encoding="ascii").strip()
        if most != "max":
            available = min(available, int(most) - int(used.read_text(encoding="ascii")))
    return max(available, 0)


def _windows_available() -> int:  # pragma: no cover
    """Ask GlobalMemoryStatusEx."""

    class Status(ctypes.Structure):
        _fields_ = (
            ("length", ctypes.c_ulong),
            ("load", ctypes.c_ulong),
            ("total", ctypes.c_ulonglong),
            ("free", ctypes.c_ulonglong),
            *((f"size_{index}", ctypes.c_ulonglong) for index in range(5)),
        )

    status = Status(length=ctypes.sizeof(Status))
    ctypes.CDLL("kernel32").GlobalMemoryStatusEx(ctypes.byref(status))
    return int(status.free)


def _windows_peak() -> int:  # pragma: no cover
    """Ask GetProcessMemoryInfo."""

    class Counters(ctypes.Structure):
        _fields_ = (
            ("length", ctypes.c_ulong),
            ("faults", ctypes.c_ulong),
            *((f"size_{index}", ctypes.c_size_t) for index in range(8)),
        )

    counters = Counters(length=ctypes.sizeof(Counters))
    kernel = ctypes.CDLL("kernel32")
    kernel.GetCurrentProcess.restype = ctypes.c_void_p
    process = ctypes.c_void_p(kernel.GetCurrentProcess())
    kernel.K32GetProcessMemoryInfo(process, ctypes.byref(counters), counters.length)
    return int(counters.size_0)
