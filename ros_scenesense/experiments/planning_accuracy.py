"""How often reasoning is right about objects, with and without the axioms that were learned."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from ros_scenesense.experiments.axioms_scenes import facts_of, labels_of
from ros_scenesense.experiments.planning_knowledge import Knowledge
from ros_scenesense.reasoning.classification import ClassificationSession
from ros_scenesense.reasoning.program import Program
from ros_scenesense.simulation.dataset.record import SceneRecord


@dataclass
class Tally:
    """Objects with a label: how many, how many of them are decided, and how many rightly."""

    labelled: int = 0
    decided: int = 0
    right: int = 0

    def add(self, label: bool, decided: bool | None) -> None:
        """Counts one."""
        self.labelled += 1
        self.decided += decided is not None
        self.right += decided is label

    @property
    def accuracy(self) -> float:
        """Share that is decided rightly; what is left undecided is not right."""
        return self.right / self.labelled if self.labelled else 0.0


@dataclass(frozen=True)
class Accuracy:
    """Of one way: by fluent, and scene by scene."""

    by_fluent: Mapping[str, Tally]
    by_scene: Sequence[Tally] = field(default_factory=list)

    @property
    def whole(self) -> Tally:
        """All objects about both fluents."""
        tallies = self.by_fluent.values()
        return Tally(
            sum(each.labelled for each in tallies),
            sum(each.decided for each in tallies),
            sum(each.right for each in tallies),
        )


def accuracies(knowledge: Knowledge, records: Sequence[SceneRecord]) -> dict[str, Accuracy]:
    """Accuracy `with` and `without` all learned axioms, of scenes with exact relations."""
    session = ClassificationSession(Program.of(knowledge.description))
    return {
        "with": _accuracy(session, records, ()),
        "without": _accuracy(session, records, knowledge.learned),
    }


def _accuracy(
    session: ClassificationSession, records: Sequence[SceneRecord], withheld: Collection[str]
) -> Accuracy:
    by_fluent: dict[str, Tally] = {}
    by_scene = []
    for record in records:
        objects = session.classify(facts_of(record), withheld).objects
        decided = {
            "stable": [each.stable.value for each in objects],
            "occluded": [each.occluded.value for each in objects],
        }
        scene = Tally()
        for fluent, labels in labels_of(record).items():
            tally = by_fluent.setdefault(fluent, Tally())
            for label, value in zip(labels, decided[fluent], strict=True):
                if label is not None:
                    tally.add(label, value)
                    scene.add(label, value)
        by_scene.append(scene)
    return Accuracy(by_fluent, by_scene)
