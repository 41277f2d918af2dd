"""Files on the command line: domains in the action language and what goes on from them, SPARC."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ros_scenesense.errors import ParameterError
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.knowledge.building import Domain
from ros_scenesense.knowledge.description import History
from ros_scenesense.knowledge.sparc.language import Program
from ros_scenesense.knowledge.sparc.language import load as load_program
from ros_scenesense.knowledge.translation import Options
from ros_scenesense.parameters import Parameter

STEPS = Parameter("--steps", int, 0, "last step", minimum=0, maximum=10_000)


def add_translation_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what a translation depends on."""
    parser.add_argument(
        "--without", metavar="IDS", default="", help="axioms to leave out, separated by commas"
    )
    parser.add_argument(
        "--steps", metavar="INT", help="last step (default: the last step of the history)"
    )
    parser.add_argument(
        "--complete",
        action="store_true",
        help="inertial fluents that are not known in the initial state are true or false, in all "
        "ways; otherwise they stay unknown",
    )
    parser.add_argument(
        "--show-all",
        action="store_true",
        help="answers also show inertial and defined fluents that are false",
    )


def translation_options(arguments: argparse.Namespace) -> Options:
    """What the arguments ask for.

    Raises:
        ParameterError: If a value is wrong.
    """
    steps = arguments.steps
    return Options(
        steps=None if steps is None else int(STEPS.check(steps)),
        complete=arguments.complete,
        show_all=arguments.show_all,
    )


def load_domain(paths: Sequence[Path], without: str = "") -> Domain:
    """Reads files, each going on from those before it; their histories are one history.

    Args:
        paths: At least one; the first declares the sorts that the others use.
        without: Ids of axioms to leave out, separated by commas.

    Raises:
        LanguageError: If a file is wrong, with all its problems.
        ParameterError: If there is no axiom of such an id.
    """
    domain = load(paths[0])
    history = domain.history
    for path in paths[1:]:
        domain = load(path, domain.description)
        more = domain.history
        history = History(
            history.observations + more.observations,
            history.happened + more.happened,
            history.initial + more.initial,
        )
    ids = [name for name in without.replace(" ", "").split(",") if name]
    unknown = [name for name in ids if name not in domain.description.ids]
    if unknown:
        raise ParameterError(
            f"--without: {paths[0]} has no axiom {', '.join(unknown)}; it has "
            f"{', '.join(domain.description.ids)}"
        )
    return replace(domain, description=domain.description.without(ids), history=history)


def load_sparc(paths: Sequence[Path], constants: Sequence[str] = ()) -> Program:
    """Reads a SPARC program.

    Args:
        paths: One file.
        constants: Values of constants, each as `name=number`.

    Raises:
        LanguageError: If the program is wrong, with all its problems.
        ParameterError: If there are several files, or a constant is none.
    """
    if len(paths) != 1:
        raise ParameterError(f"found {len(paths)} files, expected one: a SPARC program is one file")
    values = {}
    for text in constants:
        if not re.fullmatch(r"[a-z]\w*=[0-9]{1,10}", text, re.ASCII):
            raise ParameterError(f"--const: found {text!r}, expected NAME=NUMBER, as in n=5")
        name, _, number = text.partition("=")
        values[name] = int(number)
    return load_program(paths[0], values)
