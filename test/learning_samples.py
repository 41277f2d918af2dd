"""Scenes whose labels follow from rules, for tests of learning."""

import numpy as np

from ros_scenesense.knowledge.action_language import load
from ros_scenesense.learning.examples import Example
from ros_scenesense.learning.examples import SceneState as State
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.reasoning.scene_states import SceneStates
from ros_scenesense.resources import resource
from ros_scenesense.scene import Distance, Position, Size, Surface

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
