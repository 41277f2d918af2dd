"""Scenes that somebody described, recorded or simulated, as commands read them."""

import argparse
import json

import pytest

from ros_scenesense.cli.scene_source import scene_of
from ros_scenesense.errors import ParameterError, ReasoningError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import encode
from ros_scenesense.messages.grounding import Objects, PerceivedObject, Relation, Relations
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.reasoning.described_scenes import described_scene
from ros_scenesense.reasoning.facts import SceneObject
from ros_scenesense.resources import resource
from ros_scenesense.scene import Distance, NamingFrame, Position, Size, Surface

STACK = {
    "objects": {
        "duck": {"surface": "irregular"},
        "cube": {"size": "medium", "surface": "flat"},
        "can": None,
        "mug": None,
    },
    "relations": ["on(duck, cube)", "on(cube, can)", "on(can, table)", "behind(mug, can)"],
}


def relations(content: dict) -> dict[tuple[str, str], tuple[Position, Distance]]:
    facts = described_scene(content, "test").facts
    return {(r.object, r.reference): (r.position, r.distance) for r in facts.relations}


def read(path, index=None):
    return scene_of(argparse.Namespace(scene=path, index=index))


def test_what_a_description_does_not_say_follows_from_the_stacks():
    apart, touching = Distance.NOT_TOUCHING, Distance.TOUCHING
    assert relations(STACK) == {
        ("duck", "cube"): (Position.ABOVE, touching),
        ("duck", "can"): (Position.ABOVE, apart),
        ("duck", "mug"): (Position.LEFT, apart),
        ("cube", "can"): (Position.ABOVE, touching),
        ("cube", "mug"): (Position.LEFT, apart),
        ("mug", "can"): (Position.BEHIND, apart),
    }


def test_a_described_scene_keeps_attributes_and_unknown_ones_unknown():
    objects = described_scene(STACK, "test").facts.objects
    assert [(each.name, each.size, each.surface) for each in objects[:3]] == [
        ("duck", None, Surface.IRREGULAR),
        ("cube", Size.MEDIUM, Surface.FLAT),
        ("can", None, None),
    ]


def test_what_is_in_the_hand_is_no_object_of_the_scene():
    scene = described_scene({"objects": {"a": {"size": "small"}, "b": None}, "in_hand": "a"}, "x")
    assert (scene.held.name, scene.held.size) == ("a", Size.SMALL)
    assert [each.name for each in scene.facts.objects] == ["b"]
    assert scene.facts.relations == ()


def test_nothing_follows_for_an_object_that_is_not_located():
    assert relations({"objects": {"a": {"located": False}, "b": None}}) == {}


def test_converse_words_for_one_pair_agree():
    content = {"objects": {"a": None, "b": None}, "relations": ["left(a, b)", "right(b, a)"]}
    assert relations(content) == {("b", "a"): (Position.RIGHT, Distance.NOT_TOUCHING)}


@pytest.mark.parametrize(
    ("relation", "words"),
    [
        ("on(duck)", "expected relation(object, reference)"),
        ("over(duck, can)", "'over' is none of on, in, above"),
        ("on(duck, dog)", "'dog' is none of the objects duck, cube, can, mug"),
        ("on(duck, duck)", "no relation to itself"),
        ("behind(can, mug)", "contradicts"),
        ("far(duck, cube)", "contradicts"),
        ("a). bad(", "expected relation(object, reference)"),
    ],
)
def test_a_wrong_relation_is_named_with_its_place(relation, words):
    content = {**STACK, "relations": [*STACK["relations"], relation]}
    with pytest.raises(ReasoningError) as error:
        described_scene(content, "scene.yaml")
    assert "scene.yaml: $.relations[4]" in str(error.value)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"objects": {"a": {"size": "huge"}}}, "huge"),
        ({"objects": {"a": None}, "in_hand": "b"}, "$.in_hand"),
        ({"objects": {"table": None}}, "'table'"),
        ({"objects": {"a" * 65: None}}, "1 to 64 letters"),
        ({"objects": {"a": None}, "more": 1}, "more"),
    ],
)
def test_a_wrong_description_is_an_error(content, words):
    with pytest.raises(ReasoningError, match="scene here: ") as error:
        described_scene(content, "here")
    assert words in str(error.value)


def test_recorded_messages_are_a_scene(tmp_path):
    stamp = Stamp.of(1)
    objects = Objects(
        stamp=stamp,
        scene_id="s-1",
        frame_id="camera",
        objects=[
            PerceivedObject(instance=1, name="a b", points=3),
            PerceivedObject(instance=2, name="c", points=0),
        ],
    )
    pair = Relation(
        object="a b",
        reference="c",
        position=Position.ABOVE,
        position_confidence=1.0,
        position_source="qsr",
        distance=Distance.TOUCHING,
        distance_confidence=1.0,
        distance_source="qsr",
    )
    said = Relations(
        stamp=stamp,
        scene_id="s-1",
        naming_frame=NamingFrame.VIEWER,
        relations=[pair],
        disagreements=0,
        trust_qsr=1.0,
        trust_msr=0.0,
        trust_revision=0,
    )
    scene = Scene(stamp=stamp, scene_id="s-1", mode="testing", objects=[], in_hand="d")
    path = tmp_path / "scene.json"
    content = {
        name: json.loads(encode(message))
        for name, message in (("objects", objects), ("relations", said), ("scene", scene))
    }
    path.write_text(json.dumps(content))
    known = read(path)
    assert known.held == SceneObject("d")
    assert [each.name for each in known.facts.objects] == ["a b", "c"]
    (related,) = known.facts.relations
    assert (related.object, related.reference) == ("a b", "c")
    assert (related.position, related.distance) == (Position.ABOVE, Distance.TOUCHING)
    del content["relations"]
    path.write_text(json.dumps(content))
    with pytest.raises(ReasoningError, match="the message 'relations' is missing"):
        read(path)


def test_a_scene_file_of_the_simulation_is_taken_as_it_is():
    known = read(resource("config", "scenes/trace_1.yaml"))
    touching = [each for each in known.facts.relations if each.distance is Distance.TOUCHING]
    assert {(each.object, each.position, each.reference) for each in touching} == {
        ("red_cylinder", Position.BELOW, "white_cube"),
        ("white_cube", Position.BELOW, "yellow_duck"),
    }
    assert known.facts.objects[2].surface is Surface.IRREGULAR


def test_files_that_hold_no_scene_are_errors(tmp_path):
    path = tmp_path / "scene.yaml"
    for text, words in (("[]", "no 'objects'"), ("a: [", "no YAML"), ("\0", "no YAML")):
        path.write_text(text)
        with pytest.raises(ReasoningError, match=words):
            read(path)
    with pytest.raises(ReasoningError, match="cannot be read"):
        read(tmp_path / "none.yaml")
    with pytest.raises(ParameterError, match="no dataset"):
        read(path, index=3)
