"""What beside the image a query tells: who is taken to stand on whom, and how far it hangs over."""

import numpy as np
import pytest

from ros_scenesense.attention.queries import SeenScene, queries_of, regions_of
from ros_scenesense.attention.relevance import Relevance
from ros_scenesense.geometry import Box, Intrinsics, Pose, quaternion_of
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import (
    Objects,
    PerceivedObject,
    Relation,
    Relations,
    SurfaceAttribute,
)
from ros_scenesense.messages.reasoning import Belief, Beliefs, DerivedRelation, ObjectBelief
from ros_scenesense.scene import (
    DecisionStatus,
    Distance,
    Frame,
    NamingFrame,
    Position,
    Surface,
    Task,
)

CAMERA = Intrinsics(width=320, height=240, fx=330.0, fy=330.0, cx=159.5, cy=119.5)
# Optical frame z forward, x right, y down: right, away, up of a level camera.
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
PATTERNS = frozenset({frozenset({"above"})})
RELEVANCES = {task: Relevance(task, (), PATTERNS) for task in Task}
NAMES = ("low", "top")


def scene(shift_m=0.0, derived=True, position=Position.BELOW, surface=Surface.FLAT, instances=True):
    """Two blocks of 8 cm, seen straight from the front at one metre; the upper is shifted."""
    depth = np.zeros((240, 320), np.float32)
    ids = np.zeros(depth.shape, np.uint16)
    blocks = {"low": (1, 0.0, -0.12), "top": (2, shift_m, -0.04)}
    for number, right, up in blocks.values():
        columns = np.rint(159.5 + 330.0 * (right + np.array([-0.04, 0.04]))).astype(int)
        rows = np.rint(119.5 - 330.0 * (up + np.array([0.04, -0.04]))).astype(int)
        depth[slice(*rows), slice(*columns)] = 1.0
        ids[slice(*rows), slice(*columns)] = number
    stamp = Stamp.of(1)
    objects = []
    for name, (number, right, up) in blocks.items():
        x, y, z = AXES.T @ (right, 1.0, up)
        box = Box(Pose((x, y, z), quaternion_of(AXES.T)), (0.08, 0.01, 0.08))
        seen_as = SurfaceAttribute(surface if name == "low" else Surface.FLAT, "given")
        objects.append(PerceivedObject(number, name, 600, box=box, surface=seen_as))
    relation = Relation("low", "top", position, 1.0, "qsr", Distance.NOT_TOUCHING, 1.0, "qsr")
    unknown = Belief(DecisionStatus.UNDECIDED)
    return SeenScene(
        Frame(1, "camera", np.zeros((240, 320, 3), np.uint8), depth, CAMERA),
        ids if instances else np.where(ids == 2, ids, 0).astype(np.uint16),
        Objects(stamp=stamp, scene_id="s", frame_id="camera", objects=objects),
        Relations(
            stamp=stamp,
            scene_id="s",
            naming_frame=NamingFrame.VIEWER,
            relations=[relation],
            disagreements=0,
            trust_qsr=1.0,
            trust_msr=0.0,
            trust_revision=0,
        ),
        Beliefs(
            stamp=stamp,
            scene_id="s",
            objects=[ObjectBelief(name, unknown, unknown) for name in NAMES],
            structures=[],
            derived=[DerivedRelation("on", "top", "low")] if derived else [],
            knowledge_revision="k",
            trust_revision=0,
        ),
    )


def numbers(seen, task=Task.STABILITY, target="top"):
    rois = regions_of(seen, RELEVANCES[task], [target])
    (query,) = queries_of(seen, RELEVANCES, rois, 16)
    assert query.target == target
    return query.numbers


def test_the_first_number_tells_on_which_side_of_the_edge_the_centre_is():
    inside, edge, outside = (numbers(scene(shift))[:2] for shift in (0.02, 0.04, 0.06))
    assert inside[0] < -0.9
    assert abs(edge[0]) < 0.5
    assert outside[0] > 0.9
    assert {inside[1], edge[1], outside[1]} == {1.0}


def test_only_what_stands_on_others_can_hang_over_and_only_stability_asks():
    assert list(numbers(scene(), target="low")[:2]) == [-1.0, 0.0]
    assert list(numbers(scene(0.06), Task.OCCLUSION)[:2]) == [-1.0, 0.0]


def test_what_is_above_and_stands_on_nothing_known_stands_on_the_nearest_below():
    assert numbers(scene(0.06, derived=False)) == pytest.approx(numbers(scene(0.06)))
    nothing = numbers(scene(0.06, derived=False, position=Position.RIGHT))
    assert list(nothing[:2]) == [-1.0, 0.0]


def test_on_an_irregular_surface_the_contact_is_a_point():
    assert numbers(scene(0.015))[0] < -0.9
    assert numbers(scene(0.015, surface=Surface.IRREGULAR))[0] > 0.9


def test_of_what_is_not_in_the_image_the_box_counts():
    seen = scene(0.06, instances=False)
    assert numbers(seen)[0] == pytest.approx(numbers(scene(0.06))[0], abs=0.1)
