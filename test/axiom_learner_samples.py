"""The axiom learner in a chain with the reasoner, and orders for its engine."""

import itertools

from learning_samples import DOMAIN, RELEVANT, examples

from ros_scenesense.parameters import build
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.stages.axiom_learner import AxiomLearnerConfiguration, AxiomLearnerStage
from ros_scenesense.stages.learning_engine import (
    LearningOrder,
    Task,
)
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

WITHHELD = "s1,s2,s3,o1,o2,o3"
O1 = "-occluded(A) if not behind(A, B)."
S2 = "-stable(A) if irregular_below(A)."


def learner(**values):
    settings = {"cycle_scenes": 30, "merge_scenes": 5, "trees": 20} | values
    return AxiomLearnerStage(build(AxiomLearnerConfiguration, settings))


def chain(stage, messages, withheld=WITHHELD):
    """All that reasoner and learner publish, given what the graph says of some scenes."""
    reasoner = ReasonerStage(ReasonerConfiguration(withheld=withheld))
    pipeline = Pipeline([reasoner, stage], itertools.count(1).__next__)
    published = []
    for message in messages:
        pipeline.put(message)
        published += pipeline.run()
    return published


def order(given="", learned=(), **values):
    """An order about occlusion; `given` is more knowledge."""
    from ros_scenesense.knowledge.action_language import parse

    description = DOMAIN.without(WITHHELD.split(","))
    if given:
        description = parse(given, "given", description).description
    found = examples("occluded", 50, seed=3)
    ids = list(dict.fromkeys(each.scene_id for each in found))
    judging = [each for each in found if each.scene_id in ids[:10]]
    task = Task(
        "occluded",
        frozenset(RELEVANT["occluded"]),
        [each for each in found if each.scene_id not in ids[:10]],
        judging,
    )
    return LearningOrder(description, dict(learned), frozenset(), (), (task,), trees=20, **values)
