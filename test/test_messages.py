"""The codec: what is a message comes back equal, everything else is a MessageError with a path."""

import importlib.util
import json
import math
import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from message_strategies import JSON, messages, mutated
from msgspec.structs import replace

from ros_scenesense.errors import MessageError
from ros_scenesense.geometry import Box, Pose
from ros_scenesense.messages import schemas
from ros_scenesense.messages.attention import Estimate, Estimates, ObjectEstimate
from ros_scenesense.messages.base import AnyMessage, HumanMessage, Message, Stamp
from ros_scenesense.messages.codec import decode, encode, schema_of
from ros_scenesense.messages.grounding import (
    Feedback,
    Groundings,
    Objects,
    PerceivedObject,
    Relations,
    Trust,
)
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.reasoning import Query
from ros_scenesense.messages.scenes import KnownObject, Labels, ObjectLabel, Scene, SceneLost
from ros_scenesense.messages.topics import TOPICS

SOURCE = Path(__file__).resolve().parent.parent
KINDS = list(TOPICS)
STAMP = Stamp(sec=12, nanosec=34)
POSE = Pose(position=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
HEARTBEAT = Heartbeat(
    stamp=STAMP, node="grounding", process_id=7, ready=True, warm=False, counters={"scenes": 3}
)
TRUST = Trust(stamp=STAMP, revision=1, qsr=0.5, msr=0.25, feedback_count=2)

every_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
quick = settings(max_examples=20, suppress_health_check=list(HealthCheck))


def refused(payload, kind):
    """The words of the refusal; fails unless they name a path in one short line."""
    with pytest.raises(MessageError) as caught:
        decode(payload, kind)
    words = str(caught.value)
    assert words.startswith(schema_of(kind) + ": ")
    assert re.search(r" - at .*`\$[^`]*`$", words)
    assert words.isprintable()
    assert len(words) < 500
    return words


def decode_or_refuse(payload, kind):
    try:
        message = decode(payload, kind)
    except MessageError:
        refused(payload, kind)
    else:
        assert decode(encode(message), kind) == message


def changed(message, **fields):
    """The payload of a message with some fields set (None = left out)."""
    document = msgspec.to_builtins(message) | fields
    left_out = {name for name, value in fields.items() if value is None}
    return json.dumps({name: document[name] for name in document if name not in left_out})


def subclasses(kind):
    for child in kind.__subclasses__():
        yield child
        yield from subclasses(child)


def test_every_message_type_has_exactly_one_topic():
    final = {kind for kind in subclasses(AnyMessage) if not kind.__subclasses__()}
    assert final == set(KINDS)
    assert len({topic.name for topic in TOPICS.values()}) == len(KINDS)
    assert len({schema_of(kind).partition("/")[0] for kind in KINDS}) == len(KINDS)


@every_kind
def test_round_trip(kind):
    @quick
    @given(messages(kind))
    def check(message):
        assert decode(encode(message), kind) == message
        assert decode(encode(message).decode(), kind) == message

    check()


@every_kind
def test_any_bytes_and_any_text_are_decoded_or_refused(kind):
    @quick
    @given(st.one_of(st.binary(), st.text(st.characters())))
    @example(b"")
    @example(b"\xef\xbb\xbf{}")
    @example("\ud800")
    @example("null")
    @example("[" * 2000)
    @example('{"a":' * 2000)
    @example('{"schema":' * 2000 + "1" + "}" * 2000)
    def check(payload):
        decode_or_refuse(payload, kind)

    check()


@every_kind
def test_any_json_is_decoded_or_refused(kind):
    with_schema = st.dictionaries(st.text(max_size=8), JSON, max_size=4).map(
        lambda fields: fields | {"schema": schema_of(kind)}
    )

    @quick
    @given(st.one_of(JSON, with_schema))
    def check(value):
        decode_or_refuse(json.dumps(value), kind)

    check()


@every_kind
def test_a_message_with_one_fault_is_decoded_or_refused(kind):
    @settings(quick, max_examples=30)
    @given(mutated(kind))
    def check(document):
        decode_or_refuse(json.dumps(document), kind)

    check()


@quick
@given(messages(Groundings), st.data())
def test_a_damaged_payload_is_decoded_or_refused(message, data):
    payload = bytearray(encode(message))
    at = data.draw(st.integers(0, len(payload) - 1))
    match data.draw(st.sampled_from(["change", "cut", "drop", "double"])):
        case "change":
            payload[at] = data.draw(st.integers(0, 255))
        case "cut":
            del payload[at:]
        case "drop":
            del payload[at]
        case "double":
            payload[at:at] = payload
    decode_or_refuse(bytes(payload), Groundings)


def test_nesting_deeper_than_the_decoder_goes_is_refused():
    payload = '{"schema":"groundings/1","x":' + '{"a":' * 300_000 + "1" + "}" * 300_000 + "}"
    assert "recursion" in refused(payload, Groundings)


def non_finite(value, path="$"):
    """Paths of the floats that JSON cannot carry, in the order of the fields."""
    if isinstance(value, msgspec.Struct):
        value = {f".{name}": getattr(value, name) for name in value.__struct_fields__}
    elif isinstance(value, list | tuple):
        value = {f"[{index}]": member for index, member in enumerate(value)}
    elif isinstance(value, dict):
        value = {f"[{key!r}]": member for key, member in value.items()}
    elif isinstance(value, float) and not math.isfinite(value):
        return [path]
    else:
        return []
    return [found for key, member in value.items() for found in non_finite(member, path + key)]


@pytest.mark.parametrize("kind", [Scene, Objects, Groundings, Relations, Labels, Estimates])
def test_a_number_that_is_not_finite_is_refused_with_its_path(kind):
    @quick
    @given(messages(kind, floats=st.sampled_from([0.5, math.nan, math.inf, -math.inf])))
    def check(message):
        paths = non_finite(message)
        if not paths:
            assert decode(encode(message), kind) == message
            return
        with pytest.raises(MessageError, match=re.escape(f"- at `{paths[0]}`")):
            encode(message)

    check()


def box(**fields):
    return replace(Box(pose=POSE, size=(0.1, 0.1, 0.1)), **fields)


def objects(**fields):
    thing = replace(PerceivedObject(instance=1, name="duck", points=9, box=box()), **fields)
    return Objects(stamp=STAMP, scene_id="s-0", frame_id="camera", objects=[thing])


def estimates(probability):
    nothing = Estimate(value=None, source="none")
    decision = ObjectEstimate(
        name="duck", stable=nothing, occluded=replace(nothing, probability=probability)
    )
    return Estimates(
        stamp=STAMP,
        scene_id="s-0",
        objects=[decision],
        structures=[],
        knowledge_revision="k",
        trust_revision=0,
    )


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_not_finite_is_refused_in_required_optional_and_nested_fields(number):
    label = ObjectLabel(name="duck", stable="true", occluded="true", visible_fraction=number)
    labels = Labels(stamp=STAMP, scene_id="s-0", use="train", objects=[label], structures=[])
    cases = [
        (replace(TRUST, msr=number), "$.msr"),
        (labels, "$.objects[0].visible_fraction"),
        (estimates(number), "$.objects[0].occluded.probability"),
        (objects(box=box(size=(0.1, number, 0.1))), "$.objects[0].box.size[1]"),
        (
            objects(box=box(pose=replace(POSE, position=(0.0, 0.0, number)))),
            "$.objects[0].box.pose.position[2]",
        ),
    ]
    for message, path in cases:
        with pytest.raises(MessageError, match=re.escape(f"`{path}`")):
            encode(message)


@pytest.mark.parametrize(
    ("message", "path"),
    [
        (replace(HEARTBEAT, node="\ud800"), "$.node"),
        (replace(HEARTBEAT, node=""), "$.node"),
        (replace(HEARTBEAT, node="x" * 65), "$.node"),
        (replace(HEARTBEAT, process_id=-1), "$.process_id"),
        (replace(HEARTBEAT, process_id=2**53), "$.process_id"),
        (replace(HEARTBEAT, process_id=10**5000), "$.process_id"),
        (replace(HEARTBEAT, ready=object()), "$.ready"),
        (replace(TRUST, qsr=1.5), "$.qsr"),
        (replace(TRUST, stamp=Stamp(sec=2**31, nanosec=0)), "$.stamp.sec"),
        (objects(instance=0), "$.objects[0].instance"),
        (objects(instance=65536), "$.objects[0].instance"),
        (objects(box=box(size=(0.1, 0.1, -0.1))), "$.objects[0].box.size[2]"),
        (objects(name="\udfff"), "$.objects[0].name"),
    ],
)
def test_encode_refuses_what_is_no_valid_message(message, path):
    with pytest.raises(MessageError, match=re.escape(f"`{path}`")):
        encode(message)


def test_encode_refuses_a_message_that_holds_itself():
    endless = []
    endless.append(endless)
    with pytest.raises(MessageError, match="recursion"):
        encode(Scene(stamp=STAMP, scene_id="s-0", mode="testing", objects=endless))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"colour": 1}, "unknown field `colour` - at `$`"),
        ({"stamp": {"sec": 1, "nanosec": 2, "hour": 3}}, "unknown field `hour` - at `$.stamp`"),
        ({"stamp": {"sec": 1}}, "missing required field `nanosec` - at `$.stamp`"),
        ({"node": None}, "missing required field `node` - at `$`"),
        ({"node": 5}, "Expected `str`, got `int` - at `$.node`"),
        ({"process_id": 1.0}, "Expected `int`, got `float` - at `$.process_id`"),
        ({"process_id": 10**400}, "- at `$.process_id`"),
        ({"ready": 1}, "Expected `bool`, got `int` - at `$.ready`"),
        ({"counters": {"scenes": "3"}}, "- at `$.counters[...]`"),
        ({"counters": {"": 3}}, "- at `key` in `$.counters`"),
        ({"schema": "heartbeat/2"}, "2 is newer than the supported 1"),
        ({"schema": "heartbeat/0"}, "0 is older than the supported 1"),
        ({"schema": "heartbeat/01"}, "schema is 'heartbeat/01', expected 'heartbeat/1'"),
        ({"schema": "trust/1"}, "schema is 'trust/1', expected 'heartbeat/1'"),
        ({"schema": "x" * 9000}, "expected 'heartbeat/1' - at `$.schema`"),
        ({"schema": 1}, "- at `$.schema`"),
        ({"schema": None}, "missing required field `schema` - at `$`"),
        ({"x" * 9000: 1}, "unknown field"),
        ({"line\nbreak \x1b[2J": 1}, "unknown field"),
        ({"node": "x" * 17000}, "is over the limit of 16384 - at `$`"),
    ],
)
def test_a_fault_is_named_with_its_path(fields, words):
    assert words in refused(changed(HEARTBEAT, **fields), Heartbeat)


def test_a_rotation_that_is_none_is_refused():
    scene = Scene(stamp=STAMP, scene_id="s-0", mode="testing", objects=[], camera_pose=POSE)
    pose = {"position": [0, 0, 1], "orientation": [0, 0, 0, 0]}
    words = refused(changed(scene, camera_pose=pose), Scene)
    assert "length 0, must be 1 - at `$.camera_pose`" in words


def test_a_number_too_large_for_json_readers_is_refused():
    payload = changed(TRUST, qsr="N")
    for number in ("1e400", "-1e400", "NaN", "Infinity", "1" + "0" * 400):
        refused(payload.replace('"N"', number), Trust)


def test_the_limit_is_on_bytes_and_includes_its_value():
    limit = TOPICS[Heartbeat].limit
    payload = changed(HEARTBEAT)
    assert decode(payload + " " * (limit - len(payload)), Heartbeat) == HEARTBEAT
    refused(payload + " " * (limit - len(payload) + 1), Heartbeat)
    refused('"' + "é" * (limit // 2) + '"', Heartbeat)
    lost = SceneLost(stamp=STAMP, scene_id="s-0", attempts=1, reason="\x00" * 4096)
    with pytest.raises(MessageError, match="over the limit"):
        encode(lost)


def test_of_a_key_given_twice_the_last_counts():
    payload = changed(TRUST, revision=5)
    assert decode(payload[:-1] + ', "revision": 6}', Trust).revision == 6


@pytest.mark.parametrize("kind", [kind for kind in KINDS if issubclass(kind, HumanMessage)])
def test_a_person_may_leave_the_envelope_out(kind):
    @quick
    @given(messages(kind))
    def check(message):
        bare = replace(message, stamp=None, id="")
        assert decode(changed(bare, schema=None, stamp=None, id=None), kind) == bare
        assert f"expected '{schema_of(kind)}'" in refused(changed(bare, schema="other/1"), kind)

    check()


@pytest.mark.parametrize("kind", [kind for kind in KINDS if issubclass(kind, Message)])
def test_nodes_must_not_leave_the_envelope_out(kind):
    @settings(quick, max_examples=3)
    @given(messages(kind))
    def check(message):
        assert "missing required field `schema`" in refused(changed(message, schema=None), kind)
        assert "missing required field `stamp`" in refused(changed(message, stamp=None), kind)

    check()


def test_what_a_person_types_by_hand():
    assert decode(
        '{"relation": "behind", "object": "duck", "reference": "red_cube"}', Feedback
    ) == Feedback(relation="behind", object="duck", reference="red_cube")
    assert decode('{"literal": "stable(duck)"}', Query).why == "why"
    assert "Invalid enum value" in refused(
        '{"relation": "near", "object": "duck", "reference": "red_cube"}', Feedback
    )


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_keep_every_nanosecond(nanoseconds):
    assert Stamp.of(nanoseconds).nanoseconds == nanoseconds
    assert 0 <= Stamp.of(nanoseconds).nanosec < 10**9


def test_schema_files_and_the_page_on_messages_are_current():
    folder = SOURCE / "msg_defs"
    found = {path.name: path.read_text() for path in folder.glob("*.json")}
    assert found == {schemas.file_name(kind): schemas.schema_text(kind) for kind in KINDS}
    assert (SOURCE / "docs" / "messages.md").read_text() == schemas.table_text()


def test_the_generator_writes_them_and_removes_stale_ones(tmp_path, monkeypatch):
    folder = tmp_path / "msg_defs"
    folder.mkdir()
    (tmp_path / "docs").mkdir()
    (folder / "gone.schema.json").write_text("{}")
    monkeypatch.setattr("sys.argv", ["schemas", str(folder)])
    schemas.main()
    assert {path.name for path in folder.iterdir()} == {schemas.file_name(k) for k in KINDS}
    assert (tmp_path / "docs" / "messages.md").read_text() == schemas.table_text()


@pytest.mark.skipif(
    importlib.util.find_spec("jsonschema") is None, reason="jsonschema is not installed"
)
@every_kind
def test_encoded_messages_fit_their_json_schema(kind):
    import jsonschema

    schema = json.loads(schemas.schema_text(kind))
    validator = jsonschema.Draft202012Validator(schema)
    validator.check_schema(schema)

    @settings(quick, max_examples=5)
    @given(messages(kind))
    def check(message):
        document = json.loads(encode(message))
        validator.validate(document)
        assert not validator.is_valid(document | {"no_such_field": 1})
        if issubclass(kind, HumanMessage):
            del document["schema"], document["id"]
            validator.validate(document)

    check()


def test_objects_of_a_scene_are_written_as_the_documentation_shows():
    scene = Scene(
        stamp=STAMP,
        scene_id="lab-0001",
        mode="testing",
        objects=[KnownObject(instance=1, name="red_cube", size="large")],
        camera_pose=POSE,
    )
    document = json.loads(encode(scene))
    assert document["schema"] == "scene/1"
    assert document["stamp"] == {"sec": 12, "nanosec": 34}
    assert document["objects"][0]["size"] == "large"
    assert decode(encode(scene), Scene).objects[0].size.value == "large"
