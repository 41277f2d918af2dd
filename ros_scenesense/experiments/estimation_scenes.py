"""Scenes as the networks of the experiments on estimation are shown them, each looked at once.

One pass of the loop over a dataset (depth noise, grounding, reasoning with incomplete and with
complete knowledge, attention) keeps all that any network needs, so that a training reads a file
instead of images.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from ros_scenesense.attention.inputs import color_image, pack, query_image
from ros_scenesense.attention.queries import SeenScene, queries_of, regions_of
from ros_scenesense.attention.regions import in_image_order, rectangles
from ros_scenesense.attention.relevance import Relevance, relevance
from ros_scenesense.errors import DatasetError
from ros_scenesense.experiments.estimation_segments import segmented
from ros_scenesense.experiments.estimation_views import (
    Attended,
    Literal,
    Picture,
    Question,
    Reasoned,
    Region,
    View,
)
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.messages.attention import Roi
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.reasoning import Beliefs, Knowledge
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.resources import resource
from ros_scenesense.scene import DecisionStatus, Frame, Task, Truth
from ros_scenesense.simulation.engine import SimulatedScene
from ros_scenesense.stages.active_knowledge import active_description
from ros_scenesense.stages.attention import SIDE
from ros_scenesense.stages.camera_engine import PlayingEngine
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.grounding_engine import GroundingConfiguration, GroundingEngine
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

NOISE = "kinect"
KNOWLEDGE = {"incomplete": "s1,s2,s3,o1,o2,o3", "complete": ""}
"""Axioms that reasoning does without, by the name of what is left."""
SEGMENTED = "segmented"
"""Folder, beside the scenes that were looked at, of those whose objects were segmented."""
LENET_SIDE = 56
ALEXNET_SIDE = 115
"""Half of the paper's 227 pixels: a whole grid of trainings has to fit two cores."""

_TRUTH = {Truth.TRUE: True, Truth.FALSE: False}


class Camera(Protocol):
    """Shows scenes with their truth: a simulation, or a dataset."""

    def scene(self, seed: int, number: int) -> tuple[SimulatedScene, float]:
        """A scene, and how long that took."""


class Looker:
    """Looks at scenes through grounding, reasoning and attention.

    Attributes:
        relevances: What bears on each task, by the names of the knowledge.

    Args:
        camera: Shows the scenes.
        seed: Of the depth noise, and of simulated scenes.
        knowledge: Names of `KNOWLEDGE` that scenes are looked at with.
        segments: Whether objects are told apart by segmentation, see `estimation_segments`,
            instead of by the instance ids of the simulator.
    """

    def __init__(
        self,
        camera: Camera,
        seed: int,
        knowledge: Iterable[str] = tuple(KNOWLEDGE),
        segments: bool = False,
    ) -> None:
        self._camera = camera
        self._seed = seed
        self._segments = segments
        self._grounding = GroundingEngine(GroundingConfiguration())
        self._control = GroundingControlStage(GroundingControlConfiguration())
        self._reasoners = {
            name: ReasonerStage(ReasonerConfiguration(withheld=KNOWLEDGE[name]))
            for name in knowledge
        }
        self.relevances = {name: _relevances(one) for name, one in self._reasoners.items()}

    def close(self) -> None:
        """Closes the stages."""
        self._control.close()
        for reasoner in self._reasoners.values():
            reasoner.close()

    def see(self, number: int) -> tuple[SimulatedScene, dict[str, SeenScene]]:
        """A scene, each only once, and what is known of it, by the names of the knowledge.

        Raises:
            DatasetError: If its files are damaged.
        """
        simulated, _ = self._camera.scene(self._seed, number)
        if self._segments:
            simulated = segmented(simulated, np.random.default_rng([self._seed, number]))
        scene = Scene(
            stamp=Stamp.of(number + 1),
            scene_id=f"estimation-{number:06d}",
            mode="testing",
            objects=simulated.objects,
            camera_pose=simulated.frame.camera_pose,
        )
        grounded = self._grounding.ground(simulated.frame, scene)
        (relations,) = (
            item
            for item in self._control.handle(grounded.groundings, 0)
            if isinstance(item, Relations)
        )
        return simulated, {
            name: SeenScene(
                simulated.frame,
                grounded.instances,
                grounded.objects,
                relations,
                _beliefs(reasoner, scene, grounded.objects, relations),
            )
            for name, reasoner in self._reasoners.items()
        }

    def look(self, number: int) -> View:
        """Looks at a scene, each only once.

        Raises:
            DatasetError: If its files are damaged.
        """
        return self.view(number, *self.see(number))

    def view(self, number: int, simulated: SimulatedScene, seen: dict[str, SeenScene]) -> View:
        """A scene as networks need it, of what `see` gave."""
        whole, one = next(iter(seen.items()))
        boxes = rectangles(one.instances)
        places = {
            each.name: boxes[each.instance] for each in simulated.objects if each.instance in boxes
        }
        order = tuple(in_image_order(places))
        labels = _labels(simulated)
        return View(
            number=number,
            objects=order,
            labels=labels,
            structures=_structures(simulated, order),
            picture=_picture(simulated.frame),
            whole=_whole(one, self.relevances[whole], order),
            reasoned={
                name: _reasoned(each, self.relevances[name], labels, order)
                for name, each in seen.items()
            },
        )


def look_at(
    dataset: Path, numbers: Sequence[int], seed: int, file: Path, segments: bool = False
) -> int:
    """Looks at some scenes and keeps them in a file; how many, for who waits."""
    looker = Looker(PlayingEngine(dataset, NOISE), seed, segments=segments)
    try:
        keep([looker.look(number) for number in numbers], file)
    finally:
        looker.close()
    return len(numbers)


def keep(views: Sequence[View], file: Path) -> None:
    """Writes scenes for `views_in`, all or none."""
    import joblib

    partial = file.with_suffix(".partial")
    joblib.dump(list(views), partial)
    partial.replace(file)


@lru_cache(maxsize=2)
def views_in(folder: Path) -> dict[int, View]:
    """All scenes that `look_at` kept in a folder, by number.

    Raises:
        DatasetError: If there are none.
    """
    import joblib

    views = {
        view.number: view for file in sorted(folder.glob("*.joblib")) for view in joblib.load(file)
    }
    if not views:
        raise DatasetError(f"'{folder}' holds no scene that was looked at")
    return views


def _relevances(reasoner: ReasonerStage) -> dict[Task, Relevance]:
    """What bears on each task, by the axioms that the reasoner has."""
    (knowledge,) = (item for item in reasoner.start(0) if isinstance(item, Knowledge))
    domain = load(resource("asp", "robot_assistant.al")).description
    description = active_description(domain, knowledge)
    return {task: relevance(description, task) for task in Task}


def _beliefs(
    reasoner: ReasonerStage, scene: Scene, objects: Objects, relations: Relations
) -> Beliefs:
    said = [item for part in (scene, objects, relations) for item in reasoner.handle(part, 0)]
    (beliefs,) = (item for item in said if isinstance(item, Beliefs))
    return beliefs


def _labels(scene: SimulatedScene) -> dict[Literal, bool | None]:
    return {
        (label.name, task): _TRUTH.get(truth)
        for label in scene.object_labels
        for task, truth in ((Task.STABILITY, label.stable), (Task.OCCLUSION, label.occluded))
    }


def _structures(
    scene: SimulatedScene, order: Sequence[str]
) -> list[tuple[tuple[str, ...], bool | None]]:
    place = {name: index for index, name in enumerate(order)}
    last = len(order)
    found = [(tuple(one.members), _TRUTH.get(one.stable)) for one in scene.structure_labels]
    return sorted(found, key=lambda one: min(place.get(name, last) for name in one[0]))


def _reasoned(
    scene: SeenScene,
    relevances: Mapping[Task, Relevance],
    labels: Mapping[Literal, bool | None],
    order: Sequence[str],
) -> Reasoned:
    beliefs = {
        (each.name, task): belief
        for each in scene.beliefs.objects
        for task, belief in ((Task.STABILITY, each.stable), (Task.OCCLUSION, each.occluded))
    }
    undecided = {literal for literal, belief in beliefs.items() if belief.value is None}
    lacking = {
        literal
        for literal, belief in beliefs.items()
        if labels.get(literal) is not None and belief.value is not labels[literal]
    }
    defaults = {
        literal for literal, belief in beliefs.items() if belief.status is DecisionStatus.BY_DEFAULT
    }
    asked = _attended(scene, relevances, undecided, order)
    return Reasoned(
        beliefs=beliefs,
        undecided=asked,
        lacking=asked if lacking == undecided else _attended(scene, relevances, lacking, order),
        defaults=_questions(scene, relevances, _rois(scene, relevances, defaults)),
    )


def _attended(
    scene: SeenScene,
    relevances: Mapping[Task, Relevance],
    literals: Iterable[Literal],
    order: Sequence[str],
) -> Attended:
    rois = _rois(scene, relevances, literals)
    regions = [
        Region(
            task=roi.task,
            objects=tuple(name for name in order if name in roi.objects),
            targets=tuple(roi.targets),
            picture=_picture(scene.frame, roi),
        )
        for roi in rois
    ]
    return Attended(regions, _questions(scene, relevances, rois))


def _rois(
    scene: SeenScene, relevances: Mapping[Task, Relevance], literals: Iterable[Literal]
) -> list[Roi]:
    targets: dict[Task, set[str]] = {task: set() for task in Task}
    for name, task in literals:
        targets[task].add(name)
    return [
        roi
        for task, names in targets.items()
        if names
        for roi in regions_of(scene, relevances[task], names)
    ]


def _questions(
    scene: SeenScene, relevances: Mapping[Task, Relevance], rois: Sequence[Roi]
) -> list[Question]:
    return [
        Question(query.task, query.target, pack(query.image), query.numbers)
        for query in queries_of(scene, relevances, rois, SIDE)
    ]


def _whole(
    scene: SeenScene, relevances: Mapping[Task, Relevance], order: Sequence[str]
) -> list[Question]:
    """The same channels and numbers as ours, but of the whole image and of every object."""
    height, width = scene.instances.shape
    whole = Roi(
        task=Task.STABILITY,
        left=0,
        top=0,
        width=width,
        height=height,
        objects=list(order),
        targets=list(order),
        axioms=[],
        relations=[],
    )
    instance = {each.name: each.instance for each in scene.objects.objects}
    numbers = {
        query.target: query.numbers for query in queries_of(scene, relevances, [whole], SIDE)
    }
    found = []
    for name in order:
        others = [instance[other] for other in order if other != name]
        image = query_image(scene.frame, scene.instances, whole, instance[name], others, SIDE)
        found.append(Question(Task.STABILITY, name, pack(image), numbers[name]))
    return found


def _picture(frame: Frame, roi: Roi | None = None) -> Picture:
    small, large = (
        np.rint(color_image(frame.color, side, roi) * np.float32(255.0)).astype(np.uint8)
        for side in (LENET_SIDE, ALEXNET_SIDE)
    )
    return Picture(small, large)
