# SPDX-License-Identifier: GPL-3.0-or-later
"""Start a real Blender on a virtual screen and play `press_bake`: ``python tests/gui/launch.py FOLDER [BLEND]``.

Takes the Blender on PATH, or the one that the environment variable BLENDER names, with fresh settings. FOLDER gets the
screenshots, result.json and blender.log.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
SIZE = (1600, 900)


def missing() -> str:
    """Tell which programs this machine lacks; empty when it has all."""
    programs = {"Blender": blender(), "ImageMagick's import": shutil.which("import")}
    programs |= {name: shutil.which(name) for name in ("Xvfb", "xdotool")}
    return ", ".join(name for name, path in programs.items() if not path)


def blender() -> str | None:
    """Return the path of Blender."""
    return shutil.which(os.environ.get("BLENDER", "blender"))


@contextmanager
def screen() -> Iterator[str]:
    """Run a virtual X screen; give its name."""
    reading, writing = os.pipe()
    size = f"{SIZE[0]}x{SIZE[1]}x24"
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", size, "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL)
    os.close(writing)
    try:
        with os.fdopen(reading) as pipe:
            yield f":{pipe.readline().strip()}"
    finally:
        server.terminate()
        server.wait()


def run(folder: Path, blend: Path, timeout: float = 400.0) -> dict[str, Any]:
    """Build and install the extension, play the scenario in a window, and return its result."""
    folder.mkdir(parents=True, exist_ok=True)
    result = folder / "result.json"
    result.unlink(missing_ok=True)
    program = blender()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as settings, screen() as display:
        # Software drawing: the same on every machine, and there on those without a graphics card.
        env = os.environ | {"BLENDER_USER_RESOURCES": settings, "DISPLAY": display, "LIBGL_ALWAYS_SOFTWARE": "1"}
        env.pop("WAYLAND_DISPLAY", None)
        archive = Path(settings) / "radiosity.zip"
        for arguments in (
            ["build", "--source-dir", str(ROOT), "--output-filepath", str(archive)],
            ["install-file", "-r", "user_default", "-e", str(archive)],
        ):
            subprocess.run([program, "--command", "extension", *arguments], env=env, check=True, timeout=timeout)
        play = Path(__file__).with_name("press_bake.py")
        place = ["-p", "0", "0", str(SIZE[0]), str(SIZE[1])]
        command = [program, *place, str(blend), "--python", str(play), "--", str(folder)]
        with (folder / "blender.log").open("w") as log:
            subprocess.run(command, env=env, stdout=log, stderr=subprocess.STDOUT, timeout=timeout, check=False)
    if not result.is_file():
        tail = (folder / "blender.log").read_text(errors="replace").splitlines()[-30:]
        return {"passed": False, "checks": [], "problem": "\n".join(["Blender ended without a result", *tail])}
    return json.loads(result.read_text())


if __name__ == "__main__":
    if lacking := missing():
        sys.exit(f"This machine has no {lacking}")
    where = Path(sys.argv[1]).resolve()
    outcome = run(where, Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "example_blends" / "cornell_box.blend"))
    print("\n".join(outcome["checks"]), outcome["problem"], sep="\n")
    sys.exit(0 if outcome["passed"] else 1)
