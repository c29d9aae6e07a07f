# SPDX-License-Identifier: GPL-3.0-or-later
"""The words that the command understands: one parser, whichever way it is called."""

import argparse
from dataclasses import fields
from math import isfinite
from pathlib import Path
from typing import Any, NoReturn

from ..core.errors import RadiosityError
from ..core.settings import FORM_FACTORS, LIGHTS, METHODS, QUALITIES, SIDES, Settings
from .destination import DATA_TYPES, DOMAINS, TARGETS, Destination
from .display_scene import AUTO, OF_SCENE

WRONG_USAGE = 2
ENDINGS = {"output": ".blend", "gltf": ".glb", "render": ".png", "report": ".json"}


class _Parser(argparse.ArgumentParser):
    """A parser that complains in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(WRONG_USAGE, f"radiosity: error: {' '.join(message.split())} (--help lists the options)\n")


def parse(argv: list[str], prog: str, verb: str | None) -> tuple[argparse.Namespace, Settings, Destination]:
    """Read the arguments.

    Parameters
    ----------
    argv : list of str
        The arguments.
    prog : str
        How the command was called, for its help.
    verb : str or None
        Word that has to come first.

    Returns
    -------
    options : argparse.Namespace
        Paths and exposure.
    settings : Settings
        How to compute the light.
    destination : Destination
        Where the colors go.

    Raises
    ------
    SystemExit
        With code 2 after one line on stderr about what is wrong, or with 0 after the help.
    """
    top = parser = _Parser(prog=prog, description=_DESCRIPTION, allow_abbrev=False)
    if verb is not None:
        parser = top.add_subparsers(metavar=verb, required=True).add_parser(
            verb, help=_DESCRIPTION, description=_DESCRIPTION, allow_abbrev=False
        )
    _add_files(parser)
    _add_settings(parser)
    _add_destination(parser)
    options = top.parse_args(argv)
    for name, ending in ENDINGS.items():
        path = getattr(options, name)
        if path is not None and path.suffix.lower() != ending:
            parser.error(f"--{name} writes a {ending} file, and the name given is {path}")
    try:
        return options, Settings(**_given(options, Settings)), Destination(**_given(options, Destination))
    except RadiosityError as error:
        parser.error(str(error))


def _given(options: argparse.Namespace, record: type) -> dict[str, Any]:
    """Return the fields of a record that were given; the others stay as the record has them."""
    values = {field.name: getattr(options, field.name, None) for field in fields(record)}
    return {name: value for name, value in values.items() if value is not None}


_DESCRIPTION = "Bake the light of a scene into vertex colors."


def _add_files(parser: argparse.ArgumentParser) -> None:
    """Add what is read and written."""
    parser.add_argument(
        "input", type=Path, nargs="?", metavar="INPUT", help=".blend or thesis scene (.txt); default: the loaded .blend"
    )
    parser.add_argument("--output", type=Path, metavar="F.blend", help="save the baked scene here")
    parser.add_argument("--gltf", type=Path, metavar="F.glb", help="export the baked meshes, unlit")
    parser.add_argument("--render", type=Path, metavar="F.png", help="draw the baked scene")
    parser.add_argument("--report", type=Path, metavar="F.json", help="write the figures of the bake")
    parser.add_argument(
        "--exposure",
        type=_stops,
        metavar="STOPS|auto|scene",
        help="brightness of glTF and picture: stops, what suits the light, or the scene's own exposure (the scene's, "
        "or auto where that is 0)",
    )


def _add_settings(parser: argparse.ArgumentParser) -> None:
    """Add how the light is computed; what is not given stays as `Settings` has it."""
    chosen = Settings()
    parser.add_argument("--method", choices=METHODS, help=f"how light is exchanged ({chosen.method})")
    parser.add_argument("--form-factors", choices=FORM_FACTORS, help=f"dense methods' kernel ({chosen.form_factors})")
    parser.add_argument("--quality", choices=QUALITIES, help=f"effort of the hierarchical method ({chosen.quality})")
    parser.add_argument("--sides", choices=SIDES, help=f"which sides of faces have light ({chosen.sides})")
    parser.add_argument("--light", choices=LIGHTS, help=f"what the colors tell ({chosen.light})")
    parser.add_argument("--max-edge", type=float, metavar="METRES", help="longest edge of a patch (the mesh's own)")
    parser.add_argument("--subdivide", type=int, metavar="N", help=f"factor on patches a side ({chosen.subdivide})")
    parser.add_argument("--iterations", type=int, metavar="N", help=f"sweeps at most ({chosen.iterations})")
    parser.add_argument(
        "--tolerance", type=float, metavar="X", help=f"relative change at which it is done ({chosen.tolerance:g})"
    )


def _add_destination(parser: argparse.ArgumentParser) -> None:
    """Add where the colors go and how they are stored."""
    chosen = Destination()
    parser.add_argument("--attribute", default=chosen.attribute, metavar="NAME", help="color attribute (%(default)s)")
    parser.add_argument(
        "--target",
        type=_target,
        metavar="in-place|copy",
        help="which meshes get the colors: the scene's own, or copies that are as fine as the patches (in-place)",
    )
    parser.add_argument(
        "--hide-originals", action="store_true", default=None, help="hide what has a copy, in the scene that is saved"
    )
    parser.add_argument(
        "--keep-faces",
        action="store_false",
        default=None,
        dest="cut_large",
        help="copies have the faces of their originals where no patch size is given, also those that are too large to "
        "show their light",
    )
    parser.add_argument(
        "--domain",
        type=str.upper,
        choices=DOMAINS,
        help=f"whether each face corner or each vertex carries a color ({chosen.domain})",
    )
    parser.add_argument(
        "--data-type",
        type=_data_type,
        metavar="float|byte",
        help="how a color is stored: float keeps every brightness, byte ends at 1 (float)",
    )


def _data_type(text: str) -> str:
    """Return Blender's word for a kind of number."""
    known = f"{text.upper()}_COLOR"
    if known not in DATA_TYPES:
        raise argparse.ArgumentTypeError(f"{text} is no data type: give float or byte")
    return known


def _target(text: str) -> str:
    """Return Blender's word for where colors go."""
    known = text.upper().replace("-", "_")
    if known not in TARGETS:
        raise argparse.ArgumentTypeError(f"{text} is no target: give in-place or copy")
    return known


def _stops(text: str) -> float | str:
    """Read an exposure: a number of stops, or one of two words."""
    if text in (AUTO, OF_SCENE):
        return text
    stops = float(text)
    if not (isfinite(stops) and abs(stops) <= 64.0):
        raise argparse.ArgumentTypeError(f"{text} is no exposure: give stops, such as 1.5, or auto, or scene")
    return stops
