"""Shortest plans by a program written for clingo by hand, `asp/benchmarks/plan_steps.lp`."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import clingo

from ros_scenesense.errors import ReasoningError
from ros_scenesense.knowledge.terms import check_name
from ros_scenesense.reasoning.described_scenes import TABLE, KnownScene
from ros_scenesense.resources import resource
from ros_scenesense.scene import Distance, Position

_MAX_STEPS = 20


def plans_by_hand(known: KnownScene, upper: str, lower: str) -> set[tuple[str, ...]]:
    """All shortest plans to have one object on another, of those with fewest exceptions.

    Args:
        known: Stacks of objects whose size and surface are known.
        upper: The object that is to be on the other.
        lower: The other.

    Returns:
        Their actions, as the domain says them.

    Raises:
        ReasoningError: If there is no plan.
    """
    control = clingo.Control(["0", "--opt-mode=optN", "--warn=none"])
    control.load(str(resource("asp", "benchmarks/plan_steps.lp")))
    control.add("base", [], "\n".join([*_facts(known), f"want({upper}, {lower})."]))
    for step in range(_MAX_STEPS + 1):
        now = clingo.Number(step)
        parts = [("state", [now]), ("check", [now])]
        if step == 0:
            parts.append(("base", []))
        else:
            parts.append(("step", [now]))
            control.release_external(clingo.Function("query", [clingo.Number(step - 1)]))
        control.ground(parts)
        control.assign_external(clingo.Function("query", [now]), True)
        found = set()
        with control.solve(yield_=True) as handle:
            for model in handle:
                if model.optimality_proven:
                    found.add(tuple(_actions(model)))
        if found:
            return found
    raise ReasoningError(f"found no plan for on({upper}, {lower}) in {_MAX_STEPS} steps")


def _facts(known: KnownScene) -> Iterator[str]:
    below = {
        relation.object: relation.reference
        for relation in known.facts.relations
        if relation.position is Position.ABOVE and relation.distance is Distance.TOUCHING
    }
    for each in known.facts.objects:
        check_name(each.name)
        yield f"obj({each.name}). init(on({each.name}, {below.get(each.name, TABLE)}))."
        yield f"size({each.name}, {each.size}). surface({each.name}, {each.surface})."


def _actions(model: clingo.Model) -> Iterator[str]:
    timed = sorted((symbol.arguments[-1], symbol) for symbol in model.symbols(shown=True))
    for _, symbol in timed:
        what = itertools.islice(map(str, symbol.arguments), len(symbol.arguments) - 1)
        yield f"{symbol.name}({', '.join(('rob1', *what))})"
