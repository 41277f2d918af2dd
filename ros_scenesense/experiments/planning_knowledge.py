"""What the robot of the experiment on planning knows: what was given, and what was learned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ros_scenesense.attention.relevance import relevance
from ros_scenesense.experiments.axioms_scenes import Scenes, domain, withheld_ids
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.examples import Example
from ros_scenesense.learning.scoring import Judge
from ros_scenesense.reasoning.program import FLUENTS
from ros_scenesense.stages.learning_engine import LearningEngine, LearningOrder, Task


@dataclass(frozen=True)
class Knowledge:
    """The domain without the withheld axioms, and with those that were learned.

    Attributes:
        description: The domain with the learned axioms.
        learned: Their ids.
        about_stability: Ids of those that bear on what actions may bring about.
        text: The learned axioms in the action language.
    """

    description: SystemDescription
    learned: frozenset[str]
    about_stability: frozenset[str]
    text: str


def learn(scenes: Scenes, inducing: Sequence[int], merging: Sequence[int], seed: int) -> Knowledge:
    """Learns axioms from labelled scenes, as the learner of the graph does in a cycle.

    Args:
        scenes: Labelled.
        inducing: Numbers of those to learn from.
        merging: Numbers of those that choose between versions.
        seed: Of the ensemble.
    """
    whole = domain()
    reduced = whole.without(withheld_ids(whole))
    tasks = [
        Task(
            fluent,
            frozenset(relevance(reduced, task).relations),
            examples(scenes, fluent, inducing),
            examples(scenes, fluent, merging),
        )
        for fluent, task in FLUENTS.items()
    ]
    order = LearningOrder(reduced, {}, frozenset(), (), tasks, seed=seed)
    report = LearningEngine().learn(order)
    lines = [f"learned_{n}: {each.text}" for n, each in enumerate(report.found, 1)]
    text = "\n".join(lines)
    description = parse(text, "learned axioms", reduced.without(report.refuted)).description
    learned = description.axioms[len(description.axioms) - len(lines) :]
    return Knowledge(
        description,
        frozenset(axiom.id for axiom in learned),
        frozenset(
            axiom.id
            for axiom in learned
            if isinstance(axiom, StateConstraint | Default) and axiom.head.atom.name == "stable"
        ),
        text,
    )


def truths(knowledge: Knowledge, scenes: Scenes, judging: Sequence[int]) -> dict[str, float | None]:
    """By id, how often each learned axiom is true of the objects of other scenes."""
    whole = domain()
    found: dict[str, float | None] = {}
    for fluent in FLUENTS:
        judge = Judge(whole, fluent, examples(scenes, fluent, judging))
        for axiom in knowledge.description.axioms:
            if (
                axiom.id in knowledge.learned
                and isinstance(axiom, StateConstraint | Default)
                and axiom.head.atom.name == fluent
            ):
                found[axiom.id] = judge.score([axiom]).judged[0].truth
    return found


def examples(scenes: Scenes, fluent: str, numbers: Sequence[int]) -> list[Example]:
    """The examples of some scenes."""
    return [each for number in numbers for each in scenes[fluent][number]]
