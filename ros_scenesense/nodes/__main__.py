"""Runs one node: `python -m ros_scenesense.nodes grounding --ros-args ...`.

The launcher starts nodes this way. Unlike a node's own module, this one imports nothing heavy, so
a worker process that imports the main module again loses no time, and Ctrl-C is quiet while the
node is still importing.
"""

from __future__ import annotations

import importlib
import sys

from ros_scenesense.nodes.registry import NODES


def main() -> int:
    """Runs the node that the first argument names; returns its exit code."""
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if name not in NODES:
        print(f"node '{name}' is unknown, known are: {', '.join(NODES)}", file=sys.stderr)
        return 2
    del sys.argv[1]
    try:
        return int(importlib.import_module(NODES[name].module).main())
    except KeyboardInterrupt:
        return 0


if __name__ == "__main__":
    sys.exit(main())
