"""What the report shows of one scene: its image with outlines, its decisions, its relations."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ros_scenesense.demo.annotation import surely
from ros_scenesense.demo.overlay import Outline, Tag, outline, place_tags
from ros_scenesense.demo.record import Decision, Image, RunRecord, SceneRecord, Subject
from ros_scenesense.messages.attention import Roi
from ros_scenesense.messages.grounding import PerceivedObject, Relation
from ros_scenesense.scene import DecisionStatus, Distance, Position, Truth

_STATUS_WORDS = {
    DecisionStatus.STRICT: "strict",
    DecisionStatus.BY_DEFAULT: "by default",
    DecisionStatus.UNDECIDED: "undecided",
    DecisionStatus.INCONSISTENT: "inconsistent",
    DecisionStatus.TIMED_OUT: "timed out",
}
_POSITION_WORDS = {
    Position.IN: "in",
    Position.ABOVE: "above",
    Position.BELOW: "below",
    Position.FRONT: "in front of",
    Position.BEHIND: "behind",
    Position.RIGHT: "right of",
    Position.LEFT: "left of",
}
_DISTANCE_WORDS = {
    Distance.TOUCHING: "touching",
    Distance.NOT_TOUCHING: "not touching",
    Distance.FAR: "far",
}

Decisions = Mapping[tuple[Subject, tuple[str, ...]], Decision]


@dataclass(frozen=True)
class Cell:
    """A final decision in words.

    Attributes:
        look: Style of the value: yes, no or open.
        word: The value, e.g. `unstable`.
        status: Style of the badge: a `DecisionStatus`, or `network`.
        badge: Who decided it and how, in words.
        reasoning: What stood against it where the network decided, e.g. `inconsistent`; else empty.
        axioms: Ids of the axioms that reasoning used.
        why: Its short explanation; empty if there is none.
        judgement: right, wrong, or none.
        truth: What physics says of it, in words; empty if it says nothing.
    """

    look: str
    word: str
    status: str
    badge: str
    reasoning: str
    axioms: list[str]
    why: str
    judgement: str
    truth: str


@dataclass(frozen=True)
class Row:
    """An object or a stack with the decisions about it."""

    name: str
    members: list[str]
    details: str
    stable: Cell
    occluded: Cell | None


@dataclass(frozen=True)
class Drawing:
    """An object in the image; `look` and `status` are those of its stability."""

    name: str
    outline: Outline
    tag: Tag
    look: str
    status: str


@dataclass(frozen=True)
class Region:
    """A region of interest in the image, pixels; `words` say why it is one."""

    task: str
    left: int
    top: int
    width: int
    height: int
    words: str


@dataclass(frozen=True)
class Card:
    """One scene of the report."""

    number: int
    scene_id: str
    lost: str | None
    image: str | None
    width: int
    height: int
    drawings: list[Drawing]
    regions: list[Region]
    rows: list[Row]
    relations: list[tuple[str, str, str, str]]
    latency_ms: float | None
    wrong: int
    undecided: int


def make_card(scene: SceneRecord, record: RunRecord) -> Card:
    """The card of a settled scene; what was not received stays empty."""
    decisions = {(d.subject, d.names): d for d in scene.decisions()}
    objects = scene.objects.objects if scene.objects else []
    color, instances = record.image(scene, color=True), record.image(scene, color=False)
    rows = _object_rows(scene, decisions, objects) + _stack_rows(decisions)
    shown = [d for d in decisions.values() if d.subject is not Subject.STRUCTURE_STABILITY]
    size = color or instances
    height, width = size.pixels.shape[:2] if size else (240, 320)
    return Card(
        number=scene.number + 1,
        scene_id=scene.scene_id,
        lost=scene.lost.reason if scene.is_lost and scene.lost else None,
        image=png_of(color) if color else None,
        width=width,
        height=height,
        drawings=_drawings(instances, objects, decisions) if instances else [],
        regions=[_region(roi) for roi in scene.rois.rois] if scene.rois else [],
        rows=rows,
        relations=[_relation(r) for r in scene.relations.relations] if scene.relations else [],
        latency_ms=scene.latency_ms,
        wrong=sum(decision.final_right is False for decision in shown),
        undecided=sum(decision.estimate.value is None for decision in shown),
    )


def _object_rows(
    scene: SceneRecord,
    decisions: Decisions,
    objects: Sequence[PerceivedObject],
) -> list[Row]:
    details = {seen.name: _details(seen) for seen in objects}
    visible = {}
    if scene.labels is not None:
        visible = {label.name: label.visible_fraction for label in scene.labels.objects}
    rows = []
    for (subject, names), stable in decisions.items():
        if subject is Subject.STABILITY:
            occluded = decisions[Subject.OCCLUSION, names]
            fraction = visible.get(names[0])
            rows.append(
                Row(
                    name=names[0],
                    members=[],
                    details=details.get(names[0], ""),
                    stable=_cell(stable),
                    occluded=_cell(occluded, fraction),
                )
            )
    return rows


def _stack_rows(decisions: Decisions) -> list[Row]:
    return [
        Row(name="stack", members=list(names), details="", stable=_cell(decision), occluded=None)
        for (subject, names), decision in decisions.items()
        if subject is Subject.STACK_STABILITY
    ]


def _cell(decision: Decision, visible_fraction: float | None = None) -> Cell:
    yes, no = ("stable", "unstable")
    if decision.subject is Subject.OCCLUSION:
        yes, no = ("occluded", "not occluded")
    belief, estimate = decision.belief, decision.estimate
    words = {True: yes, False: no, None: "—"}
    status, badge = _badge(decision)
    reasoning = ""
    if estimate.source == "network" and belief.status is not DecisionStatus.UNDECIDED:
        said = f"{words[belief.value]} " if belief.value is not None else ""
        reasoning = f"{said}{_STATUS_WORDS[belief.status]}"
    return Cell(
        look={True: "yes", False: "no", None: "open"}[estimate.value],
        word=words[estimate.value],
        status=status,
        badge=badge,
        reasoning=reasoning,
        axioms=list(belief.axioms),
        why=belief.why,
        judgement={True: "right", False: "wrong", None: "none"}[decision.final_right],
        truth=_truth(decision, yes, no, visible_fraction),
    )


def _badge(decision: Decision) -> tuple[str, str]:
    """Style and words of who decided."""
    estimate = decision.estimate
    if estimate.source == "network":
        probability = estimate.probability
        return "network", "network" if probability is None else f"network {surely(probability)}"
    status = decision.belief.status
    if estimate.source == "timeout":
        status = DecisionStatus.TIMED_OUT
    elif estimate.source != "none":
        by_default = estimate.source == "default"
        status = DecisionStatus.BY_DEFAULT if by_default else DecisionStatus.STRICT
    elif decision.decided:
        # The estimates did not come, or know nothing of it.
        status = DecisionStatus.UNDECIDED
    return status.value, _STATUS_WORDS[status]


def _truth(decision: Decision, yes: str, no: str, visible_fraction: float | None) -> str:
    words = {Truth.TRUE: yes, Truth.FALSE: no, Truth.AMBIGUOUS: "too close to call", None: ""}
    truth = words[decision.label]
    if decision.subject is Subject.OCCLUSION and truth and visible_fraction is not None:
        visible = f"{visible_fraction:.0%} visible"
        return visible if decision.final_right is not None else f"{visible}: {truth}"
    if decision.final_right:
        return "physics agrees"
    return f"physics: {truth}" if truth else ""


def _details(seen: PerceivedObject) -> str:
    if seen.box is None:
        return "not located: too little of it is visible"
    words = [seen.size.value.value] if seen.size else []
    if seen.surface:
        words.append(f"{seen.surface.value.value} top")
    return ", ".join(words)


def _relation(relation: Relation) -> tuple[str, str, str, str]:
    position, distance = _POSITION_WORDS[relation.position], _DISTANCE_WORDS[relation.distance]
    return relation.object, position, relation.reference, distance


def _region(roi: Roi) -> Region:
    reasons = [f"{roi.task.value} of {', '.join(roi.targets)}"]
    if roi.relations:
        reasons.append(f"relations {', '.join(roi.relations)}")
    if roi.axioms:
        reasons.append(f"axioms {', '.join(roi.axioms)}")
    words = "; ".join(reasons)
    return Region(roi.task.value, roi.left, roi.top, roi.width, roi.height, words)


def _drawings(
    instances: Image,
    objects: Sequence[PerceivedObject],
    decisions: Decisions,
) -> list[Drawing]:
    pixels = instances.pixels.astype(np.uint16, copy=False)
    outlines = {}
    for seen in objects:
        found = outline(pixels, seen.instance)
        if found is not None:
            outlines[seen.name] = found
    tags = place_tags(outlines, pixels)
    drawings = []
    for name, shape in outlines.items():
        decision = decisions.get((Subject.STABILITY, (name,)))
        cell = _cell(decision) if decision else None
        look, status = (cell.look, cell.status) if cell else ("open", "undecided")
        drawings.append(Drawing(name, shape, tags[name], look, status))
    return drawings


def png_of(image: Image) -> str:
    """A colour image as PNG in base64."""
    ok, encoded = cv2.imencode(".png", cv2.cvtColor(image.pixels, cv2.COLOR_RGB2BGR))
    assert ok, "an (H, W, 3) uint8 image can always be written as PNG"
    return base64.b64encode(encoded.tobytes()).decode()
