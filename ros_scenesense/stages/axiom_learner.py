"""The axiom learner: of labelled scenes it learns axioms, and forgets those that do not hold.

Joins what was perceived of a scene with what reasoning decided and how right that was. Every so
many new labelled scenes, or when asked, it runs a cycle in its engine (paper, Algorithm 1), and
publishes the axioms, which the reasoner takes like any knowledge.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ros_scenesense.attention.relevance import relevance
from ros_scenesense.errors import ReasoningError
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.learning.examples import SceneState
from ros_scenesense.messages.actions import Transition
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, Relations, Trust
from ros_scenesense.messages.learning import AxiomRequest, AxiomResult
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, Verdicts
from ros_scenesense.parameters import parameter
from ros_scenesense.reasoning.described_scenes import perceived_object, perceived_relation
from ros_scenesense.reasoning.facts import SceneFacts
from ros_scenesense.reasoning.program import FLUENTS
from ros_scenesense.reasoning.scene_states import SceneStates
from ros_scenesense.resources import resource
from ros_scenesense.stages.axiom_keeper import (
    answer_to,
    changes_of_cycle,
    message_of,
    progress_of,
    words_of_cycle,
)
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.join import LATE_COMERS, SceneJoin
from ros_scenesense.stages.labelled_literals import labelled_literals
from ros_scenesense.stages.learner_store import LearnerStore
from ros_scenesense.stages.learning_engine import LearningEngine, LearningOrder, Task, suspended
from ros_scenesense.stages.outcome_desk import OutcomeDesk
from ros_scenesense.stages.protocol import Figure, Incoming, Job, JobFailure, Outgoing, Timing
from ros_scenesense.stages.state_file import state_path

_PART_OF: dict[type[Incoming], str] = {
    Objects: "objects",
    Relations: "relations",
    Beliefs: "beliefs",
    Verdicts: "verdicts",
}
_FEWEST_FEEDBACKS = 20
_LARGEST_SLACK = 0.05


@dataclass(frozen=True)
class AxiomLearnerConfiguration:
    """Parameters of the axiom learner node."""

    algorithm: str = parameter(
        "covering",
        "covering: short bodies, one axiom after the other; paper: its Algorithm 1",
        choices=("covering", "paper"),
    )
    cycle_scenes: int = parameter(
        60,
        "new labelled scenes after which a cycle begins; 0 = on the service alone",
        minimum=0,
        maximum=100_000,
    )
    merge_scenes: int = parameter(
        10, "of these so many choose between versions of axioms", minimum=1, maximum=1000
    )
    pool_scenes: int = parameter(
        200, "labelled scenes to learn from, the newest ones", minimum=1, maximum=10_000
    )
    purity: float = parameter(
        0.95, "share of examples that a normal axiom is true of", minimum=0.5, maximum=1.0
    )
    default_purity: float = parameter(
        0.70, "the same of a default; 1 = no defaults are learned", minimum=0.5, maximum=1.0
    )
    trees: int = parameter(100, "trees of the ensemble", minimum=1, maximum=10_000)
    reinforce: str = parameter(
        "used_right",
        "what an axiom is reinforced by besides being learned again: that it was used (the paper), "
        "or that what it alone decided was right as often as is asked of an axiom of its kind",
        choices=("used", "used_right"),
    )
    relevant_only: bool = parameter(
        True, "learn from the relations alone that the given axioms make relevant"
    )
    learn_when_surprised: bool = parameter(
        True, "begin a cycle at once when an action of the robot had an unexpected outcome"
    )
    seed: int = parameter(0, "seed of all that is random; same scenes, same axioms", minimum=0)
    join_timeout_s: float = parameter(
        20.0, "seconds to wait for the other messages of a scene", minimum=0.1, maximum=3600.0
    )
    deadline_s: float = parameter(
        120.0, "seconds that a cycle may take", minimum=1.0, maximum=3600.0
    )
    state_dir: str = parameter("", "folder of learner.db; empty = nothing is remembered")


class AxiomLearnerStage:
    """Learns from every labelled scene once.

    Raises:
        StateError: If learner.db cannot be used.
        LanguageError: If the domain is missing or broken.
        ReasoningError: If it cannot be translated.
    """

    def __init__(self, configuration: AxiomLearnerConfiguration) -> None:
        self.configuration = configuration
        self.health = Health()
        self._domain = load(resource("asp", "robot_assistant.al")).description
        self._states = SceneStates(self._domain)
        self._store = LearnerStore(
            state_path(configuration.state_dir, "learner.db"),
            self.health,
            max(configuration.pool_scenes, configuration.cycle_scenes),
        )
        self._outcomes = OutcomeDesk(self._store, self._domain, self._states, self.health)
        timeout_s = configuration.join_timeout_s
        self._scenes = SceneJoin(tuple(_PART_OF.values()), timeout_s, LATE_COMERS)
        self._given: frozenset[str] | None = None
        self._trust: Trust | None = None
        self._cycle: tuple[str, list[int]] | None = None
        self._jobs: list[Job] = []
        self._surprised = self._by_surprise = False

    def engine(self) -> Callable[[], Any] | None:
        """A factory of what learns."""
        return LearningEngine

    def start(self, now_ns: int) -> list[Outgoing]:
        """Publishes the axioms of before."""
        return self._axioms(now_ns)

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes the parts of scenes in any order, knowledge, trust, and what people ask."""
        if isinstance(item, Knowledge):
            self._given = frozenset(each.id for each in item.axioms if each.origin == "given")
            return []
        if isinstance(item, Trust):
            self._trust = item
            return []
        if isinstance(item, AxiomRequest):
            return self._answer(item, now_ns)
        if isinstance(item, Transition):
            self._surprised |= self._outcomes.take(item)
            return self._learn_if_surprised(now_ns)
        if not isinstance(item, Objects | Relations | Beliefs | Verdicts):
            return []
        part = _PART_OF[type(item)]
        if self._scenes.knows(item.scene_id, part):
            self.health.count(f"{part}_repeated")
            return []
        parts = self._scenes.add(item.scene_id, part, item, now_ns)
        return [] if parts is None else self._keep(**parts, now_ns=now_ns)

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Gives up scenes that have no labels, or lack something else."""
        for _, missing in self._scenes.expired(now_ns):
            self.health.count(f"scenes_without_{missing[0]}")
        return []

    def learn(self, now_ns: int) -> tuple[str | None, str]:
        """Begins a cycle.

        Returns:
            The id of the job, or None; and the same in words for the caller.
        """
        if self._cycle is not None:
            return None, f"{self._cycle[0]} is under way"
        pool = self._store.scenes()[-self.configuration.pool_scenes :]
        if len(pool) < 2 and not self._store.trials.all():
            return None, "there are no labelled scenes to learn from: show some in training mode"
        new = set(self._store.scenes(new_only=True)) & set(pool)
        generator = np.random.default_rng([self.configuration.seed, self._store.cycle])
        count = min(self.configuration.merge_scenes, len(pool) // 2)
        candidates = sorted(new) if len(new) > count else pool
        judging = sorted(map(int, generator.choice(candidates, count, replace=False)))
        inducing = [number for number in pool if number not in judging]
        name = f"cycle-{self._store.cycle + 1}-{now_ns}"
        self._cycle = (name, sorted(new))
        arguments = (self._order(inducing, judging, sorted(new)),)
        self._jobs.append(Job(name, "learn", arguments, self.configuration.deadline_s))
        return name, f"{name} learns from {len(inducing)} scenes, {len(judging)} judge"

    def jobs(self) -> list[Job]:
        """The cycle that begins now."""
        jobs, self._jobs = self._jobs, []
        return jobs

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """Takes what a cycle found."""
        del job
        if self._cycle is None:
            return []
        (name, new), self._cycle = self._cycle, None
        if isinstance(result, JobFailure):
            words = f"{name} failed, the axioms stay as they are: {result.reason}"
            self.health.problem("learning_failed", words)
            return [progress_of(name, "failed", words, now_ns)]
        for problem in result.problems:
            if self._by_surprise:  # nobody has asked for a cycle
                self.health.count("not_learned")
            else:
                self.health.problem("not_learned", problem)
        self._by_surprise = False
        taken = {axiom.id for axiom in self._domain.axioms}
        changes = changes_of_cycle(result, self._store, taken)
        self._store.finish_cycle(changes, new, now_ns)
        self.health.count("cycles")
        for axiom, words in changes.refuted.items():
            problem = f"given axiom {axiom!r} is put out of force: {words}"
            self.health.problem("given_refuted", problem)
        done = progress_of(name, "done", words_of_cycle(changes, result.problems), now_ns)
        return [done, *self._axioms(now_ns), *self._learn_if_surprised(now_ns)]

    def close(self) -> None:
        """Closes learner.db."""
        self._store.close()

    # --- Scenes.

    def _keep(
        self,
        objects: Objects,
        relations: Relations,
        beliefs: Beliefs,
        verdicts: Verdicts,
        now_ns: int,
    ) -> list[Outgoing]:
        if verdicts.use != "train":
            return []
        start = time.perf_counter()
        if beliefs.retracted or beliefs.conflict:
            self.health.count("scenes_contradictory")
            return []
        state = self._state(objects, relations)
        if state is None:
            self.health.count("scenes_not_known_completely")
            return []
        literals = labelled_literals(verdicts, state.names)
        if not self._store.add_scene(
            verdicts.scene_id, state, literals, self._used(beliefs, verdicts)
        ):
            self.health.count("scenes_kept_before")
            return []
        self.health.count("scenes_kept")
        timing = Timing("axiom_learner/keep", (time.perf_counter() - start) * 1e3)
        every = self.configuration.cycle_scenes
        if 0 < every <= len(self._store.scenes(new_only=True)) and self._cycle is None:
            name, words = self.learn(now_ns)
            if name is not None:
                return [timing, progress_of(name, "running", words, now_ns)]
        return [timing]

    def _state(self, objects: Objects, relations: Relations) -> SceneState | None:
        facts, problems = SceneFacts.checked(
            map(perceived_object, objects.objects), map(perceived_relation, relations.relations)
        )
        if problems:
            return None
        try:
            atoms = self._states.of(facts)
        except ReasoningError as error:
            self.health.problem("state_unknown", f"scene {objects.scene_id}: {error}")
            return None
        names = tuple(each.name for each in facts.objects)
        return None if atoms is None else SceneState(names, atoms)

    def _used(self, beliefs: Beliefs, verdicts: Verdicts) -> list[tuple[str, bool]]:
        """The axioms that decided something in this scene, each with whether that was right.

        Where any use reinforces, every use counts, as a right one; else only where no other axiom
        decided the same: who says nothing that others do not say is not needed.
        """
        right = {
            (each.subject[0], each.task): each.verdict == "right"
            for each in verdicts.verdicts
            if each.kind == "object" and each.verdict in ("right", "wrong")
        }
        any_use = self.configuration.reinforce == "used"
        return [
            (axiom, any_use or right[each.name, task])
            for each in beliefs.objects
            for fluent, task in FLUENTS.items()
            if (each.name, task) in right
            for axioms in ((each.stable if fluent == "stable" else each.occluded).axioms,)
            if any_use or len(axioms) == 1
            for axiom in axioms
        ]

    def _learn_if_surprised(self, now_ns: int) -> list[Outgoing]:
        if not (self._surprised and self.configuration.learn_when_surprised) or self._cycle:
            return []
        self._surprised = False
        name, words = self.learn(now_ns)
        self._by_surprise = name is not None
        return [] if name is None else [progress_of(name, "running", words, now_ns)]

    # --- Learning.

    def _order(self, inducing: list[int], judging: list[int], new: list[int]) -> LearningOrder:
        configuration = self.configuration
        description = self._domain.without(self._out_of_force())
        tasks = []
        for fluent, task in FLUENTS.items():
            if not judging:
                break
            relevant = None
            if configuration.relevant_only:
                relevant = frozenset(relevance(description, task).relations)
            parts = (inducing, judging, new)
            examples, judged, latest = (self._store.examples(fluent, part) for part in parts)
            recent = frozenset(each.scene_id for each in latest)
            tasks.append(Task(fluent, relevant, examples, judged, recent))
        active = self._store.axioms("active")
        return LearningOrder(
            description=description,
            learned={each.id: each.text for each in active},
            pinned=frozenset(each.id for each in active if each.pinned),
            vetoed=[each.text for each in self._store.axioms("vetoed")],
            tasks=tasks,
            suspended=suspended(self._domain, self._store.refuted()),
            algorithm="paper" if configuration.algorithm == "paper" else "covering",
            purity=configuration.purity,
            default_purity=(
                None if configuration.default_purity >= 1.0 else configuration.default_purity
            ),
            slack=self._slack(),
            trees=configuration.trees,
            seed=configuration.seed,
            trials=self._store.trials.all(),
        )

    def _out_of_force(self) -> set[str]:
        """Given axioms that decide, but not now: withheld or refuted."""
        deciding = {
            axiom.id
            for axiom in self._domain.axioms
            if isinstance(axiom, StateConstraint | Default) and axiom.head.atom.name in FLUENTS
        }
        if self._given is None:
            return set(self._store.refuted()) & deciding
        return deciding - self._given | (set(self._store.refuted()) & deciding)

    def _slack(self) -> float:
        """The share of relations that are wrong, as far as people's feedback tells."""
        if self._trust is None or self._trust.feedback_count < _FEWEST_FEEDBACKS:
            return 0.0
        return min(_LARGEST_SLACK, 1.0 - max(self._trust.qsr, self._trust.msr))

    def _answer(self, request: AxiomRequest, now_ns: int) -> list[Outgoing]:
        name = request.id or f"{request.request}-{request.axiom}-{self._store.revision}"
        known = self._store.answer(name)
        changed = False
        if known is None:
            outcome, reason, changes = answer_to(request, self._store)
            self._store.finish_request(name, outcome, reason, changes, now_ns)
            changed = changes is not None
        else:
            outcome, reason = known
            self.health.count("requests_repeated")
        result = AxiomResult(
            stamp=Stamp.of(now_ns), id=name, axiom=request.axiom, outcome=outcome, reason=reason
        )
        return [result, *(self._axioms(now_ns) if changed else [])]

    def _axioms(self, now_ns: int) -> list[Outgoing]:
        message = message_of(self._store, now_ns)
        return [message, Figure("axiom_learner/axioms", len(message.axioms))]
