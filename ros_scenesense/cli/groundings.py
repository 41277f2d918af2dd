"""Draw what prepositions mean to the robot, as it learned from scenes and from people."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from ros_scenesense.cli.launch import add_state_argument
from ros_scenesense.scene import Distance, Position

_EPILOG = """\
Reads grounding.db in the state folder of `scenesense launch` (of a demo run: its folder `state`);
a running node is not disturbed.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense groundings`."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    show = actions.add_parser(
        "show", help="draw the learned histograms", description=__doc__, epilog=_EPILOG
    )
    add_state_argument(show)
    show.add_argument(
        "--out", type=Path, metavar="FILE", required=True, help="the picture, a PNG file"
    )


def run(arguments: argparse.Namespace) -> int:
    """Draws and lists what was learned."""
    from ros_scenesense.demo.groundings_picture import examples_of, write_groundings
    from ros_scenesense.stages.grounding_store import look_into

    contents = look_into(arguments.state.expanduser() / "grounding.db")
    model = contents.memory.model
    write_groundings(model, arguments.out)
    table = Table("preposition", box=box.SIMPLE_HEAD, show_edge=False)
    for source in ("by QSR", "by itself", "by people"):
        table.add_column(source, justify="right")
    for relation in (*Position, *Distance):
        table.add_row(str(relation), *(str(count) for count in examples_of(model, relation)))
    console = Console()
    console.print("Examples that the metric grounding learned from", highlight=False)
    console.print(table)
    console.print(
        f"{contents.updates} updates merged, {contents.told} statements of people, "
        f"{contents.scenes} scenes remembered; the axes of people are turned by "
        f"{math.degrees(contents.memory.yaw_rad):.0f} degrees to the left of the viewer's",
        highlight=False,
        soft_wrap=True,
    )
    console.print(f"written: {arguments.out}", highlight=False, soft_wrap=True)
    return 0
