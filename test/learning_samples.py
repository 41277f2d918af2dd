"""Scenes whose labels follow from rules, for tests of learning."""

import numpy as np

from ros_scenesense.geometry import Box, Pose
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.learning.examples import Example
from ros_scenesense.learning.examples import SceneState as State
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import (
    Objects,
    PerceivedObject,
    Relation,
    Relations,
    SizeAttribute,
    SurfaceAttribute,
)
from ros_scenesense.messages.scenes import KnownObject, Labels, ObjectLabel, Scene
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.reasoning.scene_states import SceneStates
from ros_scenesense.resources import resource
from ros_scenesense.scene import Distance, NamingFrame, Position, Size, Surface, Truth

DOMAIN = load(resource("asp", "robot_assistant.al")).description
RELEVANT = {
    "stable": {"in", "above", "touching"},
    "occluded": {"in", "above", "below", "front", "behind", "left", "right"},
}
_STATES = SceneStates(DOMAIN)


def random_facts(generator):
    """Two stacks of up to three objects each, one beside or behind the other."""
    count = int(generator.integers(3, 6))
    cut = int(generator.integers(1, count))
    names = [f"o{index}" for index in range(count)]
    sizes, surfaces = list(Size), list(Surface)
    objects = [
        SceneObject(
            name,
            size=sizes[int(generator.integers(3))],
            surface=surfaces[int(generator.integers(4) == 0)],
        )
        for name in names
    ]
    stacks = [range(cut), range(cut, count)]
    between = (Position.LEFT, Position.RIGHT, Position.BEHIND, Position.FRONT)
    aside = between[int(generator.integers(4))]
    relations = []
    for one in range(count):
        for other in range(one):
            together = any(one in stack and other in stack for stack in stacks)
            position = Position.ABOVE if together else aside
            touching = together and one == other + 1
            distance = Distance.TOUCHING if touching else Distance.NOT_TOUCHING
            relations.append(PairRelation(names[one], names[other], position, distance))
    return SceneFacts.checked(objects, relations)[0]


def state_of(facts):
    return State(tuple(each.name for each in facts.objects), _STATES.of(facts))


def truth(fluent, state, target):
    """What the withheld axioms say, defaults as if they were strict."""
    has = {name for name, arguments in state.facts if arguments[:1] == (target,)}
    if fluent == "stable":
        return not ({"irregular_below", "small_base"} & has)
    return "behind" in has and "above" not in has


def examples(fluent, scenes, seed=0, flip=0.0):
    """All objects of some scenes, a share of them labelled wrongly."""
    generator = np.random.default_rng(seed)
    found = []
    for number in range(scenes):
        state = state_of(random_facts(generator))
        for target in range(len(state.names)):
            label = truth(fluent, state, target) != (generator.random() < flip)
            found.append(Example(f"scene-{number}", state, target, bool(label)))
    return found


def scene_messages(number, facts):
    """What the graph says of a scene, with labels by the rules."""
    stamp = Stamp.of(1_000_000_000 + number)
    scene_id = f"s-{number}"
    state = state_of(facts)
    names = [each.name for each in facts.objects]
    labels = [
        ObjectLabel(
            name=name,
            stable=Truth(str(truth("stable", state, index)).lower()),
            occluded=Truth(str(truth("occluded", state, index)).lower()),
        )
        for index, name in enumerate(names)
    ]
    return [
        Scene(
            stamp=stamp,
            scene_id=scene_id,
            mode="training",
            objects=[KnownObject(instance=i + 1, name=name) for i, name in enumerate(names)],
        ),
        Objects(
            stamp=stamp,
            scene_id=scene_id,
            frame_id="camera",
            objects=[
                PerceivedObject(
                    instance=index + 1,
                    name=each.name,
                    points=100,
                    box=_BOX,
                    size=SizeAttribute(value=each.size, source="given"),
                    surface=SurfaceAttribute(value=each.surface, source="given"),
                )
                for index, each in enumerate(facts.objects)
            ],
        ),
        Relations(
            stamp=stamp,
            scene_id=scene_id,
            naming_frame=NamingFrame.VIEWER,
            relations=[
                Relation(
                    object=each.object,
                    reference=each.reference,
                    position=each.position,
                    position_confidence=1.0,
                    position_source="qsr",
                    distance=each.distance,
                    distance_confidence=1.0,
                    distance_source="qsr",
                )
                for each in facts.relations
            ],
            disagreements=0,
            trust_qsr=1.0,
            trust_msr=1.0,
            trust_revision=0,
        ),
        Labels(stamp=stamp, scene_id=scene_id, use="train", objects=labels, structures=[]),
    ]


def scenes(count, seed=0, first=0):
    """The messages of some random scenes."""
    generator = np.random.default_rng(seed)
    for number in range(first, first + count):
        yield from scene_messages(number, random_facts(generator))


_BOX = Box(pose=Pose((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)), size=(0.1, 0.1, 0.1))


def texts(learner):
    """The learned axioms in words."""
    return [str(each.axiom) for each in learner.axioms_]
