"""Attention: where reasoning is undecided, the axioms say where to look, and a network answers.

Joins the images and the objects of a scene with what reasoning believes of it, cuts out the regions
of interest, asks the network, and publishes the final decisions. Of labelled scenes, what reasoning
left undecided or got wrong becomes examples, on which the network is trained.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ros_scenesense.attention.estimator import Answers, Estimator, measured_purity
from ros_scenesense.attention.queries import Query, SeenScene, queries_of, regions_of
from ros_scenesense.attention.relevance import relevance
from ros_scenesense.errors import LanguageError, NetworkError
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.messages.attention import Estimates, Roi, Rois
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, Verdicts
from ros_scenesense.parameters import parameter
from ros_scenesense.resources import resource
from ros_scenesense.scene import Frame, Task, Truth
from ros_scenesense.stages.active_knowledge import active_description
from ros_scenesense.stages.attention_engine import AttentionEngine
from ros_scenesense.stages.attention_lessons import conclusions_of, examples_of, lacking_of
from ros_scenesense.stages.attention_store import AttentionStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.join import LATE_COMERS, SceneJoin
from ros_scenesense.stages.network_training import NetworkTraining
from ros_scenesense.stages.protocol import (
    Figure,
    Incoming,
    Job,
    JobFailure,
    Outgoing,
    Segmentation,
    Timing,
)
from ros_scenesense.stages.state_file import state_path

SIDE = 32
"""Pixels of the inputs of the query network."""
LARGEST_POOL = 1_000_000
"""Examples that can be kept at most."""
_PUBLISHERS = {
    "frame": "the camera's images",
    "segmentation": "segmentation (from grounding)",
    "objects": "objects (from grounding)",
    "relations": "relations (from grounding_control)",
    "beliefs": "beliefs (from reasoner)",
}
_PART_OF: dict[type[Incoming], str] = {
    Frame: "frame",
    Segmentation: "segmentation",
    Objects: "objects",
    Relations: "relations",
    Beliefs: "beliefs",
}
_COLUMN = {Task.STABILITY: 0, Task.OCCLUSION: 1}


@dataclass(frozen=True)
class AttentionConfiguration:
    """Parameters of the attention node."""

    network: str = parameter(
        "shipped",
        "network at the start: shipped, the one that comes with SceneSense; a file of `scenesense "
        "train`; or none. One that was trained here comes first",
    )
    defaults: str = parameter(
        "decide",
        "what a default concludes stands, or the network may overrule it where it is surer",
        choices=("decide", "overrule"),
    )
    confidence: float = parameter(
        0.5, "the network abstains below this probability", minimum=0.5, maximum=1.0
    )
    train_every: int = parameter(
        0, "new examples after which the network is trained; 0 = on the service alone", minimum=0
    )
    pool_examples: int = parameter(
        5000,
        "examples to train on, the newest ones; 1000 need 100 MB of memory",
        minimum=10,
        maximum=LARGEST_POOL,
    )
    iterations: int = parameter(1500, "batches of a training at most", minimum=1)
    device: str = parameter("cpu", "where networks are trained: cpu, cuda, cuda:1, ...")
    seed: int = parameter(0, "seed of all training; same examples, same network", minimum=0)
    join_timeout_s: float = parameter(
        10.0, "seconds that a scene waits for all its parts", minimum=0.1, maximum=3600.0
    )
    job_deadline_s: float = parameter(
        10.0, "seconds that a network may take to answer", minimum=0.1, maximum=600.0
    )
    state_dir: str = parameter(
        "", "folder of attention.db and networks/; empty = nothing is remembered"
    )


class AttentionStage:
    """Decides every scene once, and learns from labelled ones.

    Raises:
        StateError: If the state file cannot be used.
        LanguageError: If the domain is missing or broken.
    """

    def __init__(self, configuration: AttentionConfiguration) -> None:
        self.configuration = configuration
        self.health = Health()
        self._domain = load(resource("asp", "robot_assistant.al")).description
        self._relevances = {task: relevance(self._domain, task) for task in Task}
        self._store = AttentionStore(
            state_path(configuration.state_dir, "attention.db"),
            self.health,
            SIDE,
            configuration.pool_examples,
        )
        self._training = NetworkTraining(
            self._store,
            configuration.state_dir,
            configuration.network,
            self.health,
            side=SIDE,
            iterations=configuration.iterations,
            device=configuration.device,
            seed=configuration.seed,
        )
        self._purity = measured_purity(self._store.conclusions())
        timeout_s = configuration.join_timeout_s
        self._parts = SceneJoin(
            tuple(_PUBLISHERS), timeout_s, LATE_COMERS, bulky=("frame", "segmentation")
        )
        self._judged = SceneJoin(("seen", "verdicts"), 2 * timeout_s, LATE_COMERS, bulky=("seen",))
        # After a restart topics bring their parts again, but images only if somebody waits for it.
        self._decided_before = self._store.decided()
        self._waiting: dict[int, Beliefs] = {}
        self._asked: dict[str, tuple[SeenScene, list[Query]]] = {}
        self._jobs: list[Job] = []

    def engine(self) -> Callable[[], Any] | None:
        """A factory of the engine that asks and trains networks."""
        network = self._training.network
        return partial(AttentionEngine, None if network is None else network.file)

    def start(self, now_ns: int) -> list[Outgoing]:
        """Nothing is published before a scene came."""
        del now_ns
        return []

    def handle(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        """Takes what belongs to a scene in any order, `verdicts`, and `knowledge`."""
        if isinstance(item, Knowledge):
            return self._know(item)
        if isinstance(item, Verdicts):
            return self._join_judged(item.scene_id, "verdicts", item, now_ns)
        part = _PART_OF.get(type(item))
        if part is None:
            return []
        stamp_ns = item.stamp_ns if isinstance(item, Frame | Segmentation) else _stamp_of(item)
        if self._parts.knows(stamp_ns, part):
            self.health.count(f"{part}_repeated")
            return []
        if isinstance(item, Beliefs):
            self._waiting[stamp_ns] = item
        parts = self._parts.add(stamp_ns, part, item, now_ns)
        if parts is None:
            return []
        del self._waiting[stamp_ns]
        return self._look(parts, now_ns)

    def tick(self, now_ns: int) -> list[Outgoing]:
        """Decides by reasoning alone what waited too long for its images.

        What was decided before a restart is not decided again, unless it is shown again.
        """
        decided: list[Beliefs] = []
        for stamp_ns, missing in self._parts.expired(now_ns):
            beliefs = self._waiting.pop(int(str(stamp_ns)), None)
            if "frame" in missing and stamp_ns in self._decided_before:
                self.health.count("scenes_decided_before")
                continue
            names = " and ".join(_PUBLISHERS[part] for part in missing)
            if beliefs is None:
                words = f"a scene is given up: no {names} came"
            else:
                words = f"scene {beliefs.scene_id} is decided by reasoning alone: no {names} came"
                decided.append(beliefs)
            self.health.problem("scene_incomplete", words)
        for _, missing in self._judged.expired(now_ns):
            self.health.count(f"examples_without_{missing[0]}")
        if decided:
            self._store.record_decisions(map(_stamp_of, decided))
        return [item for beliefs in decided for item in self._estimates(beliefs, {})]

    def train(self, now_ns: int) -> tuple[str | None, str]:
        """Begins a training on all examples.

        Returns:
            The id of the job, or None; and the same in words for the caller.
        """
        return self._training.begin(now_ns)

    def jobs(self) -> list[Job]:
        """Queries, and the next piece of a training."""
        # Scenes first: a training can wait.
        jobs = self._jobs + self._training.jobs
        self._jobs, self._training.jobs = [], []
        return jobs

    def finish(self, job: Job, result: Any, now_ns: int) -> list[Outgoing]:
        """Takes the network's answers, or the state of a training."""
        if job.method == "answer":
            return self._decide(job.key, result)
        progress = self._training.advance(result, now_ns)
        return [] if progress is None else [progress]

    def close(self) -> None:
        """Closes the state file."""
        self._store.close()
        self._training.close()

    # --- Scenes.

    def _know(self, knowledge: Knowledge) -> list[Outgoing]:
        try:
            description = active_description(self._domain, knowledge)
        except LanguageError as error:
            self.health.problem("knowledge_refused", f"knowledge is ignored: {error}")
            return []
        self._relevances = {task: relevance(description, task) for task in Task}
        return []

    def _look(self, parts: dict[str, Any], now_ns: int) -> list[Outgoing]:
        start = time.perf_counter()
        instances = parts.pop("segmentation").instances
        scene = SeenScene(instances=instances, **parts)
        scene_id = scene.beliefs.scene_id
        doubt = self.configuration.defaults == "overrule"
        rois = self._regions(scene, {task: scene.undecided(task, doubt) for task in Task})
        published: list[Outgoing] = [
            Rois(
                stamp=scene.beliefs.stamp,
                scene_id=scene_id,
                knowledge_revision=scene.beliefs.knowledge_revision,
                rois=rois,
            ),
        ]
        queries = self._queries(scene, rois)
        published.append(Timing("attention/regions", (time.perf_counter() - start) * 1e3))
        self._asked[scene_id] = (scene, queries)
        network = self._training.network
        if queries and network is not None:
            images = np.stack([query.image for query in queries])
            numbers = np.stack([query.numbers for query in queries])
            arguments = (network.file, images, numbers)
            deadline_s = self.configuration.job_deadline_s
            self._jobs.append(Job(scene_id, "answer", arguments, deadline_s, droppable=True))
        else:
            published += self._decide(scene_id, None)
        return published + self._join_judged(scene_id, "seen", scene, now_ns)

    def _regions(self, scene: SeenScene, targets: dict[Task, set[str]]) -> list[Roi]:
        return [
            roi
            for task in Task
            if targets[task]
            for roi in regions_of(scene, self._relevances[task], targets[task])
        ]

    def _queries(self, scene: SeenScene, rois: Sequence[Roi]) -> list[Query]:
        try:
            return queries_of(scene, self._relevances, rois, SIDE)
        except NetworkError as error:
            self.health.problem("not_asked", f"scene {scene.beliefs.scene_id}: {error}")
            return []

    def _decide(self, scene_id: str, result: Any) -> list[Outgoing]:
        """The final decisions; `result` are the network's answers, None where it was not asked."""
        scene, queries = self._asked.pop(scene_id)
        answers: dict[tuple[str, Task], float | None] = {}
        if isinstance(result, JobFailure):
            kind = "queries_dropped" if result.dropped else "network_failed"
            self.health.problem(
                kind, f"scene {scene_id} is decided without network: {result.reason}"
            )
            if result.timed_out:
                answers = {(query.target, query.task): None for query in queries}
        elif result is not None:
            for query, row in zip(queries, result, strict=True):
                answers[query.target, query.task] = float(row[_COLUMN[query.task]])
        self._store.record_decisions([_stamp_of(scene.beliefs)])
        return self._estimates(scene.beliefs, answers)

    def _estimates(self, beliefs: Beliefs, answers: Answers) -> list[Outgoing]:
        estimator = Estimator(
            "overrule" if self.configuration.defaults == "overrule" else "decide",
            self.configuration.confidence,
            self._purity,
        )
        objects = estimator.objects(beliefs, answers)
        self.health.count("scenes_decided")
        answered = sum(probability is not None for probability in answers.values())
        self.health.count("literals_asked", answered)
        network = self._training.network
        used = None if network is None or not answered else network.revision
        return [
            Estimates(
                stamp=beliefs.stamp,
                scene_id=beliefs.scene_id,
                objects=objects,
                structures=estimator.structures(beliefs, objects),
                knowledge_revision=beliefs.knowledge_revision,
                trust_revision=beliefs.trust_revision,
                network_revision=used,
            )
        ]

    # --- Learning.

    def _join_judged(
        self, scene_id: str, part: str, item: SeenScene | Verdicts, now_ns: int
    ) -> list[Outgoing]:
        if self._judged.knows(scene_id, part):
            self.health.count(f"{part}_repeated")
            return []
        both = self._judged.add(scene_id, part, item, now_ns)
        if both is None or both["verdicts"].use != "train":
            return []
        return self._learn(both["seen"], both["verdicts"], now_ns)

    def _learn(self, scene: SeenScene, verdicts: Verdicts, now_ns: int) -> list[Outgoing]:
        lacking = lacking_of(verdicts)
        targets = {task: {name for name, other in lacking if other is task} for task in Task}
        queries = self._queries(scene, self._regions(scene, targets))
        labelled = [
            (query, lacking[query.target, query.task].label is Truth.TRUE) for query in queries
        ]
        if not self._store.add(
            verdicts.scene_id, conclusions_of(scene.beliefs, verdicts), labelled
        ):
            self.health.count("scenes_judged_before")
            return []
        self._purity = measured_purity(self._store.conclusions())
        self.health.count("examples", len(labelled))
        published: list[Outgoing] = [
            examples_of(scene.beliefs.knowledge_revision, verdicts, labelled),
            Figure("attention/examples", self._store.example_count),
        ]
        every = self.configuration.train_every
        if 0 < every <= self._training.new_examples and not self._training.under_way:
            self._training.begin(now_ns)
        return published


def _stamp_of(item: Any) -> int:
    return int(item.stamp.nanoseconds)
