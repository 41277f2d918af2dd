"""The reasoner: what the knowledge says of the objects and structures of each scene.

Joins `scene`, `relations` and `objects`, classifies, and holds the beliefs against `labels` where
there are any.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

from ros_scenesense.errors import ReasoningError
from ros_scenesense.messages.actions import ActionResult, Goal
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.learning import Axioms
from ros_scenesense.messages.reasoning import (
    Beliefs,
    Query,
    RetractedRelation,
    Verdicts,
)
from ros_scenesense.messages.scenes import KnownObject, Labels, Scene
from ros_scenesense.parameters import parameter
from ros_scenesense.reasoning.classification import Classification, ClassificationSession
from ros_scenesense.reasoning.described_scenes import perceived_object, perceived_relation
from ros_scenesense.reasoning.facts import (
    ContentProblem,
    SceneFacts,
    SceneObject,
)
from ros_scenesense.reasoning.program import Program
from ros_scenesense.reasoning.verdicts import judge
from ros_scenesense.scene import DecisionStatus, NamingFrame, Position, Task
from ros_scenesense.stages.goal_ledger import GoalLedger
from ros_scenesense.stages.goals import GoalKeeper, GoalLimits
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.join import LATE_COMERS, SceneJoin
from ros_scenesense.stages.knowledge import KnowledgeInForce
from ros_scenesense.stages.planning_engine import PlanningEngine
from ros_scenesense.stages.protocol import Incoming, Job, Outgoing, Timing
from ros_scenesense.stages.queries import QueryDesk
from ros_scenesense.stages.seen_scenes import SeenScene
from ros_scenesense.stages.state_file import state_path

_PUBLISHERS = {
    "scene": "the camera",
    "relations": "grounding_control",
    "objects": "grounding",
}
_PART_OF: dict[type[Incoming], str] = {Scene: "scene", Relations: "relations", Objects: "objects"}

_DIRECTIONS = (Position.FRONT, Position.BEHIND, Position.RIGHT, Position.LEFT)


@dataclass(frozen=True)
class ReasonerConfiguration:
    """Parameters of the reasoner node."""

    withheld: str = parameter(
        "", "ids of axioms to leave out, separated by commas; an empty text leaves none out"
    )
    time_limit_s: float = parameter(
        1.0, "seconds to search for the answer of one scene", minimum=0.001, maximum=60.0
    )
    max_objects: int = parameter(
        64, "scenes with more objects are not classified", minimum=1, maximum=100
    )
    remembered_scenes: int = parameter(
        50, "scenes that can be asked about, the newest ones", minimum=1, maximum=1000
    )
    join_timeout_s: float = parameter(
        10.0, "seconds to wait for the other messages of a scene", minimum=0.1, maximum=3600.0
    )
    plan_time_limit_s: float = parameter(
        10.0, "seconds to search for a plan, or for an explanation", minimum=0.01, maximum=3600.0
    )
    plan_max_steps: int = parameter(
        20, "actions of the longest plans that are tried", minimum=1, maximum=100
    )
    plans_per_goal: int = parameter(
        12, "plans that are made for one goal before it is given up", minimum=1, maximum=1000
    )
    answer_timeout_s: float = parameter(
        30.0,
        "seconds to wait for the answer to an action, or for the scene of its effect",
        minimum=0.1,
        maximum=3600.0,
    )
    state_dir: str = parameter("", "folder of reasoner.db; empty = nothing is remembered")


class ReasonerStage:
    """Classifies each scene once.

    Args:
        configuration: The parameters.
        program: The knowledge; the shipped one if None.

    Raises:
        ParameterError: If an axiom to withhold does not exist.
        ReasoningError: If the program is missing or broken.
        StateError: If reasoner.db cannot be used.
    """

    def __init__(
        self, configuration: ReasonerConfiguration, program: Program | None = None
    ) -> None:
        self.configuration = configuration
        self.health = Health()
        self._knowledge = KnowledgeInForce(program or Program.shipped(), configuration.withheld)
        self._session = ClassificationSession(self._knowledge.program, configuration.time_limit_s)
        self._queries = QueryDesk(configuration.remembered_scenes)
        timeout_s = configuration.join_timeout_s
        self._scenes = SceneJoin(tuple(_PUBLISHERS), timeout_s, LATE_COMERS)
        # Labels come with the scene, so they wait for as long as it takes to be complete, and more.
        self._judged = SceneJoin(("beliefs", "labels"), 2 * timeout_s, LATE_COMERS)
        self._goals = _goal_keeper(configuration, self.health)

    def engine(self) -> Callable[[], Any] | None:
        """A factory of the planner. A scene is classified here, within milliseconds."""
        return PlanningEngine

    def start(self, now_ns: int) -> list[Outgoing]:
        """Publishes the axioms in force; goes on with the goal of before."""
        return [self._knowledge.message(now_ns), *self._goals.start(now_ns)]

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes the parts of scenes in any order, `axioms`, and what people and robots say."""
        if isinstance(item, Labels):
            return self._judge("labels", item, now_ns)
        if isinstance(item, Axioms):
            return self._learn(item, now_ns)
        if isinstance(item, Query):
            answer = self._queries.answer(item, now_ns)
            self.health.count("query_repeated" if answer is None else f"query_{answer.outcome}")
            return [] if answer is None else [answer]
        if isinstance(item, Goal):
            return self._goals.take_goal(item, now_ns)
        if isinstance(item, ActionResult):
            return self._goals.take_result(item, now_ns)
        if not isinstance(item, Scene | Relations | Objects):
            return []
        part = _PART_OF[type(item)]
        if self._scenes.knows(item.scene_id, part):
            self.health.count(f"{part}_repeated")
            return []
        parts = self._scenes.add(item.scene_id, part, item, now_ns)
        return [] if parts is None else self._decide(**parts, now_ns=now_ns)

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Gives up the scenes, and the goal, that waited too long."""
        for scene_id, missing in self._scenes.expired(now_ns):
            names = " and ".join(f"{part} (from {_PUBLISHERS[part]})" for part in missing)
            self.health.problem(
                "scene_incomplete", f"scene {scene_id} is given up: no {names} came"
            )
        for _, missing in self._judged.expired(now_ns):
            self.health.count(f"verdicts_without_{missing[0]}")
        return self._goals.tick(now_ns)

    def jobs(self) -> list[Job]:
        """Plans to make, and outcomes of actions to explain."""
        return self._goals.jobs()

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """Takes a plan, or what an action has led to."""
        return self._goals.finish(job, result, now_ns)

    def close(self) -> None:
        """Closes reasoner.db."""
        self._goals.close()

    def _decide(
        self, scene: Scene, relations: Relations, objects: Objects, now_ns: int
    ) -> list[Outgoing]:
        start = time.perf_counter()
        facts, problems = SceneFacts.checked(
            self._objects(scene, objects),
            map(perceived_relation, relations.relations),
        )
        self._report(scene.scene_id, problems)
        withheld = self._withheld(scene.scene_id, relations)
        result = self._classify(scene.scene_id, facts, withheld)
        self.health.count("scenes_classified")
        beliefs = Beliefs(
            stamp=scene.stamp,
            scene_id=scene.scene_id,
            objects=list(result.objects),
            structures=list(result.structures),
            derived=list(result.derived),
            knowledge_revision=self._knowledge.revision,
            trust_revision=relations.trust_revision,
            retracted=[
                RetractedRelation(
                    relation=each.relation,
                    object=each.object,
                    reference=each.reference,
                    confidence=each.confidence,
                    source=each.source,
                )
                for each in result.retracted
            ],
            conflict=result.conflict,
        )
        timing = Timing("reasoner/classify", (time.perf_counter() - start) * 1e3)
        verdicts = self._judge("beliefs", beliefs, now_ns)
        outgoing: list[Outgoing] = [beliefs, *verdicts, timing]
        domain = self._knowledge.program.description
        if domain is not None:
            doubted = {frozenset((each.object, each.reference)) for each in result.retracted}
            kept = tuple(each for each in facts.relations if each.pair not in doubted)
            believed = replace(facts, relations=kept)
            seen = SeenScene(scene, believed, domain, withheld)
            outgoing += self._goals.take_scene(seen, now_ns)
        return outgoing

    def _withheld(self, scene_id: str, relations: Relations) -> frozenset[str]:
        """Ids of the axioms that are switched off for a scene."""
        if _says_what_hides(relations):
            return self._knowledge.withheld
        self.health.problem(
            "relations_in_robot_frame",
            f"scene {scene_id}: relations are named in the robot's frame alone, so occlusion "
            "stays undecided: have them named in the viewer's frame too",
        )
        axioms = self._session.program.axioms
        about = {axiom.id for axiom in axioms if axiom.task is Task.OCCLUSION}
        return self._knowledge.withheld | about

    def _learn(self, axioms: Axioms, now_ns: int) -> list[Outgoing]:
        """Takes the learned axioms, which are in force from the next scene on."""
        for words in self._knowledge.apply(axioms):
            self.health.problem("axiom_refused", words)
        self._session.program = self._knowledge.program
        return [self._knowledge.message(now_ns)]

    def _report(self, scene_id: str, problems: Iterable[ContentProblem]) -> None:
        """One problem for each kind, however often it occurs in the scene."""
        words: dict[str, list[str]] = {}
        for problem in problems:
            words.setdefault(problem.kind, []).append(problem.words)
        for kind, [first, *others] in words.items():
            more = f" (and {len(others)} more of this kind)" if others else ""
            self.health.problem(kind, f"scene {scene_id}: {first}{more}")
            self.health.count(kind, len(others))

    def _objects(self, scene: Scene, objects: Objects) -> Iterable[SceneObject]:
        reported = {each.name for each in objects.objects}
        missing = [each for each in scene.objects if each.name not in reported]
        if missing:
            names = ", ".join(repr(each.name) for each in missing[:5])
            self.health.problem(
                "object_not_reported",
                f"scene {scene.scene_id}: objects lacks {len(missing)} of the scene's objects "
                f"({names}): they count as not located",
            )
        return [*map(perceived_object, objects.objects), *map(_unreported, missing)]

    def _classify(
        self, scene_id: str, facts: SceneFacts, withheld: frozenset[str]
    ) -> Classification:
        if len(facts.objects) > self.configuration.max_objects:
            self.health.problem(
                "scene_too_large",
                f"scene {scene_id} has {len(facts.objects)} objects and is not classified: raise "
                f"max_objects ({self.configuration.max_objects}) if that is meant",
            )
            return Classification(objects=())
        self._queries.remember(scene_id, facts, self._session.program, withheld)
        try:
            result = self._session.classify(facts, withheld)
        except ReasoningError as error:
            self.health.problem("classification_failed", f"scene {scene_id}: {error}")
            return Classification.nothing(facts.objects, DecisionStatus.UNDECIDED)
        if result.retracted:
            words = ", ".join(
                f"{each.object!r} is {each.relation} {each.reference!r}"
                for each in result.retracted
            )
            self.health.problem(
                "relations_retracted",
                f"scene {scene_id} contradicts itself or the knowledge: not believed is {words}",
            )
        if result.conflict:
            self.health.problem(
                "scene_inconsistent", f"scene {scene_id} is inconsistent: {result.conflict}"
            )
        if any(each.stable.status is DecisionStatus.TIMED_OUT for each in result.objects):
            self.health.problem(
                "classification_timed_out",
                f"scene {scene_id}: no answer within {self.configuration.time_limit_s:g} s",
            )
        return result

    def _judge(self, part: str, item: Beliefs | Labels, now_ns: int) -> list[Outgoing]:
        if self._judged.knows(item.scene_id, part):
            self.health.count(f"{part}_repeated")
            return []
        both = self._judged.add(item.scene_id, part, item, now_ns)
        if both is None:
            return []
        beliefs, labels = both["beliefs"], both["labels"]
        verdicts = judge(beliefs, labels)
        return [
            Verdicts(
                stamp=beliefs.stamp, scene_id=beliefs.scene_id, use=labels.use, verdicts=verdicts
            )
        ]


def _goal_keeper(configuration: ReasonerConfiguration, health: Health) -> GoalKeeper:
    path = state_path(configuration.state_dir, "reasoner.db")
    limits = GoalLimits(
        time_limit_s=configuration.plan_time_limit_s,
        max_steps=configuration.plan_max_steps,
        plans=configuration.plans_per_goal,
        patience_s=configuration.answer_timeout_s,
    )
    return GoalKeeper(GoalLedger(path, health), limits, health)


def _says_what_hides(relations: Relations) -> bool:
    """Whether what is behind what is said as the viewer sees it."""
    of_the_robot = relations.naming_frame is NamingFrame.ROBOT
    return not of_the_robot or all(
        each.viewer_position is not None or each.position not in _DIRECTIONS
        for each in relations.relations
    )


def _unreported(each: KnownObject) -> SceneObject:
    return SceneObject(
        each.name,
        located=False,
        size=each.size,
        surface=each.surface,
        size_source="given",
        surface_source="given",
    )
