"""What axioms are learned from: objects of scenes whose state is known, each with a label."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from ros_scenesense.errors import LearningError
from ros_scenesense.knowledge.description import SystemDescription

Fact = tuple[str, tuple[str | int, ...]]
"""An atom that holds: its name and its arguments, objects as their numbers in the scene."""

Reason = Literal[
    "right", "unjudged", "undecided", "inconsistent", "timed_out", "wrong", "unexpected_outcome"
]
"""How reasoning stood to a label; all but `right` and `unjudged` is what it lacks."""

LACKING: frozenset[Reason] = frozenset(
    ("undecided", "inconsistent", "timed_out", "wrong", "unexpected_outcome")
)


@dataclass(frozen=True)
class SceneState:
    """All that holds in a scene: statics, perceived and defined fluents.

    What is not among the facts does not hold: only scenes of which everything is known are learned
    from, for nothing may be concluded from what was merely not seen.

    Attributes:
        names: Of the objects; in facts they go by their numbers here.
        facts: Atoms of statics and of fluents that are not estimated.
    """

    names: tuple[str, ...]
    facts: frozenset[Fact]

    @cached_property
    def by_name(self) -> dict[str, list[tuple[str | int, ...]]]:
        """The arguments for which each attribute holds."""
        found: dict[str, list[tuple[str | int, ...]]] = defaultdict(list)
        for name, arguments in self.facts:
            found[name].append(arguments)
        return found


@dataclass(frozen=True)
class Example:
    """A labelled object.

    Attributes:
        scene_id: The scene, by which examples are split: those of one scene belong together.
        state: What holds there.
        target: Number of the object in the state.
        label: Whether the fluent is true of it.
        reason: How reasoning stood to it.
    """

    scene_id: str
    state: SceneState
    target: int
    label: bool
    reason: Reason = "undecided"


def checked(examples: Iterable[Example], description: SystemDescription) -> list[Example]:
    """Examples that can be learned from, each once; of those that contradict each other, none.

    Raises:
        LearningError: If there are none, if all have the same label, or if one speaks of an
            attribute that the domain does not have.
    """
    kept: dict[tuple[str, int], Example] = {}
    contradictory = set()
    known: set[int] = set()
    for example in examples:
        if id(example.state) not in known:
            _check_state(example, description)
            known.add(id(example.state))
        key = (example.scene_id, example.target)
        if key in kept and kept[key].label != example.label:
            contradictory.add(key)
        kept.setdefault(key, example)
    found = [example for key, example in kept.items() if key not in contradictory]
    if not found:
        raise LearningError("there are no labelled examples: collect labelled scenes first")
    labels = Counter(example.label for example in found)
    if len(labels) < 2:
        label = str(found[0].label).lower()
        raise LearningError(
            f"all {len(found)} examples have the label {label}, so nothing tells when it is "
            "otherwise: collect scenes of the other kind"
        )
    return found


def lacking(examples: Sequence[Example]) -> list[Example]:
    """The examples that reasoning left undecided or got wrong."""
    return [example for example in examples if example.reason in LACKING]


def _check_state(example: Example, description: SystemDescription) -> None:
    attributes = description.signature.attributes
    for name in example.state.by_name:
        if name not in attributes:
            raise LearningError(
                f"an example of scene {example.scene_id} speaks of {name!r}, which "
                f"{description.source} does not have: learn with the domain that it comes from"
            )
    if not 0 <= example.target < len(example.state.names):
        raise LearningError(
            f"an example of scene {example.scene_id} is about object {example.target} of "
            f"{len(example.state.names)}"
        )


def scenes_of(examples: Collection[Example]) -> list[str]:
    """The ids of their scenes, each once, in order."""
    return list(dict.fromkeys(example.scene_id for example in examples))
