"""List the parameters of all nodes as a params file, with meaning, default and allowed values."""

from __future__ import annotations

import argparse
import textwrap

import yaml

from ros_scenesense.nodes.registry import NODES
from ros_scenesense.parameters import Parameter, parameters_of

_INTRODUCTION = """\
# Parameters of the SceneSense nodes with their defaults, written by `scenesense params`.
#
# Copy, change, and give it with `scenesense launch --params FILE`. All are read at start.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense params`."""
    parser.add_argument(
        "node", nargs="*", choices=[*NODES, []], metavar="NODE", help="only these nodes"
    )


def run(arguments: argparse.Namespace) -> int:
    """Prints the params file."""
    print(params_file(arguments.node or list(NODES)), end="")
    return 0


def params_file(nodes: list[str]) -> str:
    """A params YAML, keyed by node, that sets every parameter to its default."""
    return _INTRODUCTION + "".join(f"\n{_section(node)}" for node in nodes)


def _section(node: str) -> str:
    entry = NODES[node]
    # `/**/` finds the node in whatever namespace it runs.
    lines = [f"# {entry.purpose}", f"/**/{node}:", "  ros__parameters:"]
    for parameter in parameters_of(entry.configuration()):
        words = f"{parameter.description} ({parameter.allowed})"
        lines += [f"    # {line}" for line in textwrap.wrap(words, 92)]
        lines.append(f"    {parameter.name}: {_yaml(parameter)}")
    return "\n".join(lines) + "\n"


def _yaml(parameter: Parameter) -> str:
    text: str = yaml.safe_dump(parameter.default, default_flow_style=True)
    return text.removesuffix("...\n").strip()
