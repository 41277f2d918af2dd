"""Compute the answer sets of a domain with its history, of a SPARC program or a logic program."""

from __future__ import annotations

import argparse
import json
import re
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ros_scenesense.cli.declared import add_declared, value_of
from ros_scenesense.cli.domain_files import (
    add_translation_arguments,
    load_domain,
    load_sparc,
    translation_options,
)
from ros_scenesense.errors import ParameterError, ReasoningError, SceneSenseError
from ros_scenesense.knowledge.sparc.idle import idle_rules
from ros_scenesense.knowledge.sparc.translation import translated
from ros_scenesense.knowledge.translation import translate
from ros_scenesense.parameters import Parameter
from ros_scenesense.reasoning.answer_sets import AnswerSetEngine, AnswerSets, Outcome, Question
from ros_scenesense.stages.one_job import run_once
from ros_scenesense.stages.protocol import JobFailure
from ros_scenesense.stages.worker import GIB

_EPILOG = """\
Files in the action language (.al): a domain, and files that go on from it; CR rules come in only
where there is no answer set without them. A SPARC program (.sp) is one file, with CR rules alike.
Files in clingo's language (.lp) are solved as they are.
Exit code: 0 there is an answer set, 1 there is none, 2 something is wrong, 3 time ran out.
"""
SATISFIABLE, UNSATISFIABLE, WRONG, TIMED_OUT = 0, 1, 2, 3
_MODELS = Parameter("--models", int, 1, "answer sets to find, 0 for all", minimum=0)
_SECONDS = Parameter(
    "--time-limit", float, 60.0, "seconds for all of it", minimum=0.01, maximum=86_400.0
)
_MEMORY = Parameter("--memory-limit", float, 4.0, "GiB of memory", minimum=0.1, maximum=1024.0)
# The search ends in time; a process that is still busy so much later is grounding.
_GRACE_S = 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense solve`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE", help=".al, .sp or .lp files")
    add_declared(parser, (_MODELS,))
    add_limits(parser)
    parser.add_argument(
        "--optimize",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="where a program optimises, only its optimal answer sets are answers",
    )
    parser.add_argument(
        "--const",
        "-c",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="value of a constant of the program; can be given several times",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--lines", action="store_true", help="print each answer set on one line, and nothing else"
    )
    parser.add_argument(
        "--warn", action="store_true", help="tell which rules of a SPARC program can never apply"
    )
    add_translation_arguments(parser)


def add_limits(parser: argparse.ArgumentParser) -> None:
    """Declares how long the solver may take, and how much memory."""
    add_declared(parser, (_SECONDS, _MEMORY))


def time_limit(arguments: argparse.Namespace) -> float:
    """The seconds that the solver may take.

    Raises:
        ParameterError: If the value is wrong.
    """
    return float(value_of(arguments, _SECONDS))


def run(arguments: argparse.Namespace) -> int:
    """Solves, and prints the answer."""
    try:
        return _run(arguments)
    except SceneSenseError as error:
        print(f"scenesense solve: {error}", file=sys.stderr)
        return WRONG


def _run(arguments: argparse.Namespace) -> int:
    asked = _asked(arguments)
    answers = answered(AnswerSetEngine, "solve", asked.question, memory_gib(arguments), "solve")
    if not isinstance(answers, AnswerSets):
        return int(answers)
    answers = replace(answers, sets=tuple((*each, *asked.shown) for each in answers.sets))
    for message in () if asked.kind == ".sp" else answers.messages:
        print(message, file=sys.stderr)
    if arguments.json:
        print(json.dumps(_object(answers), indent=2))
    elif arguments.lines:
        for literals in answers.sets:
            print(f"{{{', '.join(literals)}}}")
    else:
        for line in _lines(answers, stepwise=asked.kind == ".al"):
            print(line)
    if answers.outcome is Outcome.TIMED_OUT:
        return TIMED_OUT
    return SATISFIABLE if answers.outcome is Outcome.SATISFIABLE else UNSATISFIABLE


def answered(
    engine: Callable[[], Any], method: str, question: Question, memory_gib: float, command: str
) -> Any:
    """What a method of an engine answers in a process of its own; an exit code if it fails."""
    answers = run_once(
        engine,
        method,
        (question,),
        question.time_limit_s + _GRACE_S,
        memory_bytes=int(memory_gib * GIB),
    )
    if isinstance(answers, JobFailure):
        return _failed(answers, question, memory_gib, command)
    return answers


@dataclass(frozen=True)
class _Asked:
    """The question, the kind of its files, and what each answer shows without being asked."""

    question: Question
    kind: str
    shown: tuple[str, ...] = ()


def _asked(arguments: argparse.Namespace) -> _Asked:
    kinds = {path.suffix for path in arguments.files}
    if kinds not in ({".al"}, {".sp"}, {".lp"}):
        raise ParameterError(
            f"found files of kind {', '.join(sorted(kinds)) or 'none'}; expected domains (.al), a "
            "SPARC program (.sp) or logic programs (.lp)"
        )
    options = translation_options(arguments)
    common: dict[str, Any] = {
        "models": value_of(arguments, _MODELS),
        "optimize": arguments.optimize,
        "time_limit_s": time_limit(arguments),
    }
    if kinds == {".sp"}:
        program = load_sparc(arguments.files, arguments.const)
        if arguments.warn:
            for warning in idle_rules(program):
                print(f"warning: {warning}", file=sys.stderr)
        common["optimize"] &= program.optimizes
        translation = translated(program, optimize=arguments.optimize)
        question = Question(text=translation.text, applied=translation.applied, **common)
        return _Asked(question, ".sp", translation.shown)
    common["constants"] = tuple(map(_constant, arguments.const))
    if kinds == {".al"}:
        domain = load_domain(arguments.files, arguments.without)
        text = translate(domain.description, domain.history, options)
        return _Asked(Question(text=text, restoring=True, **common), ".al")
    return _Asked(Question(files=tuple(map(_program, arguments.files)), **common), ".lp")


def _program(path: Path) -> str:
    """A readable program; what clingo says of others helps nobody."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ReasoningError(f"{path} cannot be read: {error.strerror or error}") from error
    if b"\0" in content:
        line = content.count(b"\n", 0, content.index(b"\0")) + 1
        raise ReasoningError(f"{path}:{line}: found a zero byte, expected the text of a program")
    return str(path)


def _constant(text: str) -> str:
    if not re.fullmatch(r"_*[a-z]\w*=(-?[0-9]{1,10}|_*[a-z]\w*)", text, re.ASCII):
        raise ParameterError(f"--const: found {text!r}, expected NAME=VALUE, as in n=5")
    return text


def memory_gib(arguments: argparse.Namespace) -> float:
    """The memory that the solver may take.

    Raises:
        ParameterError: If the value is wrong.
    """
    return float(value_of(arguments, _MEMORY))


def _failed(failure: JobFailure, question: Question, memory_gib: float, command: str) -> int:
    if failure.timed_out:
        print(
            f"scenesense {command}: stopped after {question.time_limit_s:g} s while the program "
            "was grounded: it has too many instances; make sorts smaller, or take a longer "
            "--time-limit",
            file=sys.stderr,
        )
        return TIMED_OUT
    reason = failure.reason
    if "process died" in reason or "bad_alloc" in reason or "MemoryError" in reason:
        reason = (
            f"the solver died: most likely the program needs more than {memory_gib:g} GiB of "
            "memory; make sorts smaller, or take a larger --memory-limit"
        )
    print(f"scenesense {command}: {reason}", file=sys.stderr)
    return WRONG


def _object(answers: AnswerSets) -> dict[str, Any]:
    return {
        "outcome": answers.outcome.value,
        "answer_sets": [list(each) for each in answers.sets],
        "costs": list(answers.costs),
        "complete": answers.complete,
        "cr_rules": answers.restored,
    }


def _lines(answers: AnswerSets, stepwise: bool) -> Iterator[str]:
    if answers.outcome is Outcome.UNSATISFIABLE:
        yield "There is no answer set."
    for number, literals in enumerate(answers.sets, start=1):
        yield f"answer set {number}" + (", with CR rules" if answers.restored else "")
        yield from _steps(literals) if stepwise else _wrapped("  ", f"{{{', '.join(literals)}}}")
    if answers.outcome is Outcome.TIMED_OUT:
        yield "Time ran out before all answer sets were found."
    elif answers.sets:
        yield "There are no more." if answers.complete else "There may be more: see --models."
    if answers.costs and not stepwise:
        yield f"cost: {', '.join(map(str, answers.costs))}"


@dataclass(frozen=True)
class _Timed:
    """`predicate(content, step)` of a translated domain."""

    predicate: str
    content: str
    step: int


_FIXED_SPACE = "\N{NO-BREAK SPACE}"
_TIMED = re.compile(r"(-?holds|occurs|applied)\((.*),([0-9]+)\)")


def _steps(literals: Sequence[str]) -> Iterator[str]:
    """The literals of a translated domain, step by step."""
    matches = [match for each in literals if (match := _TIMED.fullmatch(each))]
    timed = [_Timed(match[1], match[2], int(match[3])) for match in matches]
    for step in sorted({each.step for each in timed}):
        for predicate, title in (("holds", ""), ("applied", "CR rule "), ("occurs", "does ")):
            contents = [
                f"-{each.content}" if each.predicate[0] == "-" else each.content
                for each in timed
                if each.step == step and each.predicate.removeprefix("-") == predicate
            ]
            if contents or predicate == "holds":
                head = f"  {step:>3}  " if predicate == "holds" else " " * 7
                yield from _wrapped(head, title + ", ".join(contents))


def _wrapped(head: str, text: str) -> list[str]:
    """Lines that are broken between literals, not within one."""
    depth, quoted, spaced = 0, False, ""
    for character in text:
        quoted ^= character == '"'
        if not quoted:
            depth += (character == "(") - (character == ")")
        inside = quoted or depth > 0
        spaced += _FIXED_SPACE if inside and character == " " else character
        if character == "," and depth > 0 and not quoted:
            spaced += _FIXED_SPACE  # clingo writes none
    lines = textwrap.wrap(
        spaced,
        100,
        initial_indent=head,
        subsequent_indent=" " * len(head),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(_FIXED_SPACE, " ") for line in lines] or [head.rstrip()]
