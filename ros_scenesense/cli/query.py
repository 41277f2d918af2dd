"""Ask a SPARC program: yes, no or unknown; for variables, the values for which it is yes."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from ros_scenesense.cli.domain_files import load_sparc
from ros_scenesense.cli.solve import (
    SATISFIABLE,
    TIMED_OUT,
    UNSATISFIABLE,
    WRONG,
    add_limits,
    answered,
    memory_gib,
    time_limit,
)
from ros_scenesense.errors import SceneSenseError
from ros_scenesense.knowledge.sparc.language import Program
from ros_scenesense.knowledge.sparc.queries import Query, bindings, parse_query, truth
from ros_scenesense.knowledge.sparc.sorts import Value
from ros_scenesense.knowledge.sparc.translation import translated
from ros_scenesense.reasoning.answer_sets import AnswerSetEngine, AnswerSets, Outcome, Question

_EPILOG = """\
A literal is answered with yes if it is in every answer set of the program, with no if its negation
is, else with unknown. Without a query they are read line by line, until "exit".
Exit code: 0 answered, 1 the program has no answer set, 2 something is wrong, 3 time ran out.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense query`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument("file", type=Path, metavar="FILE", help="a SPARC program (.sp)")
    parser.add_argument("query", nargs="?", help="a literal, such as 'p(X)' or '-p(a)'")
    parser.add_argument(
        "--const",
        "-c",
        action="append",
        default=[],
        metavar="NAME=NUMBER",
        help="value of a constant of the program; can be given several times",
    )
    add_limits(parser)


def run(arguments: argparse.Namespace) -> int:
    """Answers one query, or what is typed."""
    try:
        program = load_sparc([arguments.file], arguments.const)
        asked = None if arguments.query is None else parse_query(arguments.query, program)
        name = () if asked is None else (asked.literal.atom.name,)
        translation = translated(program, show=name or tuple(program.signature.predicates))
        question = Question(
            text=translation.text,
            applied=translation.applied,
            optimize=program.optimizes,
            time_limit_s=time_limit(arguments),
        )
        answers = answered(
            AnswerSetEngine, "consequences", question, memory_gib(arguments), "query"
        )
    except SceneSenseError as error:
        print(f"scenesense query: {error}", file=sys.stderr)
        return WRONG
    if not isinstance(answers, AnswerSets):
        return int(answers)
    if answers.outcome is Outcome.TIMED_OUT:
        print("scenesense query: time ran out; take a longer --time-limit", file=sys.stderr)
        return TIMED_OUT
    if answers.outcome is Outcome.UNSATISFIABLE:
        print("scenesense query: the program has no answer set", file=sys.stderr)
        return UNSATISFIABLE
    common = [_value(text) for text in answers.sets[-1]]
    if asked is not None:
        _answer(asked, common)
    else:
        _converse(program, common)
    return SATISFIABLE


def _answer(query: Query, common: list[tuple[bool, Value]]) -> None:
    if query.is_ground:
        print(truth(query, common))
    else:
        lines = list(bindings(query, common))
        print("\n".join(lines) if lines else "no values")


def _converse(program: Program, common: list[tuple[bool, Value]]) -> None:
    for line in _typed():
        try:
            _answer(parse_query(line, program), common)
        except SceneSenseError as error:
            print(error)


def _typed() -> Iterator[str]:
    """What is typed, line by line; a prompt only where a person sees it."""
    while True:
        if sys.stdin.isatty():
            print("?- ", end="", flush=True)
        line = sys.stdin.readline()
        if not line or line.strip().removesuffix(".") == "exit":
            return
        if line.strip():
            yield line.strip()


_PIECES = re.compile(r"-?[A-Za-z0-9_]+|[(),]")


def _value(text: str) -> tuple[bool, Value]:
    """The sign of a literal and its atom as a value, from clingo's text of it."""
    pieces = _PIECES.findall(text.removeprefix("-"))
    stack: list[list[Value]] = [[]]
    for piece, following in zip(pieces, [*pieces[1:], ""], strict=True):
        if piece == "(":
            continue
        if piece == ")":
            stack[-2].append(tuple(stack.pop()))
        elif piece != ",":
            value: Value = int(piece) if re.fullmatch(r"-?[0-9]+", piece) else piece
            if following == "(":
                stack.append([value])
            else:
                stack[-1].append(value)
    return not text.startswith("-"), stack[0][0]
