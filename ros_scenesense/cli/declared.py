"""Declared parameters as options of a command: name, type, meaning and range are said once.

A parameter may be called as the option is, `--max-steps`, or as a field, `max_steps`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any

from ros_scenesense.parameters import Parameter


def add_declared(parser: argparse.ArgumentParser, parameters: Iterable[Parameter]) -> None:
    """Adds an option for each parameter; what is not given is None, and nothing is checked yet."""
    for declared in parameters:
        field = _field(declared)
        parser.add_argument(
            f"--{field.replace('_', '-')}",
            dest=field,
            metavar=declared.type.__name__.upper(),
            help=f"{declared.description} ({declared.allowed}; default {declared.default})",
        )


def given(arguments: argparse.Namespace, parameters: Iterable[Parameter]) -> dict[str, object]:
    """The values that were given for these parameters, by name, as the command line has them."""
    values = {declared.name: getattr(arguments, declared.name) for declared in parameters}
    return {name: value for name, value in values.items() if value is not None}


def value_of(arguments: argparse.Namespace, declared: Parameter) -> Any:
    """The value that was given for a parameter; its default if none was.

    Raises:
        ParameterError: If the value is wrong.
    """
    value = getattr(arguments, _field(declared))
    return declared.default if value is None else declared.check(value)


def _field(declared: Parameter) -> str:
    return declared.name.removeprefix("--").replace("-", "_")
