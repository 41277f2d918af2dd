"""From what axioms conclude to beliefs about objects and structures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.reasoning.program import Axiom
from ros_scenesense.scene import DecisionStatus, structure_truth


def belief(
    true_by: Sequence[Axiom] | None, false_by: Sequence[Axiom] | None, name: str = ""
) -> Belief:
    """The belief about a literal.

    Args:
        true_by: The axioms that conclude it, None if it is not concluded. They may be none where
            several answer sets conclude it by different axioms; it then counts as by default.
        false_by: The same of its complement.
        name: The object that the literal is about, for the explanation in one line.
    """
    if true_by is not None and false_by is not None:
        why = "; ".join(filter(None, (_why(by, name) for by in (true_by, false_by))))
        axioms = _ids([*true_by, *false_by])
        return Belief(status=DecisionStatus.INCONSISTENT, axioms=axioms, why=why)
    by = true_by if true_by is not None else false_by
    if by is None:
        return Belief(status=DecisionStatus.UNDECIDED)
    strict = any(axiom.kind == "normal" for axiom in by)
    status = DecisionStatus.STRICT if strict else DecisionStatus.BY_DEFAULT
    return Belief(status=status, value=true_by is not None, axioms=_ids(by), why=_why(by, name))


def _why(by: Sequence[Axiom], name: str) -> str:
    """What the first axiom rests on, a normal one if there is one."""
    if not by:
        return ""
    first = next((axiom for axiom in by if axiom.kind == "normal"), by[0])
    return f"{first.id}: {first.condition.replace('{}', name)}" if first.condition else ""


def structure_belief(members: Iterable[str], stable: Mapping[str, Belief]) -> Belief:
    """Whether a structure is stable: `scene.structure_truth`, with its status and axioms.

    One unstable member makes the structure unstable whatever the others are, also inconsistent
    ones; strictly so if one member is strictly unstable. Otherwise an inconsistent member leaves
    the structure inconsistent, then an undecided one undecided. All members stable make it
    stable, strictly so if all are strictly.

    Args:
        members: Names of the members.
        stable: The belief about each member's stability.
    """
    beliefs = {name: stable[name] for name in members}
    value = structure_truth(beliefs, {name: each.value for name, each in beliefs.items()})
    if value is None:
        for status in (DecisionStatus.TIMED_OUT, DecisionStatus.INCONSISTENT):
            concerned = [each for each in beliefs.values() if each.status == status]
            if concerned:
                return Belief(status=status, axioms=_union(concerned))
        return Belief(status=DecisionStatus.UNDECIDED)
    decisive = [each for each in beliefs.values() if each.value == value]
    strict = [each for each in decisive if each.status == DecisionStatus.STRICT]
    if value is False and strict:
        decisive = strict
    all_strict = len(strict) == len(decisive)
    status = DecisionStatus.STRICT if all_strict else DecisionStatus.BY_DEFAULT
    # One member is reason enough for an unstable structure, all are for a stable one.
    why = "" if value else decisive[0].why
    return Belief(status=status, value=value, axioms=_union(decisive), why=why)


def _ids(axioms: Iterable[Axiom]) -> list[str]:
    return [axiom.id for axiom in axioms]


def _union(beliefs: Iterable[Belief]) -> list[str]:
    return list(dict.fromkeys(axiom for each in beliefs for axiom in each.axioms))
