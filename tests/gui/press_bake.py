# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside a Blender with a window: press the Bake button with the real pointer, undo, press again and cancel.

`launch` starts Blender on a virtual screen of its own and runs this as ``--python press_bake.py -- FOLDER``. FOLDER
gets the screenshots and result.json, which tells what was checked and whether all of it held.
"""

import json
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Generator
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
PATIENCE = 120.0  # seconds that anything may take
LOG: list[str] = []

Steps = Generator[float, None, None]
"""A part of the play: yields the seconds that Blender gets to itself before it goes on."""


def check(holds: bool, what: str) -> None:
    """Note what was found; end the play if it does not hold."""
    LOG.append(f"{'ok' if holds else 'FAILED'}: {what}")
    print(LOG[-1], flush=True)
    if not holds:
        raise AssertionError(what)


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def viewport() -> bpy.types.Area:
    return max((area for area in window().screen.areas if area.type == 'VIEW_3D'), key=lambda area: area.width)


def region(kind: str) -> bpy.types.Region:
    return next(region for region in viewport().regions if region.type == kind)


def pointer(*words: str) -> None:
    subprocess.run(["xdotool", *words], check=True)


def move(x: float, y: float) -> None:
    """Move the pointer; x and y as Blender counts, from the window's lower left corner [pixels]."""
    pointer("mousemove", str(int(x)), str(int(window().height - 1 - y)))


def key(name: str) -> Steps:
    """Press a key over the viewport."""
    view = region('WINDOW')
    move(view.x + view.width * 0.4, view.y + view.height * 0.4)
    yield 0.2
    pointer("key", name)
    yield 0.2


def wait(until: Callable[[], bool], what: str) -> Steps:
    """Wait for something to become true."""
    end = time.monotonic() + PATIENCE
    while not until():
        if time.monotonic() > end:
            check(False, what)
        yield 0.05
    check(True, what)


def open_tab() -> Steps:
    """Open the sidebar at the Radiosity tab; it has tabs only after it has been drawn once."""
    space = viewport().spaces.active
    space.show_region_ui = True
    space.region_3d.view_perspective = 'CAMERA'
    end = time.monotonic() + PATIENCE
    while region('UI').active_panel_category != "Radiosity":
        yield 0.1
        if region('UI').active_panel_category != 'UNSUPPORTED':
            region('UI').active_panel_category = "Radiosity"
        if time.monotonic() > end:
            break
    check(region('UI').active_panel_category == "Radiosity", "the sidebar shows the Radiosity tab")
    region('UI').tag_redraw()
    yield 0.5


def hovered() -> str:
    """Return what Blender would copy as the Python command of the button under the pointer."""
    manager = bpy.context.window_manager
    manager.clipboard = ""
    with bpy.context.temp_override(window=window(), area=viewport(), region=region('UI')):
        if bpy.ops.ui.copy_python_command_button.poll():
            bpy.ops.ui.copy_python_command_button()
    return manager.clipboard


def press(operator: str) -> Steps:
    """Look for the operator's button down the sidebar, and click it."""
    side = region('UI')
    x, y = side.x + side.width * 0.45, side.y + side.height - 4.0
    while not hovered().startswith(f"bpy.ops.{operator}("):
        y -= 6.0
        if y < side.y:
            check(False, f"the sidebar has a button for {operator}")
        move(x, y)
        yield 0.08
    move(x, y - 4.0)  # away from its upper edge
    yield 0.3
    pointer("mousedown", "1")
    yield 0.1
    pointer("mouseup", "1")
    yield 0.0


def screenshot(name: str) -> Steps:
    """Keep what is on the screen, not what Blender believes to have drawn."""
    viewport().tag_redraw()
    yield 1.0
    subprocess.run(["import", "-window", "root", str(FOLDER / name)], check=True)


def shown(name: str) -> dict[str, float]:
    """Return how much of the viewport on a screenshot is clearly red and how much clearly green."""
    image = bpy.data.images.load(str(FOLDER / name))
    width, height = image.size
    pixels = np.zeros(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    view, side = region('WINDOW'), region('UI')
    picture = pixels.reshape(height, width, 4)[view.y : view.y + view.height, view.x : side.x, :3]
    red, green, blue = np.moveaxis(picture, -1, 0)
    return {
        "red": float(((red > 2 * green) & (red > 2 * blue) & (red > 0.1)).mean()),
        "green": float(((green > 2 * red) & (green > 2 * blue) & (green > 0.1)).mean()),
    }


def running() -> bool:
    return bool(bpy.context.window_manager.radiosity.running)


def lit() -> list[bool]:
    """Tell for every mesh of the scene whether it has the baked colors."""
    return ["Radiosity" in obj.data.color_attributes for obj in bpy.context.scene.objects if obj.type == 'MESH']


def play() -> Steps:
    """Press, look, undo, press again, cancel."""
    yield from open_tab()
    check(bool(lit()) and not any(lit()), "no mesh has the colors before")
    yield from press("radiosity.bake")
    yield from wait(lambda: running() or all(lit()), "a click starts the bake")
    yield from wait(lambda: not running(), "the bake ends")
    check(all(lit()), "every mesh has the colors")
    check(viewport().spaces.active.shading.color_type == 'VERTEX', "the viewport shows vertex colors")
    colors = bpy.context.scene.objects[0].data.color_attributes
    check(colors.active_color.name == "Radiosity", "the colors are active")
    yield from screenshot("baked.png")
    colored = shown("baked.png")
    check(min(colored.values()) > 0.02, f"the red and the green wall are seen ({colored})")

    yield from key("ctrl+z")
    yield from wait(lambda: not any(lit()), "one undo takes all of them back")

    bpy.context.scene.radiosity.quality = 'production'  # long enough to be cancelled
    yield from press("radiosity.bake")
    yield from wait(running, "a second click starts another bake")
    yield from screenshot("running.png")
    check(running(), "it is still running")
    yield from key("Escape")
    yield from wait(lambda: not running(), "Esc cancels it")
    check(not any(lit()), "a cancelled bake leaves nothing behind")


def main() -> None:
    """Play in steps of Blender's own event loop, and leave the result."""
    bpy.context.preferences.view.show_splash = False
    steps = play()

    def turn() -> float | None:
        try:
            return max(next(steps), 0.01)
        except StopIteration:
            problem = ""
        except Exception:
            problem = traceback.format_exc()
            print(problem, flush=True)
        result = {"passed": not problem, "checks": LOG, "problem": problem}
        (FOLDER / "result.json").write_text(json.dumps(result, indent=1))
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(turn, first_interval=2.0, persistent=True)


main()
