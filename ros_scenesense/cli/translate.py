"""Turn a domain and a history, or a SPARC program (.sp), into a program that clingo runs alone."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ros_scenesense.cli.domain_files import (
    add_translation_arguments,
    load_domain,
    load_sparc,
    translation_options,
)
from ros_scenesense.errors import SceneSenseError
from ros_scenesense.knowledge.sparc.translation import translated
from ros_scenesense.knowledge.translation import translate

_EPILOG = """\
The program is printed, or written with --output. `clingo FILE 0 --opt-mode=optN` computes its
answer sets; of a domain with `-c restore=0` without CR rules. docs/action_language.md and
docs/sparc.md describe the languages.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense translate`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="a domain, and files that go on from it"
    )
    add_translation_arguments(parser)
    parser.add_argument("--output", type=Path, metavar="FILE", help="where to write the program")


def run(arguments: argparse.Namespace) -> int:
    """Translates.

    Returns:
        0, or 2 if something is wrong.
    """
    try:
        if {path.suffix for path in arguments.files} == {".sp"}:
            program = translated(load_sparc(arguments.files)).text
        else:
            domain = load_domain(arguments.files, arguments.without)
            program = translate(domain.description, domain.history, translation_options(arguments))
        if arguments.output is None:
            sys.stdout.write(program)
        else:
            arguments.output.write_text(program, encoding="utf-8")
    except (SceneSenseError, OSError) as error:
        print(f"scenesense translate: {error}", file=sys.stderr)
        return 2
    return 0
