"""Proofs: why an atom is in an answer set.

An answer set is the smallest set that its own reduct derives, so every atom of it has a proof that
goes down to facts. Proofs here never go in circles: each atom is proved from atoms that the
fixpoint derived before it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import clingo

from ros_scenesense.reasoning.explanation.support import GroundLiteral, Instance, Sign


@dataclass(frozen=True)
class Proof:
    """Why an atom holds.

    Attributes:
        atom: The atom.
        by: The rule that derives it; None for a fact.
        premises: One for each literal of the body, in its order: proofs of the atoms that hold, and
            the other literals themselves.
    """

    atom: clingo.Symbol
    by: Instance | None = None
    premises: tuple[Proof | GroundLiteral, ...] = ()


class Proofs:
    """Proofs of all atoms of an answer set.

    Args:
        facts: Atoms that are given, not derived.
        instances: The rules that apply in the answer set.
        preference: Of several rules that derive an atom equally soon, the one with the smallest
            value is taken; then the one with the shortest body, then the first.
    """

    def __init__(
        self,
        facts: Iterable[clingo.Symbol],
        instances: Iterable[Instance],
        preference: Callable[[Instance], int] = lambda _instance: 0,
    ) -> None:
        self._by = _well_founded(facts, instances, preference)
        self._known: dict[clingo.Symbol, Proof] = {}

    def of(self, atom: clingo.Symbol) -> Proof | None:
        """The proof of an atom, one with the fewest levels; None if it does not hold."""
        if atom not in self._by:
            return None
        # Without recursion: a chain of premises may be longer than Python's stack.
        waiting = [atom]
        while waiting:
            instance = self._by[waiting[-1]]
            missing = (
                [] if instance is None else [n for n in instance.needs if n not in self._known]
            )
            if missing:
                waiting.extend(missing)
                continue
            current = waiting.pop()
            if current not in self._known:
                self._known[current] = self._proof(current, instance)
        return self._known[atom]

    def _proof(self, atom: clingo.Symbol, instance: Instance | None) -> Proof:
        if instance is None:
            return Proof(atom)
        premises: list[Proof | GroundLiteral] = []
        for literal in instance.body:
            holds = literal.sign is Sign.HOLDS and literal.atom is not None
            premises.append(self._known[literal.atom] if holds else literal)  # type: ignore[index]
        return Proof(atom, instance, tuple(premises))


def _well_founded(
    facts: Iterable[clingo.Symbol],
    instances: Iterable[Instance],
    preference: Callable[[Instance], int],
) -> dict[clingo.Symbol, Instance | None]:
    """For each atom a rule whose body was derived before it; None for facts."""
    by: dict[clingo.Symbol, Instance | None] = dict.fromkeys(facts)
    open_needs: dict[int, int] = {}
    waiting: defaultdict[clingo.Symbol, list[int]] = defaultdict(list)
    all_instances = list(instances)
    ready: list[int] = []
    for index, instance in enumerate(all_instances):
        needs = {need for need in instance.needs if need not in by}
        open_needs[index] = len(needs)
        for need in needs:
            waiting[need].append(index)
        if not needs:
            ready.append(index)
    while ready:
        found: dict[clingo.Symbol, int] = {}
        for index in ready:
            head = all_instances[index].head
            if head not in by and (
                head not in found
                or _rank(all_instances[index], preference)
                < _rank(all_instances[found[head]], preference)
            ):
                found[head] = index
        ready = []
        for head, index in found.items():
            by[head] = all_instances[index]
            for other in waiting.pop(head, ()):
                open_needs[other] -= 1
                if open_needs[other] == 0:
                    ready.append(other)
    return by


def _rank(
    instance: Instance, preference: Callable[[Instance], int]
) -> tuple[int, int, int, clingo.Symbol]:
    return preference(instance), len(instance.body), instance.rule, instance.head
