"""Which axioms and facts contradict each other, where nothing restores consistency."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import clingo
from clingo import ast

from ros_scenesense.reasoning.facts import SceneFacts
from ros_scenesense.reasoning.program import Messages, Selection, parse
from ros_scenesense.reasoning.solving import QUIET

_ACTIVE = "active__"
# Enough for what scenes ask; a suspect that cannot be cleared within it counts as guilty.
_CONFLICTS = "20000"
_LONGEST_WORDS = 1000


@dataclass(frozen=True, eq=False)
class _Suspect:
    """A part of the scene or of the knowledge that can be left out of the program."""

    words: str
    statements: tuple[ast.AST, ...]


def find_conflict(facts: SceneFacts, selection: Selection, source: str) -> str:
    """A smallest set of axioms and facts that contradict each other: none of them can be left out.

    Args:
        facts: The scene.
        selection: The statements in force.
        source: Name of the program, for messages.

    Returns:
        The set in words; empty if there is no contradiction.

    Raises:
        ReasoningError: If the solver fails.
    """
    suspects = list(_suspects(facts, selection, source))
    with Messages(source) as messages:
        control = clingo.Control(QUIET, logger=messages.take)
        with ast.ProgramBuilder(control) as builder:
            for statement in selection.open:
                if statement.axiom is None:
                    builder.add(statement.node)
            for index, suspect in enumerate(suspects):
                for node in suspect.statements:
                    builder.add(_guarded(node, index, source))
        control.add("base", [], facts.render_frame(selection))
        control.add("base", [], f"{{ {_ACTIVE}(0..{len(suspects)}) }}.")
        control.ground()
        configuration: Any = control.configuration.solve
        configuration.solve_limit = _CONFLICTS
        guilty = _core(control, list(range(len(suspects))))
        if guilty is None:
            return ""
        for index in list(guilty):
            smaller = _core(control, [each for each in guilty if each != index])
            if smaller is not None:
                guilty = [each for each in guilty if each in smaller]
    words = "; ".join(suspects[index].words for index in guilty) or "the knowledge itself"
    return words if len(words) <= _LONGEST_WORDS else words[: _LONGEST_WORDS - 1] + "…"


def _core(control: clingo.Control, active: Sequence[int]) -> list[int] | None:
    """Those of the suspects that contradict each other; None if they do not."""
    literals = {
        control.symbolic_atoms[clingo.Function(_ACTIVE, [clingo.Number(index)])].literal: index  # type: ignore[union-attr]
        for index in active
    }
    cores: list[Sequence[int]] = []
    result = control.solve(assumptions=list(literals), on_core=cores.append)
    if not result.unsatisfiable:
        return None
    return [literals[each] for each in cores[-1]] if cores else list(active)


def _suspects(facts: SceneFacts, selection: Selection, source: str) -> Iterator[_Suspect]:
    axioms: defaultdict[str, list[ast.AST]] = defaultdict(list)
    for statement in selection.open:
        if statement.axiom is not None:
            axioms[statement.axiom].append(statement.node)
    for identifier, nodes in axioms.items():
        yield _Suspect(f"axiom {identifier}", tuple(nodes))
    for fact in facts.statements(selection):
        yield _Suspect(fact.words, tuple(parse(f"{fact.atom}.", source)))


def _guarded(node: ast.AST, index: int, source: str) -> ast.AST:
    (guard,) = parse(f":- {_ACTIVE}({index}).", source)
    return node.update(body=[*node.body, *guard.body])
