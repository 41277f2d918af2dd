"""Declared parameters as options of a command: name, type, meaning and range are said once."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

from ros_scenesense.parameters import Parameter


def add_declared(parser: argparse.ArgumentParser, parameters: Iterable[Parameter]) -> None:
    """Adds an option for each parameter; what is not given is None, and nothing is checked yet."""
    for declared in parameters:
        parser.add_argument(
            f"--{declared.name.replace('_', '-')}",
            dest=declared.name,
            metavar=declared.type.__name__.upper(),
            help=f"{declared.description} ({declared.allowed}; default {declared.default})",
        )


def given(arguments: argparse.Namespace, parameters: Iterable[Parameter]) -> dict[str, object]:
    """The values that were given for these parameters, by name, as the command line has them."""
    values = {declared.name: getattr(arguments, declared.name) for declared in parameters}
    return {name: value for name, value in values.items() if value is not None}
