# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as Blender sees it: registered, in its menus, and gone without a trace."""

import re
from pathlib import Path

import pytest

from tests.blender.building import add_square, glowing

ROOT = Path(__file__).resolve().parents[2]
OPERATORS = ("radiosity.bake", "radiosity.copy_warnings", "import_scene.radiosity", "export_scene.radiosity")


def operator(bpy, idname):
    group, name = idname.split(".")
    return getattr(getattr(bpy.ops, group), name)


def is_registered(bpy, idname):
    try:
        operator(bpy, idname).get_rna_type()
    except KeyError:
        return False
    return True


def test_everything_is_registered(extension, blender, scene):
    assert all(is_registered(blender, idname) for idname in OPERATORS)
    assert scene.radiosity.attribute == "Radiosity"
    assert not blender.context.window_manager.radiosity.running
    for panel in ("bake", "output", "advanced", "last_bake"):
        assert getattr(blender.types, f"RADIOSITY_PT_{panel}").bl_category == "Radiosity"


def test_unregistering_twice_and_registering_again_leaves_it_whole(extension, blender, scene):
    extension.unregister()
    extension.unregister()
    try:
        assert not any(is_registered(blender, idname) for idname in OPERATORS)
        assert not hasattr(scene, "radiosity")
        assert not hasattr(blender.context.window_manager, "radiosity")
        assert not hasattr(blender.types, "RADIOSITY_PT_bake")
    finally:
        extension.register()
    extension.unregister()
    extension.register()
    assert all(is_registered(blender, idname) for idname in OPERATORS)
    add_square(scene, material=glowing())
    assert blender.ops.radiosity.bake() == {'FINISHED'}


def test_no_policy_of_blender_is_violated(extension, blender):
    import addon_utils

    addon_utils.extensions_refresh()
    assert extension.__name__ not in addon_utils._extensions_warnings_get()


def test_panels_draw_before_during_and_after_a_bake(addon, blender, scene):
    drawn = []

    class Layout:
        """Stands in for Blender's layout, which exists only while a window is drawn."""

        def __getattr__(self, name):
            drawn.append(name)
            return lambda *args, **options: drawn.append((name, args, options)) or Layout()

        def __setattr__(self, name, value):
            drawn.append((name, value))

    def draw(panel):
        kind = getattr(addon("panels"), panel)
        if not hasattr(kind, "poll") or kind.poll(blender.context):
            kind.draw(type("Panel", (), {"layout": Layout()})(), blender.context)

    panels = [f"RADIOSITY_PT_{panel}" for panel in ("bake", "output", "advanced", "last_bake")]
    for panel in panels:
        draw(panel)
    assert any(entry[1][:1] == ("radiosity.bake",) for entry in drawn if entry[0] == "operator")

    status = blender.context.window_manager.radiosity
    status.running, status.stage, status.fraction = True, "Form factors", 0.25
    drawn.clear()
    draw("RADIOSITY_PT_bake")
    status.running = False
    assert any(entry[0] == "progress" and entry[2]["factor"] == 0.25 for entry in drawn)
    assert not any(entry[0] == "operator" for entry in drawn)

    add_square(scene, material=glowing())
    add_square(scene, name="Second", z=2.0)
    blender.ops.radiosity.bake()
    drawn.clear()
    draw("RADIOSITY_PT_last_bake")
    texts = [entry[2]["text"] for entry in drawn if entry[0] == "label"]
    assert texts[texts.index("Patches") + 1] == "2"
    assert "1 Warning" in texts

    for number in range(30):
        add_square(scene, name=f"Bad {number}", z=2.0).data.attributes.new("Radiosity", 'FLOAT', 'POINT')
    blender.ops.radiosity.bake()
    drawn.clear()
    draw("RADIOSITY_PT_last_bake")
    texts = [entry[2]["text"] for entry in drawn if entry[0] == "label"]
    # All are counted, and what is told of many is told once.
    assert "61 Warnings" in texts
    told = " ".join(texts)
    assert told.count("has an attribute") == 1
    assert "; likewise 29 more objects: 'Bad 1', 'Bad 2', 'Bad 3', …" in told
    assert any(entry[1][:1] == ("radiosity.copy_warnings",) for entry in drawn if entry[0] == "operator")
    assert len(status.warnings.splitlines()) == 61 and len(status.gathered.splitlines()) == 2


@pytest.mark.parametrize("path", sorted((ROOT / "radiosity_addon").glob("*.py")), ids=lambda path: path.name)
def test_the_package_name_is_never_written_out(path):
    # It differs from repository to repository.
    assert not re.search(r"bl_ext\.\w+\.\w+", path.read_text(encoding="utf-8"))


def descriptions(bpy):
    """Yield (where, text) for every tooltip of the extension."""
    for idname in OPERATORS:
        rna = operator(bpy, idname).get_rna_type()
        yield idname, rna.description
        own = set(rna.properties.keys()) - {"rna_type", "filepath", "check_existing"}
        yield from ((f"{idname}.{name}", rna.properties[name].description) for name in own if name != "filter_glob")
    settings = bpy.types.Scene.bl_rna.properties["radiosity"].fixed_type
    for prop in settings.properties:
        if prop.identifier not in {"rna_type", "name"}:
            yield prop.identifier, prop.description
            if prop.type == 'ENUM':
                yield from ((item.identifier, item.description) for item in prop.enum_items)


def test_tooltips_are_worded_as_blender_wants_them(extension, blender, scene):
    for where, text in descriptions(blender):
        assert text, where
        assert text[0].isupper() and not text.endswith(".") and "\n" not in text, where
