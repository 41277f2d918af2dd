"""The best combination of versions of axioms, by labelled scenes (paper, *Axiom Merging*)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import clingo

from ros_scenesense.reasoning.program import Messages, read_program
from ros_scenesense.reasoning.solving import QUIET

_PROGRAM = "selection.lp"


@dataclass(frozen=True)
class Version:
    """An axiom as selection sees it.

    Attributes:
        id: Its id.
        value: Whether its head is the fluent or its negation.
        strict: Whether it is no default.
        length: The number of its conditions.
        fires: Numbers of the items that its body holds of.
        given: Whether it was given, not learned.
    """

    id: str
    value: bool
    strict: bool
    length: int
    fires: frozenset[int]
    given: bool = False


@dataclass(frozen=True)
class Dropped:
    """An axiom that was not kept.

    Attributes:
        id: The axiom.
        instead: Id of the one kept of its group; None if it was optional.
        wins: Items that are decided rightly, and would not be if it had been kept.
        losses: Items that would be decided rightly with it, and are not now.
    """

    id: str
    instead: str | None
    wins: tuple[int, ...]
    losses: tuple[int, ...]


@dataclass(frozen=True)
class Selected:
    """The best combination: ids of what is kept, and what was dropped and why."""

    kept: frozenset[str]
    dropped: tuple[Dropped, ...]


def select(
    groups: Sequence[Sequence[Version]],
    fixed: Sequence[Version],
    labels: Sequence[bool],
    optional: Sequence[Version] = (),
) -> Selected:
    """Keeps one version of each group, so that the most items are decided rightly.

    Among those the one that decides the fewest wrongly is kept, then the one that is least often
    wrong itself, also where others overrule it; among equally good ones the most general: that with
    the fewest conditions.

    Args:
        groups: Versions of which one each is kept.
        fixed: Axioms that are kept.
        labels: The truth about each item.
        optional: Axioms that are kept if that costs no right decision.

    Raises:
        ReasoningError: If the solver fails.
    """
    everything = [*(each for group in groups for each in group), *fixed, *optional]
    number = {each.id: index for index, each in enumerate(everything)}
    facts = "".join(_facts(groups, fixed, labels, optional, number))
    best: list[clingo.Symbol] = []
    with Messages(_PROGRAM) as messages:
        control = clingo.Control(QUIET, logger=messages.take)
        control.add("base", [], read_program(_PROGRAM) + facts)
        control.ground()

        def take(model: clingo.Model) -> None:
            best[:] = model.symbols(shown=True)

        control.solve(on_model=take)
    chosen = {symbol.arguments[0].number for symbol in best}
    kept = [each for each in everything if number[each.id] in chosen]
    dropped = []
    for group in groups:
        (instead,) = (each for each in group if number[each.id] in chosen)
        for each in group:
            if each is not instead:
                others = [*(one for one in kept if one is not instead), each]
                dropped.append(_dropped(each, instead.id, kept, others, labels))
    for each in optional:
        if number[each.id] not in chosen:
            dropped.append(_dropped(each, None, kept, [*kept, each], labels))
    return Selected(frozenset(each.id for each in kept), tuple(dropped))


def decision(axioms: Iterable[Version], item: int) -> bool | None:
    """What axioms say of an item; None where they say nothing or contradict each other."""
    firing = [each for each in axioms if item in each.fires]
    surely = {each.value for each in firing if each.strict}
    usually = {each.value for each in firing if not each.strict}
    said = surely or usually
    return next(iter(said)) if len(said) == 1 else None


def _dropped(
    version: Version,
    instead: str | None,
    kept: Sequence[Version],
    others: Sequence[Version],
    labels: Sequence[bool],
) -> Dropped:
    right = [decision(kept, item) == label for item, label in enumerate(labels)]
    otherwise = [decision(others, item) == label for item, label in enumerate(labels)]
    items = range(len(labels))
    wins = tuple(item for item in items if right[item] and not otherwise[item])
    return Dropped(version.id, instead, wins, tuple(i for i in items if otherwise[i] > right[i]))


def _facts(
    groups: Sequence[Sequence[Version]],
    fixed: Sequence[Version],
    labels: Sequence[bool],
    optional: Sequence[Version],
    number: dict[str, int],
) -> Iterator[str]:
    """Axioms and items as integers: no id becomes program text."""
    for index, group in enumerate(groups):
        yield from (f"version({index},{number[each.id]})." for each in group)
    yield from (f"fixed({number[each.id]})." for each in fixed)
    yield from (f"optional({number[each.id]})." for each in optional)
    for each in (*(one for group in groups for one in group), *fixed, *optional):
        own = number[each.id]
        yield f"says({own},{int(each.value)}).length({own},{each.length})."
        if each.strict:
            yield f"strict({own})."
        if each.given:
            yield f"given({own})."
        yield from (f"fires({own},{item})." for item in sorted(each.fires))
    yield from (f"label({item},{int(label)})." for item, label in enumerate(labels))
