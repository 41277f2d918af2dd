"""Starts, watches and stops the nodes of the graph: `python -m ros_scenesense.launcher`."""

from __future__ import annotations

import sys

from ros_scenesense.launcher.graph import Graph
from ros_scenesense.launcher.options import GraphOptions

__all__ = ["Graph", "GraphOptions", "main"]


def main() -> int:
    """Runs `scenesense launch` with the arguments of this process; returns its exit code."""
    from ros_scenesense.cli.main import main as command

    return command(["launch", *sys.argv[1:]])
