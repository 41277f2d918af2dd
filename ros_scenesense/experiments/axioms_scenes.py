"""Labelled scenes of a dataset as examples: with exact relations, and as the graph sees them."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ros_scenesense.errors import DatasetError
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.examples import Example, Reason, SceneState
from ros_scenesense.messages.reasoning import Belief, Verdicts
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.reasoning.classification import ClassificationSession
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.reasoning.program import FLUENTS, Program
from ros_scenesense.reasoning.scene_states import SceneStates
from ros_scenesense.resources import resource
from ros_scenesense.scene import DecisionStatus, Position, Truth
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.stages.attention import AttentionConfiguration, AttentionStage
from ros_scenesense.stages.axiom_learner import AxiomLearnerConfiguration, AxiomLearnerStage
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import LearnerStore
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)

Scenes = dict[str, list[list[Example]]]
"""By fluent, the examples of each scene."""


def domain() -> SystemDescription:
    """The shipped domain."""
    return load(resource("asp", "robot_assistant.al")).description


def withheld_ids(description: SystemDescription) -> frozenset[str]:
    """Ids of the axioms that are to be learned."""
    return frozenset(axiom.id for axiom in description.axioms if axiom.withheld)


class ExactScenes:
    """Scenes of records, with the relations and labels that the simulation says.

    Args:
        description: The whole domain.
    """

    def __init__(self, description: SystemDescription) -> None:
        self._withheld = withheld_ids(description)
        self._states = SceneStates(description)
        self._session = ClassificationSession(Program.of(description))

    def read(self, records: Sequence[SceneRecord]) -> Scenes:
        """The examples of scenes, each with how the reduced knowledge stands to its label.

        Args:
            records: Of the scenes.
        """
        scenes: Scenes = {fluent: [] for fluent in FLUENTS}
        for record in records:
            facts = facts_of(record)
            atoms = self._states.of(facts)
            if atoms is None:
                raise DatasetError(
                    f"scene {record.index} does not say all relations of its objects"
                )
            state = SceneState(tuple(each.name for each in facts.objects), atoms)
            reduced = self._decided(facts, self._withheld)
            labels = labels_of(record)
            for fluent in FLUENTS:
                scenes[fluent].append(
                    [
                        Example(
                            f"scene-{record.index}",
                            state,
                            target,
                            label,
                            _reason(label, reduced[fluent][target].value),
                        )
                        for target, label in enumerate(labels[fluent])
                        if label is not None
                    ]
                )
        return scenes

    def ruled(
        self, records: Sequence[SceneRecord], scenes: Scenes, generator: np.random.Generator
    ) -> Scenes:
        """The same scenes in a world that obeys the whole knowledge.

        Labels are what normal axioms conclude; what only defaults conclude, but for exceptions,
        drawn as often as the given labels make them where these defaults decide; and where nothing
        is concluded the given labels.

        Args:
            records: Of the scenes.
            scenes: Their examples, as read.
            generator: Draws the exceptions.
        """
        facts = [facts_of(record) for record in records]
        concluded = [self._decided(each, frozenset()) for each in facts]
        reduced = [self._decided(each, self._withheld) for each in facts]
        followed: dict[tuple[str, ...], list[bool]] = defaultdict(list)
        for fluent, several in scenes.items():
            for decided, examples in zip(concluded, several, strict=True):
                for each in examples:
                    belief = decided[fluent][each.target]
                    if belief.status is DecisionStatus.BY_DEFAULT:
                        followed[tuple(belief.axioms)].append(belief.value == each.label)
        share = {axioms: sum(each) / len(each) for axioms, each in followed.items()}

        def label(example: Example, belief: Belief) -> bool:
            if belief.value is None:
                return example.label
            if belief.status is DecisionStatus.BY_DEFAULT:
                return belief.value == (generator.random() < share[tuple(belief.axioms)])
            return belief.value

        ruled: Scenes = {fluent: [] for fluent in scenes}
        for fluent, several in scenes.items():
            for examples, whole, part in zip(several, concluded, reduced, strict=True):
                ruled[fluent].append([])
                for each in examples:
                    own = label(each, whole[fluent][each.target])
                    reason = _reason(own, part[fluent][each.target].value)
                    ruled[fluent][-1].append(replace(each, label=own, reason=reason))
        return ruled

    def _decided(self, facts: SceneFacts, withheld: frozenset[str]) -> dict[str, list[Belief]]:
        objects = self._session.classify(facts, withheld).objects
        return {
            "stable": [each.stable for each in objects],
            "occluded": [each.occluded for each in objects],
        }


def grounded_scenes(
    folder: Path, count: int, state_dir: Path, say: Callable[[str], None]
) -> tuple[Scenes, int]:
    """The first scenes of a dataset as the stages of the graph perceive and judge them.

    Args:
        folder: The dataset.
        count: How many scenes.
        state_dir: Where the learner keeps its examples.
        say: Takes a line now and then.

    Returns:
        The examples, scene by scene; scenes of which not everything was seen have none. And how
        many these are.
    """
    camera = SimulatedCameraConfiguration(
        dataset=str(folder), mode="training", session="a", scenes=count
    )
    learner = replace(
        AxiomLearnerConfiguration(), cycle_scenes=0, pool_scenes=count, state_dir=str(state_dir)
    )
    pipeline = Pipeline(
        [
            SimulatedCameraStage(camera),
            GroundingStage(GroundingConfiguration()),
            GroundingControlStage(GroundingControlConfiguration()),
            ReasonerStage(ReasonerConfiguration(withheld=",".join(sorted(withheld_ids(domain()))))),
            # Its estimates tell the camera to go on.
            AttentionStage(AttentionConfiguration(network="none")),
            AxiomLearnerStage(learner),
        ],
        itertools.count(1).__next__,
    )
    judged = 0
    try:
        for item in pipeline.run():
            if isinstance(item, Verdicts):
                judged += 1
                if judged % 100 == 0:
                    say(f"{judged} of {count} scenes perceived")
    finally:
        pipeline.close()
    store = LearnerStore(state_dir / "learner.db", Health(), count)
    scenes: Scenes = {fluent: [[] for _ in range(count)] for fluent in FLUENTS}
    seen = set()
    for number in store.scenes():
        for fluent in FLUENTS:
            examples = store.examples(fluent, [number])
            for each in examples:
                index = int(each.scene_id.rpartition("-")[2])
                seen.add(index)
                scenes[fluent][index].append(replace(each, scene_id=f"scene-{index}"))
    store.close()
    return scenes, count - len(seen)


@dataclass(frozen=True)
class Feedback:
    """What people say of some pairs: how many, and how many they name otherwise."""

    asked: int
    wrong: int

    @property
    def slack(self) -> float:
        """The share of wrong relations that it shows, at most 5 %."""
        return min(0.05, self.wrong / self.asked) if self.asked else 0.0


def feedback_on(
    scenes: Sequence[list[Example]],
    records: Sequence[SceneRecord],
    generator: np.random.Generator,
    asked: int,
) -> Feedback:
    """A person says of some pairs, drawn at random, how they lie; unclear ones are not asked."""
    pairs = []
    for examples, record in zip(scenes, records, strict=True):
        if examples:
            state = examples[0].state
            number = {name: index for index, name in enumerate(state.names)}
            for each in record.relations:
                if not each.position_ambiguous and {each.object, each.reference} <= set(number):
                    fact = (str(each.position), (number[each.object], number[each.reference]))
                    pairs.append(fact in state.facts)
    chosen = generator.permutation(len(pairs))[:asked]
    return Feedback(len(chosen), sum(not pairs[int(index)] for index in chosen))


def read_records(folder: Path, needed: int) -> list[SceneRecord]:
    """The first records of a dataset, as many as needed.

    Raises:
        DatasetError: If it is none, or has too few scenes.
    """
    reader = DatasetReader(folder)
    if len(reader) < needed:
        raise DatasetError(
            f"'{folder}' has {len(reader)} scenes, {needed} are needed: let it grow with "
            f"`scenesense dataset generate {folder} --count {needed}`, or run with --quick"
        )
    return [reader.record(index) for index in range(needed)]


def facts_of(record: SceneRecord) -> SceneFacts:
    """What is known of a scene of which everything is known."""
    return SceneFacts.checked(
        [SceneObject(each.name, size=each.size, surface=each.surface) for each in record.objects],
        [
            PairRelation(each.object, each.reference, Position(each.position), each.distance)
            for each in record.relations
        ],
    )[0]


def labels_of(record: SceneRecord) -> dict[str, list[bool | None]]:
    """By fluent the truth about every object; None where it is ambiguous."""
    known = {Truth.TRUE: True, Truth.FALSE: False}
    return {
        "stable": [known.get(each.stable) for each in record.object_labels],
        "occluded": [known.get(each.occluded) for each in record.object_labels],
    }


def _reason(label: bool, decided: bool | None) -> Reason:
    if decided is None:
        return "undecided"
    return "right" if decided == label else "wrong"
