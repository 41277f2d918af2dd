"""Goals of the experiment on planning: drawn, tried in the simulator, and judged by it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import Literal

import numpy as np

from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.engine import SimulatedScene
from ros_scenesense.simulation.rehearsal import Rehearsal, Tried

Actions = tuple[PlannedAction, ...]
GoalKind = Literal["on", "tidied", "visible", "all_visible"]

_TABLE = "table"
_EMPTY_HAND = "no in_hand(R, X)"


@dataclass(frozen=True)
class Wanted:
    """A goal.

    Attributes:
        kind: `on`: one object is on another; `tidied`: one or two objects stand on the table no
            longer, to make room there; `visible`: an object is not occluded any more;
            `all_visible`: none is.
        objects: Which; of `on` the lower one last. Empty for `all_visible`.
    """

    kind: GoalKind
    objects: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """In the language of the domain. What is in the hand is no way to tidy or to be seen."""
        if self.kind == "on":
            return f"on({', '.join(self.objects)})"
        if self.kind == "tidied":
            return ", ".join([*(f"-on({name}, {_TABLE})" for name in self.objects), _EMPTY_HAND])
        if self.kind == "visible":
            return f"-occluded({self.objects[0]}), {_EMPTY_HAND}"
        return f"all -occluded(X), {_EMPTY_HAND}"

    @property
    def looks(self) -> bool:
        """Whether it takes a look to see if it is reached."""
        return self.kind in ("visible", "all_visible")

    def reached(self, tried: Tried) -> bool:
        """Whether the simulator says so, after all actions of a plan."""
        if tried.failure:
            return False
        if self.kind == "on":
            return self.objects in tried.supports
        if tried.in_hand is not None:
            return False
        if self.kind == "tidied":
            return set(self.objects) <= {upper for upper, _ in tried.supports}
        asked = self.objects or tuple(tried.occluded)
        return all(tried.occluded[name] is Truth.FALSE for name in asked)


def draw_goals(scene: SimulatedScene, rng: np.random.Generator) -> Iterator[Wanted]:
    """Goals that do not hold in a scene, each once, of all kinds in turn."""
    names = [each.name for each in scene.objects]
    hidden = [each.name for each in scene.object_labels if each.occluded is Truth.TRUE]
    standing = [name for name in names if name not in dict(scene.supports)]
    pairs = [(a, b) for a in names for b in names if a != b and (a, b) not in scene.supports]
    couples = list(combinations(standing, 2)) if len(standing) > 2 else []
    kinds: list[list[Wanted]] = [
        _shuffled([Wanted("visible", (name,)) for name in hidden], rng),
        [Wanted("all_visible")] if hidden else [],
        _shuffled([Wanted("tidied", (name,)) for name in standing], rng),
        _shuffled([Wanted("tidied", couple) for couple in couples], rng),
        _shuffled([Wanted("on", pair) for pair in pairs], rng),
    ]
    while any(kinds):
        yield from [several.pop() for several in kinds if several]


def is_possible(wanted: Wanted, scene: SimulatedScene, rehearsal: Rehearsal) -> bool:
    """Whether the simulator brings a goal about in the most straightforward way.

    Whatever is in the way is put on the table first, one thing after the other.
    """
    supports = scene.supports
    if wanted.kind == "on":
        return wanted.reached(rehearsal.attempt(_stacking(wanted.objects, supports)))
    if wanted.kind == "tidied":
        names = [each.name for each in scene.objects]
        return any(
            wanted.reached(rehearsal.attempt(plan))
            for order in permutations(wanted.objects)
            for plan in _placings(order, names, rehearsal)
        )
    moved = wanted.objects or [
        each.name for each in scene.object_labels if each.occluded is not Truth.FALSE
    ]
    plan = list(_moves(_top_down(moved, supports)))
    return wanted.reached(rehearsal.attempt(plan, looks=True))


def _placings(
    uppers: Sequence[str], names: Sequence[str], rehearsal: Rehearsal, begun: Actions = ()
) -> Iterator[Actions]:
    """Ways to put one object after the other on some other object, as far as they succeed."""
    if not uppers:
        yield begun
        return
    before = rehearsal.attempt(begun)
    if not before.failure:
        for lower in names:
            if lower != uppers[0]:
                actions = (*begun, *_stacking((uppers[0], lower), before.supports))
                yield from _placings(uppers[1:], names, rehearsal, actions)


def _stacking(pair: Sequence[str], supports: Sequence[tuple[str, str]]) -> list[PlannedAction]:
    upper, lower = pair
    in_the_way = _top_down(_above(upper, supports) | _above(lower, supports), supports)
    return [
        *_moves(in_the_way),
        PlannedAction(kind="pickup", object=upper),
        PlannedAction(kind="putdown", object=upper, location=lower),
    ]


def _moves(names: Iterable[str]) -> Iterator[PlannedAction]:
    """Puts one after the other on the table."""
    for name in names:
        yield PlannedAction(kind="pickup", object=name)
        yield PlannedAction(kind="putdown", object=name, location=_TABLE)


def _top_down(names: Iterable[str], supports: Sequence[tuple[str, str]]) -> list[str]:
    """These and all that stands on them, what is above first."""
    found = {each for name in names for each in (name, *_above(name, supports))}
    return sorted(found, key=lambda name: (len(_above(name, supports)), name))


def _above(name: str, supports: Sequence[tuple[str, str]]) -> set[str]:
    found: set[str] = set()
    waiting = [name]
    while waiting:
        lowest = waiting.pop()
        more = {upper for upper, lower in supports if lower == lowest} - found
        found |= more
        waiting += more
    return found


def _shuffled(goals: list[Wanted], rng: np.random.Generator) -> list[Wanted]:
    return [goals[int(index)] for index in rng.permutation(len(goals))]
