"""SPARC programs: reading and translating one, and solving beside clingo programs by hand; CPU."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import clingo

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.bench.timing import median_ms
from ros_scenesense.knowledge.sparc.language import load, parse
from ros_scenesense.knowledge.sparc.translation import translated
from ros_scenesense.reasoning.answer_sets import AnswerSetEngine, Question
from ros_scenesense.resources import resource
from ros_scenesense.results import Table

FIGURES = (
    Figure(
        "sparc_parse_ms_300",
        "a SPARC program of 300 lines read, checked and translated, median, ms CPU",
        at_most=50.0,
    ),
    Figure(
        "sparc_ratio",
        "all optimal answer sets of a SPARC program, from the file: CPU relative to the same "
        "program written for clingo by hand, the worse of two",
        at_most=1.3,
    ),
)

PAIRS = ("diagnosis", "planning")
"""Files in asp/benchmarks: each as SPARC program (.sp) and for clingo (.lp)."""

_TIME_LIMIT_S = 300.0


def measure(options: BenchOptions) -> Measured:
    """Measures all figures of the group."""
    text = program_of_lines(300)
    parse_ms = median_ms(lambda: translated(parse(text)), 3 if options.quick else 30)
    rows: list[list[str | int | float | None]] = []
    ratios = []
    for name in PAIRS:
        by_hand, sets = _timed(lambda name=name: _by_hand(_path(name, "lp")), options)  # type: ignore[misc]
        ours, found = _timed(lambda name=name: _ours(_path(name, "sp")), options)  # type: ignore[misc]
        if sets != found:
            raise AssertionError(f"{name}.sp and {name}.lp have other answer sets")
        ratios.append(ours / by_hand)
        rows.append([name, len(sets), round(by_hand, 3), round(ours, 3), round(ours / by_hand, 3)])
    columns = ["program", "answer sets", "by hand, s", "SPARC, s", "ratio"]
    return Measured(
        figures={"sparc_parse_ms_300": parse_ms, "sparc_ratio": max(ratios)},
        tables={"SPARC beside clingo": Table(columns=columns, rows=rows)},
    )


def program_of_lines(count: int) -> str:
    """A program of so many lines as people write them: a robot's rooms, floor by floor."""
    sections: dict[str, list[str]] = {"sorts": [], "predicates": [], "rules": []}
    made = ["#const n = 10."]
    floor = 0
    while len(made) + sum(map(len, sections.values())) + len(sections) < count:
        floor += 1
        for section, lines in _FLOOR.items():
            sections[section] += [line.replace("@", str(floor)) for line in lines]
    spare = len(made) + sum(map(len, sections.values())) + len(sections) - count
    if spare > 0:
        del sections["rules"][-spare:]
    for section, lines in sections.items():
        made += [section, *lines]
    return "\n".join(made) + "\n"


_FLOOR = {
    "sorts": [
        "#room@ = [room@_][1..6] + {hall@}.",
        "#box@ = {red@, green@, blue@}.",
        "#thing@ = #box@ + {robot@}.",
        "#step@ = 0..n.",
        "#fluent@ = loc@(#thing@, #room@) + held@(#box@).",
        "#action@ = go@(#room@) + grasp@(#box@) + put@(#box@).",
        "#way@ = way@(#room@(X), #room@(Y)) : X != Y.",
    ],
    "predicates": [
        "holds@(#fluent@, #step@).",
        "occurs@(#action@, #step@).",
        "open@(#way@).",
        "ab@(#way@).",
        "steps@(#nat).",
    ],
    "rules": [
        "holds@(loc@(robot@, L), I + 1) :- occurs@(go@(L), I).",
        "holds@(held@(B), I + 1) :- occurs@(grasp@(B), I).",
        "-holds@(held@(B), I + 1) :- occurs@(put@(B), I).",
        "holds@(loc@(B, L), I) :- holds@(loc@(robot@, L), I), holds@(held@(B), I).",
        "-holds@(loc@(T, L), I) :- holds@(loc@(T, M), I), L != M.",
        "holds@(F, I + 1) :- holds@(F, I), not -holds@(F, I + 1).",
        "-holds@(F, I + 1) :- -holds@(F, I), not holds@(F, I + 1).",
        "-occurs@(go@(L), I) :- holds@(loc@(robot@, M), I), not open@(way@(M, L)).",
        "-occurs@(grasp@(B), I) :- holds@(loc@(robot@, L), I), -holds@(loc@(B, L), I).",
        "-occurs@(put@(B), I) :- not holds@(held@(B), I).",
        "open@(way@(hall@, L)) :- not ab@(way@(hall@, L)), L != hall@.",
        "open@(way@(L, M)) :- open@(way@(M, L)).",
        "closed@ : ab@(way@(hall@, L)) :+ L != hall@.  % nobody knows why",
        "{occurs@(A, I) : #action@(A)} 1 :- I < n, #step@(I).",
        "steps@(N) :- N = #count{I : occurs@(A, I)}.",
        ":- occurs@(A, I), -occurs@(A, I).",
        ":- not holds@(loc@(red@, room@_6), n).",
        ":~ occurs@(A, I). [1:1]",
        "holds@(loc@(robot@, hall@), 0). holds@(loc@(red@, room@_1), 0).",
        "holds@(loc@(green@, room@_2), 0). holds@(loc@(blue@, room@_3), 0).",
    ],
}


def _path(name: str, suffix: str) -> Path:
    return resource("asp", f"benchmarks/{name}.{suffix}")


def _ours(path: Path) -> set[tuple[str, ...]]:
    program = load(path)
    translation = translated(program)
    question = Question(
        text=translation.text,
        applied=translation.applied,
        models=0,
        optimize=program.optimizes,
        time_limit_s=_TIME_LIMIT_S,
    )
    return set(AnswerSetEngine().solve(question).sets)


def _by_hand(path: Path) -> set[tuple[str, ...]]:
    control = clingo.Control(["0", "--opt-mode=optN"])
    control.load(str(path))
    control.ground()
    found = set()
    with control.solve(yield_=True) as handle:
        for model in handle:
            if model.optimality_proven:
                found.add(tuple(map(str, sorted(model.symbols(shown=True)))))
    return found


def _timed(
    action: Callable[[], set[tuple[str, ...]]], options: BenchOptions
) -> tuple[float, set[tuple[str, ...]]]:
    found = action()
    return median_ms(action, 1 if options.quick else 3) / 1000.0, found
