"""Finds the objects of one real RGB-D frame, their relations, and what follows from them."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import msgspec

from ros_scenesense.cli.console import console_of
from ros_scenesense.errors import ParameterError, SceneSenseError

_EPILOG = """\
With --out it writes perceived.json, and annotated.png: every object under a veil of its own
colour, its outline green if it is stable, red if it is not, grey if that is not decided. The
intrinsics are a JSON or YAML file with fx, fy, cx and cy, or a camera info. See
docs/real_cameras.md.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense perceive`."""
    parser.epilog = _EPILOG
    parser.add_argument("--color", type=Path, metavar="PNG", required=True, help="colour image")
    parser.add_argument(
        "--depth",
        type=Path,
        metavar="PNG",
        required=True,
        help="16-bit depth image, aligned to the colour image; 0 = no reading",
    )
    parser.add_argument(
        "--intrinsics", type=Path, metavar="FILE", required=True, help="intrinsics of both images"
    )
    parser.add_argument(
        "--depth-scale",
        type=float,
        metavar="NUMBER",
        help="units of the depth image per metre, or below 1 metres per unit (default: as the "
        "intrinsics say, else 1000)",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for picture and JSON")
    parser.add_argument(
        "--json", action="store_true", help="print what was found as JSON instead of tables"
    )


def run(arguments: argparse.Namespace) -> int:
    """Perceives the frame, prints and writes what was found."""
    from ros_scenesense.perceive.frame_files import read_frame, units_per_metre_of
    from ros_scenesense.perceive.run import perceive
    from ros_scenesense.perceive.words import listing

    units = arguments.depth_scale
    try:
        units = None if units is None else units_per_metre_of(units)
    except ValueError as error:
        raise ParameterError(f"--depth-scale: {error}") from error
    frame = read_frame(arguments.color, arguments.depth, arguments.intrinsics, units)
    found = perceive(frame)
    content = msgspec.json.format(msgspec.json.encode(found.report), indent=2)
    if arguments.out is not None:
        from ros_scenesense.demo.annotation import write_picture
        from ros_scenesense.perceive.picture import draw

        picture = arguments.out / "annotated.png"
        write_picture(draw(frame, found.instances, found.report), picture)
        _write(arguments.out / "perceived.json", content + b"\n")
        print(f"written: {picture}, {arguments.out / 'perceived.json'}", file=sys.stderr)
    if arguments.json:
        print(content.decode())
    else:
        console = console_of(140)
        for part in listing(found.report):
            console.print(part)
    for problem in found.report.problems:
        print(f"scenesense perceive: {problem}", file=sys.stderr)
    return 0


def _write(path: Path, content: bytes) -> None:
    from ros_scenesense.results import write_atomically

    try:
        write_atomically(path, content)
    except OSError as error:
        raise SceneSenseError(f"'{path}' cannot be written: {error.strerror}") from error
