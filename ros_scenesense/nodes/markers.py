"""What reasoning decided about a scene, as markers for RViz: boxes, names and relation arrows."""

from __future__ import annotations

from collections.abc import Iterator

from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ros_scenesense.geometry import Box
from ros_scenesense.messages.grounding import Objects, Relation, Relations
from ros_scenesense.messages.reasoning import Belief, Beliefs
from ros_scenesense.nodes.conversions import header_of, pose_message
from ros_scenesense.scene import DecisionStatus, Distance

STABLE = (0.2, 0.7, 0.3)
UNSTABLE = (0.85, 0.2, 0.2)
UNDECIDED = (0.6, 0.6, 0.6)
CONFLICT = (0.7, 0.2, 0.8)
ARROW = (0.2, 0.4, 0.9)
TEXT = (1.0, 1.0, 1.0)
TEXT_HEIGHT_M = 0.02
ARROW_WIDTH_M = 0.004


def markers_of(objects: Objects, relations: Relations, beliefs: Beliefs) -> MarkerArray:
    """The markers of a scene; the first deletes those of the scene before.

    A box has the colour of its stability decision (a default's is paler), above it stands the
    name. Arrows go from an object to its reference, for pairs that are not far apart.

    Args:
        objects: Gives boxes and the frame.
        relations: Of the same scene.
        beliefs: Of the same scene.
    """
    header = header_of(objects.stamp.nanoseconds, objects.frame_id)
    boxes = {item.name: item.box for item in objects.objects if item.box is not None}
    stable = {belief.name: belief.stable for belief in beliefs.objects}
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    for name, box in boxes.items():
        markers.extend(_object_markers(header, name, box, stable.get(name)))
    for relation in relations.relations:
        if relation.distance is not Distance.FAR and {relation.object, relation.reference} <= set(
            boxes
        ):
            markers.extend(_arrow_markers(header, relation, boxes))
    for number, marker in enumerate(markers):
        marker.id = number
    return MarkerArray(markers=markers)


def _object_markers(header: Header, name: str, box: Box, stable: Belief | None) -> Iterator[Marker]:
    yield Marker(
        header=header,
        ns="objects",
        type=Marker.CUBE,
        pose=pose_message(box.pose),
        scale=_vector(*box.size),
        color=_decision_color(stable),
    )
    yield _text(header, "names", _above(box), f"{name}\n{_decision_words(stable)}")


def _arrow_markers(header: Header, relation: Relation, boxes: dict[str, Box]) -> Iterator[Marker]:
    start, end = (boxes[name].pose.position for name in (relation.object, relation.reference))
    yield Marker(
        header=header,
        ns="relations",
        type=Marker.ARROW,
        points=[_point(*start), _point(*end)],
        scale=_vector(ARROW_WIDTH_M, 2.5 * ARROW_WIDTH_M, 0.0),
        color=_color(ARROW, 0.9),
    )
    middle = tuple((a + b) / 2.0 for a, b in zip(start, end, strict=True))
    yield _text(header, "relation_names", middle, relation.position.value)


def _text(header: Header, namespace: str, place: tuple[float, ...], words: str) -> Marker:
    marker = Marker(header=header, ns=namespace, type=Marker.TEXT_VIEW_FACING, text=words)
    marker.pose.position = _point(*place)
    marker.pose.orientation.w = 1.0
    marker.scale.z = TEXT_HEIGHT_M
    marker.color = _color(TEXT, 1.0)
    return marker


def _above(box: Box) -> tuple[float, ...]:
    x, y, z = box.pose.position
    # The optical frame's y points down in the image.
    return (x, y - max(box.size) / 2.0 - TEXT_HEIGHT_M, z)


def _decision_color(belief: Belief | None) -> ColorRGBA:
    if belief is not None and belief.status is DecisionStatus.INCONSISTENT:
        return _color(CONFLICT, 0.8)
    if belief is None or belief.value is None:
        return _color(UNDECIDED, 0.5)
    strict = belief.status is DecisionStatus.STRICT
    return _color(STABLE if belief.value else UNSTABLE, 0.8 if strict else 0.4)


def _decision_words(belief: Belief | None) -> str:
    if belief is None:
        return "unknown"
    if belief.value is None:
        return belief.status.value
    word = "stable" if belief.value else "unstable"
    return word if belief.status is DecisionStatus.STRICT else f"{word} by default"


def _color(rgb: tuple[float, float, float], alpha: float) -> ColorRGBA:
    red, green, blue = rgb
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)


def _vector(x: float, y: float, z: float) -> Vector3:
    return Vector3(x=float(x), y=float(y), z=float(z))


def _point(x: float, y: float, z: float) -> Point:
    return Point(x=float(x), y=float(y), z=float(z))
